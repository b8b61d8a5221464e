"""`proxarm new-cell`: from a URDF to a cell that runs, and whose felt mass is the one that it advises."""
import os
import re
import stat
import time
import unittest

import yaml
from harness import SOURCE, ProgramTest

FREE, SWEEP = SOURCE / "scenes/free.yaml", SOURCE / "sim/hands/sweep.yaml"

# Arms of our own, as (type, origin of the joint, its axis): four axes as of a SCARA, five without a turning wrist, six.
FOUR = [("revolute", "0 0 0.4", "0 0 1"), ("revolute", "0.35 0 0.1", "0 0 1"), ("prismatic", "0.3 0 0", "0 0 -1"),
        ("revolute", "0 0 -0.1", "0 0 -1")]
FIVE = [("revolute", "0 0 0.25", "0 0 1"), ("revolute", "0.1 0 0.15", "0 1 0"), ("revolute", "0 0 0.5", "0 1 0"),
        ("revolute", "0.45 0 0", "0 1 0"), ("revolute", "0.1 0 0", "1 0 0")]
SIX = [("revolute", "0 0 0.3", "0 0 1"), ("revolute", "0.2 0 0.2", "0 1 0"), ("revolute", "0 0 0.7", "0 1 0"),
       ("revolute", "0.3 0 0.1", "1 0 0"), ("revolute", "0.4 0 0", "0 1 0"), ("revolute", "0.1 0 0", "1 0 0")]
LIMITS = {"revolute": '<limit lower="-2.5" upper="2.5" velocity="2" effort="0"/>',
          "prismatic": '<limit lower="0" upper="0.3" velocity="0.5" effort="0"/>', "continuous": ""}
# A cart that slides along x and a pole on it that turns about y; of the tool its place in the pole's frame.
CART = """<robot name="cart"><link name="rail"/>
<link name="cart"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<link name="pole"><inertial><origin xyz="0 0 0.5"/><mass value="10"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link><link name="tool0"/>
<joint name="slide" type="prismatic"><axis xyz="1 0 0"/><parent link="rail"/><child link="cart"/>
<limit effort="1000" lower="-15" upper="15" velocity="5"/></joint>
<joint name="swing" type="continuous"><axis xyz="0 1 0"/><parent link="cart"/><child link="pole"/></joint>
<joint name="end" type="fixed"><origin xyz="{}"/><parent link="pole"/><child link="tool0"/></joint></robot>"""
GRIPPER = "".join(
    f'  <link name="{side}_finger"/><joint name="{side}" type="prismatic"><axis xyz="0 1 0"/><parent link="tool0"/>'
    f'<child link="{side}_finger"/>{LIMITS["prismatic"]}{mimic}</joint>\n'
    for side, mimic in (("left", ""), ("right", '<mimic joint="left"/>')))
LOOP = '<joint name="{0}{1}" type="fixed"><parent link="{0}"/><child link="{1}"/></joint>'
TWO_ARMS = "<robot>" + "".join(f'<link name="{link}"/>' for link in "abcde") + "".join(
    f'<joint name="{up}{down}" type="revolute"><axis xyz="0 0 1"/><parent link="{up}"/><child link="{down}"/></joint>'
    for up, down in ("ab", "bc", "ad", "de")) + "</robot>"
BODY = '<inertial><mass value="5"/><inertia ixx="0.1" iyy="0.1" izz="{}" ixy="0" ixz="0" iyz="0"/></inertial>'


def arm(joints, more="", name="made arm", limitless=(), mimic=(), inertial=None):
    """A URDF. Joint i is "joint_i" and moves "link_i"; behind the last one a fixed "tool0" follows."""
    text = f'<robot name="{name}">\n  <link name="link_0"/>\n'
    for i, (kind, origin, axis) in enumerate(joints, 1):
        kind = "continuous" if i in limitless else kind
        follows = '<mimic joint="joint_1"/>' if i in mimic else ""
        text += (f'  <link name="link_{i}">{(inertial or {}).get(i, "")}<visual><geometry>'
                 f'<mesh filename="package://made/link_{i}.stl"/></geometry></visual></link>\n'
                 f'  <joint name="joint_{i}" type="{kind}"><origin xyz="{origin}"/><axis xyz="{axis}"/>'
                 f'<parent link="link_{i - 1}"/><child link="link_{i}"/>{LIMITS[kind]}{follows}</joint>\n')
    return (text + f'  <link name="tool0"/><joint name="to_tool" type="fixed"><origin xyz="0.05 0 0"/>'
                   f'<parent link="link_{len(joints)}"/><child link="tool0"/></joint>\n{more}</robot>\n')


class NewCell(ProgramTest):
    def make(self, text, *options, out="mine", name="arm.urdf"):
        made = self.call("new-cell", self.written(name, text), "--out", self.folder / out, *options)
        self.assertEqual((made.status, made.err), (0, ""), made.err)
        return made.out

    def assert_runs(self, cell):
        """At once, without a fault; steady, to the wall, and as heavy as advised below 2 Hz."""
        check = self.call("check", cell)
        self.assertEqual((check.status, check.err), (0, ""), check.err + check.out)
        summary = self.summary(cell)
        self.assertEqual(summary["faults"], [])
        self.assertFalse(summary["oscillation"]["lasts"])
        self.assertGreater(summary["contacts"], 0, "the wall is in the hand's way")
        swept = self.summary(cell, "--scene", FREE, "--hand", SWEEP, "--duration", "20s")
        self.assertFalse(swept["oscillation"]["lasts"])
        self.assertAlmostEqual(swept["apparent_mass_kg"] / swept["wanted_mass_kg"], 1, delta=0.05)

    def test_of_the_shipped_arms_runs_at_once(self):
        for name in ("arm150", "seven"):
            out = self.folder / name
            made = self.call("new-cell", SOURCE / "models/arms" / f"{name}.urdf", "--out", out)
            self.assertEqual((made.status, made.err), (0, ""))
            self.assertNotIn("ESTIMATED inertia", made.out, "these say theirs")
            self.assert_runs(out / "cell.yaml")

    def test_an_arm_on_an_upright_joint_starts_straight_ahead_and_light_for_what_it_is(self):
        """The story: an arm of 11 kg started beside its base with an almost folded elbow, and felt like 44 kg.

        The masses are those of good poses by hand, times 1.25; the file is rounded to 0.1 mrad, at a metre 0.1 mm."""
        for name, most_kg in (("cobot", 20.0), ("arm150", 12.0)):
            with self.subTest(name):
                made = self.call("new-cell", SOURCE / "models/arms" / f"{name}.urdf", "--out", self.folder / name)
                self.assertEqual((made.status, made.err), (0, ""))
                x, y = map(float, re.search(r"starts at x ([-\d.]+), y ([-\d.]+)", made.out).groups())
                self.assertGreater(x, 0.2)
                self.assertLess(abs(y), 1e-3)
                cell = (self.folder / name / "cell.yaml").read_text()
                self.assertLessEqual(len(cell.splitlines()), 90, "what all joints have stands once")
                start = re.search(r"^start_rad: \[(.*)\]", cell, re.MULTILINE)[1]
                self.assertLessEqual(max(abs(float(q)) for q in start.split(",")), 3.1416, "not turned around for nothing")
                self.assertLessEqual(float(re.search(r"^default_mass_kg: ([\d.]+)", cell, re.MULTILINE)[1]), most_kg)

    def test_of_four_five_and_six_axes_without_inertia_runs_at_once(self):
        for joints in (FOUR, FIVE, SIX):
            with self.subTest(axes=len(joints)):
                out = f"of_{len(joints)}"
                told = self.make(arm(joints), out=out)
                for word in ("ESTIMATED inertia", "link_1 (", f"a cell of {len(joints)} axes", "sensor on tool0"):
                    self.assertIn(word, told)
                self.assertIn("estimated by proxarm", (self.folder / out / "arm.urdf").read_text())
                self.assertFalse((self.folder / out / "hand.yaml").exists(), "the default hand's way fits in")
                self.assert_runs(self.folder / out / "cell.yaml")

    def test_of_an_arm_too_small_for_the_hands_way_runs_with_a_hand_of_its_own(self):
        # A SCARA's reach is a ring about its base, of this one 0.09 to 0.28 m: a way of 0.22 m ahead and 0.18 m to the
        # side doesn't fit in, half of it does.
        small = [(kind, " ".join(f"{0.4 * float(x):g}" for x in origin.split()), axis) for kind, origin, axis in FOUR]
        told = self.make(arm(small))
        self.assertIn("a hand of its own", told)
        self.assertIn("no room", (self.folder / "mine/hand.yaml").read_text())
        self.assert_runs(self.folder / "mine/cell.yaml")

    def test_of_a_cart_with_a_pole_is_answered_at_once(self):
        """The story: no answer in 20 minutes. The handle is at the pole's axis, so that the pole's turning doesn't move it,
        and the steps of the way that was tried were as small as that rounding. 5 mm beside the axis it is still next to it."""
        for offset, status in (("0 0 0", 0), ("0 0 0.005", None)):
            urdf = self.written("arm.urdf", CART.format(offset))
            begun = time.monotonic()
            made = self.call("new-cell", urdf, "--out", self.folder / "cart", "--force", timeout=120)
            self.assertLess(time.monotonic() - begun, 30)
            if made.status == 2:
                self.assertIn("can't go straight", made.err)
            self.assertIn(made.status, (0, 2) if status is None else (status,), made.err)
            if status == 0:
                self.assertEqual(self.call("check", self.folder / "cart/cell.yaml").status, 0)
                self.assertEqual(self.summary(self.folder / "cart/cell.yaml")["faults"], [])

    def test_joints_beside_the_chain_are_fixed(self):
        told = self.make(arm(SIX, GRIPPER, limitless=(6,)))
        for word in ("joint left is fixed", "joint right, a mimic one, is fixed", "joint_6 has no limits", "sensor on tool0"):
            self.assertIn(word, told)
        text = (self.folder / "mine/arm.urdf").read_text()
        self.assertNotIn("mimic", text)
        self.assertEqual(len(re.findall(r'type="(?:revolute|prismatic|continuous)"', text)), 6)
        self.assertEqual(self.call("run", self.folder / "mine/cell.yaml", "--duration", "1s").status, 0)

    def test_says_once_what_all_joints_have_in_common(self):
        """The story: 217 lines for six axes, 12 keys of each joint the same in all of them."""
        self.make(arm(SIX), "--drive", str(SOURCE / "models/drives/simulated_drive.eds"))
        text = (self.folder / "mine/cell.yaml").read_text()
        self.assertLessEqual(max(map(len, text.splitlines())), 140)
        cell = yaml.safe_load(text)
        self.assertEqual(len(cell["drives"]), 6)
        for drive in cell["drives"]:
            self.assertEqual(set(drive) & set(cell["drive_defaults"]), set())
            self.assertEqual(set(drive["simulation"]) & set(cell["simulation_defaults"]), set())
        self.assertEqual(cell["drive_defaults"]["eds"], str(SOURCE / "models/drives/simulated_drive.eds"))
        # What stands above can be another at one joint, as a user would write it.
        own = self.written("mine/own.yaml", text.replace("node: 2,", "node: 2, gear_ratio: 81,", 1))
        self.assertEqual(self.call("check", own).status, 0)
        self.assertEqual(self.call("run", own, "--duration", "1s").status, 0)

    def test_keeps_what_the_file_says_and_estimates_the_rest(self):
        # One moment larger than the other two together: no body has that, MuJoCo refuses it, the mass is kept.
        told = self.make(arm(SIX, inertial={2: BODY.format("0.15"), 3: BODY.format("0.3")}), "--arm-mass", "120")
        self.assertIn("link_3 (5 kg, as the file says)", told)
        self.assertNotIn("link_2 (", told)
        self.assertIn("rods, of an arm of 120 kg", told)
        text = (self.folder / "mine/arm.urdf").read_text()
        self.assertIn('izz="0.15"', text)
        self.assertEqual(text.count("estimated by proxarm"), 5)
        self.assertIn("counts_per_motor_revolution: 1048576\n", (self.folder / "mine/cell.yaml").read_text())

    def test_takes_efforts_that_move_the_arm_and_names_those_that_dont(self):
        # Of a vertical axis gravity says nothing, so 0.12 Nm hold it; but they don't move what is on it. A wrist's 9 Nm
        # are far more than its own link takes, and true all the same.
        text = arm(SIX, inertial={i: BODY.format("0.15") for i in range(1, 7)})
        for joint, effort in ((1, 0.12), (2, 700), (6, 9)):
            head, mark, tail = text.partition(f'<joint name="joint_{joint}"')
            text = head + mark + tail.replace('effort="0"', f'effort="{effort}"', 1)
        told = self.make(text)
        self.assertRegex(told, r"joint joint_1: its effort of 0.12 Nm can't .*: \d+ is taken")
        for joint in (2, 6):
            self.assertNotIn(f"joint_{joint}: its effort", told)
        # An effort of 0 was replaced without a word.
        self.assertRegex(told, r"the URDF says no effort of joint_3, joint_4, joint_5: \d+ Nm, \S+ Nm, \S+ Nm are taken")
        cell = (self.folder / "mine/cell.yaml").read_text()
        drives = yaml.safe_load(cell)["drives"]
        for key in yaml.safe_load(cell)["tool"]["inertia_kg_m2"]:
            self.assertIsInstance(key, (float, int), "PyYAML takes 5e-05 for a text")
        number = lambda drive, key: float(drives[drive][key])
        self.assertGreater(number(0, "max_torque_Nm"), 50)
        self.assertEqual(number(1, "max_torque_Nm"), 700)
        self.assertEqual(number(5, "max_torque_Nm"), 9)
        # To full speed in a 15th of a second where the torque is estimated for it, later where it is given.
        self.assertAlmostEqual(number(0, "max_acceleration_rad_per_s2"), 15 * number(0, "max_speed_rad_per_s"), delta=0.5)
        self.assertLess(number(1, "max_acceleration_rad_per_s2"), 14 * number(1, "max_speed_rad_per_s"))
        force_N = float(re.search(r"max_force_N: (\S+)", cell).group(1))
        self.assertGreaterEqual(force_N, 60)
        self.assertLessEqual(force_N, 200)

    def test_finds_meshes_of_packages(self):
        package = self.folder / "ros/made_description"
        package.mkdir(parents=True)
        (package / "package.xml").write_text("<package><name>made</name></package>")
        for i in range(1, 7):
            (package / f"link_{i}.stl").write_text("solid a\nendsolid a\n")
        for where, options, env in (("given", ["--package", f"made={package}"], {}),
                                    ("by the environment", [], {"ROS_PACKAGE_PATH": str(self.folder / "ros")})):
            with self.subTest(where):
                urdf = self.written("arm.urdf", arm(SIX))
                made = self.call("new-cell", urdf, "--out", where, *options, env={**os.environ, **env})
                self.assertEqual((made.status, made.err), (0, ""))
                self.assertNotIn("--package", made.out)
                self.assertIn(str(package / "link_3.stl"), (self.folder / where / "arm.urdf").read_text())
        self.assertIn("the meshes of 6 links aren't there", self.make(arm(SIX)))

    def test_takes_the_buses_the_sensor_and_the_link_that_it_is_given(self):
        told = self.make(arm(SIX), "--buses", "1", "--tip", "link_6", "--sensor", "aidin_aft200")
        self.assertIn("1 bus,", told)
        self.assertIn("sensor on link_6", told)
        cell = self.folder / "mine/cell.yaml"
        self.assertEqual(self.call("plan", cell).status, 0)
        self.assertEqual(self.call("run", cell, "--duration", "1s").status, 0)

    def test_names_that_mean_something_to_yaml_and_to_folders_are_written_as_names(self):
        text = arm(SIX, name="../it's: #1").replace('"joint_1"', '"yes: [1"').replace('"tool0"', '"0x10"')
        made = self.call("new-cell", self.written("arm.urdf", text))
        self.assertEqual((made.status, made.err), (0, ""))
        cells = list(self.folder.rglob("cell.yaml"))
        self.assertEqual(len(cells), 1)
        self.assertEqual(self.call("run", cells[0], "--duration", "1s").status, 0)

    def test_asks_xacro_where_it_is(self):
        xacro = self.written("arm.xacro", "<robot/>")
        alone = self.call("new-cell", xacro, env={**os.environ, "PATH": str(self.folder)})
        self.assert_refused(alone, "found a xacro", "Debian 12 has none", "xacro arm.xacro > arm.urdf")
        (self.folder / "bin").mkdir()
        program = self.written("bin/xacro", "#!/bin/sh\ntest \"$2\" = size:=1 || { echo \"no size\" >&2; exit 1; }\n"
                                            "case $ROS_PACKAGE_PATH in *made*) ;; *) echo no package >&2; exit 1;; esac\n"
                                            f"cat {self.written('made.urdf', arm(SIX))}\n")
        program.chmod(program.stat().st_mode | stat.S_IXUSR)
        path = {**os.environ, "PATH": f"{program.parent}:{os.environ['PATH']}"}
        (self.folder / "made").mkdir()
        words = ["new-cell", xacro, "--out", self.folder / "out", "--package", f"made={self.folder / 'made'}"]
        self.assert_refused(self.call(*words, env=path), "xacro refuses it", "no size")
        self.assertEqual(self.call(*words, "size:=1", env=path).status, 0)

    def test_refuses_with_the_reason(self):
        self.assert_refused(self.call("new-cell", "nowhere.urdf"), "no such file")
        for text, *told in (
                ("<robot><link name='a'/></robot>", "0 moving joints"),
                ("no XML", "arm.urdf"),
                ("<sdf/>", "no <robot>"),
                (arm(SIX, mimic=(3,)), "mimic", "joint_3", "--tip"),
                (arm(SIX + FOUR), "10 moving joints", "one to seven"),
                (arm(SIX, '<link name="b"/>'), "two roots"),
                (arm(SIX, '<joint name="j" type="fixed"><parent link="link_1"/><child link="link_3"/></joint>'), "second parent"),
                (arm(SIX, '<joint name="j" type="fixed"><parent link="link_1"/><child link="nose"/></joint>'), "nose"),
                (arm(SIX, '<link name="a"/><link name="b"/>' + LOOP.format("a", "b") + LOOP.format("b", "a")), "a loop"),
                (arm(SIX, '<link name="link_3"/>'), "a second link named", "link_3"),
                (arm(SIX).replace('"revolute"', '"floating"', 1), "floating", "joint_1", "revolute"),
                (arm(SIX).replace('upper="2.5"', 'upper="${pi}"', 1), "arm.urdf:4", "upper of joint", "${pi}"),
                (arm(SIX).replace('lower="-2.5"', 'lower="nan"', 1), "lower of joint", "nan"),
                (arm(SIX).replace('lower="-2.5"', 'lower="3"', 1), "lower 3 above upper 2.5"),
                (arm(SIX).replace("0.2 0 0.2", "0.2 nan 0.2"), "xyz of <origin>", "0.2 nan 0.2", "three finite numbers"),
                (arm(SIX).replace("0.2 0 0.2", "0.2 0"), "xyz of <origin>", "three finite numbers"),
                (TWO_ARMS, "branch at link \"a\"", "--tip")):
            with self.subTest(told):
                self.assert_refused(self.call("new-cell", self.written("arm.urdf", text)), *told)
        urdf = self.written("arm.urdf", arm(SIX))
        for options, *told in ((["--tip", "nose"], "--tip", "link_3"), (["--package", "made"], "NAME=DIR"),
                               (["--sensor", "robotiq_ft300"], "Modbus"), (["--sensor", "nose"], "nose"),
                               (["--buses", "9"], "--buses"), (["--drive", "nowhere.eds"], "nowhere.eds")):
            with self.subTest(options):
                self.assert_refused(self.call("new-cell", urdf, *options, "--out", self.folder / "other"), *told)
        (self.folder / "mine").mkdir()
        self.written("mine/cell.yaml", "name: somebody's work\n")
        self.assert_refused(self.call("new-cell", urdf, "--out", self.folder / "mine"), "cell.yaml", "--force")
        self.assertEqual(self.call("new-cell", urdf, "--out", self.folder / "mine", "--force").status, 0)


if __name__ == "__main__":
    unittest.main()
