"""A second controller on a bus that somebody leads: it listens, says so and sends nothing; the first never notices."""
import os
import signal
import subprocess
import time
from pathlib import Path

import two_processes as two

CELLS = Path(__file__).resolve().parents[2] / "models/cells"
ROUNDS = int(os.environ.get("PROXARM_SECONDS", "2"))
# Each command that sends on a bus. What it would send first differs: NMT, SDO, a sensor's poll.
COMMANDS = (("run", "CELL"), ("zero", "CELL"), ("identify", "CELL"), ("prove", "CELL"), ("prove", "CELL", "--bus-loss"),
            ("calibrate", "CELL"), ("scan",))


class SecondController(two.VcanTestCase):
    def setUp(self):
        super().setUp()
        text = (CELLS / "bench.yaml").read_text()  # a copy: calibrate writes to it
        for path in ("../arms", "../sensors", "../../scenes", "../../sim"):
            text = text.replace(f" {path}/", f" {(CELLS / path).resolve()}/")
        self.cell = self.folder / "bench.yaml"
        self.cell.write_text(text)
        self.at_rest = ("--hand", two.write_hand(self.folder, "at_rest"))

    def second(self, *command):
        words = [str(self.cell) if word == "CELL" else word for word in command]
        return subprocess.run([two.PROGRAM, *words, "--bus", "vcan0"], capture_output=True, text=True, input="\n",
                              timeout=60)

    def test_is_refused_and_changes_nothing_for_the_first(self):
        with two.simulated_arm("vcan0", self.cell, *self.at_rest):
            with two.candump("vcan0") as witness, two.controller("vcan0", "60s", None, self.cell) as first:
                time.sleep(1.5)
                for _ in range(ROUNDS):
                    for command in COMMANDS:
                        with self.subTest(command[0]):
                            done = self.second(*command)
                            self.assertEqual(done.returncode, 2, done.stdout + done.stderr)
                            self.assertIn("somebody leads this bus", done.stderr)
                            self.assertIn("SYNC (0x080)", done.stderr)
                            self.assertIsNone(first.process.poll(), "the first goes on")
                self.assertEqual(first.stop(signal.SIGTERM), 0, first.errors() + first.output())
                seen = two.frames_of(witness)
        # Of one controller: to each node pre-operational and start, and pre-operational at the end.
        commands = [(f.data[0], f.data[1]) for f in seen if f.id == two.NMT]
        self.assertEqual(sorted(commands), sorted([(0x80, 1), (0x80, 2), (0x01, 1), (0x01, 2), (0x80, 1), (0x80, 2)]))

    def test_may_begin_once_the_first_has_ended(self):
        with two.simulated_arm("vcan0", self.cell, *self.at_rest):
            for _ in range(2):
                with two.controller("vcan0", "0.3s", None, self.cell) as run:
                    self.assertEqual(run.wait(), 0, run.errors() + run.output())
            found = self.second("scan")
            self.assertEqual(found.returncode, 0, found.stdout + found.stderr)

    def test_calibrate_reads_drives_where_nobody_leads(self):
        with two.simulated_arm("vcan0", self.cell, *self.at_rest):
            done = self.second("calibrate", "CELL")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("shoulder: offset_counts", done.stdout)


if __name__ == "__main__":
    two.main()
