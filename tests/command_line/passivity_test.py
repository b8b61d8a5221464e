"""A grip that the loop can't stand: --passivity, its figures, its place in cell and record."""
import unittest

from harness import SOURCE, ProgramTest

GRIP = ("--scene", "scenes/free.yaml", "--hand", SOURCE / "sim/hands/stiff_grip.yaml", "--extra-delay", "8ms",
        "--duration", "12s")


class Passivity(ProgramTest):
    def test_without_it_the_grip_is_refused(self):
        self.assert_refused(self.call("run", *GRIP), "3000 N/m", "--damping")

    def test_a_stiff_grip_is_damped_and_let_go(self):
        self.assertIsNone(self.summary(*GRIP, "--force-unstable", "--passivity", "off")["passivity"])
        outcome = self.call("run", "--json", *GRIP, "--force-unstable", "--passivity", "observe")
        self.assertEqual(outcome.status, 1)
        self.assertTrue(outcome.summary["oscillation"]["lasts"])
        seen = outcome.summary["passivity"]
        self.assertEqual(seen["added_damping_max_Ns_per_m"], 0)
        self.assertLess(seen["hand_J"], -1)  # the loop gives the hand energy
        self.assertGreater(seen["oscillating_time_s"], 4)
        self.assertLess(seen["felt_damping_min_Ns_per_m"], -20)
        damped = self.summary(*GRIP, "--force-unstable", "--passivity", "on")
        self.assertFalse(damped["oscillation"]["lasts"])
        done = damped["passivity"]
        self.assertGreater(done["hand_J"], 0)
        self.assertLess(done["oscillating_time_s"], 1)
        self.assertGreater(done["added_damping_max_Ns_per_m"], 20)
        self.assertAlmostEqual(done["damping_J"], done["added_damping_J"])

    def test_by_default_it_is_damped_once_it_has_shown_that_it_lasts(self):
        outcome = self.call("run", "--json", *GRIP, "--force-unstable")
        self.assertEqual(outcome.status, 1)  # the loop isn't stable with this grip, and that is said
        done = outcome.summary["passivity"]
        self.assertTrue(outcome.summary["oscillation"]["lasts"])
        self.assertLess(outcome.summary["oscillation"]["duration_s"], 1.5)
        self.assertGreater(done["added_damping_max_Ns_per_m"], 20)
        self.assertLess(done["oscillating_time_s"], 2)

    def test_observing_changes_nothing(self):
        figures = [self.summary("--duration", "3s", "--passivity", mode)["setpoint_sha256"]
                   for mode in ("off", "observe", "auto", "on")]
        self.assertEqual(len(set(figures)), 1)

    def test_a_replay_repeats_it(self):
        self.summary(*GRIP, "--force-unstable", "--passivity", "on", "--set", "damping=10@3s", "--record", "session")
        outcome = self.call("replay", "session")
        self.assertEqual(outcome.status, 0, outcome.out + outcome.err)

    def test_the_cell_may_want_it(self):
        cell = self.changed("models/cells/default.yaml", ("default_period_s", "passivity: on\ndefault_period_s"))
        self.assertIsNotNone(self.summary(cell, "--duration", "1s")["passivity"])
        self.assertIsNone(self.summary(cell, "--duration", "1s", "--passivity", "off")["passivity"])
        cell.write_text(cell.read_text().replace("passivity: on", "passivity: yes"))
        self.assert_refused(self.call("run", cell), "passivity", '"yes"', "off, observe, auto or on")

    def test_what_has_no_proxy_has_none(self):
        self.assert_refused(self.call("run", "models/cells/light.yaml", "--passivity", "on"), "--passivity", "off")

    def test_a_cell_whose_drives_take_torques_is_refused_with_it(self):
        for mode in ("on", "auto", "observe"):
            cell = self.changed("models/cells/light.yaml")
            text = (SOURCE / "models/cells/light.yaml").read_text().replace("../drives", f"{SOURCE}/models/drives")
            cell.write_text(text + f"passivity: {mode}\n")
            for command in ("check", "run"):
                self.assert_refused(self.call(command, cell), "passivity", f'"{mode}"', "cst")

    def test_a_delay_has_bounds(self):
        for value, said in (("200ms", "at most 0.1 s"), ("8", "--extra-delay"), ("-1ms", "--extra-delay")):
            with self.subTest(value):
                self.assert_refused(self.call("run", "--extra-delay", value), said)


if __name__ == "__main__":
    unittest.main()
