"""Hands from data: motions and forces out of CSV files, as somebody recorded them."""
import csv
import math
import unittest

from harness import SOURCE, ProgramTest

FREE = SOURCE / "scenes/free.yaml"
# The default hand's waypoints.
TOUCH = [(0.5, (0, 0, 0)), (2.5, (0.18, 0, 0)), (2.7, (0.18, 0, 0)), (4.6, (0.22, 0, 0)), (4.9, (0.22, 0, 0)),
         (7.4, (0.22, 0.18, 0)), (7.7, (0.22, 0.18, 0)), (9.5, (0.02, 0.18, 0))]


def minimum_jerk(t):
    if t <= TOUCH[0][0]:
        return TOUCH[0][1]
    for (t0, a), (t1, b) in zip(TOUCH, TOUCH[1:]):
        if t <= t1:
            s = (t - t0) / (t1 - t0)
            share = s ** 3 * (10 - 15 * s + 6 * s * s)
            return tuple(x + share * (y - x) for x, y in zip(a, b))
    return TOUCH[-1][1]


class HandData(ProgramTest):
    hand_begins_s = 0.00625

    def rows(self, name, header, rows):
        self.written(name, header + "\n" + "".join(",".join(f"{x:.9g}" for x in row) + "\n" for row in rows))
        return name

    def hand(self, text):
        return self.written("hand.yaml", text)

    def columns(self, folder, *names):
        with open(self.folder / folder / "signals.csv", encoding="utf-8") as file:
            return [[float(row[name]) for name in names] for row in csv.DictReader(file)]

    def test_a_trajectory_touches_as_its_waypoints_do(self):
        # The default hand's motion as samples at 100 Hz, recorded somewhere else: its first row is where the tool begins.
        self.rows("motion.csv", "time_s,x_m,y_m,z_m",
                  [(0.01 * n, *(x + off for x, off in zip(minimum_jerk(0.01 * n), (5, -3, 1)))) for n in range(1000)])
        hand = self.hand("mass_kg: 1\nstiffness_N_per_m: 500\ndamping_Ns_per_m: 20\ntrajectory: motion.csv\n")
        self.assertEqual(self.call("check", hand).status, 0)
        by_data, by_waypoints = self.summary("--hand", hand), self.summary()
        for key in ("contact_time_s", "sliding_time_s", "apparent_mass_kg", "tracking_rms_m"):
            self.assertAlmostEqual(by_data[key] / by_waypoints[key], 1, delta=0.01, msg=key)
        self.assertEqual(by_data["contacts"], by_waypoints["contacts"])

    def test_a_force_is_exerted_as_it_stands_whatever_the_tool_does(self):
        # F = A sin ωt for n periods from rest: m x = A/ω (t − sin ωt/ω), so the tool rests in the end, at A n T/(m ω).
        A, omega, n = 3.0, 2 * math.pi, 3
        self.rows("push.csv", "t,fx,fy,fz", [(1 + 0.01 * k, A * math.sin(omega * 0.01 * k), 0, 0) for k in range(100 * n + 1)])
        hand = self.hand("mass_kg: 0\nforce: {file: push.csv, columns: {time_s: t, x_N: fx, y_N: fy, z_N: 4}}\n")
        self.assertEqual(self.call("check", hand).status, 0)
        summary = self.summary("--hand", hand, "--scene", FREE, "--duration", "5s", "--mass", "8", "--record", "record")
        self.assertEqual(summary["faults"], [])
        times_and_forces = self.columns("record", "time_s", "hand_force_W_x_N", "hand_force_W_y_N", "hand_force_W_z_N")
        worst = 0.0
        for time_s, *force in times_and_forces:
            # The hand's time begins when the drives have power, a few cycles after the record's.
            t = min(max(time_s - 1 - self.hand_begins_s, 0.0), n)
            worst = max(worst, math.dist(force, (A * math.sin(omega * t), 0, 0)))
        # A millisecond is A ω T = 0.02 N; straight between rows is off by A (ω/100 Hz)²/8 = 0.0015 N.
        self.assertLess(worst, 0.03)
        tool = [row[0] for row in self.columns("record", "true_tool_W_x_m")]
        self.assertAlmostEqual((tool[-1] - tool[0]) / (A * n / (8 * omega)), 1, delta=0.03)
        self.assertEqual(self.call("replay", "record").status, 0)

    def test_the_hand_of_a_record_plays_against_another_scene(self):
        # Its force as it was recorded: the first two seconds, in free space, are the same again.
        self.summary("--record", "record")
        hand = self.hand("mass_kg: 0\nforce: {file: record/signals.csv, columns: "
                         "{x_N: hand_force_W_x_N, y_N: hand_force_W_y_N, z_N: hand_force_W_z_N}}\n")
        again = self.summary("--hand", hand, "--scene", FREE, "--duration", "2s", "--record", "again")
        self.assertEqual(again["faults"], [])
        first, second = (self.columns(name, "true_tool_W_x_m")[:2000] for name in ("record", "again"))
        self.assertGreater(first[-1][0] - first[0][0], 0.1)
        worst = max(abs(a[0] - b[0]) for a, b in zip(first, second))
        # Half a dozen milliseconds later at up to 0.2 m/s, and what a millinewton does in two seconds at 4 kg.
        self.assertLess(worst, 0.003)

    def test_a_hand_without_a_grip_is_no_reason_to_refuse_a_mass(self):
        # Such a hand was refused: no mass below 1.1 t was said to be stable with it.
        hand = self.hand("stiffness_N_per_m: 0\ndamping_Ns_per_m: 0\nwaypoints: [{time_s: 0, offset_m: [0, 0, 0]}]\n")
        summary = self.summary("--hand", hand, "--scene", FREE, "--duration", "2s")
        self.assertFalse(summary["oscillation"]["lasts"])

    def test_refuses_with_file_and_line(self):
        self.rows("motion.csv", "time_s,x_m,y_m,z_m", [(0, 0, 0, 0), (1, 0.1, 0, 0)])
        self.written("bad.csv", "time_s,x_m,y_m,z_m\n0,0,0,0\n1,0.1,oops,0\n")
        grip = "stiffness_N_per_m: 500\n"
        for text, *told in (
                (grip + "trajectory: nowhere.csv\n", "hand.yaml:2", "trajectory", "doesn't exist"),
                (grip + "trajectory: bad.csv\n", "bad.csv:3", "y_m", "oops", "a number"),
                (grip + "trajectory: {file: motion.csv, columns: {x_m: px}}\n", "motion.csv:1", "px", "x_m"),
                (grip + "trajectory: {file: motion.csv, columns: {x: px}}\n", "hand.yaml:2", "columns.x", "x_m"),
                (grip + "trajectory: {columns: {x_m: px}}\n", "hand.yaml:2", "file"),
                (grip + "trajectory: motion.csv\nwaypoints: [{time_s: 0, offset_m: [0, 0, 0]}]\n", "trajectory", "both"),
                ("force: motion.csv\n", "motion.csv:1", "x_N", "time_s, x_m, y_m, z_m"),
        ):
            hand = self.hand(text)
            for command in (("run", "--hand", hand), ("check", hand)):
                with self.subTest(text, command=command[0]):
                    self.assert_refused(self.call(*command), *told)


if __name__ == "__main__":
    unittest.main()
