#!/usr/bin/python3
"""Drives that go where nobody sent them, and encoders that lie: what the steel does, by the record alone.

The story: setpoints waited for a drive that didn't follow by going to where it said that it was. An encoder that said
5 mrad too much drove an arm that nobody touched by 1.05 m at 0.6 m/s, without a fault; a drive that was too weak let it
fall by 0.9 m at 2.3 m/s; one that ran off at 0.5 rad/s was chased. Jams and drives that heeded nothing were waited for
without end.

Judged by the columns true_tool_W of signals.csv: the simulated steel, which the controller never sees. What a deviation
does is told by another session with the same hand and no deviation.
"""
import math
import re
import unittest

import harness
import tool_motion
from steel import BEFORE_FIRST_CYCLE_S, NOBODY, SLACK_S, Track

FAULT_S = 1.9  # from power on
# What the deviation may last, and how far the tool may go by it.
MOST_S, MOST_M = 0.2, 0.05
# An empty handle drifts by the sensor's bias and noise: 0.5 mm/s here.
DRIFT_M = 0.005
# What shows, as against a session without it.
SHOWS_M = 1e-3
# For as long a joint may be behind, also where the hand makes its setpoint swing about it.
BLOCKED_S = 0.5

# To all sides, so that every joint has to move.
SOMEBODY = """name: somebody
mass_kg: 1.0
stiffness_N_per_m: 500
damping_Ns_per_m: 20
waypoints:
  - {time_s: 0.4, offset_m: [0, 0, 0]}
  - {time_s: 2.6, offset_m: [0.16, 0.12, -0.1]}
"""

DEVIATES = {"drive_deviates", "position_implausible"}

# Of an arm that isn't what its cell says: deviations from the start, which no encoder shows by itself.
FOUND_M = 0.1  # a lie of the sensor, or of a sign, may lead it so far


def start_counts(text, axis, edit):
    """A figure of one drive changed, and its zero with it, so that the arm stands where the controller takes it to be:
    as where it was calibrated at its start pose."""
    head, *drives = text.split("  - joint: ")
    starts = [float(x) for x in re.search(r"start_rad: \[(.*?)\]", text).group(1).split(",")]
    figure = {key: float(re.search(rf"{key}: (-?[\d.]+)", drives[axis - 1]).group(1))
              for key in ("counts_per_motor_revolution", "gear_ratio", "direction", "offset_counts")}

    def counts(f):
        return f["direction"] * f["counts_per_motor_revolution"] * f["gear_ratio"] / (2 * math.pi) * starts[axis - 1]

    changed = {**figure, **edit(figure)}
    changed["offset_counts"] += round(counts(figure) - counts(changed))
    for key, value in changed.items():
        drives[axis - 1], n = re.subn(rf"{key}: -?[\d.]+", f"{key}: {value:.10g}", drives[axis - 1], count=1)
        assert n == 1, key
    return "  - joint: ".join([head, *drives])


class Deviations(harness.ProgramTest):
    references = {}  # by the hand: sessions in which nothing deviates

    def session(self, hand, *arguments):
        cell = self.changed("models/cells/default.yaml")
        if "hold_s" not in cell.read_text():
            cell.write_text(cell.read_text() + "supervision: {hold_s: 0.2}\n")
        # For a hand that holds nothing no mass is said to be stable.
        outcome = self.call("run", cell, "--scene", harness.SOURCE / "scenes/free.yaml", "--hand",
                            self.written(f"{hand}.yaml", {"nobody": NOBODY, "somebody": SOMEBODY}[hand]), "--duration",
                            "2.6s", "--force-unstable", "--no-plot", "--record", "record", "--json", *arguments)
        return outcome.summary, Track(self.folder / "record")

    def reference(self, hand):
        if hand not in self.references:
            summary, track = self.session(hand)
            self.assertEqual(summary["faults"], [])
            self.references[hand] = track
        return self.references[hand]

    def judged(self, hand, fault):
        """A session with this fault: what ended it, how long after the fault and after it showed, how far off the steel
        went until it came to rest, and how far it went in all."""
        reference = self.reference(hand)
        summary, track = self.session(hand, "--fault", f"{fault}@{FAULT_S}s")
        began = track.at(FAULT_S - BEFORE_FIRST_CYCLE_S - SLACK_S)
        ended = track.leaves_rendering(began)
        until = min(ended, len(reference.place))
        apart = [math.dist(track.place[k], reference.place[k]) for k in range(began, until)]
        shown = next((began + i for i, m in enumerate(apart) if m > SHOWS_M), ended)
        off = max(apart)
        coasting = max(math.dist(place, track.place[ended]) for place in track.place[ended:])
        names = {f["fault"] for f in summary["faults"]} | {n["fault"] for n in summary["notices"]}
        after = track.time_s[ended] - track.time_s[began]
        went = max(math.dist(place, track.place[began]) for place in track.place[began:])
        print(f"{fault:22s} {hand:8s} {', '.join(sorted(names)) or 'nothing':22s} {1e3 * after:5.0f} ms, "
              f"{1e3 * (off + coasting):5.1f} mm off, {1e3 * went:5.1f} mm in all")
        return names, after, track.time_s[ended] - track.time_s[shown], off + coasting, went

    def test_a_drive_or_an_encoder_that_deviates_is_stopped_at_once(self):
        for fault in ("axis_1:runaway=0.1", "axis_2:runaway=0.5", "axis_2:runaway=-0.5", "axis_3:runaway=1",
                      "axis_5:runaway=0.5", "axis_2:offset=1.5mrad", "axis_2:offset=5mrad", "axis_3:offset=-5mrad",
                      "axis_1:offset=20mrad", "axis_2:offset=100mrad", "axis_2:weak=100Nm", "axis_3:weak=20Nm"):
            for hand in ("nobody", "somebody"):
                with self.subTest(f"{fault}, {hand}"):
                    names, after, _, off, _ = self.judged(hand, fault)
                    self.assertTrue(names and names <= DEVIATES, names)
                    self.assertLessEqual(after, MOST_S + SLACK_S)
                    self.assertLessEqual(off, MOST_M)

    def test_one_that_can_not_carry_or_turns_the_wrong_way_is_stopped_when_it_shows(self):
        """The hand moves it, or nothing does: then there is nothing to stop."""
        for fault in ("axis_1:reversed", "axis_2:reversed", "axis_3:reversed", "axis_2:weak=150Nm"):
            with self.subTest(f"{fault}, somebody"):
                names, _, after, off, _ = self.judged("somebody", fault)
                self.assertEqual(names, {"drive_deviates"})
                self.assertLessEqual(after, MOST_S)
                self.assertLessEqual(off, MOST_M)
            with self.subTest(f"{fault}, nobody"):
                self.assertLessEqual(self.judged("nobody", fault)[-1], 2 * DRIFT_M)

    def test_one_that_does_not_come_is_held_after_half_a_second(self):
        for fault in ("axis_1:jammed", "axis_2:jammed", "axis_2:ignored", "axis_3:ignored", "axis_1:stuck",
                      "axis_3:stuck"):
            with self.subTest(f"{fault}, somebody"):
                names, after, _, _, went = self.judged("somebody", fault)
                # A drive that stops dead at speed goes back by more than it may.
                self.assertEqual(names, {"drive_deviates" if fault == "axis_2:ignored" else "drive_blocked"})
                self.assertLessEqual(after, BLOCKED_S + 0.1)
                # All that the tool goes from the fault on, where the hand would have led it by 0.1 m.
                self.assertLessEqual(went, MOST_M)
            with self.subTest(f"{fault}, nobody"):
                names, _, _, _, went = self.judged("nobody", fault)
                self.assertLessEqual(names, {"drive_blocked"})
                self.assertLessEqual(went, DRIFT_M)

    def other_arm(self, axis=None, edit=None, longer_link=None):
        """The cell of an arm beside which the default cell is wrong."""
        cell = self.changed("models/cells/default.yaml")
        text = cell.read_text()
        if edit:
            text = start_counts(text, axis, edit)
        if longer_link:
            urdf = cell.parent.parent / "arms/arm150.urdf"
            joint = re.compile(rf'(<joint name="{longer_link}".*?<origin xyz=")([^"]*)(")', re.DOTALL)
            longer, n = joint.subn(lambda m: m[1] + " ".join(f"{1.05 * float(x):.6g}" for x in m[2].split()) + m[3],
                                   urdf.read_text())
            self.assertEqual(n, 1)
            (urdf.parent / "longer.urdf").write_text(longer)
            text = text.replace("arm150.urdf", "longer.urdf")
        other = cell.parent / "other.yaml"
        other.write_text(text)
        return other

    def lie(self, what, hand, arm):
        """A session with another arm than the controller takes it for: what ended it, how far the steel went off a
        session in which it is as it says (or, with nobody there, in all), and for how long."""
        reference = self.reference(hand)
        summary, track = self.session(hand, "--arm", arm)
        began = track.began
        ended = track.leaves_rendering(began)
        origin = [a - b for a, b in zip(track.place[began], reference.place[reference.began])]
        shift = reference.began - began
        off = max((math.dist(track.place[k], [a + b for a, b in zip(reference.place[k + shift], origin)])
                   for k in range(began, min(ended, len(reference.place) - shift))), default=0.0)
        coasting = max(math.dist(place, track.place[ended]) for place in track.place[ended:])
        went = max(math.dist(place, track.place[began]) for place in track.place[began:])
        names = {f["fault"] for f in summary["faults"]} | {n["fault"] for n in summary["notices"]}
        seconds = track.time_s[ended] - track.time_s[began]
        print(f"{what:22s} {hand:8s} {', '.join(sorted(names)) or 'nothing':22s} {1e3 * seconds:5.0f} ms, "
              f"{1e3 * (off + coasting):5.1f} mm off, {1e3 * went:5.1f} mm in all")
        return names, off + coasting, went

    def test_an_arm_that_is_not_as_its_cell_says_is_stopped_or_hardly_goes_astray(self):
        """A joint that turns the other way shows by what the hand's force does; a gear or a link that is another one
        only makes the hand lead another mass."""
        def reverse(figure):
            return {"direction": -figure["direction"]}

        def geared(by):
            return lambda figure: {"gear_ratio": by * figure["gear_ratio"]}

        rows = [(f"axis_{i} turns the other way", {"axis": i, "edit": reverse}) for i in (1, 2, 3, 5)]
        rows += [(f"axis_{i} gear x {by:g}", {"axis": i, "edit": geared(by)}) for by in (2, 0.5) for i in (1, 2, 3)]
        rows += [(f"{link} 5 % longer", {"longer_link": link}) for link in ("axis_3", "axis_4")]
        for what, arm in rows:
            with self.subTest(f"{what}, somebody"):
                names, off, _ = self.lie(what, "somebody", self.other_arm(**arm))
                # Axis 5 turns the tool more than it moves it.
                shows = "other way" in what and "axis_5" not in what
                self.assertEqual(names, {"force_reversed"} if shows else set())
                self.assertLessEqual(off, FOUND_M)
            with self.subTest(f"{what}, nobody"):
                names, _, went = self.lie(what, "nobody", self.other_arm(**arm))
                self.assertEqual(names, set())
                self.assertLessEqual(went, DRIFT_M)

    def test_an_arm_that_is_wired_otherwise_is_refused(self):
        cell, other = (harness.SOURCE / f"models/cells/{name}.yaml" for name in ("default", "bench"))
        self.assert_refused(self.call("run", cell, "--arm", other, "--no-plot"), "--arm", "other buses or joints")
        self.assert_refused(self.call("run", cell, "--arm", other, "--bus", "vcan0"), "--arm", "isn't simulated")

    def test_a_joint_that_comes_free_goes_on_without_a_snap(self):
        reference = self.reference("somebody")
        summary, track = self.session("somebody", "--fault", "axis_2:jammed@1.9s..2.2s")
        self.assertEqual(summary["faults"], [])
        began = track.at(1.6)
        fastest = max(math.dist(a, b) / 1e-3 for a, b in zip(track.place[began:], track.place[began + 1:]))
        self.assertLess(fastest, 0.5)
        last = track.leaves_rendering(began) - 1
        self.assertLess(math.dist(track.place[last], reference.place[last]), 0.01)

    def test_each_drive_is_told_what_it_may_be_off_and_for_how_long(self):
        """6065h and 6066h, written and read back by SDO, in counts and milliseconds."""
        self.session("nobody")
        log = (self.folder / "record" / "frames.log").read_text()
        cell = tool_motion.Cell(harness.SOURCE / "models/cells/default.yaml")
        for axis, drive in enumerate(cell.drives):
            speed, acceleration = float(drive["max_speed_rad_per_s"]), float(drive["max_acceleration_rad_per_s2"])
            window_rad = 5 * 1e-3 + speed / (2 * math.pi * float(drive["position_bandwidth_Hz"]))
            counts = (window_rad * float(drive["counts_per_motor_revolution"]) * float(drive["gear_ratio"])
                      / (2 * math.pi))
            node = int(drive["node"])
            milliseconds = math.ceil(1e3 * (2.5 * speed / acceleration + 0.02))
            # To a count, which is how far rounding goes.
            for request, answer, wanted in (("23656000", "43656000", counts), ("2B666000", "4B666000", milliseconds)):
                for identifier, start in ((0x600 + node, request), (0x580 + node, answer)):
                    told = re.findall(f" {identifier:03X}#{start}([0-9A-F]+)\n", log)
                    self.assertEqual(len(told), 1, drive["joint"])
                    value = int.from_bytes(bytes.fromhex(told[0]), "little")
                    self.assertLessEqual(abs(value - wanted), 1, drive["joint"])

    def test_a_drive_that_finds_it_first_is_believed(self):
        summary, _ = self.session("nobody", "--fault", "axis_3:fault=0x8611@1.9s")
        self.assertEqual([f["fault"] for f in summary["faults"]], ["drive_fault"])

    def test_what_a_deviation_did_is_replayed_to_the_bit(self):
        for fault in ("axis_3:offset=1.5mrad", "axis_3:jammed"):
            self.session("somebody", "--fault", f"{fault}@{FAULT_S}s")
            outcome = self.call("replay", "record")
            self.assertEqual(outcome.status, 0, outcome.out + outcome.err)


if __name__ == "__main__":
    unittest.main()
