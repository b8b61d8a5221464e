"""Gears damped by their measured torque, as a user has them: lighter masses, truer ones, and readings that lie. What the
steel does and what the hand feels are computed here, from the records."""
import csv
import math
import re
import unittest

from harness import SOURCE, ProgramTest
from steel import coefficient

FREQUENCIES_HZ = (1.0, 2.0, 5.0, 10.0)
NUDGE = """name: nudge
mass_kg: 1
stiffness_N_per_m: 500
damping_Ns_per_m: 20
waypoints:
  - {time_s: 0.3, offset_m: [0, 0, 0]}
  - {time_s: 0.45, offset_m: [0.01, 0.01, 0.01]}
"""
TORQUE = '{object: "0x2031", Nm_per_count: 0.05, delay_s: 0.0005}'


def sines(axis, share):
    lines = ["name: sines", "mass_kg: 1.0", "stiffness_N_per_m: 500", "damping_Ns_per_m: 20", "multisine:"]
    direction = [float(i == axis) for i in range(3)]
    for i, frequency_Hz in enumerate(FREQUENCIES_HZ):
        amplitude_m = share * min(0.012, 0.05 / (2 * math.pi * frequency_Hz))
        lines.append(f"  - {{frequency_Hz: {frequency_Hz}, amplitude_m: {amplitude_m:.9f}, "
                     f"phase_rad: {math.pi * (i % 2)!r}, direction: {direction}}}")
    return "\n".join(lines) + "\n"


class GearDamping(ProgramTest):
    def cell(self, name="default", simulation="", torque=TORQUE, file="cell.yaml"):
        text = (SOURCE / f"models/cells/{name}.yaml").read_text()
        text = text.replace("../../", f"{SOURCE}/").replace("../", f"{SOURCE}/models/")
        if shared := "\ndrive_defaults:" in text:
            text = re.sub(r"\ndrive_defaults:.*\n", rf"\g<0>  gear_torque: {torque}\n", text)
        text, drives = re.subn(r"\n( +)gear_stiffness_Nm_per_rad:",
                               rf"\n\1gear_torque: {torque}\n\1gear_stiffness_Nm_per_rad:", text)
        self.assertTrue(shared or drives >= 6)
        if simulation:
            text = re.sub(r"\n( *)simulation(_defaults)?:.*\n( +)", rf"\g<0>{simulation}\n\3", text)
        return self.written(file, text)

    def rows(self, folder):
        with open(self.folder / folder / "signals.csv", newline="") as file:
            return [row for row in csv.DictReader(file) if row["phase"] == "rendering"]

    def left_m(self, cell, mass_kg, *more):
        """What the steel goes to and fro in the last second of eight, after a nudge of 10 mm."""
        self.call("run", cell, "--scene", SOURCE / "scenes/free.yaml", "--hand", self.written("nudge.yaml", NUDGE),
                  "--mass", mass_kg, "--duration", "8s", "--no-plot", "--signals", "csv", "--record", "nudge", *more)
        last = self.rows("nudge")[-1000:]
        return max(max(float(row[f"true_tool_W_{axis}_m"]) for row in last)
                   - min(float(row[f"true_tool_W_{axis}_m"]) for row in last) for axis in "xyz")

    def error(self, cell, mass_kg, share=1.0):
        """|F/a − M|/M by frequency, in the worst direction, over ten seconds."""
        worst = [0.0] * len(FREQUENCIES_HZ)
        for axis in range(3):
            folder = f"along_{axis}"
            self.call("run", cell, "--scene", SOURCE / "scenes/free.yaml", "--hand",
                      self.written("sines.yaml", sines(axis, share)), "--mass", mass_kg, "--lookahead", "auto",
                      "--duration", "22s", "--no-plot", "--passivity", "observe", "--signals", "csv", "--record",
                      folder)
            rows = self.rows(folder)[-10000:]
            force = [float(row[f"hand_force_W_{'xyz'[axis]}_N"]) for row in rows]
            travel = [float(row[f"true_tool_W_{'xyz'[axis]}_m"]) for row in rows]
            for i, f in enumerate(FREQUENCIES_HZ):
                felt = coefficient(force, f) / (-(2 * math.pi * f) ** 2 * coefficient(travel, f))
                worst[i] = max(worst[i], abs(felt - mass_kg) / mass_kg)
        return worst

    def test_a_mass_that_swings_without_is_calm_with_it(self):
        cell = self.cell()
        refused = self.call("run", cell, "--scene", SOURCE / "scenes/free.yaml", "--mass", 0.8, "--gear-damping", "off",
                            "--duration", "1s", "--no-plot")
        self.assert_refused(refused, "--mass: found 0.8 kg", "at least 1.8 kg")
        self.assertLess(self.left_m(cell, 0.8), 20e-6)
        self.assertGreater(self.left_m(cell, 0.8, "--gear-damping", "off", "--force-unstable", "--passivity", "off"),
                           1e-3)
        summary = self.summary(cell, "--scene", SOURCE / "scenes/free.yaml", "--mass", 0.8, "--duration", "1s")
        self.assertGreaterEqual(summary["gear_damping_per_s"], 100)
        self.assertEqual(self.summary("--duration", "1s")["gear_damping_per_s"], 0)

    def test_readings_that_lie_as_much_as_is_counted_on(self):
        for lie in ("gear_torque_ratio: 0.8", "gear_torque_ratio: 1.2", "gear_torque_offset_Nm: 50",
                    "gear_torque_hysteresis_Nm: 1", "gear_stiffness_ratio: 0.7", "gear_stiffness_ratio: 1.4"):
            with self.subTest(lie=lie):
                self.assertLess(self.left_m(self.cell(simulation=lie), 0.8), 20e-6)

    def test_noise_shakes_the_steel_by_less_than_a_tenth_of_a_millimetre(self):
        self.assertLess(self.left_m(self.cell(simulation="gear_torque_noise_Nm: 2"), 1, "--passivity", "observe"),
                        150e-6)

    def run_with(self, cell):
        return self.call("run", cell, "--scene", SOURCE / "scenes/free.yaml", "--hand",
                         self.written("nudge.yaml", NUDGE), "--mass", 4, "--duration", "5s", "--no-plot")

    def test_a_reading_of_the_wrong_sign_is_refused_where_a_weight_shows_it(self):
        for lie in ("gear_torque_ratio: -1", "gear_torque_ratio: -0.5"):
            result = self.run_with(self.cell(simulation=lie))
            self.assertEqual(result.status, 1)
            self.assertIn("weight_unknown", result.out)
            self.assertIn("0 of 5 s were rendered", result.out)
        for offset_Nm in (-60, 60):
            self.assertEqual(self.run_with(self.cell(simulation=f"gear_torque_offset_Nm: {offset_Nm}")).status, 0)

    def test_one_of_an_upright_joint_stops_the_arm(self):
        text = self.cell().read_text()
        first = text.index("simulation:\n")
        text = text[:first] + text[first:].replace("simulation:\n", "simulation:\n      gear_torque_ratio: -1\n", 1)
        result = self.run_with(self.written("base.yaml", text))
        self.assertEqual(result.status, 1)
        self.assertTrue("drive_deviates" in result.out or "OSCILLATION" in result.out, result.out)

    def test_a_reading_that_sticks_leaves_a_usual_mass_calm(self):
        self.assertLess(self.left_m(self.cell(), 4, "--fault", "axis_1:torque_stuck@0.2s", "--fault",
                                    "axis_2:torque_stuck@0.2s", "--fault", "axis_3:torque_stuck@0.2s"), 20e-6)

    def test_what_is_felt_is_what_was_asked_for(self):
        for name, mass_kg, share, promised in (("default", 10, 1.0, (0.01, 0.02, 0.07, 0.20)),
                                               ("default", 4, 1.0, (0.02, 0.04, 0.10, 0.28)),
                                               ("seven", 10, 0.5, (0.01, 0.02, 0.07, 0.20))):
            with self.subTest(cell=name, mass_kg=mass_kg):
                for f, error, most in zip(FREQUENCIES_HZ, self.error(self.cell(name), mass_kg, share), promised):
                    self.assertLess(error, most, f"at {f} Hz")

    def test_a_second_encoder_does_as_well(self):
        encoder = '{object: "0x60E4:01", bits: 32, counts_per_revolution: 67108864, delay_s: 0.0005}'
        cell = self.cell(torque=encoder)
        refused = self.call("run", cell, "--duration", "1s", "--no-plot")
        self.assert_refused(refused, "gear_torque", "at most 8 bytes", "10 bytes", "fd: true")
        text = cell.read_text().replace("\n    gear_torque:", "\n    fd: true\n    gear_torque:")
        text = re.sub(r"(name: axes_\d_\d, bitrate: 1000000)", r"\1, data_bitrate: 4000000", text)
        self.assertLess(self.left_m(self.written("fd.yaml", text), 0.8), 20e-6)

    def test_what_is_wrong_in_a_cell_is_named(self):
        for torque, words in (('{object: "0x2031"}', "neither"),
                              ('{object: "0x2031", Nm_per_count: 1, counts_per_revolution: 1}', "both"),
                              ('{object: "0x60E4:01", counts_per_revolution: 1000}', "run over"),
                              ('{object: "0x2031", Nm_per_count: 1, delay_s: 0.1}', "delay_s"),
                              ('{object: "0x2031", Nm_per_count: 1, bits: 8}', "bits"),
                              ('{object: "2031", Nm_per_count: 1}', "object")):
            with self.subTest(torque=torque):
                self.assert_refused(self.call("run", self.cell(torque=torque), "--duration", "1s"), words)
        rigid = self.cell().read_text()
        rigid = re.sub(r"gear_stiffness_Nm_per_rad: \d+", "gear_stiffness_Nm_per_rad: 0", rigid)
        self.assert_refused(self.call("run", self.written("rigid.yaml", rigid), "--duration", "1s"), "gear_torque",
                            "gear_stiffness_Nm_per_rad above 0")

    def test_a_drive_that_has_no_such_object_stops_the_start(self):
        result = self.call("run", self.cell(), "--fault", "axis_2:lacks=0x203100", "--duration", "1s", "--no-plot")
        self.assertEqual(result.status, 2)
        self.assertIn("axis_2", result.err)
        self.assertIn("2031", result.err)


if __name__ == "__main__":
    unittest.main()
