"""Odd arms get from `proxarm new-cell` a cell that runs at once and is steady, or the reason why there is none."""
import unittest

from harness import ProgramTest
from new_cell_test import FOUR, SIX, arm

LONG_TOOL = ('<origin xyz="0.05 0 0"/>', '<origin xyz="0.4 0 0"/>')
TURN_Z, TURN_Y = ("revolute", "0 0 0.5", "0 0 1"), ("revolute", "0 0 0.1", "0 1 0")


def body(mass, moment):
    return (f'<inertial><mass value="{mass}"/><inertia ixx="{moment}" iyy="{moment}" izz="{moment}" ixy="0" ixz="0" '
            'iyz="0"/></inertial>')


def scaled(joints, by):
    return [(kind, " ".join(f"{by * float(x):g}" for x in origin.split()), axis) for kind, origin, axis in joints]


class OddArms(ProgramTest):
    def made(self, text):
        return self.call("new-cell", self.written("arm.urdf", text), "--out", self.folder / "out", "--force")

    def assert_steady(self, text, touches=True):
        made = self.made(text)
        self.assertEqual((made.status, made.err), (0, ""))
        summary = self.summary(self.folder / "out/cell.yaml")
        self.assertEqual(summary["faults"], [])
        self.assertFalse(summary["oscillation"]["lasts"])
        self.assertEqual(summary["contacts"] > 0, touches)
        self.assertAlmostEqual(summary["apparent_mass_kg"] / summary["wanted_mass_kg"], 1, delta=0.05)
        return made.out

    def test_masses_that_no_body_has_are_estimated(self):
        told = self.assert_steady(arm(SIX, inertial={1: body("nan", 0.1), 2: body(-5, 0.1), 3: body("inf", 1),
                                                     4: body(2, "nan"), 5: body(2, -0.1), 6: body("heavy", 0.1)}))
        for link in range(1, 7):
            self.assertIn(f"link_{link} (", told)
        self.assertIn("link_4 (2 kg, as the file says)", told)

    def test_a_line_a_plane_and_three_axes_run(self):
        # The default hand's way lies ahead and to the side: of a tool that goes up and down it is turned upwards. Before,
        # such an arm was refused, since the hand pulled it where it can't go.
        for name, text, touches in (
                ("up and down", arm([("prismatic", "0 0 0.5", "0 0 1")]), False),
                ("an upright plane", arm([("revolute", "0 0 0.5", "0 1 0"), ("revolute", "0.5 0 0", "0 1 0")]).replace(*LONG_TOOL), False),
                ("three that turn", arm([TURN_Z, TURN_Y, ("revolute", "0.5 0 0", "0 1 0")]).replace(*LONG_TOOL), True)):
            with self.subTest(name):
                told = self.assert_steady(text, touches)
                self.assertEqual((self.folder / "out/hand.yaml").exists() and "turned to where the tool can go" in told,
                                 not touches)
                if not touches:
                    self.folder.joinpath("out/hand.yaml").unlink()

    def test_an_arm_starts_alike_wherever_its_base_stands(self):
        # Starts were judged from the world's origin: 3 m behind it the best one was near full stretch.
        kind, origin, axis = SIX[0]
        z = origin.split()[2]
        starts = []
        for place in (f"0 0 {z}", f"-3 0 {z}", f"2 -4 {z}"):
            made = self.made(arm([(kind, place, axis), *SIX[1:]]))
            self.assertEqual((made.status, made.err), (0, ""))
            starts += [line for line in (self.folder / "out/cell.yaml").read_text().splitlines() if "start_rad:" in line]
        self.assertEqual(len(starts), 3)
        self.assertEqual(len(set(starts)), 1, starts)

    def test_instructions_for_other_programs_are_passed_over(self):
        # Behind a comment, or within the robot: well-formed, and refused as no XML.
        text = arm(FOUR)
        begun = text.index("<robot")
        end = text.index(">", begun) + 1
        text = ("<!-- made <?by?> hand -->\n<?xml-stylesheet type='text/css' href='arm.css'?>\n" + text[begun:end] +
                "<?editor\nfold <link?>" + text[end:])
        made = self.made(text)
        self.assertEqual((made.status, made.err), (0, ""))
        broken = self.made(text.replace("</robot>", "", 1))
        self.assert_refused(broken, "arm.urdf", "not XML")

    def test_efforts_that_cant_move_the_arm_are_told_of_and_not_taken(self):
        # They bear the light wrist's weight, and no hand.
        made = self.made(arm(SIX).replace('effort="0"', 'effort="1"'))
        self.assertEqual((made.status, made.err), (0, ""))
        for joint in range(1, 7):
            self.assertRegex(made.out, rf"joint joint_{joint}: its effort of 1 Nm can't bear the arm and .*: \d+ is taken")
        cell = (self.folder / "out/cell.yaml").read_text()
        self.assertNotIn("max_torque_Nm: 1\n", cell)

    def test_what_no_arm_is_is_refused_with_the_reason(self):
        for name, text, *told in (
                ("millimetres", arm(scaled(SIX, 1000)), "arm.urdf", "reaches", "at most 1e+06 Nm", "in m"),
                ("twenty metres", arm(scaled(FOUR, 20)), "arm.urdf", "reaches", "--arm-mass"),
                ("a thousand tons", arm(SIX, inertial={2: body(1e6, 1e5)}), "arm.urdf", "at most 1e+06 Nm", "kg"),
                ("one that turns", arm([TURN_Z]), "1 axis", "along a curve"),
                ("two that cross", arm([TURN_Z, TURN_Y]).replace(*LONG_TOOL), "2 axes", "curved surface"),
                ("five centimetres", arm(scaled(SIX, 0.05)), "arm.urdf: ", "reaches 0.", "room for a hand's motion"),
                ("six joints in one place", arm([("revolute", "0 0 0", axis) for _, _, axis in SIX]), "arm.urdf", "22 mm"),
                ("three on one axis", arm([TURN_Z] * 3), "arm.urdf", "22 mm"),
                ("nothing that moves", '<robot name="f"><link name="a"/><link name="b"/><joint name="j" type="fixed">'
                 '<parent link="a"/><child link="b"/></joint></robot>', "0 moving joints"),
                ("an axis of no direction", arm(SIX).replace('<axis xyz="0 1 0"/>', '<axis xyz="0 0 0"/>', 1), "joint_2", "a direction")):
            with self.subTest(name):
                made = self.made(text)
                self.assert_refused(made, *told)
                self.assertNotRegex(made.err, "unfinished-cell.yaml:", "a file that nobody wrote")


if __name__ == "__main__":
    unittest.main()
