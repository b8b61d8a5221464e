#!/usr/bin/python3
"""A cell whose drives have their makers' EDS or DCF files is rendered in simulation as it stands."""
import re
import unittest

import eds_styles
from harness import SOURCE, ProgramTest


class EdsDrive(ProgramTest):
    def cell(self, name, text, change=lambda cell: cell):
        """The default cell, each drive with this file and nothing said of its device type."""
        folder = self.copies() / "models/cells"
        (folder / name).write_bytes(text.encode())
        cell = (folder / "default.yaml").read_text().replace("    device_type: 0x00020192\n", f"    eds: {name}\n")
        self.assertEqual(cell.count(f"eds: {name}"), 6)
        file = folder / (name + ".yaml")
        file.write_text(change(cell))
        return file

    def test_cells_with_makers_files_of_three_handwritings_are_rendered_as_they_stand(self):
        wanted = self.summary("--no-plot", "--duration", "2s")
        for name, style in eds_styles.STYLES.items():
            with self.subTest(name):
                cell = self.cell(name, style(eds_styles.usual()))
                self.assertEqual(self.call("check", cell).status, 0)
                summary = self.summary(cell, "--no-plot", "--duration", "2s")
                self.assertEqual(summary["faults"], [])
                self.assertEqual(summary["contacts"], wanted["contacts"])
                self.assertAlmostEqual(summary["apparent_mass_kg"], wanted["apparent_mass_kg"], delta=0.02)

    def test_the_drives_answer_with_the_identity_and_dictionary_of_the_file(self):
        cell = self.cell("plain.eds", eds_styles.plain(eds_styles.usual()))
        self.summary(cell, "--no-plot", "--duration", "0.2s", "--record", "session")
        log = (self.folder / "session/frames.log").read_text()
        for words, frame in (("1000h", "581#4300100092014200"), ("vendor", "581#43181001CDAB0000"),
                             ("product", "581#4318100215080000"), ("revision", "581#4318100303000200"),
                             ("no 605Bh", "581#805B600000000206"), ("no 6080h, and it isn't asked for", None)):
            if frame:
                with self.subTest(words):
                    self.assertEqual(frame in log, words != "no 605Bh", "the file says so before anything is asked")
        self.assertNotIn("601#2B5B6000", log)

    def test_what_the_file_has_another_drive_for_is_refused_before_anything_moves(self):
        table = eds_styles.usual()
        table[(0x1000, 0)] = ("Device Type", eds_styles.U32, "ro", 0, "0x00030191")
        self.assert_refused(self.call("run", self.cell("io.eds", eds_styles.plain(table))), "io.eds", "[1000]", "00020192")
        table = eds_styles.usual()
        table[(0x6502, 0)] = ("Supported Modes", eds_styles.U32, "ro", 0, "0x00000065")
        self.assert_refused(self.call("run", self.cell("old.eds", eds_styles.plain(table))), "old.eds", "[6502]",
                            "cyclic synchronous position")

    def test_objects_that_a_drive_has_elsewhere_are_elsewhere_in_simulation_too(self):
        table = eds_styles.usual()
        for old, new in ((0x6060, 0x3002), (0x6061, 0x3003)):
            table[(new, 0)] = table.pop((old, 0))
        cell = self.cell("elsewhere.eds", eds_styles.plain(table), lambda text: text.replace(
            "    eds: ", "    objects: {mode: '0x3002', mode_display: '0x3003'}\n    eds: "))
        self.assertEqual(self.summary(cell, "--no-plot", "--duration", "0.5s")["faults"], [])

    def test_the_shipped_file_of_the_simulated_drive_is_true_of_it(self):
        text = (SOURCE / "models/drives/simulated_drive.eds").read_text()
        wanted = self.summary("--no-plot", "--duration", "1s")["setpoint_sha256"]
        self.assertIsNotNone(re.search("(?m)^\\[607A\\]", text))
        summary = self.summary(self.cell("simulated_drive.eds", text), "--no-plot", "--duration", "1s")
        self.assertEqual(summary["faults"], [])
        self.assertEqual(len(summary["setpoint_sha256"]), len(wanted))


if __name__ == "__main__":
    unittest.main()
