"""A session again, by the controller alone: from a record, and from the black box that a fault or a crash leaves."""
import os
import re
import signal
import subprocess
import time
import unittest

from harness import SOURCE, ProgramTest, program

SAME = re.compile(r"(\d+) cycles from (\d+) on: every setpoint is the same to the bit\n")

# The sides of a box as triangles, its face towards the tool where wall.yaml has its own.
MESH = """v 0.9 -0.5 0
v 1.4 -0.5 0
v 1.4 0.5 0
v 0.9 0.5 0
v 0.9 -0.5 1
v 1.4 -0.5 1
v 1.4 0.5 1
v 0.9 0.5 1
f 1 4 3
f 1 3 2
f 5 6 7
f 5 7 8
f 1 2 6
f 1 6 5
f 2 3 7
f 2 7 6
f 3 4 8
f 3 8 7
f 4 1 5
f 4 5 8
"""


class Replay(ProgramTest):
    def assert_same(self, folder, *, cycles=None):
        outcome = self.call("replay", folder)
        self.assertEqual(outcome.status, 0, outcome.err + outcome.out)
        match = SAME.fullmatch(outcome.out)
        self.assertIsNotNone(match, outcome.out)
        if cycles:
            self.assertEqual(int(match[1]), cycles)
        return int(match[1]), int(match[2])

    def recorded(self, *arguments):
        summary = self.summary("--record", "session", *arguments)
        return self.folder / "session", summary

    def test_a_record_gives_the_same_setpoints(self):
        record, summary = self.recorded("--duration", "4s")
        self.assert_same(record, cycles=summary["cycles"])
        outcome = self.call("replay", "--json", record)
        self.assertEqual((outcome.status, outcome.summary),
                         (0, {"same": True, "first_cycle": 0, "cycles": summary["cycles"]}))

    def test_torques(self):
        record, summary = self.recorded(SOURCE / "models/cells/light.yaml", "--duration", "4s")
        self.assert_same(record, cycles=summary["cycles"])

    def test_whatever_was_rendered(self):
        mesh = self.written("box.obj", MESH)
        scene = self.written("mesh.yaml", f"name: box of triangles\nobjects:\n  - mesh: {{file: {mesh.name}, friction: 0.3}}\n")
        for arguments in (("--scene", scene), ("--scene", "scenes/moving_plate.yaml", "--order", "2"),
                          ("--scene", "scenes/line.yaml"), ("--orientation", "free"),
                          ("--scene", "scenes/box_on_belt.yaml", "--hand", "sim/hands/tip.yaml", "--inertia", "0.1"),
                          ("models/cells/rail.yaml", "--timestep", "4ms")):
            with self.subTest(arguments):
                outcome = self.call("run", "--json", "--record", "session", "--duration", "3s", *arguments)
                self.assertEqual(outcome.status, 0, outcome.err)
                self.assert_same("session", cycles=outcome.summary["cycles"])

    def test_another_controller_is_noticed_with_cycle_and_axis(self):
        record, _ = self.recorded("--duration", "1s")
        cell = next((record / "replay" / "files").rglob("default.yaml"))
        text = cell.read_text()
        changed = re.sub(r"setpoint_bandwidth_Hz: \S+", "setpoint_bandwidth_Hz: 24", text)
        self.assertNotEqual(changed, text)
        cell.write_text(changed)
        outcome = self.call("replay", record)
        self.assertEqual(outcome.status, 1, outcome.err)
        self.assertRegex(outcome.out, r"^cycle \d+, axis_\d: recorded -?\d+ counts, replayed -?\d+\n$")

    def test_what_is_no_record_is_refused(self):
        self.assert_refused(self.call("replay", "nowhere"), "nowhere", "no such file")
        record, _ = self.recorded("--duration", "200ms")
        log = record / "replay" / "cycles.bin"
        whole = log.read_bytes()
        for broken, said in ((b"", "too short"), (whole[:100], "too short"), (b"x" * len(whole), "another kind"),
                             (whole[:16] + b"\1" + whole[17:], "head of another version")):
            log.write_bytes(broken)
            self.assert_refused(self.call("replay", record), said)
        cell = whole.index(b"models/cells/default.yaml")
        log.write_bytes(whole[:cell] + b"../../../../../etc/passwd"[:25] + whole[cell + 25:])
        self.assert_refused(self.call("replay", record), "../../../../../etc/passwd", "a file of the record")
        # A head without buses, of a cell that has three: by six axes, three buses, and their numbers.
        head = b"\6\0\0\0\3\0\0\0\0\1\2"
        self.assertEqual(whole.count(head), 1)
        log.write_bytes(whole.replace(head, b"\6\0\0\0\0\0\0\0\0\0\0"))
        self.assert_refused(self.call("replay", record), "buses", "found 3, expected 0, as recorded")
        # Cut off in the middle of an entry, as by a crash: all that is whole counts.
        log.write_bytes(whole[:-1000])
        self.assert_same(record)

    def test_random_damage_is_refused_or_noticed(self):
        record, _ = self.recorded("--duration", "200ms")
        log = record / "replay" / "cycles.bin"
        whole = log.read_bytes()
        step = max(1, len(whole) // 60)
        for at in range(7, len(whole), step):
            log.write_bytes(whole[:at] + bytes([whole[at] ^ 0xFF]) + whole[at + 1:])
            self.assertIn(self.call("replay", record).status, (0, 1, 2), at)

    def test_the_record_is_whole_without_the_files_that_it_was_made_from(self):
        cell = self.changed("models/cells/default.yaml", ("name: ", "name: copied "))
        record, summary = self.recorded(cell, "--duration", "300ms")
        (self.folder / "copies").rename(self.folder / "gone")
        self.assert_same(record, cycles=summary["cycles"])


# The box holds the last 10 to 11 s: from the third second on, in the middle of a motion or of a contact.
FROM_THE_MIDDLE = {
    "order 2": ("--order", "2"),
    "order 2 on a groove": ("--order", "2", "--scene", "@scenes/groove.yaml"),
    "2 ms": ("--timestep", "2ms", "--mass", "8"),
    "damping and spring": ("--damping", "20", "--spring", "50"),
    "passivity": ("--passivity", "on", "--hand", "@sim/hands/stiff_grip.yaml"),
    "late sensor": ("--extra-delay", "4ms", "--mass", "8"),
    "lookahead": ("--mass", "10", "--lookahead", "auto"),
    "lookahead with a rigid tool": ("--scene", "@scenes/box_on_belt.yaml", "--mass", "10", "--lookahead", "auto"),
    "free orientation": ("--orientation", "free"),
    "a tool that swings as it turns": ("--scene", "@scenes/free.yaml", "--hand", "@sim/hands/lean.yaml", "--mass", "2",
                                       "--inertia", "0.005", "--force-unstable", "--extra-delay", "2ms"),
    "a rigid one": ("--scene", "@scenes/rod_over_edge.yaml", "--hand", "@sim/hands/lean.yaml", "--mass", "4", "--inertia",
                    "0.0087", "--force-unstable", "--passivity", "on"),
    "a sweep in free space": ("--scene", "@scenes/free.yaml", "--hand", "@sim/hands/sweep.yaml"),
    "elastic layers": ("--scene", "@scenes/soft_corner.yaml"),
    "a medium": ("--scene", "@scenes/honey.yaml"),
    "a guide among objects": ("--scene", "@scenes/guided_insertion.yaml"),
    "a driven plate": ("--scene", "@scenes/moving_plate.yaml"),
    "a driven mesh": ("--scene", "@scenes/moving_mesh.yaml"),
    "a room": ("--scene", "@scenes/room.yaml"),
    "two axes": ("@models/cells/bench.yaml",),
    "seven axes": ("@models/cells/seven.yaml",),
    "a rail on Modbus": ("@models/cells/rail.yaml",),
    "torques": ("@models/cells/light.yaml",),
    "changes": ("--set", "mass=8@1s", "--set", "damping=10@6s", "--set", "spring=20@8s"),
    "a change of timestep": ("--set", "timestep=2ms@11s"),
    "a hold": ("--do", "hold@1.5s", "--do", "resume@6s"),
    "a release": ("--do", "hold@1s", "--do", "release@1.5s", "--do", "hold@7s", "--do", "resume@8s"),
}


class BlackBox(ProgramTest):
    assert_same = Replay.assert_same

    def box_of(self, *arguments, status=1):
        outcome = self.call("run", "--no-plot", *arguments)
        self.assertEqual(outcome.status, status, outcome.err)
        return outcome

    def test_a_fault_leaves_the_last_ten_seconds(self):
        outcome = self.box_of("--duration", "20s", "--fault", "sensor:frozen@14s")
        box = self.folder / "proxarm-black-box"
        self.assertIn(f"black box:                {box}", outcome.out)
        self.assertIn("sensor_frozen (bus sensor): ", (box / "reason.txt").read_text())
        cycles, first = self.assert_same(box)
        self.assertGreater(first, 0)
        self.assertGreaterEqual(cycles, 10000)
        self.assertLess(cycles, 11100)
        rows = (box / "signals.csv").read_text().splitlines()
        self.assertGreaterEqual(len(rows) - 1, cycles)
        self.assertGreater((box / "frames.log").read_text().count(" 181#"), 10000)
        self.assertIn("mass_kg: 4", (box / "effective.yaml").read_text())

    def test_every_kind_of_session_goes_on_from_its_middle(self):
        """All that a cycle leaves to the next one is in the archive: a member that was forgotten there would begin anew in
        the middle, and the setpoints would be others. One session for each part that has a state of its own."""
        for name, arguments in FROM_THE_MIDDLE.items():
            with self.subTest(name):
                shipped = [str(SOURCE / a[1:]) if a.startswith("@") else a for a in arguments]
                self.box_of(*shipped, "--duration", "20s", "--fault", "sensor:silent@13s")
                cycles, first = self.assert_same("proxarm-black-box")
                self.assertGreater(first, 500)
                self.assertGreater(cycles, 4000)

    def test_lies_in_the_record_or_where_it_was_told_to(self):
        self.box_of("--duration", "1s", "--record", "session", "--fault", "sensor:silent@800ms")
        self.assert_same("session/black-box")
        self.assert_same("session")
        # A later session replaces both.
        self.box_of("--duration", "500ms", "--record", "session", status=0)
        self.assertFalse((self.folder / "session" / "black-box").exists())
        self.box_of("--duration", "1s", "--black-box", "here", "--fault", "sensor:silent@800ms")
        self.assert_same("here")
        self.assertFalse((self.folder / "proxarm-black-box").exists())

    def test_nothing_is_left_of_a_session_that_ends_well(self):
        self.box_of("--duration", "300ms", status=0)
        self.assertFalse((self.folder / "proxarm-black-box").exists())

    def test_overwrites_nothing_that_is_not_its_own(self):
        other = self.folder / "mine"
        other.mkdir()
        (other / "thesis.txt").write_text("years of work")
        self.assert_refused(self.call("run", "--black-box", other), "thesis.txt")
        (self.folder / "proxarm-black-box").mkdir()
        (self.folder / "proxarm-black-box" / "thesis.txt").write_text("years of work")
        outcome = self.box_of("--duration", "1s", "--fault", "sensor:silent@800ms")
        self.assertIn("no black box could be written", outcome.err)
        self.assertEqual(sorted(f.name for f in (self.folder / "proxarm-black-box").iterdir()), ["thesis.txt"])

    def test_survives_every_death(self):
        for number in (signal.SIGKILL, signal.SIGSEGV, signal.SIGABRT):
            with self.subTest(number):
                run = subprocess.Popen([program(), "run", "--no-plot", "--pace", "realtime", "--duration", "60s"],
                                       cwd=self.folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
                time.sleep(2.5)
                self.assertIsNone(run.poll())
                os.kill(run.pid, number)
                said = run.communicate(timeout=60)[1]
                self.assertIn("the session died; its black box is in", said)
                box = self.folder / "proxarm-black-box"
                self.assertIn("crashed or was killed", (box / "reason.txt").read_text())
                cycles, _ = self.assert_same(box)
                self.assertGreater(cycles, 0)


if __name__ == "__main__":
    unittest.main()
