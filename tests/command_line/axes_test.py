"""Arms of one to seven axes: what they feel like, where they can go, and what is refused with words.

Each is judged by what a hand would feel: the apparent mass is taken from the simulation's truth, the touch from the
scene. Five axes are the default arm with its fourth joint fixed, three the SCARA without its last.
"""
import csv
import json
import math
import re
import unittest

from harness import SOURCE, ProgramTest
import plan_test  # not its classes: they would run here, too

FREE, SWEEP = SOURCE / "scenes/free.yaml", SOURCE / "sim/hands/sweep.yaml"


class Axes(ProgramTest):
    def without_drive(self, cell, joint):
        """A copied cell without this drive, its joint fixed in a URDF of its own."""
        text = (self.copies() / "models/cells" / cell).read_text()
        parts = re.split(r"(?m)^(?=  - \{?joint: )", text)
        at = next(i for i, part in enumerate(parts) if re.match(rf"  - \{{?joint: {joint}\b", part))
        last = parts[at].find("\nsensor:")  # of the last drive, what follows the drives
        parts[at] = parts[at][last:] if last >= 0 else ""
        text = "".join(parts)
        start = re.search(r"start_rad: \[(.*)\]", text)[1].split(", ")
        del start[at - 1]
        text = re.sub(r"start_rad: \[.*\]", f"start_rad: [{', '.join(start)}]", text)
        urdf = re.search(r"urdf: \.\./arms/(\S+)", text)[1]
        arm = (self.copies() / "models/arms" / urdf).read_text()
        arm, count = re.subn(rf'<joint name="{joint}" type="\w+">', f'<joint name="{joint}" type="fixed">', arm)
        self.assertEqual(count, 1)
        (self.copies() / "models/arms" / f"without_{joint}.urdf").write_text(arm)
        file = self.copies() / "models/cells" / f"without_{joint}.yaml"
        file.write_text(text.replace(urdf, f"without_{joint}.urdf"))
        return file

    def cells(self):
        """Axes -> cells."""
        shipped = SOURCE / "models/cells"
        return {1: [shipped / "linear.yaml"], 2: [shipped / "bench.yaml"],
                3: [shipped / "gantry.yaml", self.without_drive("scara.yaml", "turn")], 4: [shipped / "scara.yaml"],
                5: [self.without_drive("default.yaml", "axis_4")], 6: [shipped / "default.yaml", shipped / "cobot.yaml"],
                7: [shipped / "seven.yaml"]}

    def for_each(self, judge):
        for axes, cells in self.cells().items():
            for cell in cells:
                with self.subTest(axes=axes, cell=cell.name):
                    judge(axes, cell)

    def ended_well(self, *arguments):
        """The summary; what holds say on standard error is left aside."""
        outcome = self.call("run", "--json", "--no-plot", *arguments)
        self.assertEqual(outcome.status, 0, outcome.err + outcome.out)
        self.assertEqual(outcome.summary["faults"], [])
        return outcome.summary

    def test_each_feels_like_the_mass_that_is_asked_for(self):
        def judge(_, cell):
            free = self.ended_well(cell, "--scene", FREE, "--hand", SWEEP, "--mass", "6")
            # 0.3 to 2 Hz; the same bound as the default cell's.
            self.assertAlmostEqual(free["apparent_mass_kg"] / 6.0, 1.0, delta=0.05)
            self.assertLess(free["tracking_max_m"], 0.5e-3)

        self.for_each(judge)

    def test_each_touches(self):
        def judge(axes, cell):
            touch = self.ended_well(cell)
            self.assertGreaterEqual(touch["contacts"], 1)
            self.assertGreater(touch["contact_time_s"], 2.0)
            self.assertEqual(touch["penetration_max_m"], 0.0)
            self.assertEqual(touch["pulling_force_max_N"], 0.0)
            self.assertLess(touch["tool_penetration_sliding_max_m"] or 0.0, 0.2e-3)
            self.assertLess(touch["contact_force_error_N"], 0.1)
            if axes > 1:
                self.assertGreater(touch["sliding_time_s"], 1.0)
                self.assertLess(abs(touch["friction_ratio_error"]), 0.01)

        self.for_each(judge)

    def test_each_comes_out_of_holds_and_contacts_again(self):
        def judge(_, cell):
            held = self.ended_well(cell, "--do", "hold@5s", "--do", "back-off 20mm@6s", "--do", "resume@8s")
            self.assertGreater(held["rendered_time_s"], 9.0)

        self.for_each(judge)

    def test_a_released_bench_keeps_to_its_plane(self):
        # The hand pulls sideways, where nothing moves, with up to 50 N: the proxy used to follow it as far as the leash.
        hand = self.written("aside.yaml", "mass_kg: 1.0\nstiffness_N_per_m: 500\ndamping_Ns_per_m: 20\nwaypoints:\n"
                            "  - {time_s: 0.5, offset_m: [0, 0, 0]}\n  - {time_s: 2, offset_m: [0.05, 0.1, 0]}\n"
                            "  - {time_s: 6, offset_m: [0.1, 0.1, 0.05]}\n")
        record = self.folder / "record"
        self.ended_well(SOURCE / "models/cells/bench.yaml", "--hand", hand, "--record", record, "--do", "hold@2s", "--do",
                        "release@3s", "--do", "hold@5s", "--do", "resume@6s", "--duration", "3s")
        with open(record / "signals.csv") as file:
            rows = list(csv.DictReader(file))
        freed = [row for row in rows if row["phase"] == "freeing"]
        self.assertGreater(len(freed), 1000)
        for axis, least, most in (("x", 0.005, 1.0), ("y", 0.0, 1e-6)):
            values = [float(row[f"proxy_W_{axis}_m"]) for row in freed]
            self.assertGreaterEqual(max(values) - min(values), least, axis)
            self.assertLessEqual(max(values) - min(values), most, axis)

    def test_the_bench_has_the_loads_that_its_plan_says(self):
        plan_test.Plan.assert_agrees(self, [SOURCE / "models/cells/bench.yaml"])
        plan_test.Plan.assert_agrees(self, [SOURCE / "models/cells/bench.yaml", "--timestep", "2ms"])

    planned, logged = plan_test.Plan.planned, plan_test.Plan.logged

    def test_the_bench_wants_its_sensor_first_and_its_window(self):
        def refused(*change):
            file = self.changed("models/cells/bench.yaml", change)
            outcome = self.call("run", file, "--no-plot")
            self.copies().joinpath("models/cells/bench.yaml").write_text(
                (SOURCE / "models/cells/bench.yaml").read_text())
            self.assert_refused(outcome, "bus can can't carry a timestep of 1 ms")

        refused("base_id: 0x12", "base_id: 0x68")
        refused("receive_window: 0.55", "receive_window: 0.45")
        refused("receive_window: 0.55", "receive_window: 0.8")  # setpoints would be late then
        self.assert_refused(self.call("run", self.changed("models/cells/bench.yaml",
                                                          ("receive_window: 0.55", "receive_window: 0.95"))),
                            "receive_window", "0.95")

    def test_the_bench_with_its_switch_fits_and_runs(self):
        # As docs/tutorial/first_bus.md has it: a copy, and this line at its end.
        line = "enabling_input: {drive: shoulder, bit: 16}"
        self.assertIn(f"echo '{line}' >> models/cells/mine.yaml", (SOURCE / "docs/tutorial/first_bus.md").read_text())
        bench = self.copies() / "models/cells/bench.yaml"
        mine = bench.with_name("mine.yaml")
        mine.write_text(bench.read_text() + line + "\n")
        self.assertEqual(self.call("check", mine).status, 0)
        self.assertIn("\n  fits\n", self.call("plan", mine).out)
        self.assertGreaterEqual(self.ended_well(mine)["contacts"], 1)

    def test_check_says_what_run_would_refuse(self):
        copies = self.copies()
        bend = self.changed("models/cells/scara.yaml", ("range_rad: [0.2, 2.5]", "range_rad: [-2.5, 2.5]"))
        bend.write_text(re.sub(r"start_rad: \[.*\]", "start_rad: [0.3, 0, 0, 0]", bend.read_text()))
        lever = self.without_drive("bench.yaml", "elbow")
        for cell, words in ((bend, ("start_rad", "a singular pose", "bend the elbow")),
                            (lever, ("drives", "1 axis, which leads the tool along a curve"))):
            with self.subTest(cell.name):
                run, check = self.call("run", cell, "--no-plot"), self.call("check", cell)
                self.assert_refused(run, *words)
                self.assert_refused(check, *words)
                self.assertEqual(run.err, check.err)
        wall = copies / "scenes/wall.yaml"
        for cell, space in (("bench", "a plane along [1, 0, 0], [0, 0, 1]"), ("linear", "a line along [1, 0, 0]")):
            with self.subTest(cell):
                cell = copies / "models/cells" / f"{cell}.yaml"
                run = self.call("run", cell, "--scene", wall, "--no-plot")
                check = self.call("check", cell, "--scene", wall)
                self.assert_refused(run, "dimensions", "found 3", space)
                self.assertEqual(run.err, check.err)

    def test_what_the_refusal_says_to_write_is_taken(self):
        wall = self.changed("scenes/wall.yaml")
        bench = SOURCE / "models/cells/bench.yaml"
        said = self.call("run", bench, "--scene", wall, "--no-plot").err
        lines = re.findall(r"`([^`]*)`", said)
        self.assertEqual(len(lines), 2, said)
        wall.write_text(wall.read_text() + "\n".join(lines) + "\n")
        touch = self.summary(bench, "--scene", wall, "--no-plot")
        self.assertGreaterEqual(touch["contacts"], 1)
        self.assertEqual(touch["faults"], [])

    def test_fewer_than_six_dont_turn_as_a_hand_likes(self):
        self.assert_refused(self.call("run", SOURCE / "models/cells/scara.yaml", "--orientation", "free"),
                            "--orientation", "free, with 4 axes")
        self.summary(SOURCE / "models/cells/seven.yaml", "--orientation", "free", "--duration", "1s", "--no-plot")

    def test_the_session_says_what_the_axes_do(self):
        for cell, said in (("linear", "1 axis: the tool moves along a line"), ("bench", "2 axes: the tool moves in a plane"),
                           ("scara", "4 axes: the tool moves in space; its orientation is held as far as they can"),
                           ("seven", "7 axes: place and orientation are held, and the elbow where it began")):
            outcome = self.call("run", SOURCE / f"models/cells/{cell}.yaml", "--duration", "0.1s", "--no-plot")
            self.assertIn(said, outcome.out)

    def test_records_replay_to_the_same_setpoints(self):
        for cell in ("linear", "bench", "seven"):
            with self.subTest(cell):
                record = self.folder / cell
                self.ended_well(SOURCE / f"models/cells/{cell}.yaml", "--record", record, "--do", "hold@3s", "--do",
                                "resume@4s", "--duration", "4s", "--scene", FREE)
                replay = self.call("replay", record)
                self.assertEqual(replay.status, 0, replay.out + replay.err)
                self.assertIn("every setpoint is the same", replay.out)

    def test_the_bench_is_proven_and_mistakes_are_found(self):
        cell = self.changed("models/cells/bench.yaml")
        proven = self.call("prove", cell)
        self.assertEqual(proven.status, 0, proven.out + proven.err)
        self.assertRegex(proven.out, "(?m)^PROVEN")
        # The arm's elbow turns the other way than the cell says, and stands where the cell takes it to stand.
        text = cell.read_text()
        start_rad = float(re.search(r"start_rad: \[.*, (.*)\]", text)[1])
        counts_per_rad = 131072 * 100 / (2 * math.pi)
        other = cell.with_name("other.yaml")
        other.write_text(text.replace("direction: -1", "direction: 1").replace(
            "offset_counts: 40000", f"offset_counts: {round(40000 - 2 * counts_per_rad * start_rad)}"))
        wrong = self.call("prove", cell, "--arm", other)
        self.assertEqual(wrong.status, 1, wrong.out + wrong.err)
        self.assertRegex(wrong.out, "NOT PROVEN")
        # Its sensor is mounted a quarter turn off.
        other.write_text(text.replace("pose_link: {position_m: [0, 0, 0.03], rpy_rad: [0, 0, 0]}",
                                      "pose_link: {position_m: [0, 0, 0.03], rpy_rad: [0, 0, 1.5707963]}"))
        turned = self.call("prove", cell, "--arm", other)
        self.assertEqual(turned.status, 1, turned.out + turned.err)
        self.assertIn("the sensor is turned by -90 degrees about its z axis", turned.out)

    def test_what_no_weight_proves_is_refused_with_the_reason(self):
        for cell, reason in (("linear", "linear joint carriage"), ("gantry", "linear joint bridge")):
            self.assert_refused(self.call("prove", SOURCE / f"models/cells/{cell}.yaml"), "prove", reason)

    def test_assess_leads_the_bench_in_its_plane(self):
        outcome = self.call("assess", SOURCE / "models/cells/bench.yaml", "--poses", "1", "--json")
        self.assertIn(outcome.status, (0, 1), outcome.err)
        found = json.dumps(json.loads(outcome.out))
        self.assertRegex(found, r'"[+-][xz]"')
        self.assertNotRegex(found, r'"[+-]y"')


if __name__ == "__main__":
    unittest.main()
