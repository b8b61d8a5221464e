"""`proxarm view` from outside: a record or a black box, as the page asks for it."""
import csv
import json
import os
import re
import shutil
import unittest

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
        while (moment := page.receive_moment(stage["fields"]))["cycle"] != int(row["cycle"]):
            pass
        names = [stage["scene"]["objects"][int(moment[object])]["name"] for object in ("object", "object_2")]
        self.assertEqual(names, ["table", "foam"])
        self.assertEqual((moment["friction"], moment["friction_2"]), (0.3, 0.5))
        self.assertEqual([moment[f"normal_2_{axis}"] for axis in "xyz"], [-1.0, 0.0, 0.0])
        self.assertEqual((int(row["contact_object_2"]), float(row["normal_2_W_x_1"])), (0, -1.0))
        self.assertEqual(moment["object_3"], -1)
        for_others = (folder / "session.mcap").read_bytes()
        self.assertRegex(for_others, rb'"object":"table","contacts":2,"friction":0.3,[^[]*'
                                     rb'"others":\[\{"object":"foam","friction":0.5,"normal":\{"x":-1(\.0)?,')

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



class Colours(ProgramTest):
    @unittest.skipUnless(shutil.which("gnuplot"), "no gnuplot")
    def test_the_plot_of_a_run_has_those_of_the_view(self):
        """What sticks was blue in the view and grey in the plot, what slips orange in the view and blue in the plot."""
        self.call("run", "--record", "session", "--duration", "6s")
        drawn = (self.folder / "session" / "plot.svg").read_text().replace(" ", "")
        light = (SOURCE / "controller/view/page/style.css").read_text().split(":root[data-theme")[0]
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
