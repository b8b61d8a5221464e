#!/usr/bin/python3
"""Drives that lack something: taken where it fits, with a word of what is lost; else refused with what doesn't fit."""
import unittest

import eds_styles
from eds_styles import I16, U32
from harness import ProgramTest


class LackingDrive(ProgramTest):
    def cell(self, table, of="default.yaml"):
        folder = self.copies() / "models/cells"
        (folder / "drive.eds").write_text(eds_styles.plain(table))
        cell = (folder / of).read_text()
        cell = cell.replace("    device_type: 0x00020192\n", "    eds: drive.eds\n")
        self.assertIn("eds: drive.eds", cell)
        (folder / "mine.yaml").write_text(cell)
        return folder / "mine.yaml"

    def lacking(self, *arguments):
        return self.summary("--no-plot", "--duration", "0.3s", *arguments)["drives_lack"]

    def of_all(self, lines):
        prefix = "drives of axis_1, axis_2, axis_3, axis_4, axis_5, axis_6: "
        for line in lines:
            self.assertTrue(line.startswith(prefix), line)
        return [line[len(prefix):] for line in lines]

    def said_by_check(self, cell):
        outcome = self.call("check", cell)
        self.assertEqual((outcome.status, outcome.err), (0, ""))
        return outcome.out.splitlines()[:-1]

    def test_a_drive_that_has_all_lacks_nothing(self):
        self.assertEqual(self.lacking(), [])

    def test_without_6007h_it_runs_and_check_and_summary_say_so(self):
        words = "no 6007h:00: how it stops without the controller is its own affair"
        self.assertEqual(self.lacking("--fault", "axis_2:lacks=0x600700"), ["drive of axis_2: " + words])
        table = eds_styles.usual()
        del table[(0x6007, 0)]
        cell = self.cell(table)
        self.assertEqual(self.of_all(self.said_by_check(cell)), [words])
        self.assertEqual(self.of_all(self.lacking(cell)), [words])
        text = self.call("run", cell, "--no-plot", "--duration", "0.3s").out
        self.assertEqual(text.count(words), 1)

    def test_a_6007h_that_is_its_makers_is_taken_unless_it_does_nothing(self):
        table = eds_styles.usual()
        table[(0x6007, 0)] = ("Abort Connection", I16, "ro", 0, "1")
        cell = self.cell(table)
        self.assertIn("6007h:00 can't be written: how it stops", self.said_by_check(cell)[0])
        lines = self.of_all(self.lacking(cell))
        self.assertIn("6007h:00", " ".join(lines))
        table[(0x6007, 0)] = ("Abort Connection", I16, "ro", 0, "0")
        self.assert_refused(self.call("run", self.cell(table)), "drive.eds", "[6007] DefaultValue", "0x0000", "0x0003")

    def test_identifiers_and_mappings_that_are_the_makers_are_taken_where_they_are_what_is_wanted(self):
        table = eds_styles.usual()
        for index, words in ((0x1600, ("0x60400010", "0x607A0020")), (0x1A00, ("0x60410010", "0x60640020"))):
            name, kind, _, mappable, _ = table[(index, 0)]
            table[(index, 0)] = (name, kind, "ro", mappable, str(len(words)))
            for sub in range(1, 9):
                value = words[sub - 1] if sub <= len(words) else "0"
                table[(index, sub)] = ("Mapping", U32, "ro", 0, value)
        for index, offset in ((0x1400, 0x200), (0x1800, 0x180)):
            table[(index, 1)] = ("COB-ID", U32, "ro", 0, f"$NODEID+0x{offset:X}")
            table[(index, 2)] = ("Type", eds_styles.U8, "const", 0, "1")
        cell = self.cell(table)
        found = "taken as found, because it fits: 1400h:01, 1600h:00, 1600h:01"
        self.assertIn(found, self.said_by_check(cell)[0])
        lines = self.lacking(cell)
        self.assertEqual(len(lines), 1)
        self.assertIn(found, lines[0])
        # More behind what is wanted: the controller doesn't read it.
        table[(0x1A00, 0)] = ("Count", eds_styles.U8, "ro", 0, "3")
        table[(0x1A00, 3)] = ("Mapping", U32, "ro", 0, "0x60770010")
        self.assertEqual(len(self.lacking(self.cell(table))), 1)
        # Another order is another thing.
        for key, value, section in (((0x1A00, 2), "0x60770010", "[1A00sub2]"), ((0x1600, 0), "1", "[1600]"),
                                    ((0x1400, 1), "$NODEID+0x300", "[1400sub1]"), ((0x1800, 2), "255", "[1800sub2]")):
            with self.subTest(section):
                other = dict(table)
                name, kind, access, mappable, _ = other[key]
                other[key] = (name, kind, access, mappable, value)
                self.assert_refused(self.call("run", self.cell(other)), "drive.eds", section, "can't be written")

    def test_a_drive_without_a_file_is_asked_itself(self):
        # Its identifier is the wanted one, but while the PDO is valid its mapping, the controlword alone, stays.
        self.assert_refused(self.call("run", "--fault", "axis_3:fixed=0x140001"), "axis_3", "1600h:00", "0x01 (1)")
        self.assertIn("taken as found, because it fits: 1803h:01", self.lacking("--fault", "axis_3:fixed=0x180301")[0])
        self.assert_refused(self.call("run", "--fault", "axis_3:fixed=0x160000"), "axis_3", "1600h:00",
                            "which can't be written", "(2)")
        self.assertIn("no 1400h:05: its RPDO timer doesn't stop it", self.lacking("--fault", "axis_1:lacks=0x140005")[0])
        # A torque would act on until the heartbeat is lost.
        self.assert_refused(self.call("run", "models/cells/light.yaml", "--fault", "turn:lacks=0x140005"), "turn", "1400h:05")
        self.assert_refused(self.call("run", "--fault", "axis_1:lacks=0x101601"), "axis_1", "1016h:01")
        self.assert_refused(self.call("run", "--fault", "axis_1:lacks=0x123401"), "--fault", "axis_1", "0x600700")
        self.assert_refused(self.call("run", "--fault", "axis_1:lacks=0x600700@2s"), "no time")

    def test_feedback_that_a_drive_has_not_got_is_left_out(self):
        with_speed = self.changed("models/cells/default.yaml", ("    device_type: 0x00020192\n",
                                                                "    feedback: [{object: '0x6077', bits: 16}]\n"))
        self.assertIn("bits", with_speed.read_text())
        # Not mappable: the drive says so when it is asked, and its PDO gets shorter.
        lines = self.lacking(with_speed, "--timestep", "2ms", "--fault", "axis_1:lacks=0x607700", "--mass", "6")
        self.assertEqual(lines, ["drive of axis_1: no 6077h:00 in its TPDO: no torque feedback"])
        torques = self.lacking("models/cells/light.yaml", "--fault", "turn:lacks=0x607700")
        self.assertEqual(torques, ["drive of turn: no 6077h:00 in its TPDO: no torque feedback"])

    def test_a_session_with_less_feedback_is_replayed_to_the_same_setpoints(self):
        summary = self.summary("models/cells/light.yaml", "--no-plot", "--duration", "0.5s", "--record", "session",
                               "--fault", "turn:lacks=0x607700")
        outcome = self.call("replay", "session")
        self.assertEqual(outcome.status, 0, outcome.err)
        self.assertEqual(summary["faults"], [])


if __name__ == "__main__":
    unittest.main()
