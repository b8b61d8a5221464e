#!/usr/bin/python3
"""`proxarm assess`: stops and clamps of the simulated arm, from outside."""
import json
import re
import unittest

from harness import ProgramTest

GENEROUS = """source: "nobody's figures, for a test"
regions:
  - {name: a rhinoceros, stiffness_N_per_mm: 75, quasi_static_N: 10000, transient_N: 10000}
"""


class Assess(ProgramTest):
    outcomes = {}  # of calls without files of a test's own: each takes some seconds

    def shipped(self, *arguments):
        if arguments not in self.outcomes:
            self.outcomes[arguments] = self.call("assess", "--poses", "1", *arguments)
        return self.outcomes[arguments]

    def figures(self, *arguments):
        outcome = self.call("assess", "--poses", "1", "--json", *arguments) if arguments else self.shipped("--json")
        self.assertEqual(outcome.status, 1, outcome.err + outcome.out)
        self.assertEqual(outcome.err, "")
        return json.loads(outcome.out)

    def braked(self, torque, delay):
        """The default cell, with what it says of its drives' brakes."""
        cell = self.copies() / "models/cells/default.yaml"
        text, n = re.subn(r"( {6})(max_torque_Nm: .*\n)", rf"\1\2\1brake_torque_Nm: {torque}\n\1brake_delay_s: {delay}\n",
                          cell.read_text())
        self.assertEqual(n, 6)
        return self.written_beside(cell, f"braked{delay}.yaml", text)

    @staticmethod
    def written_beside(file, name, text):
        (file.parent / name).write_text(text)
        return file.parent / name

    def test_stops_are_told_with_speed_time_and_distance(self):
        found = self.figures()
        self.assertEqual(found["certifies"], "nothing")
        self.assertEqual([stop["category"] for stop in found["stops"]], [0, 1, 2])
        for stop in found["stops"]:
            # The proxy keeps to 0.9 of the cell's 0.5 m/s, elastic gears add a little.
            self.assertTrue(0.40 < stop["from_m_per_s"] <= 0.5, stop)
            self.assertTrue(stop["at_rest"], stop)
            self.assertTrue(0.0 < stop["time_s"] < 1.0, stop)
        off, controlled, held = (stop["distance_m"] for stop in found["stops"])
        # Without power nothing brakes but friction until the brakes close: the tool goes on for a tenth of a second. The
        # drives brake with up to 30 rad/s²: 0.45 m/s are gone in some 20 ms. They latch a setpoint a cycle later and
        # reach it after another, and their filter adds 13 ms.
        self.assertGreater(off, 0.8 * 0.1 * found["stops"][0]["from_m_per_s"])
        self.assertLess(controlled, off)
        self.assertLess(held, 0.02)
        self.assertGreater(held, 0.45 * 0.002)

    def test_brakes_are_assumed_only_where_the_cell_does_not_say(self):
        self.assertEqual(self.figures()["assumed_brakes"], 6)
        told = self.shipped().out
        self.assertIn("ASSUMED for 6 drives", told)
        self.assertIn("It certifies nothing.", told.splitlines()[0])
        quick, slow = (self.figures(self.braked(2000, delay)) for delay in (0.01, 0.2))
        self.assertEqual((quick["assumed_brakes"], slow["assumed_brakes"]), (0, 0))
        self.assertLess(quick["stops"][0]["distance_m"] + 0.1 * 0.4, slow["stops"][0]["distance_m"])

    def test_a_slower_tool_stops_sooner_and_presses_less(self):
        cell = self.changed("models/cells/default.yaml", ("max_tool_speed_m_per_s: 0.5", "max_tool_speed_m_per_s: 0.1"))
        slow, fast = self.figures(cell), self.figures()
        for a, b in zip(slow["stops"], fast["stops"]):
            self.assertLess(a["distance_m"], b["distance_m"])
            self.assertLessEqual(a["from_m_per_s"], 0.1)
        for a, b in zip(slow["clamps"], fast["clamps"]):
            self.assertEqual((a["felt"], a["stiffness_N_per_m"]), (b["felt"], b["stiffness_N_per_m"]))
            self.assertLess(a["transient_N"], b["transient_N"])

    def test_clamps_of_every_stiffness_are_told_felt_and_unfelt(self):
        clamps = self.figures()["clamps"]
        self.assertEqual([(c["felt"], c["stiffness_N_per_m"]) for c in clamps],
                         [(felt, 1e3 * k) for felt in (True, False) for k in (10, 25, 50, 75, 100, 150)])
        for clamp in clamps:
            # k x²/2 of the largest force, whenever it was.
            most = max(clamp["transient_N"], clamp["quasi_static_N"])
            self.assertAlmostEqual(clamp["energy_J"], 0.5 * most * most / clamp["stiffness_N_per_m"],
                                   delta=1e-6 * clamp["energy_J"])
            # The tool alone, 0.25 kg with a hand of 1 kg, at 0.4 m/s would press with v √(k m) already.
            self.assertGreater(clamp["transient_N"], 0.4 * (clamp["stiffness_N_per_m"] * 1.25) ** 0.5)
        felt, unfelt = clamps[:6], clamps[6:]
        for a, b in zip(felt, unfelt):
            self.assertLess(a["transient_N"], b["transient_N"], "what the sensor feels the arm gives way to")

    def test_what_presses_too_hard_is_backed_off_from(self):
        """The story: an arm that force_excessive had stopped went on pressing with its brakes closed: 536 N on 75 N/mm."""
        excessive = [clamp for clamp in self.figures()["clamps"] if clamp["ended_by"] == "force_excessive"]
        self.assertGreaterEqual(len(excessive), 4)
        for clamp in excessive:
            print(f"{clamp['stiffness_N_per_m'] / 1e3:.0f} N/mm: {clamp['transient_N']:.0f} N, "
                  f"{clamp['left_N']:.0f} N at last")
            self.assertTrue(clamp["felt"])
            # The hand goes on leading: 500 N/m over half of its way, 0.15 m, are 75 N. The rest is what is left to be
            # pressed on, 20 N, and what the arm gives while its brakes close, 0.1 s after its drives are off.
            self.assertLess(clamp["left_N"], min(200, 0.55 * clamp["transient_N"]))

    def test_thresholds_decide_the_exit_status_and_their_source_is_told(self):
        told = self.shipped()
        self.assertEqual(told.status, 1)
        self.assertIn("thresholds: ISO/TS 15066:2016, Table A.2", told.out)
        self.assertTrue(told.out.endswith("EXCEEDED: hands and fingers\n"), told.out)
        file = self.written("generous.yaml", GENEROUS)
        told = self.call("assess", "--poses", "1", "--thresholds", file)
        self.assertEqual((told.status, told.err), (0, ""))
        self.assertIn("thresholds: nobody's figures, for a test", told.out)
        self.assertIn("within a rhinoceros", told.out)
        self.assertTrue(told.out.endswith("no threshold is exceeded in these trials\n"), told.out)

    def test_the_same_call_gives_the_same_figures(self):
        self.assertEqual(self.figures(), json.loads(self.call("assess", "--poses", "1", "--json").out))

    def test_what_can_not_be_assessed_is_refused(self):
        for arguments, words in (
                (("--poses", "0"), ("--poses", "1 to 100")),
                (("--poses", "many"), ("--poses",)),
                (("models/cells/light.yaml",), ("light.yaml", "positions")),
                (("--hand", "nobody.yaml"), ("--hand", "no such file")),
                (("--mass", "0.1"), ("mass",)),
                (("--thresholds", "nothing.yaml"), ("nothing.yaml",)),
                (("--thresholds", self.written("a.yaml", GENEROUS.replace("source", "sauce"))), ("a.yaml", "source")),
                (("--thresholds", self.written("b.yaml", GENEROUS.replace("transient_N: 10000", "transient_N: 5"))),
                 ("b.yaml", "transient_N", "quasi_static_N")),
                (("--thresholds", self.written("c.yaml", GENEROUS.replace("75", "-75"))),
                 ("c.yaml", "stiffness_N_per_mm")),
                (("--scene", "scenes/wall.yaml"), ("--scene",))):
            with self.subTest(arguments):
                self.assert_refused(self.call("assess", *arguments), *words)


if __name__ == "__main__":
    unittest.main()
