#!/usr/bin/python3
"""`proxarm prove`: a controller that takes the simulated arm for another one finds out; and the file of a proof."""
import json
import re
import unittest

from harness import AXES, SOURCE, ProgramTest

SENSOR = "  description: ../sensors/ati_net_can_oem.yaml\n"


class Prove(ProgramTest):
    def cell(self, name, change=lambda text: text, *, of="default.yaml"):
        folder = self.copies() / "models/cells"
        shipped = (folder / of).read_text()
        (folder / name).write_text(change(shipped))
        return folder / name

    def of_joint(self, axis, key, change):
        """Changes one figure of one drive in a cell's text."""
        def edit(text):
            parts = text.split("  - joint: ")
            parts[axis], n = re.subn(rf"{key}: (-?[\d.]+)", lambda m: f"{key}: {change(float(m[1])):g}", parts[axis],
                                     count=1)
            self.assertEqual(n, 1)
            return "  - joint: ".join(parts)
        return edit

    def replaced(self, old, new):
        def edit(text):
            self.assertIn(old, text)
            return text.replace(old, new)
        return edit

    def verdict(self, *arguments, status=1):
        outcome = self.call("prove", "--json", "--out", self.folder / "proof", *arguments)
        self.assertEqual((outcome.status, outcome.err), (status, ""), outcome.out)
        self.assertEqual((self.folder / "proof").exists(), status == 0, "a proof is written where there is one")
        return json.loads(outcome.out)

    def assert_found(self, taken_for, arm, words):
        verdict = self.verdict(taken_for, "--arm", arm)
        self.assertFalse(verdict["proven"])
        self.assertEqual(verdict["failure"], "")
        self.assertIn(words, verdict["mistakes"][0]["mistake"])

    def test_an_arm_that_is_as_its_cell_says_is_proven(self):
        verdict = self.verdict(status=0)
        self.assertTrue(verdict["proven"])
        self.assertEqual(verdict["mistakes"], [])
        self.assertLess(verdict["as_it_is"]["residual"], 0.05)
        self.assertLess(verdict["as_it_is"]["angle_deg"], 2)

    def test_every_joint_that_turns_the_other_way_is_found(self):
        for i, axis in enumerate(AXES, 1):
            with self.subTest(axis):
                self.assert_found(self.cell("taken.yaml", self.of_joint(i, "direction", lambda v: -v)),
                                  self.cell("arm.yaml"), f"{axis} turns the other way")

    def test_every_gear_ratio_that_is_off_by_two_is_found(self):
        for i, axis in enumerate(AXES, 1):
            key = "gear_ratio" if i % 2 else "counts_per_motor_revolution"
            with self.subTest(axis, key=key):
                self.assert_found(self.cell("taken.yaml", self.of_joint(i, key, lambda v: 2 * v)),
                                  self.cell("arm.yaml"), f"{axis} turns twice as far")
                if i % 3 != 2:
                    continue
                self.assert_found(self.cell("arm.yaml"),
                                  self.cell("real.yaml", self.of_joint(i, key, lambda v: 2 * v)),
                                  f"{axis} turns half as far")

    def test_a_sensor_that_is_turned_is_found(self):
        old = "position_m: [0, 0, 0.03], rpy_rad: [0, 0, 0]"
        for rpy, words in (("0, 0, 3.14159265", "180 degrees about its z axis"),
                           ("3.14159265, 0, 0", "180 degrees about its x axis"),
                           ("0, 0, 1.57079633", "90 degrees about its z axis")):
            with self.subTest(rpy):
                self.assert_found(self.cell("taken.yaml", self.replaced(old, old.replace("0, 0, 0]", rpy + "]"))),
                                  self.cell("arm.yaml"), words)

    def test_a_sensor_of_another_sign_or_scale_is_found(self):
        sensors = self.copies() / "models/sensors"
        aidin = (sensors / "aidin_aft200.yaml").read_text()
        for name, scale, offset in (("opposite", -0.01, 300), ("doubled", 0.02, -600)):
            text = aidin.replace("scale: 0.01, offset: -300", f"scale: {scale}, offset: {offset}")
            (sensors / f"{name}.yaml").write_text(text)

        def with_sensor(name):
            return lambda text: text.replace(SENSOR, f"  description: ../sensors/{name}.yaml\n").replace(
                "  base_id: 0x68\n", "")
        arm = self.cell("arm.yaml", with_sensor("aidin_aft200"))
        self.assertTrue(self.verdict(arm, status=0)["proven"])
        (self.folder / "proof").unlink()
        self.assert_found(self.cell("taken.yaml", with_sensor("opposite")), arm, "opposite sign")
        self.assert_found(self.cell("taken.yaml", with_sensor("doubled")), arm, "twice the force")

    def test_a_tool_of_another_mass_is_no_proof(self):
        self.assert_found(self.cell("taken.yaml", self.replaced("mass_kg: 0.25", "mass_kg: 0.5")), self.cell("arm.yaml"),
                          "tool.mass_kg is twice what hangs there")

    def test_a_drive_that_turns_against_its_setpoints_ends_it(self):
        verdict = self.verdict("--fault", "axis_3:reversed")
        self.assertIn("drive_deviates (axis_3)", verdict["failure"])

    def test_brakes_that_do_not_hold_are_no_proof(self):
        weak = self.cell("weak.yaml", lambda text: re.sub("( {6})(max_torque_Nm: .*)", r"\1\2\n\1brake_torque_Nm: 50", text))
        self.assertIn("the brakes don't hold", self.verdict(self.cell("arm.yaml"), "--arm", weak)["failure"])

    def test_somebody_who_pushes_for_a_proof_is_there_in_place_of_the_hand_not_beside_it(self):
        self.assert_refused(self.call("sim", "--bus", "vcan0", "--for-proof", "--hand", SOURCE / "sim/hands/touch.yaml"),
                            "--for-proof: found --hand beside it", "one of the two")

    # `prove --hardware` proved the simulated arm, without a word of it.
    def test_a_real_arm_is_one_on_an_interface(self):
        for command in ("prove", "prove --bus-loss", "prove --bus sim", "run", "calibrate"):
            with self.subTest(command):
                self.assert_refused(self.call(*command.split(), "--hardware"), "--hardware: found --bus sim",
                                    "such as --hardware --bus can0")

    def test_the_enabling_switch_is_part_of_it(self):
        cell = self.cell("switch.yaml", lambda text: text + "\nenabling_input: {drive: axis_6, bit: 16}\n")
        self.assertIn("enabling_released", self.verdict(cell, "--enabling", "0.1s..5s")["failure"])
        self.assertIn("enabling_not_pressed", self.verdict(cell, "--enabling", "2min..")["failure"])
        self.assertTrue(self.verdict(cell, status=0)["proven"])

    def test_the_proof_lies_beside_the_cell_and_names_what_it_is_of(self):
        cell = self.cell("mine.yaml")
        outcome = self.call("prove", cell)
        self.assertEqual((outcome.status, outcome.err), (0, ""))
        self.assertIn("PROVEN", outcome.out)
        text = (cell.parent / "mine.yaml.proof").read_text()
        self.assertRegex(text, r'(?m)^cell_sha256: "[0-9a-f]{64}"$')
        self.assertIn("arm: simulated\n", text)
        self.assertIn("certifies nothing", text)
        of_it = re.search("cell_sha256: .*", text)[0]
        # Another cell, or another URDF under the same cell, is another hash.
        for file in (cell, self.copies() / "models/arms/arm150.urdf", self.copies() / "models/sensors/ati_net_can_oem.yaml"):
            comment = "<!-- -->" if file.suffix == ".urdf" else "# a comment"
            file.write_text(file.read_text() + comment + "\n")
            self.assertEqual(self.call("prove", cell).status, 0)
            other = re.search("cell_sha256: .*", (cell.parent / "mine.yaml.proof").read_text())[0]
            self.assertNotEqual(other, of_it)
            of_it = other

    def test_what_can_not_be_proven_is_refused(self):
        for arguments, words in ((("models/cells/rail.yaml",), ("rail", "linear joint")),
                                 (("models/cells/light.yaml",), ("light.yaml", "positions")),
                                 (("--arm", "nobody.yaml"), ("nobody.yaml",)),
                                 (("--arm", "models/cells/default.yaml", "--bus", "vcan0"), ("--arm", "proxarm sim")),
                                 (("--hand", "sim/hands/touch.yaml"), ("--hand",))):
            with self.subTest(arguments):
                self.assert_refused(self.call("prove", *arguments), *words)
        # It had sixteen digits: "found elbow at 1.8509341503988659 rad".
        narrow = self.cell("narrow.yaml", self.replaced("range_rad: [0.25, 2.65]", "range_rad: [1.8, 2.0]"), of="bench.yaml")
        outcome = self.call("prove", narrow)
        self.assert_refused(outcome, "narrow.yaml: prove: found elbow at ", "expected 0.3 rad of its range to either side")
        self.assertRegex(outcome.err, r"found elbow at \d\.\d{1,2} rad")
        outcome = self.call("prove", "--out", self.folder / "nowhere" / "proof")
        self.assertEqual(outcome.status, 2)
        self.assertIn("the proof can't be written", outcome.err)
        self.assertTrue((SOURCE / "models/cells/default.yaml.proof").exists() is False)


if __name__ == "__main__":
    unittest.main()
