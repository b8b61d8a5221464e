#!/usr/bin/python3
"""What is done once with a new arm: the controller falls silent on purpose, zeros of encoders are found, drives homed.

The judge of the silence reads no more than the program's figures and the cell: what stops each drive follows from how its
stack behaves (sim/canopen/stack_behaviour.hpp).
"""
import json
import re
import unittest

from harness import AXES, ProgramTest

COUNTS_PER_RAD = 1048576 * 150 / (2 * 3.141592653589793)


class Commissioning(ProgramTest):
    def cell(self, name, change=lambda text: text):
        folder = self.copies() / "models/cells"
        file = folder / name
        file.write_text(change((folder / "default.yaml").read_text()))
        return file

    def with_stack(self, stack):
        return self.cell(f"{stack}.yaml", lambda text: text.replace("    simulation:\n", f"    simulation:\n      stack: {stack}\n"))

    # ---- bus loss

    def stops(self, *arguments, status=0):
        outcome = self.call("prove", "--bus-loss", "--json", "--out", self.folder / "proof", *arguments)
        self.assertEqual((outcome.status, outcome.err), (status, ""), outcome.out)
        verdict = json.loads(outcome.out)
        self.assertEqual(verdict["proven"], status == 0)
        return verdict, {drive["joint"]: drive for drive in verdict["drives"]}

    def test_each_stack_stops_by_what_its_kind_watches_and_when_that_runs_out(self):
        # Drives look every millisecond, and a frame takes 0.1 ms. SYNC: 3 periods of 1 ms. The last word is a heartbeat.
        for stack, emcy, least, most in (("strict", "8700", 0.003, 0.006), ("latching", "8700", 0.003, 0.006),
                                         ("lazy", "8100", 0.059, 0.0625)):
            with self.subTest(stack):
                verdict, drives = self.stops(self.with_stack(stack))
                self.assertEqual(sorted(drives), AXES)
                self.assertEqual(verdict["promised_s"], 0.06)
                for drive in drives.values():
                    self.assertGreater(drive["stops_after_s"], least)
                    self.assertLess(drive["stops_after_s"], most)
                    self.assertIn(f"EMCY {emcy}h", drive["by"])

    def test_without_the_rpdo_timer_and_sync_the_heartbeat_keeps_the_promise_that_the_cell_makes(self):
        quick = self.cell("quick.yaml", lambda text: text.replace("    simulation:\n", "    simulation:\n      stack: lazy\n")
                          + "\nsupervision: {bus_loss_stop_s: 0.015}\n")
        verdict, drives = self.stops(quick)
        self.assertEqual(verdict["promised_s"], 0.015)
        for drive in drives.values():
            self.assertLess(drive["stops_after_s"], 0.015 + 0.0025)
        # The heartbeat three times in that time is part of the bus' plan, and of what is refused.
        plan = self.call("plan", quick)
        self.assertEqual(plan.status, 0, plan.err)
        self.assert_refused(self.call("run", quick, "--timestep", "8ms", "--mass", "20"), "bus_loss_stop_s", "three timesteps")

    def test_a_drive_that_does_not_stop_by_itself_is_found(self):
        # 6007h = 0 does nothing; the simulated one can't be set to that, so its connection is cut instead: it says nothing.
        verdict, drives = self.stops("--fault", "axis_4:silent@0.65s", status=1)
        if drives:
            self.assertNotEqual(drives["axis_4"]["failure"], "")
        else:
            self.assertIn("drive_silent", verdict["failure"])

    def test_it_is_kept_with_the_cells_proof_whichever_comes_first(self):
        cell = self.cell("mine.yaml")
        proof = cell.parent / "mine.yaml.proof"
        missing = "still missing there: signs, ratios, sensor and brakes"
        alone = self.call("prove", "--bus-loss", cell)
        self.assertEqual(alone.status, 0)
        self.assertIn(missing, alone.out)
        text = proof.read_text()
        self.assertIn("whole: false\n", text)
        self.assertEqual(len(re.findall(r"stops_after_ms: [\d.]+", text)), 6)
        self.assertEqual(self.call("prove", cell).status, 0)
        text = proof.read_text()
        self.assertNotIn("whole: false", text)
        self.assertEqual(len(re.findall(r"stops_after_ms: [\d.]+", text)), 6)
        again = self.call("prove", "--bus-loss", cell)
        self.assertEqual(again.status, 0)
        self.assertNotIn(missing, again.out)
        self.assertIn("signs, ratios, sensor and brakes proven", proof.read_text())
        # Of another cell nothing is kept.
        cell.write_text(cell.read_text() + "# another\n")
        self.assertEqual(self.call("prove", cell).status, 0)
        self.assertNotIn("stops_after_ms", proof.read_text())

    # ---- absolute encoders

    def of_joint(self, text, axis, change):
        parts = text.split("  - joint: ")
        parts[axis] = change(parts[axis])
        return "  - joint: ".join(parts)

    def test_offsets_are_found_in_marked_poses_and_written_with_a_backup(self):
        truth = self.cell("truth.yaml", lambda text: re.sub(r"offset_counts: .*", "offset_counts: 4711", text))
        mine = self.cell("mine.yaml", lambda text: self.of_joint(
            text, 3, lambda drive: re.sub(r"    offset_counts: .*\n", "", drive)).replace("# Inertia", "# my arm\n# Inertia"))
        before = mine.read_text()
        poses = ("--at", "0.5,0.4,0.2,0.3,1.3,0.4", "--at", "0,0.0675,0.5008,0,1.0025,0")
        outcome = self.call("calibrate", mine, "--arm", truth, *poses)
        self.assertEqual((outcome.status, outcome.err), (0, ""), outcome.out)
        offsets = [int(number) for number in re.findall(r"(?m)^axis_\d: offset_counts (-?\d+)", outcome.out)]
        self.assertEqual(len(offsets), 6)
        for offset in offsets:  # the model's twist of the gears is the simulation's to 20 µrad
            self.assertAlmostEqual(offset, 4711, delta=20e-6 * COUNTS_PER_RAD)
        text = mine.read_text()
        self.assertEqual(len(re.findall(r"(?m)^    offset_counts: ", text)), 6)
        self.assertIn("# my arm\n", text, "all else stays, comments too")
        self.assertEqual((mine.parent / "mine.yaml.before-calibration").read_text(), before)
        self.assertEqual(self.call("check", mine).status, 0)
        # Once more there is nothing to write, and no second backup.
        again = self.call("calibrate", mine, "--arm", truth, *poses)
        self.assertIn("stays as it is", again.out)
        self.assertEqual(mine.read_text(), text)
        self.assertEqual(len(list(mine.parent.glob("mine.yaml.before*"))), 1)

    def test_a_cell_in_braces_is_written_too(self):
        rewritten = self.cell("flow.yaml", lambda text: self.of_joint(text, 2, lambda drive: re.sub(
            r"(?s)^axis_2\n(.*?)    simulation:\n", lambda m: "axis_2\n" + m[1] + "    simulation:\n", drive)))
        text = rewritten.read_text()
        head, tail = text.split("drives:\n")
        body = tail.split("  - joint: axis_2\n")
        keys = dict(re.findall(r"(?m)^    (\w+): (.+)$", body[0]))
        simulation = dict(re.findall(r"(?m)^      (\w+): (.+)$", body[0]))
        keys.pop("offset_counts")
        flow = ", ".join(f"{key}: {value}" for key, value in keys.items())
        flow += ", simulation: {" + ", ".join(f"{key}: {value}" for key, value in simulation.items()) + "}"
        rewritten.write_text(head + "drives:\n  - {joint: axis_1, " + flow + "}\n  - joint: axis_2\n" + body[1])
        truth = self.cell("truth.yaml", lambda text: re.sub(r"offset_counts: .*", "offset_counts: -99000", text))
        outcome = self.call("calibrate", rewritten, "--arm", truth)
        self.assertEqual((outcome.status, outcome.err), (0, ""), outcome.out)
        self.assertRegex(rewritten.read_text(), r"\{joint: axis_1, offset_counts: -\d+,")

    def test_poses_that_do_not_fit_one_another_change_nothing(self):
        for key, old, new in (("direction", "direction: 1", "direction: -1"), ("gear_ratio", "gear_ratio: 150", "gear_ratio: 75")):
            with self.subTest(key):
                truth = self.cell("truth.yaml", lambda text: self.of_joint(text, 1, lambda drive: drive.replace(old, new)))
                mine = self.cell("mine.yaml")
                before = mine.read_text()
                outcome = self.call("calibrate", mine, "--arm", truth, "--at", "0,0.0675,0.5008,0,1.0025,0", "--at",
                                    "0.8,0.0675,0.5008,0,1.0025,0")
                self.assertEqual(outcome.status, 1, outcome.out + outcome.err)
                self.assertIn("axis_1 is", outcome.out)
                self.assertNotIn("axis_2 is", outcome.out)
                self.assertEqual(mine.read_text(), before)
        self.assert_refused(self.call("calibrate", self.cell("mine.yaml"), "--at", "0,0"), "--at", "2 angles", "6")
        self.assert_refused(self.call("calibrate", self.cell("mine.yaml"), "--home"), "--home", "absolute encoders")

    # ---- incremental encoders

    def incremental(self, name="incremental.yaml", axis=2, extra="", more=""):
        homing = ("    encoder: incremental\n    homing: {method: 17, speed_rad_per_s: 0.2, slow_speed_rad_per_s: 0.02, "
                  f"acceleration_rad_per_s2: 1, angle_rad: 0.3{extra}}}\n")
        return self.cell(name, lambda text: self.of_joint(text, axis, lambda drive: drive.replace(
            "    gear_ratio:", homing + "    gear_ratio:", 1)) + more)

    def test_an_incremental_encoder_is_homed_and_until_then_nothing_is_rendered(self):
        cell = self.incremental()
        self.assert_refused(self.call("run", cell), "axis_2", "1020h:01", "calibrate --home")
        outcome = self.call("calibrate", cell, "--home")
        self.assertEqual((outcome.status, outcome.err), (0, ""), outcome.out)
        self.assertRegex(outcome.out, r"axis_2: homed, at 0\.3 rad it reads -?\d+ counts")
        # Its servo has no integrator: some tenths of a milliradian of its weight are left, and the encoder sees them.
        self.assertLess(abs(int(re.search(r"reads (-?\d+) counts", outcome.out)[1])), 1e-3 * COUNTS_PER_RAD)
        written = int(re.findall(r"offset_counts: (-?\d+)", cell.read_text().split("joint: axis_2")[1])[0])
        self.assertAlmostEqual(abs(written), 0.3 * COUNTS_PER_RAD, delta=1)  # it turns against its counts
        summary = self.summary(cell, "--fault", "axis_2:homed", "--no-plot", "--duration", "0.5s")
        self.assertEqual(summary["faults"], [])
        # Others' poses are still to be marked; this one has none.
        self.assertIn("axis_2: its encoder is incremental", self.call("calibrate", cell).out)

    def test_homing_that_fails_says_so_and_leaves_the_cell_as_it_is(self):
        for extra, fault, words in ((", timeout_s: 1", None, ("no home within 1 s",)), ("", "axis_2:jammed@0.3s", ("statusword",)),
                                    ("", "axis_2:lacks=0x609801", None), ("", "axis_2:lacks=0x609901", ("6099h:01",))):
            if words is None:
                continue
            with self.subTest(fault or extra):
                cell = self.incremental(extra=extra)
                before = cell.read_text()
                self.assert_refused(self.call("calibrate", cell, "--home", *(("--fault", fault) if fault else ())), "axis_2",
                                    *words)
                self.assertEqual(cell.read_text(), before)
        odd = self.incremental()
        odd.write_text(odd.read_text().replace("method: 17", "method: 99"))
        self.assert_refused(self.call("calibrate", odd, "--home"), "homing error", "method 99")

    def test_what_a_cell_says_of_its_encoders_is_checked(self):
        for old, new, words in (("encoder: incremental", "encoder: absolute", ("encoder", "incremental")),
                                ("speed_rad_per_s: 0.2", "speed_rad_per_s: 20", ("homing.speed_rad_per_s",)),
                                ("angle_rad: 0.3", "angle_rad: 9", ("homing.angle_rad",))):
            with self.subTest(new):
                cell = self.incremental()
                cell.write_text(cell.read_text().replace(old, new, 1))
                self.assert_refused(self.call("run", cell), *words)
        self.assert_refused(self.call("run", "--fault", "axis_1:homed"), "homed for axis_1", "incremental")


if __name__ == "__main__":
    unittest.main()
