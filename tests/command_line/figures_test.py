"""The figures that the main job must show, from the summary that users get."""
import math
import re
import unittest

from harness import SOURCE, ProgramTest

SWEEP = ["--scene", "scenes/free.yaml", "--hand", "sim/hands/sweep.yaml"]


def sensor_noise_N():
    """Standard deviation of a force reading along x of S: noise before the converter, and the converter's steps.

    Along x of S because the default wall's normal is along it. A gauge of n counts that is rounded to whole ones is off
    by 1/sqrt(12) of a count, and the gauges' errors are independent: row x of the matrix adds their squares.
    """
    cell = (SOURCE / "models/cells/default.yaml").read_text()
    noise_N = float(re.search(r"^  noise_N: (\S+)", cell, re.M)[1])
    sensor = (SOURCE / "models/sensors/ati_net_can_oem.yaml").read_text()
    row = [float(x) for x in re.search(r"^    - \[(.*)\]", sensor, re.M)[1].split(",")]
    counts_per_N = float(re.search(r"^  counts_per_N: (\S+)", sensor, re.M)[1])
    return math.hypot(noise_N, math.sqrt(sum(x * x for x in row)) / counts_per_N / math.sqrt(12))


class DefaultRun(ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        shared = cls("run_it")
        shared.setUp()
        cls.addClassCleanup(shared.doCleanups)
        cls.figures = shared.summary()

    def run_it(self):
        """Stands for the one run that the tests of this class look at."""

    def test_it_touches_slides_and_leaves_without_a_fault(self):
        self.assertEqual(self.figures["faults"], [])
        self.assertEqual(self.figures["overruns"], 0)
        self.assertGreater(self.figures["sliding_time_s"], 1.0)
        self.assertGreater(self.figures["contact_time_s"], self.figures["sliding_time_s"])

    def test_the_proxy_never_enters_the_wall(self):
        self.assertLessEqual(self.figures["penetration_max_m"], 1e-12)

    def test_the_tool_enters_it_by_less_than_a_millimetre_and_0_2_while_sliding(self):
        self.assertLessEqual(self.figures["tool_penetration_max_m"], 1e-3)
        self.assertLessEqual(self.figures["tool_penetration_touch_max_m"], 1e-3)
        self.assertLessEqual(self.figures["tool_penetration_sliding_max_m"], 0.2e-3)

    def test_the_contact_force_is_the_hands_push_within_the_sensors_noise(self):
        # A root mean square of thousands of samples is within a few per cent of the standard deviation; the other 7 %
        # is what the tool's own acceleration, a difference of positions, adds.
        self.assertLessEqual(self.figures["contact_force_error_N"], 1.1 * sensor_noise_N())
        # Some 4000 samples stay within four standard deviations but for a few in a million.
        self.assertLessEqual(self.figures["contact_force_error_max_N"], 5 * sensor_noise_N())

    def test_friction_is_mu_times_normal_within_two_per_cent(self):
        self.assertLessEqual(abs(self.figures["friction_ratio_error"]), 0.02)

    def test_the_wall_never_pulls(self):
        self.assertEqual(self.figures["pulling_force_max_N"], 0.0)

    def test_the_buses_have_room(self):
        for bus, load in self.figures["bus_load"].items():
            self.assertLess(load, 0.85, bus)
            self.assertGreater(load, 0.1, bus)


class Mass(ProgramTest):
    def test_what_is_asked_for_is_felt_within_five_per_cent(self):
        for mass_kg in (2, 4, 10, 20):
            for what in (SWEEP, []):  # of the hand's own tremor, and of the move to the wall
                with self.subTest(mass_kg=mass_kg, scene=what[1:2]):
                    figures = self.summary("--mass", mass_kg, *what)
                    self.assertEqual(figures["faults"], [])
                    self.assertAlmostEqual(figures["apparent_mass_kg"] / mass_kg, 1.0, delta=0.05)

    def test_also_with_a_period_of_two_milliseconds(self):
        figures = self.summary("--timestep", "2ms", *SWEEP)
        self.assertAlmostEqual(figures["apparent_mass_kg"] / 4, 1.0, delta=0.05)
        self.assertAlmostEqual(figures["cycles"] * 2e-3, figures["simulated_time_s"], places=6)

    def test_damping_is_felt_as_damping(self):
        # Delay takes some off: B less what a run without any shows.
        none = self.summary(*SWEEP)["apparent_damping_Ns_per_m"]
        felt = self.summary("--damping", "20", *SWEEP)["apparent_damping_Ns_per_m"]
        self.assertAlmostEqual(felt - none, 20.0, delta=2.0)


class DefaultRunTwoMilliseconds(ProgramTest):
    def test_meets_the_same_limits_at_the_wall(self):
        figures = self.summary("--timestep", "2ms")
        self.assertEqual(figures["faults"], [])
        self.assertLessEqual(figures["penetration_max_m"], 1e-12)
        self.assertLessEqual(figures["tool_penetration_max_m"], 1e-3)
        self.assertLessEqual(figures["tool_penetration_sliding_max_m"], 0.2e-3)
        self.assertEqual(figures["pulling_force_max_N"], 0.0)
        self.assertLessEqual(abs(figures["friction_ratio_error"]), 0.02)


if __name__ == "__main__":
    unittest.main(verbosity=2)
