"""Hands that lead the tool to where the arm can't go: out of its reach, along a border, turning where it stands.

Until 2026-11 an arm that had been led to full stretch stayed there, whatever the pull, or went up by a metre against a
hand that pulled down: guards clipped the setpoints there, and the proxy was wound back. All tests asked about speeds, and
none whether it comes back."""
import math
import sys
import unittest

from harness import SOURCE, ProgramTest

sys.path.insert(0, str(SOURCE / "tests/soak"))
import comes_back_hunt  # noqa: E402

FREE = ("--scene", str(SOURCE / "scenes/free.yaml"), "--no-plot")
MASS_KG = 4.0
DELAY_S = 0.0166  # of the default cell's loop at 1 ms


def hand(stiffness, waypoints, most_N=None):
    lines = ["name: led", "mass_kg: 1.0", f"stiffness_N_per_m: {stiffness}", "damping_Ns_per_m: 20"]
    lines += [f"max_force_N: {most_N}"] if most_N else []
    lines += ["waypoints:"] + [f"  - {{time_s: {t}, offset_m: {list(at)}}}" for t, at in waypoints]
    return "\n".join(lines) + "\n"


class Reach(ProgramTest):
    def led(self, text, seconds, *arguments, cell=None):
        (self.folder / "hand.yaml").write_text(text)
        summary = self.summary(*([str(cell)] if cell else []), *FREE, "--hand", "hand.yaml", "--duration", f"{seconds}s",
                               "--record", "record", *arguments)
        return summary, comes_back_hunt.hunting.Record(self.folder / "record/signals.csv")

    def assert_comes_back(self, text, seconds, *arguments):
        summary, record = self.led(text, seconds, *arguments)
        off_m = math.dist(record.steel[-1], record.steel[0])
        self.assertLess(off_m, 1e-3)
        self.assertEqual(comes_back_hunt.against_the_hand(record, MASS_KG, DELAY_S), 0.0)
        limits = [limit["limit"] for limit in summary["limits"]]
        self.assertIn("singularity or end of reach", limits)
        self.assertEqual([limit for limit in limits if limit.startswith("guard")], [])
        self.assertFalse(summary["oscillation"]["lasts"])
        return record

    def test_a_gentle_hand_leads_it_out_and_back(self):
        self.assert_comes_back(hand(300, [(0.5, (0, 0, 0)), (5, (0.58, 0, 0)), (6, (0.58, 0, 0)), (10, (0, 0, 0))]), 13)

    def test_it_doesn_t_rise_against_a_hand_that_pulls_it_down(self):
        self.assert_comes_back(hand(500, [(0.5, (0, 0, 0)), (5, (0.55, 0.01, 0.08)), (6, (0.55, 0.01, 0.08)),
                                          (11, (0, 0, 0))], 40), 15)

    def test_a_strong_hand_leads_it_around_the_end_of_its_reach(self):
        self.assert_comes_back(hand(300, [(0.5, (0, 0, 0)), (4, (1.0, 0, 0)), (6, (1.0, 0.2, 0.1)), (9, (0.2, 0, 0)),
                                          (12, (0, 0, 0))], 40), 16)

    def test_with_lookahead_too(self):
        self.assert_comes_back(hand(300, [(0.5, (0, 0, 0)), (5, (0.58, 0, 0)), (6, (0.58, 0, 0)), (10, (0, 0, 0))]), 13,
                               "--lookahead", "auto")

    def bordered(self, lines):
        text = (SOURCE / "models/cells/default.yaml").read_text()
        for folder in ("arms", "drives", "sensors"):
            text = text.replace(f"../{folder}", f"{SOURCE}/models/{folder}")
        for folder in ("scenes", "sim"):
            text = text.replace(f"../../{folder}", f"{SOURCE}/{folder}")
        old = "  max_force_N: 200\n"
        self.assertIn(old, text)
        (self.folder / "cell.yaml").write_text(text.replace(old, old + lines))
        return self.folder / "cell.yaml"

    # Pressed on with 2.5 N at first, then with 20, and slid along. The hand's force bends the gears by what the arm's
    # stiffness there, some 5e5 N/m, gives.
    def assert_slides(self, lines, press_m):
        cell = self.bordered(lines)
        down = -0.0375 - press_m
        text = hand(500, [(0.5, (0, 0, 0)), (2.5, (0, 0, down)), (4, (0, 0, down)), (7, (0.06, 0, down)),
                          (10, (-0.06, 0, down))])
        summary, record = self.led(text, 10, cell=cell)
        self.assertEqual(summary["oscillation"]["amplitude_m"], 0.0)
        self.assertEqual([limit["limit"] for limit in summary["limits"] if limit["limit"].startswith("guard")], [])
        lowest = min(at[2] for at in record.steel)
        self.assertGreater(lowest, 0.5625 - 0.2e-3)
        self.assertLess(lowest, 0.5625 + 0.55e-3, "it stops half a millimetre before the border")
        # It goes along with the hand: 60 mm to either side.
        self.assertLess(math.dist(record.steel[-1][:2], (record.steel[0][0] - 0.06, record.steel[0][1])), 2e-3)

    def test_a_workspace_s_border_is_slid_along_as_a_wall(self):
        self.assert_slides("  workspace_m: {min: [0.2, -0.6, 0.5625], max: [1.2, 0.6, 1.4]}\n", 0.005)

    def test_it_is_under_20_newtons_too(self):
        self.assert_slides("  workspace_m: {min: [0.2, -0.6, 0.5625], max: [1.2, 0.6, 1.4]}\n", 0.04)

    def test_so_is_a_keep_out_zone_s(self):
        self.assert_slides("  keep_out_m: [{min: [0.25, -0.25, 0.4375], max: [1.25, 0.25, 0.5625]}]\n", 0.005)

    # A hand that only turns, as fast as it likes: the place is kept. 2 mm are asked for; seven axes went 82 mm.
    def assert_place_is_kept(self, cell):
        summary, record = self.led((SOURCE / "sim/hands/wobble.yaml").read_text(), 10, "--inertia", "0.1",
                                   cell=SOURCE / f"models/cells/{cell}.yaml")
        self.assertLess(max(math.dist(at, record.proxy[0]) for at in record.proxy), 2e-3)

    def test_a_hand_that_only_turns_leaves_the_place_of_six_axes(self):
        self.assert_place_is_kept("default")

    def test_a_hand_that_only_turns_leaves_the_place_of_a_cobot(self):
        self.assert_place_is_kept("cobot")

    def test_a_hand_that_only_turns_leaves_the_place_of_seven_axes(self):
        self.assert_place_is_kept("seven")


if __name__ == "__main__":
    unittest.main()
