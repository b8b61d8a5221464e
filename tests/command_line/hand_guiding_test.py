#!/usr/bin/python3
"""`profile: hand_guiding`: what a cell must say, the switch with three positions, monitored standstill."""
import re
import unittest

from harness import ProgramTest

SWITCH = "enabling_input: {drive: axis_6, bit: 16, three_position: {panic_bit: 17}}\n"
LIMITS = """limits:
  max_tool_speed_m_per_s: 0.25
  max_tool_acceleration_m_per_s2: 10
  max_force_N: 150
  workspace_m: {min: [0.4, -0.5, 0.3], max: [1.2, 0.5, 1.0]}
"""
MESSAGE = "enabling_input: {bus: sensor, identifier: 0x1A0, byte: 1, bit: 7, three_position: {panic_bit: 0, panic_is: 0}}\n"


class HandGuiding(ProgramTest):
    def cell(self, switch=SWITCH, limits=LIMITS, profile="profile: hand_guiding\n", name="guided.yaml"):
        shipped = self.copies() / "models/cells/default.yaml"
        text = re.sub(r"limits:\n(  .*\n)+", "", shipped.read_text())
        file = shipped.parent / name
        file.write_text(text + "\n" + profile + switch + limits)
        return file

    def session(self, *arguments, cell=None, status=0):
        outcome = self.call("run", cell or self.cell(), "--json", "--no-plot", *arguments)
        self.assertEqual(outcome.status, status, outcome.err + outcome.out)
        return outcome.summary

    def times_of(self, record, phase):
        rows = (record / "signals.csv").read_text().splitlines()
        names = rows[0].split(",")
        time, at = names.index("time_s"), names.index("phase")
        return [float(row.split(",")[time]) for row in rows[1:] if row.split(",")[at] == phase]

    def test_a_cell_that_keeps_to_the_profile_runs(self):
        summary = self.session("--duration", "3s")
        self.assertEqual(summary["faults"], [])
        self.assertEqual(self.call("check", self.cell()).status, 0)

    def test_every_speed_of_the_tool_stays_below_a_quarter_metre_a_second(self):
        record = self.folder / "record"
        self.session("--scene", "scenes/free.yaml", "--hand", "sim/hands/sweep.yaml", "--duration", "6s", "--mass", "4",
                     "--record", record)
        rows = [row.split(",") for row in (record / "signals.csv").read_text().splitlines()]
        columns = [rows[0].index(f"true_tool_W_{x}_m") for x in "xyz"]
        places = [[float(row[c]) for c in columns] for row in rows[1:]]
        # Over 20 ms, as the monitor of the tool looks at it.
        fastest = max(sum((a - b) ** 2 for a, b in zip(p, q)) ** 0.5 for p, q in zip(places, places[20:])) / 0.02
        self.assertLessEqual(fastest, 0.25)
        self.assertGreater(fastest, 0.1, "the tool was to move")

    def test_what_the_profile_asks_for_must_be_there(self):
        for change, words in (
                (dict(limits=LIMITS.replace("0.25", "0.26")), ("max_tool_speed_m_per_s", "0.26", "at most 0.25")),
                (dict(limits=LIMITS.replace("  max_tool_speed_m_per_s: 0.25\n", "")), ("max_tool_speed_m_per_s",)),
                (dict(limits=LIMITS + "  max_elbow_speed_m_per_s: 0.3\n"), ("max_elbow_speed_m_per_s", "at most 0.25")),
                (dict(limits=LIMITS.replace("s2: 10", "s2: 10.5")), ("max_tool_acceleration_m_per_s2", "at most 10")),
                (dict(limits=LIMITS + "  following_error_rad: 0.006\n"), ("following_error_rad", "at most 0.005")),
                (dict(limits=LIMITS + "supervision: {reactions: {enabling_squeezed: hold}}\n"),
                 ("enabling_squeezed", '"hold"', "stop_1 or stop_0")),
                (dict(limits=LIMITS.replace("  max_force_N: 150\n", "")), ("max_force_N",)),
                (dict(limits=re.sub("  workspace.*\n", "", LIMITS)), ("workspace_m",)),
                (dict(limits=""), ("limits",)),
                (dict(switch=""), ("enabling_input",)),
                (dict(switch="enabling_input: {drive: axis_6, bit: 16}\n"), ("three_position", "panic_bit")),
                (dict(profile="profile: hand_guided\n"), ("profile", "hand_guiding"))):
            with self.subTest(change):
                expected = words if "hand_guided" in str(change) else (*words, "profile: hand_guiding")
                self.assert_refused(self.call("run", self.cell(**change)), "guided.yaml", *expected)
        self.assert_refused(self.call("run", self.cell(), "--without-enabling-input"), "--without-enabling-input",
                            "profile: hand_guiding")

    def test_without_the_profile_none_of_it_is_asked_for(self):
        summary = self.session("--duration", "1s", cell=self.cell("", LIMITS.replace("0.25", "0.5"), ""))
        self.assertEqual(summary["faults"], [])

    def test_contacts_must_be_two(self):
        for switch, word in ((SWITCH.replace("17", "16"), "another bit"), (SWITCH.replace("17", "32"), "panic_bit"),
                             (SWITCH.replace("panic_bit: 17", "panic_bit: 17, panic_byte: 1"), "panic_byte"),
                             (MESSAGE.replace("panic_bit: 0", "panic_bit: 8"), "panic_bit"),
                             (SWITCH.replace("panic_bit", "panik_bit"), "panic_bit")):
            self.assert_refused(self.call("run", self.cell(switch)), "three_position", word)

    def test_letting_go_holds_and_pressing_goes_on(self):
        for switch in (SWITCH, MESSAGE):
            summary = self.session("--duration", "3s", "--timestep", "2ms", "--mass", "8", "--enabling", "0.1s..1.5s", "--enabling", "2s..",
                                   cell=self.cell(switch))
            self.assertEqual([n["fault"] for n in summary["notices"] if n["fault"].startswith("enabling")],
                             ["enabling_released"])
            self.assertEqual(summary["end"]["reason"], "duration")

    def test_squeezing_through_stops_and_ends_the_session(self):
        for switch in (SWITCH, MESSAGE):
            record = self.folder / f"record{len(switch)}"
            summary = self.session("--enabling", "squeezed:1.5s..2s", "--record", record, "--timestep", "2ms",
                                   "--mass", "8", cell=self.cell(switch), status=1)
            self.assertEqual([fault["fault"] for fault in summary["faults"]], ["enabling_squeezed"])
            # A message every 10 ms; the drive's inputs come with each cycle. Then the arm brakes.
            last = max(self.times_of(record, "rendering"))
            self.assertTrue(1.49 <= last <= 1.52, last)

    # The way back through the middle position must not enable.
    def test_after_a_squeeze_only_letting_go_and_pressing_enables(self):
        reset = ("--wait-after-fault", "5s", "--do", "reset@2.5s", "--do", "resume@4s", "--duration", "3s")
        squeeze = ("--enabling", "squeezed:1.5s..2s")
        through_the_middle = self.session("--enabling", "0.1s..", *squeeze, *reset, status=1)
        self.assertEqual([f["fault"] for f in through_the_middle["faults"]], ["enabling_squeezed"])
        self.assertTrue(through_the_middle["idle_orders"], "the reset had to be refused")
        let_go = self.session("--enabling", "0.1s..2s", "--enabling", "2.2s..", *squeeze, *reset)
        self.assertTrue(let_go["faults"][0]["was_reset"])
        self.assertEqual(let_go["end"]["reason"], "duration")

    def test_a_squeeze_needs_a_switch_with_three_positions(self):
        cell = self.cell("enabling_input: {drive: axis_6, bit: 16}\n", profile="")
        self.assert_refused(self.call("run", cell, "--enabling", "squeezed:1s..2s"), "--enabling", "three_position")

    def test_a_joint_that_moves_in_a_hold_is_found(self):
        runs_off = ("--do", "hold@1s", "--fault", "axis_1:runaway=0.05@2s")
        summary = self.session(*runs_off, status=1)
        self.assertEqual([fault["fault"] for fault in summary["faults"]], ["standstill_left"])
        # Without the profile the drive's deviation is found, later.
        without = self.session(*runs_off, cell=self.cell(profile=""), status=1)
        self.assertEqual([fault["fault"] for fault in without["faults"]], ["drive_deviates"])
        self.assertLess(summary["faults"][0]["cycle"], without["faults"][0]["cycle"])

    def test_a_hand_that_leans_on_a_held_arm_is_no_motion(self):
        hand = self.written("leaning.yaml", "mass_kg: 1\nstiffness_N_per_m: 500\ndamping_Ns_per_m: 20\nwaypoints:\n"
                            "  - {time_s: 1.5, offset_m: [0, 0, 0]}\n  - {time_s: 2, offset_m: [0.2, 0.15, -0.1]}\n")
        summary = self.session("--hand", hand, "--do", "hold@1s", "--do", "resume@5s", "--duration", "3s")
        self.assertEqual(summary["faults"], [])
        self.assertEqual(summary["end"]["reason"], "duration")


if __name__ == "__main__":
    unittest.main()
