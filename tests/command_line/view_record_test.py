"""`proxarm view` from outside: a record or a black box, as the page asks for it."""
import csv
import json
import os
import re
import shutil
import unittest

import mcap_reader
import view_browser
from harness import SOURCE, ProgramTest
from view_client import Session


class Records(ProgramTest):
    def record(self, *arguments):
        self.call("run", "--no-plot", "--record", "session", "--duration", "5s", *arguments)
        return self.folder / "session"

    def opened(self, folder):
        session = Session(self.folder, "view", folder)
        self.addCleanup(session.end)
        page = session.open_socket()
        self.addCleanup(page.close)
        return page, page.receive_json("stage")

    def test_a_record_opens_at_its_fault_and_any_cycle_can_be_had(self):
        folder = self.record("--fault", "axis_3:silent@4s")
        fault = json.loads((folder / "summary.json").read_text())["faults"][0]
        for played in (folder, folder / "black-box"):
            with self.subTest(played.name):
                with open(played / "signals.csv", newline="") as file:
                    rows = list(csv.DictReader(file))
                page, stage = self.opened(played)
                record = stage["record"]
                self.assertEqual(record["cycles"], len(rows))
                self.assertEqual(int(rows[record["open_at"]]["cycle"]), fault["cycle"])
                told = page.receive_json("status")["fault"]
                self.assertIn("drive_silent (drive of axis_3", told)
                self.assertEqual(page.receive_moment(stage["fields"])["cycle"], fault["cycle"])
                self.assertTrue({"contact", "phase", "fault"} <= {event["kind"] for event in record["events"]})
                for index in (0, 1000, len(rows) - 1):
                    page.send({"at": index})
                    moment = page.receive_moment(stage["fields"])
                    for field, column in (("cycle", "cycle"), ("proxy_x", "proxy_W_x_m"), ("force_y", "force_W_y_N"),
                                          ("contact_force_x", "contact_force_W_x_N"), ("time_s", "time_s"),
                                          ("friction", "friction_1"), ("tool_clearance_m", "tool_clearance_m")):
                        self.assertAlmostEqual(moment[field], float(rows[index][column]), places=9, msg=field)

    def test_a_record_opens_where_a_contact_lasts(self):
        """It opened on the first cycle of the first touch: an impact of 136 N for a hand of 0.07 N."""
        for scene in ("wall", "peg_in_hole", "free"):
            with self.subTest(scene):
                folder = self.record("--scene", SOURCE / f"scenes/{scene}.yaml")
                with open(folder / "signals.csv", newline="") as file:
                    rows = list(csv.DictReader(file))
                expected, since = 0, None
                for i, row in enumerate(rows):
                    since = None if row["contact"] == "free" else since or float(row["time_s"])
                    if since and float(row["time_s"]) - since > 0.1 - 1e-6:
                        expected = i
                        break
                self.assertEqual(expected > 100, scene != "free")
                _, stage = self.opened(folder)
                self.assertEqual(stage["record"]["open_at"], expected)

    def test_each_of_several_contacts_is_told(self):
        """A foam wall and a table at once."""
        folder = self.record("--scene", SOURCE / "scenes/soft_corner.yaml", "--hand", SOURCE / "sim/hands/explore.yaml")
        with open(folder / "signals.csv", newline="") as file:
            index, row = next((i, row) for i, row in enumerate(csv.DictReader(file)) if row["contacts"] == "2")
        page, stage = self.opened(folder)
        page.send({"at": index})
        while (moment := page.receive_moment(stage["fields"], stage["contact_fields"]))["cycle"] != int(row["cycle"]):
            pass
        touches = moment["touches"]
        names = [stage["scene"]["objects"][int(touch["object"])]["name"] for touch in touches]
        self.assertEqual(names, ["table", "foam"])
        self.assertEqual([touch["friction"] for touch in touches], [0.3, 0.5])
        self.assertEqual([touches[1][f"normal_{axis}"] for axis in "xyz"], [-1.0, 0.0, 0.0])
        self.assertEqual((int(row["contact_object_2"]), float(row["normal_2_W_x_1"])), (0, -1.0))
        # Both at the proxy. The foam is pressed in, the table isn't; and their forces are the world's.
        for touch in touches:
            self.assertEqual([touch[f"point_{axis}"] for axis in "xyz"], [moment[f"proxy_{axis}"] for axis in "xyz"])
        self.assertAlmostEqual(touches[0]["gap_m"], 0.0, places=12)
        self.assertLess(touches[1]["gap_m"], -1e-6)
        for axis in "xyz":
            self.assertAlmostEqual(sum(touch[f"force_{axis}"] for touch in touches), moment[f"contact_force_{axis}"], places=9)
        said = dict(mcap_reader.messages(folder / "session.mcap")["/contact"])[round(1e9 * float(row["time_s"]))]
        self.assertEqual((said["object"], said["contacts"], said["friction"]), ("table", 2, 0.3))
        self.assertEqual(said["others"], [{"object": "foam", "friction": 0.5, "normal": {"x": -1, "y": 0, "z": 0}}])

    def test_the_frames_of_a_cycle_are_decoded(self):
        page, stage = self.opened(self.record())
        page.send({"frames": 3000})
        frames = page.receive_json("frames")
        self.assertEqual(frames["at"], 3000)
        with open(self.folder / "session" / "signals.csv", newline="") as file:
            row = list(csv.DictReader(file))[3000]
        said = {(frame["from"], frame["words"]) for frame in frames["list"]}
        self.assertIn(("controller", "SYNC"), said)
        for axis in (f"axis_{i}" for i in range(1, 7)):
            whole = " ".join(words for whose, words in said if whose == axis)
            self.assertIn(f"position 6064h: {row[axis + '_actual_counts']} = ", whole)
            self.assertIn("statusword 6041h: ", whole)
            whole = " ".join(words for whose, words in said if whose == "to " + axis)
            self.assertIn(f"target position 607Ah: {row[axis + '_target_counts']} = ", whole)
        self.assertIn(("sensor", "sample"), said)

    def test_what_is_asked_for_beyond_the_record_is_refused(self):
        folder = self.record()
        for asked in ({"at": 10 ** 9}, {"at": -1}, {"at": 1.5}, {"window": [0]}, {"window": [0, 10 ** 9]}, {"frames": "1"},
                      {"at": 1, "frames": 1}, {}):
            with self.subTest(asked):
                page, _ = self.opened(folder)
                page.send(asked)
                self.assertTrue(page.is_closed())

    def test_what_is_no_record_is_refused(self):
        self.assert_refused(self.call("view", "."), "cycles.bin", "no such file")
        self.assert_refused(self.call("view"), "folder is required")
        folder = self.record()
        (folder / "signals.csv").write_text("a,b\n1,2\n")
        self.assert_refused(self.call("view", folder), "signals.csv", "another kind of file")
        (folder / "signals.csv").write_bytes(b"")
        self.assert_refused(self.call("view", folder), "signals.csv", "empty")



class Contacts(Records):
    def test_each_contact_is_where_the_record_has_it(self):
        """A tool's contacts had no place in any output, and were drawn at its handle."""
        for form in ("csv", "binary"):
            for scene, hand in (("valve_key", "wrench"), ("box_on_table", "tip")):
                with self.subTest(form=form, scene=scene):
                    folder = self.record("--scene", SOURCE / f"scenes/{scene}.yaml", "--inertia", "0.05", "--signals", form,
                                         "--hand", SOURCE / f"sim/hands/{hand}.yaml")
                    cycles = {}
                    for row in csv.DictReader(self.call("signals", folder, "--contacts").out.splitlines()):
                        cycles.setdefault(int(row["cycle"]), []).append(row)
                    self.assertGreater(len(cycles), 500)
                    self.assertGreater(max(map(len, cycles.values())), 1)
                    page, stage = self.opened(folder)
                    page.receive_moment(stage["fields"])
                    for cycle in [0, *list(cycles)[::300]]:
                        page.send({"at": cycle})
                        touches = page.receive_moment(stage["fields"], stage["contact_fields"])["touches"]
                        rows = cycles.get(cycle, [])
                        self.assertEqual(len(touches), len(rows))
                        for touch, row in zip(touches, rows):
                            said = [touch[name] for name in ("object", "part", "slips", "friction", "gap_m")]
                            kept = [float(row["object"]), float(row["part"]), row["state"] == "slip",
                                    float(row["friction_1"]), float(row["gap_m"])]
                            for name, unit in (("point", "m"), ("normal", "1"), ("force", "N")):
                                said += [touch[f"{name}_{axis}"] for axis in "xyz"]
                                kept += [float(row[f"{name}_W_{axis}_{unit}"]) for axis in "xyz"]
                            self.assertEqual(said, kept)
                    page.close()

    def test_a_record_without_contacts_shows_them_at_the_handle(self):
        """One of a version that kept none."""
        folder = self.record()
        for name in ("contacts.csv", "contact_columns.json"):
            (folder / name).unlink()
        with open(folder / "signals.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        index = next(i for i, row in enumerate(rows) if row["contacts"] == "1")
        page, stage = self.opened(folder)
        page.receive_moment(stage["fields"])
        page.send({"at": index})
        moment = page.receive_moment(stage["fields"], stage["contact_fields"])
        touch, = moment["touches"]
        for axis in "xyz":
            self.assertEqual(touch[f"point_{axis}"], moment[f"proxy_{axis}"])
            self.assertEqual(touch[f"force_{axis}"], moment[f"contact_force_{axis}"])
        self.assert_refused(self.call("signals", folder, "--contacts"), "neither contacts.bin nor contacts.csv")

    def test_damaged_contacts_are_refused_or_end_there(self):
        folder = self.record()
        file = folder / "contacts.csv"
        whole = file.read_bytes()
        for data in (b"", b"a,b\n1,2\n"):
            file.write_bytes(data)
            self.assert_refused(self.call("view", folder), "contacts.csv")
        for data in (whole[:-30], whole[:whole.index(b"\n") + 1], whole.replace(b"stick", b"\xff,,"), whole.replace(b",0.3,", b",1e999,")):
            file.write_bytes(data)
            page, stage = self.opened(folder)
            page.receive_moment(stage["fields"])
            page.send({"at": stage["record"]["cycles"] - 1})
            page.receive_moment(stage["fields"], stage["contact_fields"])


class Colours(ProgramTest):
    @unittest.skipUnless(shutil.which("gnuplot"), "no gnuplot")
    def test_the_plot_of_a_run_has_those_of_the_view(self):
        """What sticks was blue in the view and grey in the plot, what slips orange in the view and blue in the plot."""
        self.call("run", "--record", "session", "--duration", "6s")
        drawn = (self.folder / "session" / "plot.svg").read_text().replace(" ", "")
        with Session(self.folder, "view", "session") as viewed:
            status, _, palette = viewed.request("/palette.css", Cookie=viewed.cookie())
        self.assertEqual(status, 200)
        light = palette.decode().split(":root[data-theme")[0]
        for name in ("tool", "proxy", "hand", "shade-stick", "shade-slip"):
            with self.subTest(name):
                number = re.search(rf"--{name}: #(\w+);", light)[1]
                red, green, blue, *opacity = bytes.fromhex(number)
                share = opacity[0] / 255 if opacity else 1.0
                on_white = [round(255 + share * (part - 255)) for part in (red, green, blue)]
                self.assertIn("rgb({},{},{})".format(*on_white), re.findall(r"rgb\([\d,]+\)", drawn))
        style = dict(re.findall(r"--(\w+): (#\w+);", light))
        self.assertEqual(style["proxy"], style["stick"], "the contact's line is of what sticks")


class Snapshots(ProgramTest):
    def setUp(self):
        super().setUp()
        self.call("run", "--no-plot", "--record", "session", "--duration", "4s")

    @unittest.skipUnless(view_browser.CHROMIUM.exists(), "no chromium")
    @unittest.skipIf(os.environ.get("PROXARM_SLOW_BUILD"), "a browser beside sanitizers has no time to draw")
    def test_pictures_are_saved(self):
        done = self.call("view", "session", "--snapshot", "1s", "--snapshot", "3.9s", "--out", "x.png", "--size", "640x480")
        self.assertEqual(done.status, 0, done.err)
        seen = []
        for name in ("x-01.png", "x-02.png"):
            rows, step = view_browser.pixels(self.folder / name)
            self.assertEqual((len(rows[0]) // step, len(rows)), (640, 480))
            colours = {bytes(row[at:at + 3]) for row in rows[::3] for at in range(0, len(row), 3 * step)}
            self.assertGreater(len(colours), 100, "a picture that isn't blank")
            seen.append(rows)
        self.assertNotEqual(*seen)
        dark = self.call("view", "session", "--snapshot", "1s", "--out", "dark.png", "--size", "640x480", "--dark", "--look", "tool")
        self.assertEqual(dark.status, 0, dark.err)
        rows, step = view_browser.pixels(self.folder / "dark.png")
        mean = lambda picture: sum(sum(row[::step]) for row in picture) / sum(len(row) // step for row in picture)
        self.assertLess(mean(rows), 90)
        self.assertGreater(mean(seen[0]), 170)

    def test_without_a_browser_that_is_said(self):
        words = ("view", "session", "--snapshot", "1s", "--out", "x.png")
        nothing = self.folder / "bin"
        nothing.mkdir()
        env = {**os.environ, "PATH": str(nothing)}
        self.assert_refused(self.call(*words, env=env), "no chromium on the PATH", "apt-get install chromium")
        # Something of that name that isn't one, or ends at once.
        browser = nothing / "chromium"
        browser.write_text("#!/bin/sh\nexit 1\n")
        browser.chmod(0o755)
        for _ in range(10):  # writing to it ended the program with SIGPIPE, where that came before its end was seen
            self.assert_refused(self.call(*words, env=env), "--snapshot", "a browser that ")
        self.assertFalse((self.folder / "x.png").exists())

    def test_mistakes_are_told(self):
        self.assert_refused(self.call("view", "session", "--snapshot", "1s"), "--out", "none")
        self.assert_refused(self.call("view", "session", "--out", "x.png"), "--out", "--snapshot TIME")
        self.assert_refused(self.call("view", "session", "--snapshot", "1s", "--out", "x.jpg"), "--out", "x.jpg")
        self.assert_refused(self.call("view", "session", "--snapshot", "soon", "--out", "x.png"), "--snapshot", "soon")
        self.assert_refused(self.call("view", "session", "--snapshot", "1s", "--out", "x.png", "--size", "10x10"), "--size")


if __name__ == "__main__":
    unittest.main()
