"""Whether an arm's weight leaves its drives torque: told before a session begins.

The story: a collaborative arm whose joint held 148 Nm of weight at stretch, where setpoints may ask for 132 Nm, began
without a word, and stood 7 mm in a wall near the end of its reach. The judge is the bench's arm in closed form: two links
in an upright plane.
"""
import math
import re
import unittest

from harness import ProgramTest

G = 9.80665
ELBOW = 1.2 * 0.175 + (0.3 + 0.25) * 0.35  # link_2; flange and handle at its end: kg m
SHOULDER = 4.6 * 0.266304 + (1.2 + 0.3 + 0.25) * 0.35  # link_1, and what its end carries
START, SHOULDER_RANGE, ELBOW_RANGE = (0.962551, 1.925101), (-0.5, 2.3), (0.25, 2.65)
SHARE = 0.4  # two fifths


def shoulder_Nm(shoulder, elbow):
    return G * (SHOULDER * math.cos(shoulder) + ELBOW * math.cos(shoulder - elbow))


def spread(between, count=300):
    return (between[0] + (between[1] - between[0]) * i / count for i in range(count + 1))


class Weight(ProgramTest):
    def bench(self, rated_Nm):
        """With another rating of the shoulder's drive; --scene as the bench's own."""
        cell = self.copies() / "models/cells/bench.yaml"
        text = cell.read_text()
        for key, value in (("range_rad", SHOULDER_RANGE), ("range_rad", ELBOW_RANGE), ("start_rad", START)):
            self.assertIn(f"{key}: [{value[0]}, {value[1]}]", text, "the judge's arm is the cell's")
        cell.write_text(re.sub(r"max_torque_Nm: [0-9.]+", f"max_torque_Nm: {rated_Nm}", text, count=1))
        return cell

    def told(self, rated_Nm):
        """What `run` says, and `check` in the same words."""
        cell = self.bench(rated_Nm)
        run = self.call("run", cell, "--duration", "20ms", "--no-plot")
        check = self.call("check", cell)
        words = run.err.splitlines()
        lines = [line.removeprefix("proxarm: warning: ") for line in words if "warning: " in line]
        if run.status == 2:
            self.assertEqual((check.status, check.err, check.out.splitlines()), (2, words[-1] + "\n", lines))
            return words[-1]
        self.assertEqual((run.status, check.status), (0, 0), run.err + check.err)
        self.assertEqual(check.out.splitlines()[:-1], lines)
        self.assertLessEqual(len(lines), 1)
        return "".join(lines)

    def assert_figures(self, told, weight_Nm, torque_Nm):
        found = re.search(r"weight takes ([0-9.]+) of the ([0-9.]+) Nm that", told)
        self.assertIn("shoulder", told)
        # Three digits are shown, and the search misses the heaviest pose by 0.2 % at most.
        self.assertAlmostEqual(float(found[1]) / weight_Nm, 1.0, delta=7e-3)
        self.assertAlmostEqual(float(found[2]) / torque_Nm, 1.0, delta=5e-3)

    def test_is_told_at_the_worst_and_refused_at_the_start(self):
        start_Nm = shoulder_Nm(*START)
        worst_Nm = max(shoulder_Nm(s, e) for s in spread(SHOULDER_RANGE) for e in spread(ELBOW_RANGE))
        # As much as setpoints may ask for at the worst is enough, and less isn't.
        for enough_Nm in (90, math.ceil(1.01 * worst_Nm / SHARE)):
            self.assertEqual(self.told(enough_Nm), "")
        for rated_Nm, where in ((0.99 * worst_Nm / SHARE, "full stretch"), (1.01 * worst_Nm, "full stretch"),
                                (0.98 * worst_Nm, "can't hold it"), (1.02 * start_Nm, "can't hold it")):
            told = self.told(rated_Nm)
            self.assertIn(where, told)
            self.assert_figures(told, worst_Nm, SHARE * rated_Nm)
        # Where the drive can't even hold the start.
        rated_Nm = 0.99 * start_Nm
        told = self.told(rated_Nm)
        for word in ("bench.yaml", "start_rad", "max_torque_Nm"):
            self.assertIn(word, told)
        self.assert_figures(told, start_Nm, rated_Nm)

    def test_counts_only_poses_within_the_workspace(self):
        # With T no further ahead than 0.75 m, 0.05 m beyond the start, the arm can't stretch.
        self.assertIn("at the worst", self.told(54))
        cell = self.bench(54)
        text = cell.read_text()
        self.assertNotIn("workspace_m", text)
        cell.write_text(text.replace("limits:\n", "limits:\n  workspace_m: {min: [-2, -2, 0.3], max: [0.75, 2, 2]}\n", 1))
        self.assertNotIn("at the worst", self.call("check", cell).out)

    def test_isnt_told_where_the_cell_rates_nothing(self):
        cell = self.bench(1)
        cell.write_text(re.sub(r"\n    max_torque_Nm: .*", "", cell.read_text()))
        self.assertEqual(self.call("check", cell).out.count("\n"), 1)


if __name__ == "__main__":
    unittest.main()
