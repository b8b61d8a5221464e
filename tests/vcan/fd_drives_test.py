"""Drives whose PDOs are CAN FD frames, and an FD sensor, on one interface of a real kernel."""
import json
import subprocess
import sys
from pathlib import Path

import two_processes as two

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "command_line"))
from can_fd_test import fd_cell  # noqa: E402


class CanFd(two.VcanTestCase):
    def mtu(self, size):
        for words in (("down",), ("mtu", str(size)), ("up",)):
            subprocess.run(["ip", "link", "set", "dev", "vcan3", *words], check=True)

    def test_a_session_ends_well(self):
        cell, record = fd_cell(self.folder), self.folder / "record"
        self.mtu(72)
        with two.simulated_arm("vcan3", cell) as arm, two.controller("vcan3", "1s", record, cell) as run:
            self.assertEqual(run.wait(), 0, run.output() + run.errors())
            summary = json.loads(run.output())
            arm.stop()
        self.assertEqual(summary["faults"], [])
        log = (record / "frames.log").read_text()
        self.assertGreater(log.count(" 186##1"), 1_000)
        self.assertRegex(log, r" 186##1[0-9A-F]{128}\n")
        self.assertGreater(log.count(" 123##1"), 1_000)

    def test_an_interface_for_classic_can_is_refused(self):
        cell = fd_cell(self.folder)
        self.mtu(16)
        self.addCleanup(self.mtu, 72)
        for command in ("run", "sim"):
            refused = subprocess.run([two.PROGRAM, command, cell, "--bus", "vcan3"], capture_output=True, text=True)
            self.assertEqual(refused.returncode, 2, refused.stderr)
            self.assertIn("set up for classic CAN", refused.stderr)
            self.assertIn("ip link set vcan3 mtu 72", refused.stderr)


if __name__ == "__main__":
    two.main()
