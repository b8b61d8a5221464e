"""What somebody does on the first day: files in each other's place, options that have nothing to act on, help."""
import json
import os
import pty
import re
import subprocess
import unittest

from harness import SOURCE, ProgramTest, program

CELL = SOURCE / "models/cells/default.yaml"
SCENE, HAND, URDF = SOURCE / "scenes/wall.yaml", SOURCE / "sim/hands/touch.yaml", SOURCE / "models/arms/arm150.urdf"


class FilesInTheWrongPlace(ProgramTest):
    def test_each_kind_is_told_by_its_name_and_where_it_belongs(self):
        # A scene given as the cell was "urdf: found nothing, expected a file's path".
        self.assert_refused(self.call("run", SCENE), "found a scene file, expected a cell file", "--scene FILE")
        self.assert_refused(self.call("run", HAND), "found a hand file, expected a cell file", "--hand FILE")
        self.assert_refused(self.call("run", URDF), "found a URDF file", "a cell file names it")
        self.assert_refused(self.call("run", "--scene", CELL), "found a cell file, expected a scene file")
        self.assert_refused(self.call("run", "--hand", SCENE), "found a scene file, expected a hand file")
        self.assert_refused(self.call("explain", HAND), "found a hand file, expected a scene file")

    def test_a_force_where_a_hands_file_belongs(self):
        outcome = self.call("tune", "--hand", "5N")
        self.assert_refused(outcome, "--hand: 5N: no such file", "such as sim/hands/touch.yaml")

    def test_check_reads_an_arm(self):
        # It was "not YAML".
        outcome = self.call("check", URDF)
        self.assertEqual((outcome.status, outcome.err), (0, ""))
        self.assertIn("fine, an arm", outcome.out)
        broken = self.written("broken.urdf", URDF.read_text().replace("<inertial>", "<inertia>", 1))
        self.assert_refused(self.call("check", broken), "broken.urdf")

    def test_a_mistake_in_a_file_of_the_right_kind_stays_that_mistake(self):
        hand = self.written("hand.yaml", "mass_kg: 1\nstiffness_N_per_m: 500\nobjects: []\n")
        self.assert_refused(self.call("run", "--hand", hand), "objects: unknown key")


class EnablingSwitch(ProgramTest):
    def with_switch(self):
        """The default cell with the line that the refusal advises."""
        line = "enabling_input: {drive: axis_6, bit: 16}"
        return self.changed("models/cells/default.yaml", ("limits:\n", line + "\n\nlimits:\n"))

    def test_a_script_for_a_switch_that_is_not_there_is_refused(self):
        # It was taken, and did nothing.
        for command in (["run"], ["sim", "--bus", "nocan7"]):
            outcome = self.call(*command, "--enabling", "0.5s..3s")
            self.assert_refused(outcome, "--enabling: found a cell without an enabling input",
                                "enabling_input: {drive: axis_6, bit: 16}")
        outcome = self.call("run", self.with_switch(), "--without-enabling-input", "--enabling", "0.5s..3s")
        self.assert_refused(outcome, "--enabling: found --without-enabling-input")
        outcome = self.call("run", CELL, "--bus", "nocan7", "--enabling", "0.5s..3s")
        self.assert_refused(outcome, "--enabling", "`proxarm sim`")

    def test_a_cell_with_a_switch_holds_when_it_is_let_go(self):
        outcome = self.call("run", "--json", self.with_switch(), "--enabling", "0.5s..3s", "--enabling", "4s..",
                            "--duration", "5s")
        self.assertEqual(outcome.status, 0, outcome.err)
        [notice] = outcome.summary["notices"]
        self.assertEqual((notice["fault"], notice["reaction"]), ("enabling_released", "hold"))
        self.assertEqual(outcome.summary["end"]["reason"], "duration")


class Help(ProgramTest):
    def test_help_is_a_command(self):
        # It was "did you mean hold?".
        for words, same in ((["help"], ["--help"]), (["help", "run"], ["run", "--help"])):
            outcome = self.call(*words)
            self.assertEqual((outcome.status, outcome.err), (0, ""))
            self.assertEqual(outcome.out, self.call(*same).out)

    def test_no_line_is_longer_than_a_terminal(self):
        commands = re.findall(r"^  ([a-z-]+) ", self.call("--help").out.split("Subcommands:")[1], re.MULTILINE)
        self.assertGreaterEqual(len(commands), 15)
        for command in [[], *([name] for name in commands)]:
            text = self.call(*command, "--help").out
            self.assertLessEqual(max(map(len, text.splitlines())), 100, command)
            self.assertNotIn("{ask}", text)

    def test_set_names_what_can_be_set(self):
        text = self.call("set", "--help").out
        for name in ("mass=", "damping=", "spring=", "timestep=", "OBJECT.friction=", "OBJECT.position_m="):
            self.assertIn(name, text)

    def test_a_cell_without_a_scene_and_a_hand_has_some(self):
        # `run` and `plan` said that the cell's folder is a folder.
        text = (SOURCE / "models/cells/default.yaml").read_text().replace("../", str(SOURCE / "models") + "/")
        bare = "".join(line for line in text.splitlines(True) if not line.startswith(("default_scene", "default_hand")))
        cell = self.folder / "bare.yaml"
        cell.write_text(bare)
        for command in (("check",), ("plan",), ("run", "--no-plot", "--duration", "0.1s")):
            outcome = self.call(command[0], cell, *command[1:])
            self.assertEqual(outcome.status, 0, outcome.err)
        self.assertIn("free space", outcome.out)

    def test_commands_offer_what_has_an_effect(self):
        for command in ("plan", "tune"):
            self.assertNotIn("--duration", self.call(command, "--help").out)
            self.assert_refused(self.call(command, "--duration", "5s"), "unknown option", "--duration")

    def test_each_study_has_its_own_help(self):
        listed = re.search(r"figure5, .*?skip", self.call("study", "--help").out, re.DOTALL)[0]
        names = re.findall(r"[a-z_0-9]{4,}", listed)
        self.assertEqual(len(names), 12)
        texts = {name: self.call("study", name, "--help").out for name in names}
        self.assertEqual(len({text.split("Usage:")[0] for text in texts.values()}), len(names))
        self.assertIn("by (1), (5) and (23)", " ".join(texts["figure5"].split()))


class WhatIsPrinted(ProgramTest):
    def lines_of(self, *arguments):
        out = self.call("run", "--no-plot", "--verbose", *arguments).out
        return {line[:26].strip(" :"): line[28:] for line in out.splitlines() if line.startswith("  ")}

    def test_no_overruns_are_counted_where_time_waits(self):
        # "max 12075.9 µs; overruns 0" read as a contradiction.
        self.assertTrue(self.lines_of("--duration", "1s")["compute per cycle"].endswith("simulated time stands still meanwhile"))
        realtime = self.lines_of("--duration", "0.1s", "--pace", "realtime")
        self.assertRegex(realtime["compute per cycle"], r"; overruns \d+$")

    def test_it_is_eight_lines_unless_something_went_wrong(self):
        # Of 22 lines a reader had to find the two that told how it went.
        names = ["ended", "apparent mass", "contact", "accuracy", "limits active", "faults", "verdict", "plot"]
        out = self.call("run").out
        self.assertEqual([line.strip().split(":")[0] for line in out.splitlines() if line.startswith("  ")], names)
        self.assertIn("\n  verdict:                  fine: no fault, nothing swung\n", out)
        failed = self.call("run", "--no-plot", "--fault", "sensor:frozen@4s").out
        self.assertIn("\n  FAULT:                    sensor_frozen", failed)
        self.assertIn("\n  verdict:                  a fault ended it: sensor_frozen\n", failed)
        self.assertEqual(json.loads(self.call("run", "--json").out)["verdict"]["word"], "fine")

    def on_a_terminal(self, **environment):
        ours, theirs = pty.openpty()
        done = subprocess.Popen([program(), "run", "--duration", "1s", "--no-plot"], cwd=self.folder, stdout=theirs,
                                stdin=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                env={**os.environ, "TERM": "xterm", **environment})
        os.close(theirs)
        out = b""
        while True:
            try:
                part = os.read(ours, 4096)
            except OSError:  # EIO: the other side is closed
                break
            if not part:
                break
            out += part
        os.close(ours)
        self.assertEqual(done.wait(), 0)
        return out.decode()

    def test_it_is_coloured_on_a_terminal_that_wants_it(self):
        told = self.on_a_terminal()
        self.assertIn("\x1b[32mfine: no fault, nothing swung\x1b[0m", told)
        for environment in ({"NO_COLOR": "1"}, {"TERM": "dumb"}):
            self.assertNotIn("\x1b", self.on_a_terminal(**environment))
        self.assertIn("\x1b[32m", self.on_a_terminal(NO_COLOR=""))
        self.assertNotIn("\x1b", self.call("run", "--no-plot").out)

    def test_a_scene_that_was_not_touched_is_told(self):
        room = SOURCE / "scenes/room.yaml"
        self.assertRegex(self.lines_of("--scene", room)["contact"], r"^none; the nearest surface was at least [\d.]+ mm away$")
        self.assertEqual(self.lines_of("--scene", SOURCE / "scenes/free.yaml")["contact"], "none")

    def test_every_clock_of_a_script_is_told(self):
        # --fault …@4s struck at cycle 3821, --set …@3s at 3.26 s, --do …@2s at 2.0 s, and nothing said why.
        record = self.folder / "session"
        arguments = ("--fault", "sensor:frozen@2s", "--set", "mass=5@1s", "--do", "resume@1s", "--record", record)
        clocks = self.lines_of(*arguments)["clocks"]
        found = re.fullmatch(r"--do and --enabling count from the first cycle; --fault from power on, (\S+) s before it; "
                             r"--set from (\S+) s after it, rendering time only", clocks)
        self.assertTrue(found, clocks)
        summary = self.call("run", "--json", *arguments).summary
        self.assertAlmostEqual(summary["first_cycle_s"], float(found[1]), delta=0.001)
        self.assertAlmostEqual(summary["rendering_from_s"], float(found[2]), delta=0.001)
        [fault] = summary["faults"]
        # A frozen reading is noticed when it has come 20 times.
        self.assertAlmostEqual(fault["cycle"] * 1e-3, 2.0 - float(found[1]), delta=0.025)
        self.assertNotIn("clocks", self.lines_of("--duration", "1s"))


class Scenes(ProgramTest):
    def test_every_shipped_scene_is_touched_by_the_hand_that_it_names(self):
        # room.yaml with the default hand touched nothing.
        for scene in sorted((SOURCE / "scenes").glob("*.yaml")):
            with self.subTest(scene.name):
                found = re.search(r"^# Try it: proxarm (run --scene scenes/.*)$", scene.read_text(), re.MULTILINE)
                self.assertTrue(found, "the scene's file says how to try it")
                self.assertEqual(found[1].split()[2], f"scenes/{scene.name}")
                outcome = self.call(*found[1].split(), "--json")
                self.assertEqual(outcome.status, 0, outcome.err)
                if scene.name not in ("free.yaml", "coulomb.yaml"):  # there is nothing to touch
                    self.assertGreaterEqual(outcome.summary["contacts"], 1)

    def test_the_enabling_switch_is_told_from_when_until_when(self):
        cell = self.changed("models/cells/default.yaml",
                            ("default_period_s", "enabling_input: {drive: axis_6, bit: 16}\ndefault_period_s"))
        for wrong in ("1s", "..2s", "squeezed:1s"):
            self.assert_refused(self.call("run", cell, "--enabling", wrong), "--enabling", "FROM..UNTIL", "FROM..")


if __name__ == "__main__":
    unittest.main(verbosity=2)
