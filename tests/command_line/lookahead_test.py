"""The arm is sent to where the proxy is going to be: the mass that a hand feels, from a record; and that nothing else
changes."""
import cmath
import csv
import json
import math
import unittest

from harness import SOURCE, ProgramTest
from steel import coefficient

FREQUENCIES_HZ = (2.0, 5.0, 10.0)
PERIOD_S = 1e-3

# An empty handle is braked where the hand's force is small, as at the turns of these sines.
COASTING = "\nsupervision: {let_go: coast}\n"


def hand():
    lines = ["name: sines", "mass_kg: 1.0", "stiffness_N_per_m: 500", "damping_Ns_per_m: 20",
             "waypoints:", "  - {time_s: 0, offset_m: [0, 0, 0]}", "multisine:"]
    for i, frequency_Hz in enumerate(FREQUENCIES_HZ):
        amplitude_m, phase_rad = 0.05 / (2 * math.pi * frequency_Hz), math.pi * (i % 2)
        lines.append(f"  - {{frequency_Hz: {frequency_Hz}, amplitude_m: {amplitude_m:.9f}, phase_rad: {phase_rad!r}, "
                     "direction: [1, 0, 0]}")
    return "\n".join(lines) + "\n"


class Lookahead(ProgramTest):
    def cell(self):
        """The default cell, whose proxy coasts where nobody holds the handle."""
        text = (SOURCE / "models/cells/default.yaml").read_text()
        text = text.replace("../../", f"{SOURCE}/").replace("../", f"{SOURCE}/models/")
        self.assertNotIn("\nsupervision:", text)
        return self.written("coasting.yaml", text + COASTING)

    def rows(self, folder="session"):
        with open(self.folder / folder / "signals.csv", newline="") as file:
            return [row for row in csv.DictReader(file) if row["phase"] == "rendering"]

    def errors(self, lookahead, mass_kg, tool="point"):
        """|F/a − M|/M by frequency, over the last four seconds: whole periods of all sines."""
        self.summary(self.cell(), "--scene", SOURCE / "scenes/free.yaml", "--hand", self.written("sines.yaml", hand()),
                     "--mass", mass_kg, "--lookahead", lookahead, "--duration", "20s", "--record", lookahead, "--tool", tool)
        rows = self.rows(lookahead)[-4000:]
        force = [float(row["hand_force_W_x_N"]) for row in rows]
        travel = [float(row["true_tool_W_x_m"]) for row in rows]
        felt = [coefficient(force, f) / (-(2 * math.pi * f) ** 2 * coefficient(travel, f)) for f in FREQUENCIES_HZ]
        return [abs(mass - mass_kg) / mass_kg for mass in felt]

    def test_the_mass_that_is_felt(self):
        for mass_kg, promised in ((10, (0.02, 0.07, 0.20)), (4, (0.06, 0.16, 0.32))):
            with self.subTest(mass_kg=mass_kg):
                for error, most in zip(self.errors("auto", mass_kg), promised):
                    self.assertLess(error, most)
                for error, least in zip(self.errors("off", mass_kg), (0.1, 0.3, 0.6)):
                    self.assertGreater(error, least, "without it a hand feels the delay")

    def test_the_mass_that_is_felt_of_a_tool_with_a_shape(self):
        for error, most in zip(self.errors("auto", 10, SOURCE / "scenes/tools/rod.yaml"), (0.02, 0.07, 0.20)):
            self.assertLess(error, most)

    def test_the_summary_says_so_by_frequency(self):
        """Held against the coefficient at 5 Hz, by the record; the summary's band is up to half a hertz off it."""
        arguments = (self.cell(), "--scene", SOURCE / "scenes/free.yaml", "--hand", SOURCE / "sim/hands/multisine.yaml",
                     "--mass", 10, "--duration", "25s")
        without = self.summary(*arguments, "--record", "without")
        ahead = self.summary(*arguments, "--lookahead", "auto")
        self.assertLess(without["felt_mass_band_Hz"]["10 %"], 2.0)
        self.assertGreater(ahead["felt_mass_band_Hz"]["10 %"], 6.0)
        self.assertGreater(len(ahead["felt_mass"]), 8)
        rows = self.rows("without")[-20000:]
        force, travel = ([float(row[column]) for row in rows] for column in ("hand_force_W_x_N", "true_tool_W_x_m"))
        felt = coefficient(force, 5.0) / (-(2 * math.pi * 5.0) ** 2 * coefficient(travel, 5.0))
        nearest = min(without["felt_mass"], key=lambda point: abs(point["frequency_Hz"] - 5.0))
        self.assertAlmostEqual(nearest["error"], abs(felt - 10) / 10, delta=0.05)
        self.assertAlmostEqual(nearest["phase_deg"], math.degrees(cmath.phase(felt)), delta=3.0)
        self.assertIn("mass by frequency", self.call("run", *arguments, "--no-plot", "--verbose").out)
        self.assertEqual(self.summary("--duration", "3s")["felt_mass"], [])

    def test_a_replay_is_the_same_to_the_bit(self):
        summary = self.summary("--lookahead", "auto", "--duration", "4s", "--record", "session", "--mass", 8,
                               "--set", "mass=12@1.5s", "--set", "lookahead=3ms@2.5s")
        outcome = self.call("replay", "session")
        self.assertEqual(outcome.status, 0, outcome.out + outcome.err)
        self.assertIn("every setpoint is the same to the bit", outcome.out)
        self.assertGreater(summary["lookahead_s"], 0.005)

    def test_the_touch_is_as_good_as_without(self):
        ahead = self.summary("--mass", 10, "--lookahead", "auto", "--duration", "6s")
        without = self.summary("--mass", 10, "--duration", "6s")
        self.assertEqual(without["lookahead_s"], 0)
        self.assertEqual((ahead["contacts"], ahead["faults"]), (without["contacts"], []))
        self.assertLess(ahead["tool_penetration_touch_max_m"], 1.5 * without["tool_penetration_touch_max_m"])
        self.assertLess(ahead["tool_penetration_sliding_max_m"], 1.1 * without["tool_penetration_sliding_max_m"])
        self.assertEqual(ahead["penetration_max_m"], without["penetration_max_m"])
        self.assertEqual(ahead["pulling_force_max_N"], 0)

    def jerk(self, *arguments):
        """The largest change of the true tool's acceleration from one cycle to the next in 0.3 s after 2 s."""
        self.summary(self.cell(), "--scene", SOURCE / "scenes/free.yaml", "--hand", self.written("sines.yaml", hand()),
                     "--duration", "3s", "--record", "session", *arguments)
        place = [float(row["true_tool_W_x_m"]) for row in self.rows()][1990:2300]
        speed = [(b - a) / PERIOD_S for a, b in zip(place, place[1:])]
        acceleration = [(b - a) / PERIOD_S for a, b in zip(speed, speed[1:])]
        return max(abs(b - a) for a, b in zip(acceleration, acceleration[1:]))

    def test_no_change_makes_it_jump(self):
        for change in ("mass=6@2s", "lookahead=off@2s", "damping=10@2s"):
            with self.subTest(change=change):
                still = self.jerk("--mass", 12, "--lookahead", "auto")
                changed = self.jerk("--mass", 12, "--lookahead", "auto", "--set", change)
                # A mass that changes is felt at once, and looking ahead makes up for the filter that softens it: the
                # acceleration changes up to three times as fast as without. A jump of 10 µm would be 0.25 m/s² a cycle.
                most = 4.0 * self.jerk("--mass", 12, "--set", change) if change.startswith("mass") else 2.0 * still
                self.assertLess(changed, most)

    def test_a_timestep_changes_with_it(self):
        outcome = self.call("run", "--json", "--mass", 10, "--lookahead", "auto", "--duration", "4s", "--record",
                            "session", "--set", "timestep=2ms@1s")
        self.assertEqual((outcome.status, outcome.summary["faults"]), (0, []), outcome.err)
        self.assertEqual(self.call("replay", "session").status, 0)

    def test_it_is_calm_at_other_timesteps(self):
        """The story: at 4 ms a hand of 500 N/m rang by 6.2 mm at 16 Hz, by a horizon that rigid links would bear."""
        for timestep, mass_kg in (("2ms", 10), ("4ms", 20)):
            with self.subTest(timestep=timestep):
                ahead = self.summary("--lookahead", "auto", "--mass", mass_kg, "--timestep", timestep, "--passivity",
                                     "observe")
                self.assertGreater(ahead["lookahead_s"], 0.0)
                self.assertEqual(ahead["faults"], [])
                self.assertEqual(ahead["oscillation"]["duration_s"], 0.0)

    def test_it_is_written_down(self):
        self.summary("--lookahead", "4ms", "--mass", 10, "--duration", "0.5s", "--record", "session")
        self.assertIn("lookahead_s: 0.004", (self.folder / "session" / "effective.yaml").read_text())
        self.assertEqual(json.loads((self.folder / "session" / "summary.json").read_text())["lookahead_s"], 0.004)
        self.assertIn("lookahead", self.call("run", "--verbose", "--lookahead", "4ms", "--mass", 10, "--duration", "0.5s",
                                             "--no-plot").out)

    def test_what_is_refused(self):
        for arguments, words in ((("--lookahead", "8"), ("--lookahead", "auto, off")),
                                 (("--lookahead", "2s"), ("100 ms",)),
                                 (("--lookahead", "16ms", "--mass", "2"), ("--lookahead", "stable")),
                                 ((SOURCE / "models/cells/light.yaml", "--lookahead", "auto"), ("impedance",)),
                                 (("--set", "lookahead=5ms@1s"), ("without lookahead",))):
            with self.subTest(arguments=arguments):
                outcome = self.call("run", "--duration", "1s", *arguments)
                self.assertEqual(outcome.status, 2, outcome.err)
                for word in words:
                    self.assertIn(word, outcome.err)


if __name__ == "__main__":
    unittest.main()
