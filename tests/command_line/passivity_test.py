"""A grip that the loop can't stand: --passivity, its figures, its place in cell and record."""
import csv
import math
import unittest

from harness import SOURCE, ProgramTest

GRIP = ("--scene", "scenes/free.yaml", "--hand", SOURCE / "sim/hands/stiff_grip.yaml", "--extra-delay", "8ms",
        "--duration", "12s")


def swing_m(time_s, place_m, from_s, until_s, window_s=0.15):
    """The largest swing to either side along an axis within a window, in which a led hand goes millimetres at most."""
    moving = [place for t, place in zip(time_s, place_m) if from_s <= t <= until_s]
    n = round(window_s / (time_s[1] - time_s[0]))
    return max((max(column) - min(column)) / 2 for i in range(0, max(1, len(moving) - n), n // 3)
               for column in zip(*moving[i:i + n]))


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

    def test_a_clamp_that_is_felt_late_is_quiet_or_stopped_soon(self):
        """10,000 N/m with readings 30 and 50 ms older than the default cell's: nothing damps the first swing, which
        reaches max_force_N where damping comes too late. Whatever comes: 20 mm and 350 N at most, and after a second
        it is quiet or has been stopped. Half again what was measured bounds what is left."""
        hand = self.written("clamp.yaml", "name: clamp\nmass_kg: 1\nstiffness_N_per_m: 500\ndamping_Ns_per_m: 20\n"
                            "grips: [{time_s: 2, stiffness_N_per_m: 10000, damping_Ns_per_m: 50}]\nwaypoints:\n"
                            "  - {time_s: 0.5, offset_m: [0, 0, 0]}\n  - {time_s: 1.5, offset_m: [0.02, 0.03, 0]}\n"
                            "  - {time_s: 4, offset_m: [-0.02, 0, 0.02]}\n")
        for delay, mode, quiet in (("30ms", "auto", False), ("30ms", "on", True), ("50ms", "auto", False),
                                   ("50ms", "on", False)):
            with self.subTest(f"{delay}, {mode}"):
                outcome = self.call("run", "--scene", "scenes/free.yaml", "--hand", hand, "--extra-delay", delay,
                                    "--force-unstable", "--passivity", mode, "--duration", "6s", "--no-plot", "--json",
                                    "--record", "record")
                faults = [fault["fault"] for fault in outcome.summary["faults"]]
                self.assertEqual(faults, [] if quiet else ["force_excessive"])
                time_s, force_N, place_m = self.motion("record")
                self.assertLess(max(force_N), 350)
                self.assertLess(swing_m(time_s, place_m, 2.2, time_s[-1]), 0.02)
                if quiet:
                    self.assertLess(swing_m(time_s, place_m, 3.5, 6.0), 2.5e-3)
                else:
                    self.assertLess(time_s[-1], 3.3)

    def motion(self, record):
        with open(self.folder / record / "signals.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        return ([float(row["time_s"]) for row in rows],
                [math.hypot(*(float(row[f"hand_force_W_{axis}_N"]) for axis in "xyz")) for row in rows],
                [[float(row[f"true_tool_W_{axis}_m"]) for axis in "xyz"] for row in rows])

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
