#!/usr/bin/python3
"""A handle that nobody holds comes to rest and stays, by the record alone.

The story: let go at 0.45 m/s, the arm coasted on for as long as there was room; never touched, it drifted by 0.83 m in a
minute, because the sensor's bias is known to some millinewtons only.

Judged by true_tool_W and hand_force_W of signals.csv: the simulated steel and the hand's force on it, which the
controller never sees.
"""
import cmath
import math
import unittest

import harness
import steel
from steel import NOBODY

# A hand without a mass of its own, so that nothing of it stays at the handle.
LETS_GO = """name: lets go at speed
mass_kg: 0
stiffness_N_per_m: 500
damping_Ns_per_m: 20
grips:
  - {time_s: 1.2, stiffness_N_per_m: 0, damping_Ns_per_m: 0}
waypoints:
  - {time_s: 0.5, offset_m: [0, 0, 0]}
  - {time_s: 2.0, offset_m: [0, 0.36, 0]}
"""
# Led for two seconds, held still for three, led on.
PAUSES = """name: pauses
mass_kg: 1
stiffness_N_per_m: 500
damping_Ns_per_m: 20
waypoints:
  - {time_s: 0.5, offset_m: [0, 0, 0]}
  - {time_s: 2.0, offset_m: [0, 0.1, 0]}
  - {time_s: 5.0, offset_m: [0, 0.1, 0]}
  - {time_s: 6.5, offset_m: [0, 0.2, 0]}
"""
# Led away from where it started, and let go there.
LETS_GO_AWAY = """name: lets go away from the start
mass_kg: 0
stiffness_N_per_m: 500
damping_Ns_per_m: 20
grips:
  - {time_s: 2.5, stiffness_N_per_m: 0, damping_Ns_per_m: 0}
waypoints:
  - {time_s: 0.5, offset_m: [0, 0, 0]}
  - {time_s: 2.0, offset_m: [0, 0.15, 0]}
"""


class Track(steel.Track):
    def take(self, column, rows):
        super().take(column, rows)
        self.hands_off = ["hands_off" in row[column["flags"]].split("|") for row in rows]
        self.hand_N = steel.vectors(column, rows, "hand_force_W", "N")

    def speed(self, k):
        """Over 10 ms."""
        return math.dist(self.place[k], self.place[k - 10]) / (self.time_s[k] - self.time_s[k - 10])


def felt_mass_kg(track, frequency_Hz, samples):
    """F/a in x over the last so many cycles of a millisecond."""
    turn = -2j * math.pi * frequency_Hz * 1e-3
    force = sum(f[0] * cmath.exp(turn * k) for k, f in enumerate(track.hand_N[-samples:]))
    place = sum(x[0] * cmath.exp(turn * k) for k, x in enumerate(track.place[-samples:]))
    return force / (-(2 * math.pi * frequency_Hz) ** 2 * place)


class LetGo(harness.ProgramTest):
    def session(self, hand, *arguments, let_go=None, scene="free"):
        cell = self.copies() / "models/cells/default.yaml"
        chosen = f"supervision: {{let_go: {let_go}}}\n" if let_go else ""
        cell.write_text((harness.SOURCE / "models/cells/default.yaml").read_text() + chosen)
        outcome = self.call("run", cell, "--scene", harness.SOURCE / f"scenes/{scene}.yaml", "--hand",
                            self.written("hand.yaml", hand), "--force-unstable", "--no-plot", "--record", "record",
                            "--json", *arguments)
        return outcome.summary, Track(self.folder / "record")

    def test_an_arm_that_nobody_touches_stays_where_it_is(self):
        for drift in ((), ("--fault", "sensor:drift=0.005N/s@3s")):
            with self.subTest(drift):
                summary, track = self.session(NOBODY, "--duration", "60s", *drift)
                self.assertEqual(summary["faults"], [])
                went = max(math.dist(place, track.place[track.began]) for place in track.place[track.began:])
                print(f"nobody for a minute {drift}: {1e3 * went:.2f} mm")
                # Before it is known to be empty: 1.5 s with the bias, a few millinewtons on 4 kg.
                self.assertLess(went, 5e-3)
                self.assertGreater(summary["hands_off_s"], 57)

    def test_an_arm_that_stands_beside_its_guide_does_not_begin_by_itself(self):
        """The story: the start lies 21 um off the guide, since counts and gears are rounded; the first step went there in
        a millisecond, and with that speed on along the guide, 23 mm far, until the handle was known to be empty."""
        for scene in ("guide", "groove", "wall"):
            with self.subTest(scene):
                summary, track = self.session(NOBODY, "--duration", "6s", scene=scene)
                self.assertEqual(summary["faults"], [])
                ways = [math.dist(place, track.place[track.began]) for place in track.place[track.began:]]
                fastest = max(track.speed(k) for k in range(track.began + 10, len(track.place)))
                print(f"nobody, {scene}: at most {1e3 * fastest:.1f} mm/s, {1e3 * max(ways):.1f} mm")
                # What the sensor's bias makes of 4 kg before that is known: a few millinewtons for 1.5 s.
                self.assertLess(fastest, 3e-3)
                self.assertLess(max(ways), 5e-3)

    def test_a_spring_still_pulls_to_the_start_after_a_timestep_change_and_a_hold(self):
        """The story: it then pulled to where the arm happened to stand, 0.135 m away, for good."""
        changes = (("--set", "timestep=2ms@6s"), ("--do", "hold@6s", "--do", "resume@7s"))
        for change in changes:
            with self.subTest(change):
                summary, track = self.session(LETS_GO_AWAY, "--duration", "16s", "--set", "spring=500@4s", *change)
                self.assertEqual(summary["faults"], [])
                left = math.dist(track.place[-1], track.place[track.began])
                fastest = max(track.speed(k) for k in range(track.at(5.5), len(track.place)))
                print(f"a spring after {change[1]}: at most {fastest:.3f} m/s, {1e3 * left:.1f} mm left")
                self.assertLess(left, 1e-3)
                self.assertLess(fastest, 0.1)  # twice the speed of its anchor

    def test_a_spring_that_becomes_stiffer_far_from_its_place_throws_nobody(self):
        """The story: set to 2000 N/m 0.15 m from where it pulls to, the spring pulled with 300 N at once: 0.52 m/s."""
        for spring in ("2000", "20"):
            with self.subTest(spring):
                summary, track = self.session(LETS_GO_AWAY, "--duration", "9s", "--set", f"spring={spring}@4s")
                self.assertEqual(summary["faults"], [])
                changed = track.began + 3900
                fastest = max(track.speed(k) for k in range(changed, len(track.place)))
                left = math.dist(track.place[-1], track.place[track.began])
                print(f"a spring of {spring} N/m far from its place: at most {fastest:.3f} m/s, {1e3 * left:.1f} mm left")
                # Twice the speed of its anchor.
                self.assertLess(fastest, 0.1)
                self.assertLess(left, 1e-3 if spring == "2000" else 0.05)
        outcome = self.call("replay", "record")
        self.assertEqual(outcome.status, 0, outcome.out + outcome.err)

    def test_let_go_at_speed_it_stops_within_a_decimetre(self):
        summary, track = self.session(LETS_GO, "--duration", "4s")
        self.assertEqual(summary["faults"], [])
        gone = next(k for k in range(track.began + 1000, len(track.place)) if math.hypot(*track.hand_N[k]) == 0.0)
        self.assertGreater(track.speed(gone), 0.4)
        self.assertLess(math.dist(track.place[-1], track.place[gone]), 0.1)
        self.assertLess(track.speed(len(track.place) - 1), 1e-4)
        # It never gets faster on the way, but for what the gears swing.
        self.assertLess(max(track.speed(k) for k in range(gone, len(track.place))), track.speed(gone) + 0.01)
        print(f"let go at {track.speed(gone):.3f} m/s: {1e3 * math.dist(track.place[-1], track.place[gone]):.0f} mm")

    def test_a_cell_may_choose_that_it_coasts_or_is_held(self):
        _, track = self.session(LETS_GO, "--duration", "1.6s", let_go="coast")
        self.assertGreater(track.speed(len(track.phase) - 200), 0.4)
        self.assertFalse(any(track.hands_off))
        _, track = self.session(LETS_GO, "--duration", "2s", let_go="hold")
        self.assertIn("holding", track.phase)
        held = track.phase.index("holding")
        self.assertLess(math.dist(track.place[-1], track.place[held]), 0.1)
        outcome = self.call("check", self.changed("models/cells/default.yaml", ("let_go: hold", "let_go: fly")))
        self.assertNotEqual(outcome.status, 0)
        self.assertIn("rest", outcome.out + outcome.err)

    def test_a_hand_that_rests_and_goes_on_loses_nothing(self):
        """Beside a session in which the proxy may coast: the same way, to a millimetre."""
        _, without = self.session(PAUSES, "--duration", "7s", let_go="coast")
        summary, track = self.session(PAUSES, "--duration", "7s")
        # 1.5 s after it rests, and until it begins again.
        self.assertGreater(summary["hands_off_s"], 0.2)
        self.assertLess(summary["hands_off_s"], 2)
        apart = max(map(math.dist, track.place, without.place))
        most_N = max(math.hypot(*force) for force in track.hand_N[track.began:])
        most_without_N = max(math.hypot(*force) for force in without.hand_N[without.began:])
        print(f"a pause: {1e3 * apart:.3f} mm apart, the hand's force {most_N:.2f} N, {most_without_N:.2f} N without")
        self.assertLess(apart, 1e-3)
        self.assertLess(abs(most_N - most_without_N), 0.1)

    def test_a_hand_that_never_stops_feels_the_mass_as_if_the_proxy_might_coast(self):
        """The story: the hand shook the handle during the tare, what the sensor read there was taken for its noise, and
        from then on the hand for none, 34 times in 40 s: 4 kg felt like 28 at 0.1 Hz, and 54 % off at 0.5 Hz.

        F/a of the hand's force and the steel, by Fourier over ten seconds, in which each frequency has whole periods."""
        frequencies_Hz = (0.3, 0.5, 0.8, 1.2, 2, 3, 5, 8)
        sines = "".join(f"  - {{frequency_Hz: {f}, amplitude_m: {min(0.012, 0.05 / (2 * math.pi * f)):.6f}, "
                        f"phase_rad: {math.pi * (i % 2)}, direction: [1, 0, 0]}}\n"
                        for i, f in enumerate(frequencies_Hz))
        hand = ("name: multisine\nmass_kg: 1\nstiffness_N_per_m: 500\ndamping_Ns_per_m: 20\nwaypoints:\n"
                "  - {time_s: 0, offset_m: [0, 0, 0]}\nmultisine:\n" + sines)
        felt = {}
        for let_go in ("coast", "rest"):
            _, track = self.session(hand, "--duration", "14s", let_go=let_go)
            felt[let_go] = [felt_mass_kg(track, f, 10_000) for f in frequencies_Hz]
        for f, coasting, resting in zip(frequencies_Hz, felt["coast"], felt["rest"]):
            print(f"{f} Hz: felt mass {resting:.3f} kg, {coasting:.3f} kg where the proxy may coast")
            self.assertLess(abs(resting - coasting), 0.05 * 4, f"{f} Hz")

    def test_no_bias_leads_an_arm_that_nobody_holds_further_than_five_centimetres(self):
        """The story: half a newton that came 0.6 s after the start, before the handle was known to be empty, led the arm
        1.7 m far; so did one that came in a hold, jumps of 0.2 N, and ramps of 0.08 to 0.2 N/s from power on."""
        held = ("--do", "hold@3s", "--do", "resume@5s")
        biases = [(f"offset={force}@{at}s", ()) for force in ("0.2N", "0.3N", "0.4N", "0.5N", "1N", "5N")
                  for at in (0.8, 1.0, 5.0)]
        biases += [(f"drift={rate}N/s", ()) for rate in (0.05, 0.08, 0.1, 0.12, 0.15, 0.2, 0.3)]
        biases += [("offset=0.4N@4s", held), ("offset=0.5N@5.5s", held), ("drift=0.1N/s@5s", held)]
        biases += [("offset=0.3N@3s..6s", ()), ("offset=0.5N@0.8s", ("--mass", "20")),
                   ("offset=0.5N@0.8s", ("--mass", "2"))]
        for bias, arguments in biases:
            with self.subTest(f"{bias} {arguments}"):
                summary, track = self.session(NOBODY, "--duration", "15s", "--fault", f"sensor:{bias}", *arguments)
                went = max(math.dist(place, track.place[track.began]) for place in track.place[track.began:])
                faults = [fault["fault"] for fault in summary["faults"]]
                print(f"nobody, sensor:{bias} {arguments}: {1e3 * went:.1f} mm {faults}")
                self.assertLess(went, 0.05)
                self.assertLessEqual(set(faults), {"sensor_drifts", "force_jumped"})
                if not faults:
                    self.assertLess(track.speed(len(track.place) - 1), 1e-3)

    def test_what_it_did_is_replayed_to_the_bit(self):
        self.session(LETS_GO, "--duration", "4s")
        outcome = self.call("replay", "record")
        self.assertEqual(outcome.status, 0, outcome.out + outcome.err)


if __name__ == "__main__":
    unittest.main()
