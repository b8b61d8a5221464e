"""Mistakes that people make in files of a cell, a scene and a hand: another unit, upside down, the wrong way round. Each
is refused or warned of, with the key that it is in; and nothing is said of what is shipped.

The mistakes are made here, one at a time, of files that are right; what is judged is what `check` and `run` print.
"""
import os
import re
import subprocess
import sys
import tempfile
import unittest
from concurrent.futures import ThreadPoolExecutor

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from harness import program  # noqa: E402

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))

# What is written in the place of what stands there, and of which joint (the first place where the pattern is found, or
# all). The key that the answer has to name is the pattern's first word, but where a third entry says another one.
CELL = [
    ("gravity_W_m_per_s2: [0, 0, -9.80665]", "gravity_W_m_per_s2: [0, 0, 9.80665]"),
    ("gravity_W_m_per_s2: [0, 0, -9.80665]", "gravity_W_m_per_s2: [0, 0, -1]"),
    ("gravity_W_m_per_s2: [0, 0, -9.80665]", "gravity_W_m_per_s2: [0, 0, 0]"),
    ("gravity_W_m_per_s2: [0, 0, -9.80665]", "gravity_W_m_per_s2: [0, 0, -9806.65]"),
    ("gravity_W_m_per_s2: [0, 0, -9.80665]", "gravity_W_m_per_s2: [0, 0, -0.980665]"),
    ("base_W: {position_m: [0, 0, 0]", "base_W: {position_m: [0, 0, 850]"),
    ("base_W: {position_m: [0, 0, 0], rpy_rad: [0, 0, 0]", "base_W: {position_m: [0, 0, 0], rpy_rad: [0, 0, 90]"),
    ("start_rad: [0, 0.0675, 0.5008, 0, 1.0025, 0]", "start_rad: [0, 3.87, 28.69, 0, 57.44, 0]"),
    ("mass_kg: 0.25", "mass_kg: 250"),
    ("centre_of_mass_S_m: [0, 0, 0.06]", "centre_of_mass_S_m: [0, 0, 60]"),
    ("inertia_kg_m2: [3.25e-4, 3.25e-4, 5.0e-5", "inertia_kg_m2: [325, 325, 50"),
    ("inertia_kg_m2: [3.25e-4, 3.25e-4, 5.0e-5", "inertia_kg_m2: [3.25, 3.25, 0.5"),
    ("handle_S: {position_m: [0, 0, 0.1]", "handle_S: {position_m: [0, 0, 100]"),
    ("handle_S: {position_m: [0, 0, 0.1], rpy_rad: [0, 0, 0]", "handle_S: {position_m: [0, 0, 0.1], rpy_rad: [180, 0, 0]"),
    ("bitrate: 1000000", "bitrate: 1000"),
    ("bitrate: 1000000", "bitrate: 1"),
    ("counts_per_motor_revolution: 1048576", "counts_per_motor_revolution: 20"),
    ("gear_ratio: 150", "gear_ratio: 0.00667"),
    ("gear_ratio: 150", "gear_ratio: -150"),
    ("gear_ratio: 150", "gear_ratio: 1.5"),
    ("direction: 1", "direction: 0"),
    ("direction: 1", "direction: true"),
    ("range_rad: [-2.9, 2.9]", "range_rad: [-166, 166]"),
    ("range_rad: [-2.9, 2.9]", "range_rad: [2.9, -2.9]"),
    ("max_speed_rad_per_s: 2.1", "max_speed_rad_per_s: 120"),
    ("max_speed_rad_per_s: 2.1", "max_speed_rad_per_s: 0.0021"),
    ("max_speed_rad_per_s: 2.1", "max_speed_rad_per_s: 3000"),
    ("max_acceleration_rad_per_s2: 30", "max_acceleration_rad_per_s2: 1719"),
    ("max_acceleration_rad_per_s2: 30", "max_acceleration_rad_per_s2: 0.03"),
    ("rotor_inertia_kg_m2: 58.0", "rotor_inertia_kg_m2: 0.00258"),
    ("rotor_inertia_kg_m2: 58.0", "rotor_inertia_kg_m2: 580000000"),
    ("position_bandwidth_Hz: 100", "position_bandwidth_Hz: 0.1"),
    ("position_bandwidth_Hz: 100", "position_bandwidth_Hz: 100000"),
    ("gear_stiffness_Nm_per_rad: 115000", "gear_stiffness_Nm_per_rad: 115"),
    ("gear_stiffness_Nm_per_rad: 115000", "gear_stiffness_Nm_per_rad: 33.5"),
    ("gear_stiffness_Nm_per_rad: 310000", "gear_stiffness_Nm_per_rad: 310"),
    ("max_torque_Nm: 2500", "max_torque_Nm: 2.5"),
    ("max_torque_Nm: 2500", "max_torque_Nm: 250000000"),
    ("coulomb_friction_Nm: 25", "coulomb_friction_Nm: 25000"),
    ("noise_N: 0.02", "noise_N: 20"),
    ("noise_Nm: 0.001", "noise_Nm: 10"),
    ("sample_rate_Hz: 7147", "sample_rate_Hz: 7.147"),
    ("bandwidth_Hz: 800", "bandwidth_Hz: 0.8"),
    ("pose_link: {position_m: [0, 0, 0.03]", "pose_link: {position_m: [0, 0, 30]"),
    ("pose_link: {position_m: [0, 0, 0.03], rpy_rad: [0, 0, 0]", "pose_link: {position_m: [0, 0, 0.03], rpy_rad: [0, 0, 45]"),
    ("link: flange", "link: flansch"),
    ("base_id: 0x68", "base_id: 0x868"),
    ("max_tool_speed_m_per_s: 0.5", "max_tool_speed_m_per_s: 500"),
    ("max_tool_speed_m_per_s: 0.5", "max_tool_speed_m_per_s: 30"),
    ("max_tool_acceleration_m_per_s2: 20", "max_tool_acceleration_m_per_s2: 20000"),
    ("max_force_N: 200", "max_force_N: 0.2"),
    ("max_force_N: 200", "max_force_N: 200000"),
    ("leash_m: 0.02", "leash_m: 20"),
    ("setpoint_bandwidth_Hz: 25", "setpoint_bandwidth_Hz: 25000"),
    ("setpoint_bandwidth_Hz: 25", "setpoint_bandwidth_Hz: 0.025"),
    ("leash_m: 0.02", "leash_m: 0.02\n  following_error_rad: 0.57", "following_error_rad"),
    ("leash_m: 0.02", "leash_m: 0.02\n  max_turning_speed_rad_per_s: 115", "max_turning_speed_rad_per_s"),
    ("leash_m: 0.02", "leash_m: 0.02\n  max_turn_rad: 40", "max_turn_rad"),
    ("leash_m: 0.02", "leash_m: 0.02\n  max_power_W: 0.08", "max_power_W"),
    ("leash_m: 0.02", "leash_m: 0.02\n  workspace_m: {min: [-1000, -1000, 0], max: [1000, 1000, 1500]}", "workspace_m"),
    ("default_period_s: 0.001", "default_period_s: 1"),
    ("default_mass_kg: 4", "default_mass_kg: 4000"),
    ("default_mass_kg: 4", "default_mass_kg: 0.004"),
    ("node: 1\n", "node: 200\n"),
    ("mode: csp", "mode: csv-like"),
    ("arms/arm150.urdf", "arms/arm15.urdf", "urdf"),
    ("joint: axis_1", "joint: axis1"),
    ("gear_damping_Nms_per_rad: 130", "gear_damping_Nms_per_rad: 0.130"),
    ("gear_damping_Nms_per_rad: 130", "gear_damping_Nms_per_rad: 130000"),
    ("      gear_damping_Nms_per_rad: 130", "      gear_damping_Nms_per_rad: 0.13", "simulation.gear_damping_Nms_per_rad"),
    ("viscous_friction_Nms_per_rad: 20", "viscous_friction_Nms_per_rad: 20000"),
    ("coulomb_friction_Nm: 25", "coulomb_friction_Nm: 2500"),
    ("backlash_rad: 0", "backlash_rad: 1"),
    ("      max_torque_Nm: 2500", "      max_torque_Nm: 2.5", "simulation.max_torque_Nm"),
    ("position_gain_per_s: 350", "position_gain_per_s: 0.35"),
    ("velocity_bandwidth_Hz: 200", "velocity_bandwidth_Hz: 0.2"),
    ("velocity_feedforward: 1", "velocity_feedforward: 100"),
    ("servo_rate_Hz: 4000", "servo_rate_Hz: 4"),
    ("device_type: 0x00020192", "device_type: 20192"),
    ("rotor_inertia_kg_m2: 58.0", "rotor_inertia_kg_m2: 58000"),
    ("rotor_inertia_kg_m2: 58.0", "rotor_inertia_kg_m2: 0.0258"),
    ("max_torque_Nm: 2500", "max_torque_Nm: 16"),
    ("gravity_W_m_per_s2: [0, 0, -9.80665]", "gravity_W_m_per_s2: [0, -9.80665, 0]"),
    ("gravity_W_m_per_s2: [0, 0, -9.80665]", "gravity_W_m_per_s2: -9.80665"),
    ("mass_kg: 0.25", "mass_kg: 0"),
    ("mass_kg: 0.25", "mass_kg: 0,25"),
    ("mass_kg: 0.25", "mass_kg: 0.25 kg"),
    ("inertia_kg_m2: [3.25e-4, 3.25e-4, 5.0e-5", "inertia_kg_m2: [3.25e-7, 3.25e-7, 5.0e-8"),
    ("inertia_kg_m2: [3.25e-4, 3.25e-4, 5.0e-5", "inertia_kg_m2: [3.25e-4, 5e-5, 5.0e-5"),
    ("centre_of_mass_S_m: [0, 0, 0.06]", "centre_of_mass_S_m: [0, 0, 0.6]"),
    ("handle_S: {position_m: [0, 0, 0.1]", "handle_S: {position_m: [0, 0, 10]"),
    ("noise_Nm: 0.001", "noise_Nm: 1"),
    ("sample_rate_Hz: 7147", "sample_rate_Hz: 7147\n  delay_s: 2", "delay_s"),
    ("leash_m: 0.02", "leash_m: 0.02\n  max_turn_rad: 0.0001", "max_turn_rad"),
    ("leash_m: 0.02", "leash_m: 0.00002"),
    ("leash_m: 0.02", "leash_m: 0.02\n  max_elbow_speed_m_per_s: 500", "max_elbow_speed_m_per_s"),
    ("max_force_N: 200", "max_force_N: 2"),
    ("default_mass_kg: 4", "default_mass_kg: 4\ndefault_damping_Ns_per_m: 50000", "default_damping_Ns_per_m"),
    ("default_period_s: 0.001", "default_period_s: 1ms"),
    ("node: 2\n", "node: 1\n"),
]
WALL = "plane: {name: wall, point_m: [0.9, 0, 0.6], normal: [-1, 0, 0]"
SCENE = [
    ("friction: 0.3", "friction: 30"),
    ("friction: 0.3", "friction: -0.3"),
    ("point_m: [0.9, 0, 0.6]", "point_m: [900, 0, 600]", "wall"),
    ("normal: [-1, 0, 0]", "normal: [0, 0, 0]"),
    ("normal: [-1, 0, 0]", "normal: [1, 0, 0]", "wall"),
    ("friction: 0.3}", "friction: 0.3, layer: {thickness_m: 20, stiffness_N_per_m: 2000}}", "thickness_m"),
    ("friction: 0.3}", "friction: 0.3, layer: {thickness_m: 0.02, stiffness_N_per_m: 2}}", "stiffness_N_per_m"),
    ("friction: 0.3}", "friction: 0.3, motion: {velocity_m_per_s: [100, 0, 0]}}", "velocity_m_per_s"),
    ("friction: 0.3}", "friction: 0.3, motion: {swing: {amplitude_m: [100, 0, 0], frequency_Hz: 0.2}}}", "amplitude_m"),
    ("plane:", "plan:", "plan"),
    ("friction: 0.3", "friction: 0,3"),
    ("point_m: [0.9, 0, 0.6]", "point_m: [9, 0, 6]", "wall"),
    ("friction: 0.3}", "friction: 0.3, motion: {swing: {amplitude_m: [0.05, 0, 0], frequency_Hz: 200}}}", "frequency_Hz"),
    (WALL, "sphere: {name: ball, centre_m: [2.3, 0, 0.6], radius_m: 0.1", "ball"),
    (WALL, "box: {name: block, centre_m: [0, 2.3, 0.6], size_m: [0.3, 0.3, 0.3]", "block"),
    (WALL, "sphere: {name: ball, centre_m: [0.9, 0, 0.6], radius_m: 0.00005", "radius_m"),
]
HAND = [
    ("mass_kg: 1.0", "mass_kg: 1000"),
    ("stiffness_N_per_m: 500", "stiffness_N_per_m: 0.5"),
    ("damping_Ns_per_m: 20", "damping_Ns_per_m: 20000"),
    ("damping_Ns_per_m: 20", "damping_Ns_per_m: 20\nmax_force_N: 0.06", "max_force_N"),
    ("offset_m: [0.18, 0, 0]", "offset_m: [180, 0, 0]"),
    ("offset_m: [0.18, 0, 0]", "offset_m: [1.8, 0, 0]"),
    ("time_s: 2.7", "time_s: 2.4"),
    ("time_s: 0.5", "time_s: 500"),
    ("offset_m: [0.18, 0, 0]", "offset_m: [18, 0, 0]"),
    ("mass_kg: 1.0", "mass_kg: 100"),
    ("offset_m: [0.18, 0, 0]}", "offset_m: [0.18, 0, 0], turn_rad: [0, 0, 30]}", "turn_rad"),
]


def text_of(path):
    with open(os.path.join(ROOT, path)) as file:
        return file.read()


def here(text):
    """A shipped cell's text, for a folder of its own."""
    return re.sub(r"(?<=: )\.\./(?=arms|sensors|drives)", f"{ROOT}/models/", text).replace("../../", f"{ROOT}/")


def answer(*arguments):
    done = subprocess.run([program(), *arguments], stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=300)
    return done.returncode, done.stdout + done.stderr


class Mistakes(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def missed(self, right, table, command):
        """The mistakes of which nothing is said, or not where they are."""
        def try_one(numbered):
            n, (found, written, *key) = numbered
            text = right.replace(found, written, 1)
            self.assertTrue(text != right, found)
            file = os.path.join(self.folder.name, f"{table[0][0][:4]}{n}.yaml".replace(" ", ""))
            with open(file, "w") as out:
                out.write(text)
            status, said = answer(*command(file))
            word = key[0] if key else re.match(r"\w+", found)[0]
            # Said in a refusal or in a warning about that very file.
            lines = [line for line in said.splitlines() if file in line]
            ok = any(word in line for line in lines) and (status == 2 or any("expected" in x or "metres" in x for x in lines))
            return None if ok else f"{written!r}: status {status}, {said[:300]!r}"
        with ThreadPoolExecutor(2) as pool:
            return [line for line in pool.map(try_one, enumerate(table)) if line]

    def test_each_in_a_cell_is_named_with_its_key(self):
        right = here(text_of("models/cells/default.yaml"))
        self.assertEqual([], self.missed(right, CELL, lambda file: ("check", file)))

    def test_each_in_a_scene_is_named(self):
        cell = os.path.join(ROOT, "models/cells/default.yaml")
        self.assertEqual([], self.missed(text_of("scenes/wall.yaml"), SCENE,
                                         lambda file: ("check", cell, "--scene", file)))

    def test_units_in_a_scene_and_a_hand_are_doubted_without_a_cell(self):
        for table, of in ((SCENE[:1] + SCENE[6:9], "scenes/wall.yaml"), (HAND[:3], "sim/hands/touch.yaml")):
            self.assertEqual([], self.missed(text_of(of), table, lambda file: ("check", file)))

    def test_each_in_a_hand_is_named_when_it_is_used(self):
        self.assertEqual([], self.missed(text_of("sim/hands/touch.yaml"), HAND,
                                         lambda file: ("run", "--hand", file, "--duration", "10ms", "--no-plot")))

    def test_registers_that_count_from_40001_are_doubted(self):
        right = text_of("models/drives/generic_absolute.yaml")
        counted = {"register: 0\n": "register: 40001\n", "register: 16\n": "register: 40017\n", "{register: 17}": "{register: 40018}",
                   "{register: 16,": "{register: 40017,"}
        for found, written in counted.items():
            self.assertIn(found, right)
            right = right.replace(found, written)
        file = os.path.join(self.folder.name, "registers.yaml")
        with open(file, "w") as out:
            out.write(right)
        status, said = answer("check", file)
        self.assertEqual(status, 0)
        for key, number in (("command.register", 0), ("feedback.register", 16), ("feedback.position.register", 17)):
            self.assertRegex(said, rf"{key}: found 400\d\d, .* counts from 40001, write {number}\n")

    def test_nothing_is_said_of_what_is_shipped(self):
        cells = [os.path.join(ROOT, "models/cells", name) for name in sorted(os.listdir(os.path.join(ROOT, "models/cells")))
                 if name.endswith(".yaml")]
        self.assertGreater(len(cells), 6)
        for cell in cells:
            status, said = answer("check", cell)
            self.assertEqual(status, 0, said)
            self.assertRegex(said, rf"^{re.escape(cell)}: fine, a cell; its tool starts at \[[^]]*\] m\n$")
        for folder in ("scenes", "sim/hands"):
            for name in sorted(os.listdir(os.path.join(ROOT, folder))):
                if not name.endswith(".yaml"):
                    continue
                option = "--scene" if folder == "scenes" else "--hand"
                _, said = answer("run", option, os.path.join(ROOT, folder, name), "--duration", "10ms", "--no-plot")
                self.assertNotIn("warning:", said, name)


if __name__ == "__main__":
    unittest.main()
