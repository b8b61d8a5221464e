"""A hand that changes its grip is judged by the one that asks for most, which needn't be the stiffest."""
import csv
import math
import unittest

from harness import SOURCE, ProgramTest

FREE = ("--scene", str(SOURCE / "scenes/free.yaml"))
WAYPOINTS = "waypoints:\n  - {time_s: 3.5, offset_m: [0, 0, 0]}\n  - {time_s: 3.6, offset_m: [0.01, 0, 0.01]}\n"


class Grips(ProgramTest):
    def hand(self, *grips, stiffness=500, damping=20):
        text = f"name: changing\nmass_kg: 1\nstiffness_N_per_m: {stiffness}\ndamping_Ns_per_m: {damping}\n"
        if grips:
            text += "grips:\n" + "".join(f"  - {{time_s: {2 + i}, stiffness_N_per_m: {k}, damping_Ns_per_m: {d}}}\n"
                                         for i, (k, d) in enumerate(grips))
        return self.written("changing.yaml", text + WAYPOINTS)

    def judged(self, hand, *more):
        return self.call("run", "--json", "--no-plot", *FREE, "--hand", hand, *(more or ("--duration", "1s")))

    def test_one_that_is_nearly_as_stiff_and_damps_little_is_refused_by_name(self):
        """The story: the stiffest was judged alone, this was accepted, and swung by 0.2 mm at 8 Hz."""
        self.assertEqual(self.judged(self.hand()).status, 0)
        for grips in (((490, 1),), ((300, 30), (490, 1), (500, 20)), ((0, 0), (490, 1))):
            outcome = self.judged(self.hand(*grips))
            self.assertEqual(outcome.status, 2, grips)
            self.assertIn("with a hand of 490 N/m, 1 Ns/m, 1 kg", outcome.err)
        self.assertIn("held by changing: 490 N/m, 1 Ns/m", self.call("tune", *FREE, "--hand", self.hand((490, 1))).out)

    def test_it_swings_indeed(self):
        self.judged(self.hand((490, 1)), "--force-unstable", "--passivity", "off", "--duration", "8s", "--record", "swings")
        self.judged(self.hand((490, 20)), "--passivity", "off", "--duration", "8s", "--record", "calm")
        self.assertGreater(self.fastest("swings"), 0.004)
        self.assertLess(self.fastest("calm"), 0.001)

    def fastest(self, folder):
        """Of the steel in the last second."""
        with open(self.folder / folder / "signals.csv", newline="") as file:
            rows = [row for row in csv.DictReader(file) if row["phase"] == "rendering"][-1000:]
        ways = [[float(row[f"true_tool_W_{axis}_m"]) for axis in "xyz"] for row in rows]
        return max(math.dist(a, b) for a, b in zip(ways, ways[1:])) / 1e-3

    def test_one_that_lets_go_or_that_asks_for_less_changes_nothing(self):
        def told(hand):
            return self.judged(hand, "--mass", "0.5").err
        alone = told(self.hand(stiffness=2000, damping=100))
        self.assertIn("with a hand of 2000 N/m, 100 Ns/m, 1 kg", alone)
        for grips in (((0, 0),), ((500, 20),), ((2000, 100), (2000, 100))):
            self.assertEqual(told(self.hand(*grips, stiffness=2000, damping=100)), alone, grips)

    def test_a_thousand_grips_are_judged_in_time(self):
        hand = self.hand(*((400 + 0.1 * i, 30) for i in range(1000)))
        outcome = self.judged(hand)
        self.assertEqual(outcome.status, 0, outcome.err)
        self.assertLess(outcome.user_s, 20.0)
        print(f"a thousand grips: {outcome.user_s:.2f} s")


if __name__ == "__main__":
    unittest.main()
