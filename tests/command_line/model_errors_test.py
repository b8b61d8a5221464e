"""Arms and hands that aren't what the controller believes: what was asked for, found in the record."""
import csv
import math
import unittest

from harness import ProgramTest

HAND = """name: leans on the wall
mass_kg: 1
stiffness_N_per_m: 500
damping_Ns_per_m: 20
waypoints: [{time_s: 0.5, offset_m: [0, 0, 0]}, {time_s: 2.5, offset_m: [0.25, 0, 0]}]
"""


class ModelErrors(ProgramTest):
    def columns(self, *names):
        with open(self.folder / "record/signals.csv", newline="") as file:
            return [[float(row[name] or "nan") for name in names] for row in csv.DictReader(file) if row["phase"] == "rendering"]

    def test_a_hand_that_varies_pulls_between_the_bounds_that_were_asked_for(self):
        def stiffness(seed, duration="22s"):
            hand = self.written("hand.yaml", HAND + f"variation: {{share: 0.5, interval_s: 0.25, seed: {seed}}}\n")
            self.assertEqual(self.call("check", hand).status, 0)
            summary = self.summary("--hand", hand, "--mass", "10", "--duration", duration, "--record", "record")
            rows = self.columns("time_s", "true_tool_W_x_m", "hand_force_W_x_N")
            begun = rows[0][0]
            start = rows[0][1]
            # At rest on the wall it pulls by what its grip's stiffness makes of the way that is left.
            return summary, [force / (start + 0.25 - x) for t, x, force in rows if t > begun + 4]

        summary, varied = stiffness(3)
        # 72 numbers are drawn: that none is beyond ±0.8 has a probability of 0.8^72 = 1e-7. 2 %: the tool still moves.
        self.assertGreater(min(varied), 0.98 * 250)
        self.assertLess(min(varied), 300)
        self.assertLess(max(varied), 1.02 * 750)
        self.assertGreater(max(varied), 700)
        again, same = stiffness(3, "5s")
        self.assertEqual(same[:100], varied[:100])
        other, _ = stiffness(4, "5s")
        self.assertNotEqual(other["setpoint_sha256"], again["setpoint_sha256"])

    def test_a_gear_with_hysteresis_has_its_loop_in_the_record(self):
        # A carriage that is pushed against its wall and pulled, slowly: the link's place less the motor's over the force.
        width_m = 20e-6
        cell = self.changed("models/cells/linear.yaml", ("simulation:\n", f"simulation:\n      gear_hysteresis_rad: {width_m}\n"))
        push_N = [(1 + 0.01 * k, 150 * math.sin(2 * math.pi * 0.1 * 0.01 * k)) for k in range(2200)]  # 9 widths either way
        self.written("push.csv", "time_s,x_N,y_N,z_N\n" + "".join(f"{t:.2f},{f:.6f},0,0\n" for t, f in push_N))
        hand = self.written("hand.yaml", "mass_kg: 1\nforce: push.csv\n")
        self.summary(cell, "--hand", hand, "--spring", "3000N/m", "--damping", "500Ns/m", "--mass", "30", "--duration",
                     "22s", "--record", "record", "--scene", self.written("free.yaml", "name: free\nobjects: []\n"))
        loop = {True: [], False: []}
        rows = self.columns("time_s", "hand_force_W_x_N", "true_tool_W_x_m", "carriage_actual_rad")
        for before, now in zip(rows, rows[1:]):
            if now[0] > 8 and abs(now[1]) < 15:
                loop[now[1] > before[1]].append(now[2] - now[3])
        rising, falling = (sum(values) / len(values) for values in (loop[True], loop[False]))
        # The encoder's step is 0.8 µm, of which hundreds of rows are averaged; the carriage's own inertia does less.
        self.assertAlmostEqual(falling - rising, width_m, delta=0.8e-6)

    def test_what_contradicts_itself_is_refused(self):
        cell = self.changed("models/cells/linear.yaml",
                            ("simulation:\n", "simulation:\n      gear_hysteresis_rad: 1e-5\n      backlash_rad: 1e-5\n"))
        self.assert_refused(self.call("run", cell), "linear.yaml:", "gear_hysteresis_rad", "0 of a gear with backlash_rad")
        for text, found in (("{share: 1.5}", "share"), ("{share: 0.1, interval_s: 0}", "interval_s"), ("{}", "share"),
                            ("{share: 0.1, seed: -1}", "seed"), ("{share: 0.1, rate_Hz: 2}", "rate_Hz")):
            self.assert_refused(self.call("run", "--hand", self.written("hand.yaml", HAND + f"variation: {text}\n")), "hand.yaml:", found)


if __name__ == "__main__":
    unittest.main(verbosity=2)
