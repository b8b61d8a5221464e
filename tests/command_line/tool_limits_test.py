#!/usr/bin/python3
"""Whatever a hand of up to 200 N does, also at singularities: the tool and the elbow stay within the cell's limits.

Told by the record of a session alone, by kinematics that share nothing with the controller (tool_motion.py). The story:
speed was limited at the proxy, ahead of inverse kinematics; a hand that pulled the tool to the end of its reach had it
go at 1.21 m/s where 0.5 was the limit, and at 1.33 where it was 0.25, and left a workspace by up to 6 mm.
"""
import math
import unittest

import harness
import steel
import tool_motion

# Setpoints are rounded to counts: 4e-8 rad, at 1 ms and a metre 0.04 mm/s for each end of a step and each of the axes.
COUNTS_M_PER_S = 2.5e-4
# What the encoders may say, and the simulated steel do, beyond what was sent: drives lag, overshoot, and gears ring.
STEEL = 1.05
BORDER_M = 1e-4


def hand(*places, stiffness=200, start_s=0.3, step_s=1.2):
    lines = ["name: pull", "mass_kg: 1.0", f"stiffness_N_per_m: {stiffness}", "damping_Ns_per_m: 10", "waypoints:",
             f"  - {{time_s: {start_s}, offset_m: [0, 0, 0]}}"]
    for i, place in enumerate(places):
        lines.append(f"  - {{time_s: {start_s + (i + 1) * step_s}, offset_m: [{', '.join(map(str, place))}]}}")
    return "\n".join(lines) + "\n"


class ToolLimits(harness.ProgramTest):
    def judged(self, pull, *limits):
        """A session of this hand with lines put in the place of the cell's speed limit."""
        cell = self.changed("models/cells/default.yaml", ("  max_tool_speed_m_per_s: 0.5\n", "".join(
            f"  {line}\n" for line in limits or ["max_tool_speed_m_per_s: 0.5"])))
        return self.judged_cell(cell, pull)

    def session(self, cell, pull, duration):
        outcome = self.call("run", cell, "--scene", harness.SOURCE / "scenes/free.yaml", "--hand",
                            self.written("hand.yaml", pull), "--duration", duration, "--record", "record", "--json")
        self.assertEqual(outcome.status, 0, outcome.err + outcome.out)

    def judged_cell(self, cell, pull):
        self.session(cell, pull, "3s")
        signals = self.folder / "record" / "signals.csv"
        sent = tool_motion.judge(cell, signals, "target")
        seen = tool_motion.judge(cell, signals, "actual")
        limit = tool_motion.Cell(cell)
        self.assertLessEqual(sent.tool, 1.0 + COUNTS_M_PER_S / limit.speed)
        self.assertLessEqual(sent.elbow, 1.0 + COUNTS_M_PER_S / limit.elbow_speed)
        for figures in (sent, seen):
            self.assertLessEqual(figures.outside, BORDER_M)
            self.assertLessEqual(figures.inside, BORDER_M)
        return seen

    def assert_steel_follows(self, seen):
        self.assertLessEqual(seen.tool, STEEL)
        self.assertLessEqual(seen.elbow, STEEL)

    def test_what_is_sent_at_the_end_of_its_reach(self):
        self.judged(hand((0.9, 0, 0.3), (0.9, 0.5, 0.3)))

    def assert_true_tool_follows(self, limit_m_per_s=0.5):
        """Of the simulated steel itself, over a millisecond, gears ringing and all."""
        track = steel.Track(self.folder / "record")
        speeds = [math.dist(a, b) / 1e-3 for a, b in zip(track.place[track.began:], track.place[track.began + 1:])]
        print(f"the steel: {max(speeds) / limit_m_per_s:.2f} of the tool's limit")
        self.assertLessEqual(max(speeds), STEEL * limit_m_per_s)

    def test_what_the_drives_make_of_it_at_the_end_of_its_reach(self):
        """The story: at full stretch axis 2 can't accelerate as hard as its cell says. The drive lagged at its torque
        limit, and caught up faster than anything that was sent: the tool did 1.8 times its limit."""
        self.assert_steel_follows(self.judged(hand((0.9, 0, 0.3), (0.9, 0.5, 0.3))))
        self.assert_true_tool_follows()

    def test_what_it_does_where_it_is_led_slowly_to_its_full_stretch(self):
        """The story: 2.3 to 2.5 times its limit, and the healthy drive was blamed."""
        for place, step_s in (((0.9, 0.9, 0), 6), ((0.9, 0, 0), 6), ((0, 1.4, 0.6), 5)):
            with self.subTest(place):
                self.session(self.changed("models/cells/default.yaml"), hand(place, stiffness=300, step_s=step_s),
                             f"{step_s + 2}s")
                self.assert_true_tool_follows()

    def test_at_the_end_of_its_reach_slowly(self):
        self.assert_steel_follows(self.judged(hand((0.9, 0, -0.3)), "max_tool_speed_m_per_s: 0.25"))

    def test_above_the_wrist_and_the_base(self):
        self.assert_steel_follows(self.judged(hand((0.1, 0.1, 0.9), (-0.7, 0.02, 0.5)), "max_tool_speed_m_per_s: 0.1"))

    def test_in_a_box_with_a_thin_zone(self):
        self.assert_steel_follows(self.judged(
            hand((0.5, 0.4, 0.1), (0.5, -0.4, -0.3)), "max_tool_speed_m_per_s: 0.5",
            "workspace_m: {min: [0.5, -0.1, 0.5], max: [0.95, 0.12, 0.75]}",
            "keep_out_m: [{min: [0.8, -0.2, 0.4], max: [0.801, 0.05, 0.9]}]"))


if __name__ == "__main__":
    unittest.main()
