#!/usr/bin/python3
"""What hangs at the handle: a zero that is known, the tool's inertia, forces that jump, loads that are constant.

Judged by true_tool_W of signals.csv, the simulated steel, which the controller never sees.
"""
import csv
import math
import re
import unittest

import harness
import steel

# Held from before the start; lets go at 3 s. Its spring is out by the first waypoint's way.
GRIP = """name: grip
mass_kg: 1
stiffness_N_per_m: 500
damping_Ns_per_m: 20
waypoints:
  - {time_s: 0.5, offset_m: [%g, %g, %g]}
grips:
  - {time_s: 3, stiffness_N_per_m: 0, damping_Ns_per_m: 0}
"""
HOLDS = """name: holds the handle still
mass_kg: 1
stiffness_N_per_m: 500
damping_Ns_per_m: 20
waypoints:
  - {time_s: 0, offset_m: [0, 0, 0]}
"""
LEADS = """name: leads
mass_kg: 1
stiffness_N_per_m: 500
damping_Ns_per_m: 20
waypoints:
  - {time_s: 0.5, offset_m: [0, 0, 0]}
  - {time_s: 3.5, offset_m: [-0.2, 0.1, 0]}
"""
LEADS_AND_LETS_GO = """name: leads by 0.1 m, lets go at rest
mass_kg: 0.05
stiffness_N_per_m: 500
damping_Ns_per_m: 20
waypoints:
  - {time_s: 0.5, offset_m: [0, 0, 0]}
  - {time_s: 2.0, offset_m: [-0.1, 0, 0]}
grips:
  - {time_s: 4, stiffness_N_per_m: 0, damping_Ns_per_m: 0}
"""
FORCE = "name: a force\nmass_kg: 0\nforce: force.csv\n"
# Nothing moves: what the steel gives under a push of 30 N, through its gears and drives.
STILL_M = 1e-3


class Track(steel.Track):
    def take(self, column, rows):
        self.hand_N = steel.vectors(column, rows, "hand_force_W", "N")
        if "rendering" in (row[column["phase"]] for row in rows):
            return super().take(column, rows)
        self.time_s = [float(row[column["time_s"]]) for row in rows]
        self.phase = [row[column["phase"]] for row in rows]
        self.place = steel.vectors(column, rows, "true_tool_W", "m")
        return None


class Handle(harness.ProgramTest):
    def session(self, hand, *arguments, cell="models/cells/default.yaml", duration="5s"):
        file = cell if str(cell).startswith("/") else harness.SOURCE / cell
        outcome = self.call("run", file, "--scene", harness.SOURCE / "scenes/free.yaml", "--hand",
                            self.written("hand.yaml", hand), "--force-unstable", "--no-plot", "--record", "record",
                            "--json", "--duration", duration, *arguments)
        return outcome, Track(self.folder / "record")

    def force(self, *rows):
        """A hand without mass that exerts this: (time, N along each axis), straight in between."""
        text = "time_s,x_N,y_N,z_N\n" + "".join(f"{t:.5f},{x:.6g},{y:.6g},{z:.6g}\n" for t, (x, y, z) in rows)
        self.written("force.csv", text)
        return FORCE

    @staticmethod
    def faults(outcome):
        return [fault["fault"] for fault in outcome.summary["faults"]]

    @staticmethod
    def way(track, first, last=None):
        return max(math.dist(place, track.place[first]) for place in track.place[first:last])

    # ---- the zero

    def test_a_steady_push_while_the_sensor_is_tared_is_told_with_its_direction_and_nothing_moves(self):
        """The story: 30 N were taken for zero; let go, the empty arm ran off by 0.5 m at 0.5 m/s, without a fault."""
        for newtons, towards, words in ((30, (-1, 0, 0), "-x"), (10, (0, 1, 0), "+y"), (25, (0, -1, 0), "-y"),
                                        (10, (0, 0, 1), "+z"), (15, (0.6, 0.8, 0), r"\(0.6, 0.8, ")):
            with self.subTest(f"{newtons} N towards {words}"):
                outcome, track = self.session(GRIP % tuple(newtons / 500 * x for x in towards))
                self.assertEqual((outcome.status, self.faults(outcome)), (1, ["force_at_start"]))
                text = outcome.summary["faults"][0]["text"]
                self.assertRegex(text, rf"{newtons} N towards ({re.escape(words) if words[0] in '+-' else words})")
                self.assertIn("is somebody holding it", text)
                self.assertIn("while the sensor is tared", outcome.err)  # of the hand's file
                self.assertNotIn("rendering", track.phase)
                self.assertLess(self.way(track, 0), STILL_M)

    def test_a_tool_that_is_heavier_than_the_cell_says_is_told_by_its_mass(self):
        cell = self.copies() / "models/cells/default.yaml"
        arm = self.changed("models/cells/bench.yaml").with_name("heavy.yaml")
        arm.write_text(cell.read_text().replace("mass_kg: 0.25", "mass_kg: 1.25", 1))
        outcome, track = self.session(steel.NOBODY, "--arm", arm, cell=cell)
        self.assertEqual((outcome.status, self.faults(outcome)), (1, ["force_at_start"]))
        self.assertIn("is the tool heavier by 1 kg?", outcome.summary["faults"][0]["text"])
        self.assertLess(self.way(track, 0), STILL_M)

    def test_a_force_that_was_accepted_starts(self):
        outcome, track = self.session(GRIP % (-0.02, 0, 0), "--accept-force", "15N", duration="1s")
        self.assertEqual(self.faults(outcome), [])
        self.assertIn("rendering", track.phase)

    def test_a_zero_that_is_kept_is_what_the_next_tare_is_held_against(self):
        cell = self.copies() / "models/cells/default.yaml"
        self.changed("models/sensors/ati_net_can_oem.yaml")
        other = self.copies() / "models/sensors/other.yaml"
        text = (self.copies() / "models/sensors/ati_net_can_oem.yaml").read_text()
        other.write_text(re.sub(r"bias_counts: .*", "bias_counts: [5000, -2000, 420, 3000, -1507, 653]", text))
        arm = cell.with_name("arm.yaml")
        arm.write_text(cell.read_text().replace("ati_net_can_oem", "other"))
        zero = cell.with_name("default.yaml.zero")
        with_arm = ("--arm", arm)

        outcome, _ = self.session(steel.NOBODY, *with_arm, cell=cell, duration="0.5s")
        self.assertEqual(self.faults(outcome), ["force_at_start"])
        told = self.call("zero", cell, *with_arm)
        self.assertEqual(told.status, 0, told.err)
        self.assertIn(str(zero), told.out)
        for key in ("cell_sha256", "arm: simulated", "date", "force_S_N", "noise_N", "spread_N", "motor_rad"):
            self.assertIn(key, zero.read_text())
        outcome, _ = self.session(steel.NOBODY, *with_arm, cell=cell, duration="0.5s")
        self.assertEqual(self.faults(outcome), [])
        outcome, _ = self.session(steel.NOBODY, cell=cell, duration="0.5s")
        self.assertEqual(self.faults(outcome), ["force_at_start"], "the zero of another sensor")
        replayed = self.call("replay", "record")
        self.assertEqual(replayed.status, 0, replayed.out + replayed.err)

        cell.write_text(cell.read_text() + "\n")  # another cell, of which nothing is known
        outcome, _ = self.session(steel.NOBODY, cell=cell, duration="0.5s")
        self.assertEqual(self.faults(outcome), [])
        zero.write_text("force_S_N: [0, 0]\n")
        outcome = self.call("run", cell, "--no-plot", "--duration", "0.1s")
        self.assert_refused(outcome, "default.yaml.zero")

    def test_taring_alone_refuses_a_handle_that_moves_and_moves_nothing(self):
        cell = self.copies() / "models/cells/default.yaml"
        for drift in ("50N/s", "20N/s", "5N/s"):
            told = self.call("zero", cell, "--fault", f"sensor:drift={drift}")
            self.assertEqual(told.status, 1, told.out + told.err)
            self.assertIn("force_at_start", told.err)
            self.assertFalse(cell.with_name("default.yaml.zero").exists())

    def test_a_sign_or_an_offset_that_comes_within_the_tare_moves_nothing(self):
        """The story: the tare took half of it for the sensor's zero, and the rest led the arm off."""
        for fault in ("inverted@0.35s", "offset=1N@0.3s", "offset=3N@0.4s"):
            outcome, track = self.session(steel.NOBODY, "--fault", f"sensor:{fault}", duration="2s")
            self.assertEqual(self.faults(outcome), ["force_jumped"], fault)
            self.assertLess(self.way(track, 0), STILL_M, fault)

    def test_nobody_at_a_noisy_sensor_leads_nothing(self):
        """The story: 0.1 N of noise leave 7 mN of the tare unknown, which led the arm by 6 to 11 mm within 1.5 s."""
        noisy = self.copies() / "models/cells/noisy.yaml"
        text = re.sub("noise_N: .*", "noise_N: 0.1", (self.copies() / "models/cells/default.yaml").read_text())
        noisy.write_text(re.sub("noise_Nm: .*", "noise_Nm: 0.005", text))
        outcome, track = self.session(steel.NOBODY, cell=noisy, duration="10s")
        self.assertEqual(self.faults(outcome), [])
        self.assertLess(self.way(track, 0), 2e-3)

    def test_a_lean_too_weak_to_be_refused_leads_nothing_away_once_it_is_let_go(self):
        """The story: 0.3 to 3 N that stood at the handle while the sensor was tared led the empty arm by 1.2 to 1.8 m."""
        for newtons in (0.3, 0.5, 1.0, 3.0):
            with self.subTest(f"{newtons} N"):
                lean = self.force((0, (0, newtons, 0)), (2.0, (0, newtons, 0)), (2.2, (0, 0, 0)), (9, (0, 0, 0)))
                outcome, track = self.session(lean, duration="8s")
                gone = max(k for k, force in enumerate(track.hand_N) if math.hypot(*force) > 0)
                way = self.way(track, gone)
                print(f"{newtons} N in the tare: {1e3 * way:.1f} mm, {self.faults(outcome)}", flush=True)
                self.assertLess(way, 0.05)
                self.assertEqual(self.faults(outcome), ["sensor_drifts"])

    def test_a_hand_that_trembles_while_the_sensor_is_tared_makes_the_session_deaf_to_nothing(self):
        """The story: its motion was taken for the sensor's noise, and an offset of 10 N that jumped in led by 1.3 m."""
        trembles = LEADS_AND_LETS_GO + "multisine:\n  - {frequency_Hz: 8, amplitude_m: 0.001, direction: [0.6, 0, 0.8]}\n"
        for fault in ("offset=2N", "offset=5N", "offset=10N"):
            with self.subTest(fault):
                faults, after_s, off_m = self.jumped(trembles, fault, at_s=2.0)
                self.assertEqual(faults, ["force_jumped"])
                self.assertLess(after_s, 0.2)
                self.assertLess(off_m, 0.05)

    # ---- the tool's inertia

    def test_damping_never_lets_an_empty_handle_run_further(self):
        """The story: the tool that damping brakes reads as a hand; let go with 5 Ns/m the arm ran on by 172 mm, without
        by 25, and 245 mm with a tool of 1 kg and 10 Ns/m."""
        heavy = self.copies() / "models/cells/heavy.yaml"
        heavy.write_text((self.copies() / "models/cells/default.yaml").read_text().replace("mass_kg: 0.25", "mass_kg: 1", 1))
        push = self.force((0, (0, 0, 0)), (0.5, (0, 0, 0)), (0.6, (30, 0, 0)), (1.1, (30, 0, 0)), (1.101, (0, 0, 0)),
                          (9, (0, 0, 0)))
        for cell in ("models/cells/default.yaml", heavy):
            ways = {}
            for damping in ("0", "5", "10", "20"):
                _, track = self.session(push, "--mass", "10", "--damping", damping, cell=cell)
                pushed = [k for k, force in enumerate(track.hand_N) if math.hypot(*force) > 15]
                ways[damping] = self.way(track, pushed[-1] + 1)
                print(f"let go at {cell}, {damping} Ns/m: {1e3 * ways[damping]:.1f} mm", flush=True)
            for damping in ("5", "10", "20"):
                # 2 mm: what the steel lags behind the proxy by another speed.
                self.assertLess(ways[damping], ways["0"] + 2e-3, damping)

    # ---- jumps

    def jumped(self, hand, fault, *arguments, at_s=2.0):
        """Its faults, how long after the jump rendering ended, and how far the tool was led off."""
        _, without = self.session(hand, *arguments)
        outcome, track = self.session(hand, "--fault", f"sensor:{fault}@{at_s}s", *arguments)
        began = track.at(at_s - steel.BEFORE_FIRST_CYCLE_S - steel.SLACK_S)
        ended = track.leaves_rendering(began) or len(track.phase) - 1
        off = max(math.dist(a, b) for a, b in zip(track.place[began:ended], without.place[began:ended]))
        coasting = max(math.dist(place, track.place[ended]) for place in track.place[ended:])
        print(f"sensor:{fault}: {self.faults(outcome)} after {track.time_s[ended] - track.time_s[began]:.3f} s, "
              f"{1e3 * (off + coasting):.1f} mm", flush=True)
        return self.faults(outcome), track.time_s[ended] - track.time_s[began], off + coasting

    def test_a_sign_that_flips_or_an_offset_that_jumps_in_stops_the_arm_before_it_goes_anywhere(self):
        """The story: 386 mm and 202 N on a hand that held still, 177 mm by 100 N."""
        for name, hand in (("holds", HOLDS), ("leads", LEADS)):
            for fault in ("inverted", "offset=100N", "offset=-100N"):
                with self.subTest(f"{name}, {fault}"):
                    faults, after_s, off_m = self.jumped(hand, fault)
                    self.assertEqual(faults, ["force_jumped"])
                    self.assertLess(after_s, 0.2)
                    self.assertLess(off_m, 0.05)

    def test_a_sensor_that_is_turned_while_somebody_pulls_stops_the_arm(self):
        """The story: 474 mm. Half a turn about its axis swaps the sign of a pull, and leaves the tool's weight as it is."""
        pull = self.force((0, (0, 0, 0)), (1.0, (0, 0, 0)), (2.0, (20, 0, 0)), (9, (20, 0, 0)))
        faults, after_s, off_m = self.jumped(pull, "turned", "--mass", "20", at_s=1.9)
        self.assertEqual(faults, ["force_jumped"])
        self.assertLess(after_s, 0.2)
        self.assertLess(off_m, 0.05)

    def test_a_sign_that_flips_under_a_hand_that_also_moved_while_the_sensor_was_tared(self):
        """The story: in half of the moments the arm went 0.4 m, since the tare's mean wasn't the sensor's zero."""
        sweep = (harness.SOURCE / "sim/hands/sweep.yaml").read_text()
        for at_s in (1.5, 2.2, 2.5, 3.1, 4.0):
            with self.subTest(at_s):
                faults, after_s, off_m = self.jumped(sweep, "inverted", at_s=at_s)
                self.assertEqual(faults, ["force_jumped"])
                self.assertLess(after_s, 0.2)
                self.assertLess(off_m, 0.05)

    def test_an_offset_is_told_under_a_hand_that_goes_to_and_fro(self):
        """The story: at 0.3 to 0.4 m/s the force changes by 0.5 N from sample to sample, which hid one of 3 N: 1.2 m."""
        for speed in (0.3, 0.4):
            legs = "".join(f"  - {{time_s: {0.5 + (k + 1) * 0.15 / speed:.4g}, offset_m: [0, {0.15 * (1 - k % 2)}, 0]}}\n"
                           for k in range(6))
            hand = LEADS_AND_LETS_GO.split("  - {time_s: 2.0")[0] + legs
            for quarter in (0.25, 0.5, 0.75):
                at_s = round(steel.BEFORE_FIRST_CYCLE_S + 0.5 + (2 + quarter) * 0.15 / speed, 3)
                with self.subTest(f"{speed} m/s, {quarter}"):
                    faults, _, off_m = self.jumped(hand, "offset=3N", at_s=at_s)
                    self.assertEqual(faults, ["force_jumped"])
                    self.assertLess(off_m, 0.05)

    def test_an_offset_that_came_while_a_hand_led_doesnt_lead_the_handle_that_is_let_go(self):
        """The story: 2 N that jumped in while a hand led drove the arm off by 0.6 m when it let go, without a fault."""
        for offset in ("1N", "2N", "5N"):
            with self.subTest(offset):
                faults, _, off_m = self.jumped(LEADS_AND_LETS_GO, f"offset={offset}", at_s=1.3)
                self.assertEqual(faults, ["force_jumped"])
                self.assertLess(off_m, 0.05)

    def test_a_blow_that_is_over_at_once_is_no_jump(self):
        for newtons in (30, 150):
            blow = self.force((0, (0, 0, 0)), (1.0, (0, 0, 0)), (1.001, (newtons, 0, 0)), (1.003, (newtons / 3, 0, 0)),
                              (1.006, (0, 0, 0)), (9, (0, 0, 0)))
            outcome, _ = self.session(blow, "--handle", "held", duration="2s")
            self.assertEqual(self.faults(outcome), [], newtons)

    def test_an_offset_that_nobody_saw_come_leads_no_handle_that_was_let_go_in_motion(self):
        """The story: at the tool's speed limit no force accelerates it, so one of 4 N led on for as long as the session."""
        shakes = LEADS_AND_LETS_GO + "multisine:\n  - {frequency_Hz: 90, amplitude_m: 0.0002, direction: [0.6, 0, 0.8]}\n"
        outcome, track = self.session(shakes, "--fault", "sensor:offset=4N@1.3s", duration="8s")
        way = self.way(track, track.at(4.0))
        print(f"let go with an offset: {1e3 * way:.1f} mm, {self.faults(outcome)}", flush=True)
        self.assertLess(way, 0.1)

    def test_a_torque_device_whose_tool_is_lighter_than_its_cell_says_stays_where_it_is_let_go(self):
        """The story: 40 g that aren't there read as 0.2 N once the tool has turned, and lifted it by 0.7 m."""
        cell = harness.SOURCE / "models/cells/light.yaml"
        text = cell.read_text().replace("../", f"{harness.SOURCE / 'models'}/")
        for mass_kg in (0.01, 0.02, 0.09):
            arm = self.written("arm.yaml", text.replace("mass_kg: 0.05", f"mass_kg: {mass_kg}", 1))
            hand = ("name: leads, lets go\nmass_kg: 0.05\nstiffness_N_per_m: 300\ndamping_Ns_per_m: 10\nwaypoints:\n"
                    "  - {time_s: 0.5, offset_m: [0, 0, 0]}\n  - {time_s: 2, offset_m: [0.1, 0.1, 0.1]}\n"
                    "grips:\n  - {time_s: 3.2, stiffness_N_per_m: 0, damping_Ns_per_m: 0}\n")
            outcome, track = self.session(hand, "--arm", arm, cell=cell, duration="8s")
            self.assertEqual(self.faults(outcome), [], mass_kg)
            self.assertLess(self.way(track, track.at(3.2)), 0.05, mass_kg)

    # ---- loads

    def test_a_constant_force_moves_the_mass_that_is_felt(self):
        """The story: a weight over a pulley, an engineer's first test of 4 kg, was taken for nobody: -29 to -48 mm of +80.

        F t²/2M of the proxy, to 2 % and 0.02 mm: a sample of the force more or less at both ends."""
        cases = [(0.5, 1.0, 2), (0.5, 2.0, 4), (1, 1.0, 4), (2, 0.4, 4), (2, 1.0, 10), (5, 0.2, 4), (10, 0.2, 4),
                 (10, 0.5, 20), (20, 0.1, 10), (50, 0.1, 20), (50, 0.1, 10), (0.5, 2.0, 20)]
        for newtons, seconds, mass_kg in cases:
            with self.subTest(f"{newtons} N for {seconds} s, {mass_kg} kg"):
                began_s = 0.9
                load = self.force((0, (0, 0, 0)), (began_s - 1e-4, (0, 0, 0)), (began_s, (newtons, 0, 0)),
                                  (began_s + seconds, (newtons, 0, 0)), (began_s + seconds + 1e-4, (0, 0, 0)), (9, (0, 0, 0)))
                outcome, track = self.session(load, "--mass", mass_kg, duration=f"{began_s + seconds + 0.5}s")
                self.assertEqual(self.faults(outcome), [])
                went = self.proxy_way(newtons / 2)
                expected = newtons * seconds**2 / 2 / mass_kg
                print(f"{newtons} N for {seconds} s, {mass_kg} kg: {1e3 * went:.2f} of {1e3 * expected:.2f} mm", flush=True)
                self.assertLess(abs(went - expected), 0.02 * expected + 2e-5)

    def proxy_way(self, least_N):
        """How far the proxy went while the sensor read more than this along x, samples' delays apart."""
        with open(self.folder / "record/signals.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        under = [row["phase"] == "rendering" and float(row["force_W_x_N"]) > least_N for row in rows]
        first = under.index(True)
        last = under.index(False, first) - 1
        return float(rows[last]["proxy_W_x_m"]) - float(rows[first - 1]["proxy_W_x_m"])

    def test_what_is_taken_for_drift_is_said_at_once_and_can_be_settled(self):
        """Along the line from the sensor to the handle a load and an offset read alike."""
        load = self.force((0, (0, 0, 0)), (0.9, (0, 0, 0)), (0.9001, (0, 0, -2)), (1.9, (0, 0, -2)), (1.9001, (0, 0, 0)),
                          (9, (0, 0, 0)))
        outcome, _ = self.session(load, duration="2s")
        self.assertRegex(outcome.err, r"nobody at the handle from 1\.\d+ s on, it is taken: [12](\.\d)? N .*--handle held")
        outcome, _ = self.session(load, "--handle", "held", duration="2.5s")
        self.assertEqual((self.faults(outcome), outcome.summary["hands_off_s"]), ([], 0))
        self.assertNotIn("nobody at the handle", outcome.err)
        replayed = self.call("replay", "record")
        self.assertEqual(replayed.status, 0, replayed.out + replayed.err)


if __name__ == "__main__":
    unittest.main()
