#!/usr/bin/python3
"""`proxarm identify`: what hangs behind the sensor, found on arms that carry another tool than their cell says.

The judge of masses, centres and zeros is tests/soak/identify_hunt.py, which reads the truth from the files."""
import json
import math
import re
import sys
import unittest

import yaml
from harness import SOURCE, ProgramTest

sys.path.insert(0, str(SOURCE / "tests/soak"))
import identify_hunt as hunt  # noqa: E402
import identify_joints_hunt as joints_hunt  # noqa: E402

HELD = """name: {name}
mass_kg: 0.5
stiffness_N_per_m: 200
damping_Ns_per_m: 10
max_force_N: {newtons}
waypoints:
  - {{time_s: 1.0, offset_m: [0, 0, 0]}}
  - {{time_s: 4.0, offset_m: [0.05, 0.05, 0]}}
"""


class Identify(ProgramTest):
    def cell(self, name, *, of="default.yaml", change=lambda text: text):
        """A copy of a shipped cell that nobody else uses, in the test's folder."""
        path = SOURCE / "models/cells" / of
        return self.written(name, change(hunt.rooted(path.read_text())))

    def identify(self, *arguments, status=0):
        outcome = self.call("identify", "--json", *arguments)
        self.assertEqual((outcome.status, outcome.err), (status, ""), outcome.out)
        return json.loads(outcome.out)

    def heavier(self, name="arm.yaml"):
        return self.cell(name, change=lambda text: text.replace("  mass_kg: 0.25\n", "  mass_kg: 1.75\n", 1).replace(
            "centre_of_mass_S_m: [0, 0, 0.06]", "centre_of_mass_S_m: [0.03, -0.02, 0.09]", 1))

    def test_random_tools_are_found_and_the_intervals_are_true(self):
        judge = hunt.Judge()
        for n in range(4):
            hunt.session(judge, f"fast/{n}", self.folder)
        self.assertEqual(judge.missed, [])
        # Of 4 masses and 12 components each, one in twenty may be missed: two of twelve are, in one of eight such tests.
        for kind, true in judge.true.items():
            self.assertGreaterEqual(sum(true), len(true) - 2, kind)

    def test_the_result_is_told_compared_and_written(self):
        cell, arm = self.cell("mine.yaml"), self.heavier()
        before = cell.read_text()
        told = self.call("identify", cell, "--arm", arm, "--compare", "--write")
        self.assertEqual((told.status, told.err), (0, ""), told.out)
        self.assertRegex(told.out, r"(?m)^  mass +1\.7\d+ kg, ± 0\.\d+$")
        self.assertRegex(told.out, r"tool\.mass_kg: 0\.25\d*, found 1\.7\d+: DIFFERS")
        self.assertIn("mounting error of 0.5 degrees, a zero that drifts by 3.3 N", told.out)
        self.assertIn("mine.yaml.before-identify", told.out)
        self.assertEqual((self.folder / "mine.yaml.before-identify").read_text(), before)
        after = cell.read_text()
        mass = float(re.search(r"\n  mass_kg: ([\d.]+)", after)[1])
        centre = [float(x) for x in re.search(r"centre_of_mass_S_m: \[([^]]*)\]", after)[1].split(",")]
        self.assertAlmostEqual(mass, 1.75, delta=0.0275)
        self.assertLess(math.dist(centre, (0.03, -0.02, 0.09)), 0.002)
        blank = lambda text: re.sub(r"(\n  mass_kg:|centre_of_mass_S_m:).*", r"\1", text)
        self.assertEqual(blank(after), blank(before), "all else stays")
        zero = (self.folder / "mine.yaml.zero").read_text()
        self.assertIn("arm: simulated\n", zero)
        read = [float(x) for x in re.search(r"force_S_N: \[([^]]*)\]", zero)[1].split(",")]
        self.assertLess(math.dist(read, hunt.zero_of_sensor()[0]), 0.1)
        # The cell is now as the arm is: a session starts, and a comparison finds no difference.
        run = self.call("run", cell, "--arm", arm, "--duration", "0.2s", "--no-plot", "--json", "--hand",
                        self.written("nobody.yaml", "name: nobody\nmass_kg: 0\nstiffness_N_per_m: 0\n"
                                     "damping_Ns_per_m: 0\nwaypoints:\n  - {time_s: 0.3, offset_m: [0, 0, 0]}\n"))
        self.assertEqual(run.summary["faults"], [])
        compared = self.identify(cell, "--arm", arm, "--compare")["compared"]
        self.assertEqual([d["key"] for d in compared],
                         ["tool.mass_kg", "tool.centre_of_mass_S_m", "force_S_N of mine.yaml.zero"])
        self.assertEqual([d["differs"] for d in compared], [False] * 3, compared)

    def test_a_comparison_that_differs_is_status_1_and_changes_nothing(self):
        cell, arm = self.cell("mine.yaml"), self.heavier()
        before = cell.read_text()
        result = self.identify(cell, "--arm", arm, "--compare", status=1)
        self.assertTrue(result["identified"])
        self.assertTrue(result["compared"][0]["differs"])
        self.assertEqual(cell.read_text(), before)
        self.assertEqual(sorted(file.name for file in self.folder.iterdir()), ["arm.yaml", "mine.yaml"])

    def test_a_hand_at_the_handle_is_noticed(self):
        cell = self.cell("mine.yaml")
        for newtons in (1, 5):
            with self.subTest(newtons):
                hand = self.written("hand.yaml", HELD.format(name="held", newtons=newtons))
                result = self.identify(cell, "--hand", hand, "--write", status=1)
                self.assertFalse(result["identified"])
                self.assertIn("hand", result["failure"])
                self.assertIsNone(result["mass_kg"])
        self.assertEqual(sorted(file.name for file in self.folder.iterdir()), ["hand.yaml", "mine.yaml"])

    def test_a_drive_that_fails_ends_it(self):
        result = self.identify(self.cell("mine.yaml"), "--fault", "axis_5:fault=0x4210@6s", status=1)
        self.assertIn("drive_fault", result["failure"])

    def test_a_zero_that_drifts_is_told_from_weight(self):
        result = self.identify(self.cell("mine.yaml"), "--fault", "sensor:drift=0.03N/s")
        self.assertAlmostEqual(result["mass_kg"]["value"], 0.25, delta=0.005)

    def test_what_can_t_be_identified_is_said_with_the_reason(self):
        for name in ("scara", "gantry", "linear"):
            with self.subTest(name):
                outcome = self.call("identify", SOURCE / f"models/cells/{name}.yaml", "--write")
                self.assertEqual((outcome.status, outcome.err), (1, ""))
                self.assertIn("not identifiable: mass, centre of mass and zero: no joint of the wrist tilts",
                              outcome.out)

    def test_mistakes_are_refused(self):
        light = SOURCE / "models/cells/light.yaml"
        for arguments, words in (((light,), ("light.yaml", "identify", "impedance", "positions")),
                                 (("--arm", "nobody.yaml"), ("nobody.yaml",)),
                                 (("--hand", "nobody.yaml"), ("nobody.yaml",)),
                                 (("--arm", light, "--bus", "vcan0"), ("--arm", "proxarm sim")),
                                 (("--hand", "hand.yaml", "--bus", "vcan0"), ("--hand", "proxarm sim")),
                                 (("--hardware",), ("--hardware: found --bus sim",)),
                                 (("--mass", "4"), ("--mass",))):
            with self.subTest(arguments):
                self.written("hand.yaml", HELD.format(name="held", newtons=1))
                self.assert_refused(self.call("identify", *arguments), *words)
        narrow = self.cell("narrow.yaml", change=lambda text: text.replace(
            "limits:\n", "limits:\n  workspace_m: {min: [0.699, -0.001, 0.599], max: [0.701, 0.001, 0.601]}\n", 1))
        self.assert_refused(self.call("identify", narrow), "identify: found a start from which the wrist can go to",
                            "workspace_m")


KEYS = ("rotor_inertia_kg_m2", "gear_stiffness_Nm_per_rad", "gear_damping_Nms_per_rad", "simulation.coulomb_friction_Nm",
        "simulation.viscous_friction_Nms_per_rad")


class IdentifyJoints(ProgramTest):
    def cell(self, name="mine.yaml", *, change=lambda text: text):
        return self.written(name, change(joints_hunt.shipped("default")))

    def identify(self, *arguments, status=0):
        outcome = self.call("identify", "--joints", "--json", *arguments)
        self.assertEqual((outcome.status, outcome.err), (status, ""), outcome.out)
        return json.loads(outcome.out)

    def test_random_arms_are_found_and_the_intervals_are_true(self):
        rows = []
        for n in range(2):
            result = joints_hunt.session(f"fast/{n}", self.folder / str(n))
            self.assertEqual(result["wrong"], [])
            rows += result["rows"]
        self.assertGreaterEqual(len(rows), 2 * 20)
        missed = [row for row in rows if abs(row[2]) > 1.0]
        # Of 50, one in twenty may be missed: more than five are, in one of thirty such tests.
        self.assertLessEqual(len(missed), 5, missed)

    def test_what_is_about_to_move_is_said_and_the_result_is_compared_and_written(self):
        soft = lambda text: text.replace("gear_stiffness_Nm_per_rad: 115000", "gear_stiffness_Nm_per_rad: 90000", 1).replace(
            "coulomb_friction_Nm: 25", "coulomb_friction_Nm: 40", 1)
        cell, arm = self.cell(), self.cell("arm.yaml", change=soft)
        before = cell.read_text()
        told = self.call("identify", cell, "--joints", "--arm", arm, "--compare", "--write")
        self.assertEqual((told.status, told.err), (0, ""), told.out)
        self.assertRegex(told.out, r"\Athe arm is about to move, one joint after the other, for \d+ s:\n  axis_1 +± [\d.]+ mrad")
        self.assertRegex(told.out, r"simulation\.coulomb_friction_Nm +(39|40|41)\S* Nm, ± \S+; the cell has 25: DIFFERS")
        self.assertRegex(told.out, r"gear_stiffness_Nm_per_rad +(8|9)\d+ Nm/rad, ± \d+; the cell has 1.15e\+05: DIFFERS")
        self.assertRegex(told.out, r"axis_6\n(  .*\n)*  gear_damping_Nms_per_rad +not identifiable: the tool hardly swings")
        self.assertEqual((self.folder / "mine.yaml.before-identify").read_text(), before)
        after = cell.read_text()
        blank = lambda text: re.sub(rf"({'|'.join(key.split('.')[-1] for key in KEYS)}): \S+", r"\1", text)
        self.assertEqual(blank(after), blank(before), "all else stays")
        first = after[:after.index("joint: axis_2")]
        self.assertAlmostEqual(float(re.search(r"coulomb_friction_Nm: (\S+)", first)[1]), 40.0, delta=2.5)
        damping = re.findall(r"gear_damping_Nms_per_rad: (\S+)", first)
        self.assertEqual(len(set(damping)), 1, "the controller's and the simulated one")
        self.assertIn("gear_damping_Nms_per_rad: 1.5\n", after, "what wasn't found stays")
        compared = self.identify(cell, "--arm", arm, "--compare")
        self.assertEqual([key for joint in compared["joints"].values() for key, e in joint.items() if e.get("differs")], [])

    def test_a_comparison_that_differs_is_status_1_and_changes_nothing(self):
        cell = self.cell()
        arm = self.cell("arm.yaml", change=lambda text: text.replace("coulomb_friction_Nm: 25", "coulomb_friction_Nm: 50", 1))
        before = cell.read_text()
        result = self.identify(cell, "--arm", arm, "--compare", status=1)
        self.assertTrue(result["joints"]["axis_1"]["simulation.coulomb_friction_Nm"]["differs"])
        self.assertEqual(cell.read_text(), before)

    def test_a_hand_at_the_handle_is_noticed(self):
        for newtons in (1, 5):
            with self.subTest(newtons):
                hand = self.written("hand.yaml", HELD.format(name="held", newtons=newtons))
                result = self.identify(self.cell(), "--hand", hand, "--write", status=1)
                self.assertFalse(result["identified"])
                self.assertIn("hand", result["failure"])
                self.assertEqual(result["joints"], {})
        self.assertEqual(sorted(file.name for file in self.folder.iterdir()), ["hand.yaml", "mine.yaml"])

    def test_a_drive_that_fails_ends_it(self):
        result = self.identify(self.cell(), "--fault", "axis_3:fault=0x4210@20s", status=1)
        self.assertIn("drive_fault", result["failure"])

    def test_a_tool_that_is_another_is_noticed(self):
        heavier = self.cell("arm.yaml", change=lambda text: text.replace("  mass_kg: 0.25\n", "  mass_kg: 0.5\n", 1))
        result = self.identify(self.cell(), "--arm", heavier, status=1)
        self.assertIn("tool", result["failure"])

    def test_without_torques_the_reason_is_told(self):
        result = self.identify(self.cell(), "--fault", "axis_2:lacks=0x607700")
        self.assertIn("6077h", result["joints"]["axis_2"]["simulation.coulomb_friction_Nm"]["not_identifiable"])
        self.assertIsNotNone(result["joints"]["axis_2"]["gear_stiffness_Nm_per_rad"]["value"])
        self.assertIsNotNone(result["joints"]["axis_1"]["simulation.coulomb_friction_Nm"]["value"])
        unsaid = self.cell("unsaid.yaml", change=lambda text: re.sub(r"\n    rated_torque_Nm: \S+", "", text))
        result = self.identify(unsaid)
        for joint in result["joints"].values():
            self.assertIn("rated_torque_Nm", joint["rotor_inertia_kg_m2"]["not_identifiable"])

    def test_mistakes_are_refused(self):
        for arguments, words in (((SOURCE / "models/cells/light.yaml",), ("light.yaml", "identify --joints", "impedance")),
                                 ((SOURCE / "models/cells/rail.yaml",), ("rail.yaml", "Modbus")),
                                 (("--hardware",), ("--hardware: found --bus sim",))):
            with self.subTest(arguments):
                self.assert_refused(self.call("identify", "--joints", *arguments), *words)
        narrow = self.cell("narrow.yaml", change=lambda text: text.replace(
            "limits:\n", "limits:\n  workspace_m: {min: [0.6, -0.005, 0.5], max: [0.8, 0.005, 0.7]}\n", 1))
        self.assert_refused(self.call("identify", "--joints", narrow), "identify --joints", "axis_1", "workspace_m")

    def test_keys_that_the_file_does_not_have_are_put_in_and_all_else_stays(self):
        """A cell without damping and friction of one drive, and with little in `simulation` of another."""
        lost = "gear_damping_Nms_per_rad|coulomb_friction_Nm|viscous_friction_Nms_per_rad"

        def without(text):
            one, two, three = (text.index(f"- joint: axis_{n}") for n in (1, 2, 3))
            first = re.sub(rf"\n +(?:{lost}): \S+", "", text[one:two])
            second = re.sub(r"\n    simulation:\n(?:      .*\n)+", "\n    simulation: {max_torque_Nm: 2500, position_gain_per_s: 350, "
                            "velocity_bandwidth_Hz: 200}  # little\n", text[two:three])
            return text[:one] + first + second + text[three:]

        bare = self.cell("bare.yaml", change=without)
        before = bare.read_text()
        self.assertNotRegex(before[:before.index("axis_2")], lost)
        outcome = self.call("identify", "--joints", bare, "--arm", self.cell(), "--write")
        self.assertEqual((outcome.status, outcome.err), (0, ""), outcome.out)
        self.assertEqual((self.folder / "bare.yaml.before-identify").read_text(), before)
        after = bare.read_text()
        left = after.splitlines()
        kept = [line for line in before.splitlines() if not re.search("|".join(["little", *(key.split(".")[-1] for key in KEYS)]), line)]
        rest = iter(left)
        self.assertTrue(all(any(line == there for there in rest) for line in kept), "every other line is there, in order")
        first = after[after.index("joint: axis_1"):after.index("joint: axis_2")]
        self.assertEqual(len(re.findall(r"\n    gear_damping_Nms_per_rad: ", first)), 1)
        self.assertAlmostEqual(float(re.search(r"\n      coulomb_friction_Nm: (\S+)", first)[1]), 25.0, delta=2.5)
        self.assertRegex(after[after.index("joint: axis_2"):after.index("joint: axis_3")],
                         r"\n    simulation: \{max_torque_Nm: 2500, .*coulomb_friction_Nm: [\d.]+, .*\}  # little\n")
        # The program reads it again, and finds no difference.
        compared = self.identify(bare, "--arm", self.cell(), "--compare")
        self.assertEqual([(joint, key) for joint, of in compared["joints"].items() for key, e in of.items()
                          if e.get("differs")], [])

    def test_what_is_found_of_a_joint_is_written_at_it_where_all_joints_had_it_from_defaults(self):
        arm = self.written("arm.yaml", joints_hunt.shipped("cobot"))
        text = re.sub(r", gear_stiffness_Nm_per_rad: [\d.]+, gear_damping_Nms_per_rad: [\d.]+", "", arm.read_text())
        text = re.sub(r",\n     simulation: \{.*\}\}", "}", text)
        for name, keys in (("drive", "gear_stiffness_Nm_per_rad: 50000"),
                           ("simulation", "coulomb_friction_Nm: 3\n  gear_damping_Nms_per_rad: 10\n  gear_stiffness_ratio: 1.1\n"
                                          "  max_torque_Nm: 300")):
            text = re.sub(rf"\n{name}_defaults:.*\n", rf"\g<0>  {keys}\n", text)
        cell = self.written("short.yaml", text)
        for _ in range(2):  # the second time the joint has them itself
            outcome = self.call("identify", "--joints", cell, "--arm", arm, "--write")
            self.assertEqual(outcome.status, 0, outcome.err)
            before, after = yaml.safe_load(text), yaml.safe_load(cell.read_text())
            for name in ("drive_defaults", "simulation_defaults"):
                self.assertEqual(after[name], before[name], "what all have stays")
            first = after["drives"][0]
            self.assertEqual(next(iter(first)), "joint")
            self.assertAlmostEqual(first["gear_stiffness_Nm_per_rad"], 130000, delta=6500)
            self.assertAlmostEqual(first["simulation"]["coulomb_friction_Nm"], 4.8, delta=0.5)
            self.assertEqual(first["simulation"]["gear_damping_Nms_per_rad"], first["gear_damping_Nms_per_rad"])
            self.assertEqual(first["simulation"]["gear_stiffness_ratio"], 1, "the stiffness that was found is the real one")

    def test_a_key_that_can_not_be_put_in_is_named_and_nothing_is_written(self):
        """A drive that another line of the file is: it has no entry of its own."""
        bare = self.cell("bare.yaml", change=lambda text: re.sub(r"\n +gear_damping_Nms_per_rad: 130(?=\n)", "", text).replace(
            "- joint: axis_1\n", "- \"joint\": axis_1\n", 1))
        before = bare.read_text()
        outcome = self.call("identify", "--joints", bare, "--arm", self.cell(), "--write")
        self.assertEqual(outcome.status, 2)
        self.assertRegex(outcome.err, r"bare\.yaml.*axis_1.*write it by hand")
        self.assertEqual(bare.read_text(), before)
        self.assertEqual(sorted(file.name for file in self.folder.iterdir()), ["bare.yaml", "mine.yaml"])


if __name__ == "__main__":
    unittest.main()
