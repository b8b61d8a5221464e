"""Every session ends by itself, and says why: on the screen and in the summary for programs."""
import csv
import unittest

from harness import AXES, ProgramTest


def scripted(*orders):
    return [word for order in orders for word in ("--do", order)]


class SessionEnd(ProgramTest):
    def ended(self, *arguments, status=0):
        """The session's summary. One that doesn't end by itself is cut off here: each of these takes less than a second."""
        outcome = self.call("run", "--json", *arguments, timeout=60)
        self.assertEqual(outcome.status, status, outcome.err)
        summary = outcome.summary
        self.assertEqual(set(summary["end"]), {"reason", "text"})
        return summary

    def test_after_its_duration(self):
        summary = self.ended("--duration", "1s")
        self.assertEqual(summary["end"], {"reason": "duration", "text": "1 s were rendered, as asked for"})
        self.assertEqual(summary["idle_orders"], [])

    def test_after_a_fault(self):
        summary = self.ended("--fault", "axis_2:silent@1s", status=1)
        self.assertEqual(summary["end"]["reason"], "fault")
        self.assertIn("of 10 s were rendered", summary["end"]["text"])

    def test_after_a_hold_that_nobody_ends(self):
        # It ended with 1.76 of 10 s rendered, "faults: none" and status 0, without a word why.
        summary = self.ended(*scripted("hold@2s"))
        self.assertEqual(summary["end"]["reason"], "hold_expired")
        for fragment in ("hold within 10 s", "supervision.hold_s", "of 10 s were rendered"):
            self.assertIn(fragment, summary["end"]["text"])

    def test_after_a_release_that_nobody_ends(self):
        # It never ended: an order to resume does nothing while the arm follows the hand.
        summary = self.ended(*scripted("hold@5s", "release@6s", "resume@8s"))
        self.assertEqual(summary["end"]["reason"], "release_expired")
        self.assertEqual(summary["idle_orders"],
                         [{"order": "resume", "time_s": 8.0, "refused": "the arm isn't in a hold"}])
        self.assertAlmostEqual(summary["simulated_time_s"], 18.0, delta=0.5)  # 10 s after the script's last order

    def test_a_release_waits_for_the_orders_of_the_script(self):
        summary = self.ended("--duration", "3s", *scripted("hold@1s", "release@2s", "hold@30s", "resume@31s"))
        self.assertEqual(summary["end"]["reason"], "duration")
        self.assertEqual(summary["idle_orders"], [])

    def test_after_backing_off_for_good(self):
        # Backing off ends by itself, into a hold; so does that.
        summary = self.ended(*scripted("hold@5s", "back-off 20mm@6s"))
        self.assertEqual(summary["end"]["reason"], "hold_expired")

    def test_after_waiting_for_a_reset_in_vain(self):
        summary = self.ended("--fault", "axis_2:silent@1s", "--wait-after-fault", "5s", status=1)
        self.assertEqual(summary["end"]["reason"], "fault")

    def test_nobody_waits_for_the_reset_of_a_drive_that_never_said_that_it_is_off(self):
        summary = self.ended("--fault", "axis_2:silent@2s", "--wait-after-fault", "20s", *scripted("reset@5s"), status=1)
        self.assertLess(summary["simulated_time_s"], 4.0)
        self.assertEqual(summary["idle_orders"],
                         [{"order": "reset", "time_s": 5.0, "refused": "the session had ended before"}])
        self.assertIn("not every drive has confirmed it", summary["faults"][0]["text"])

    def test_a_reset_fails_while_a_drive_is_silent(self):
        # Silent only after it was switched off, so that a reset is awaited.
        summary = self.ended("--fault", "axis_3:fault=0x4210@2s..3s", "--fault", "axis_2:silent@4s",
                             "--wait-after-fault", "5s", *scripted("reset@5s"), status=1)
        self.assertEqual([(fault["fault"], fault["was_reset"]) for fault in summary["faults"]],
                         [("drive_fault", True), ("drive_silent", False)])

    def test_orders_that_come_too_late_or_too_early_are_told(self):
        summary = self.ended("--duration", "3s", *scripted("resume@1s", "hold@20s"))
        self.assertEqual(summary["end"]["reason"], "duration")
        self.assertEqual(summary["idle_orders"],
                         [{"order": "resume", "time_s": 1.0, "refused": "the arm isn't in a hold"},
                          {"order": "hold", "time_s": 20.0, "refused": "the session had ended before"}])

    def test_changes_for_which_the_session_ended_too_early_are_told(self):
        # `--set mass=6@20s` of a session of 10 s did nothing, without a word.
        summary = self.ended("--duration", "3s", "--set", "mass=6@20s", "--set", "damping=20@1s", "--set",
                             "timestep=2ms@30s")
        self.assertEqual(summary["idle_orders"],
                         [{"order": "set mass=6", "time_s": 20.0, "refused": "the session had ended before"},
                          {"order": "set timestep=2ms", "time_s": 30.0, "refused": "the session had ended before"}])
        outcome = self.call("run", "--no-plot", "--duration", "1s", "--set", "mass=6@20s")
        self.assertIn("order without effect:     set mass=6 at 20 s: the session had ended before\n", outcome.out)

    def test_changes_of_a_session_that_a_fault_ends_are_told(self):
        summary = self.ended("--fault", "axis_2:silent@1s", "--set", "mass=6@0.2s", "--set", "mass=5@3s", status=1)
        self.assertEqual([order["order"] for order in summary["idle_orders"]], ["set mass=5"])

    def test_a_change_for_a_timestep_that_was_refused_is_told(self):
        summary = self.ended("--duration", "3s", "--fault", "axis_3:period", "--set", "timestep=2ms@1s", "--set",
                             "mass=6@1500ms")
        self.assertEqual(summary["idle_orders"],
                         [{"order": "set mass=6", "time_s": 1.5,
                           "refused": "the timestep that it was checked for wasn't taken"}])

    def test_a_release_waits_until_the_arm_stands(self):
        """It was answered with ok and dropped."""
        summary = self.ended("--record", "session", *scripted("hold@2s", "release@2001ms"))
        self.assertEqual(summary["idle_orders"], [])
        with open(self.folder / "session" / "signals.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(summary["end"]["reason"], "release_expired")
        held = [row for row in rows if row["phase"] == "holding"]
        counts = [[int(row[f"{axis}_target_counts"]) for axis in AXES] for row in held]
        steps = [max(abs(x - y) for x, y in zip(a, b)) for a, b in zip(counts, counts[1:])]
        self.assertGreater(len(steps), 3)  # it braked first
        self.assertLess(steps[-1], 0.5 * steps[0])

    def test_an_order_takes_back_a_release_that_waits(self):
        summary = self.ended("--duration", "4s", *scripted("hold@2s", "release@2001ms", "resume@2002ms"))
        self.assertEqual(summary["idle_orders"], [])
        self.assertEqual(summary["end"]["reason"], "duration")

    def test_people_read_it(self):
        outcome = self.call("run", "--no-plot", *scripted("hold@5s", "release@6s", "resume@8s"), timeout=60)
        lines = {line[:26].strip(" :"): line[28:] for line in outcome.out.splitlines() if line.startswith("  ")}
        self.assertIn("a release that no order could end any more lasted for 10 s", lines["ended"])
        self.assertEqual(lines["order without effect"], "resume at 8 s: the arm isn't in a hold")
        self.assertEqual(lines["faults"], "none")


class Figures(ProgramTest):
    def test_screen_and_summary_call_the_masses_by_the_same_names(self):
        # "felt mass" was the measured one on the screen, and felt_mass_kg the wanted one in the summary.
        summary = self.summary()
        self.assertEqual(summary["wanted_mass_kg"], 4.0)
        self.assertNotIn("felt_mass_kg", summary)
        [line] = [line for line in self.call("run", "--no-plot").out.splitlines() if "apparent mass" in line]
        self.assertIn(f"{summary['apparent_mass_kg']:.3f} kg, wanted 4.000 kg", line)


if __name__ == "__main__":
    unittest.main(verbosity=2)
