"""What `proxarm run` and `proxarm sim` refuse on a real kernel's interfaces: one clear line, exit status 2."""
import json
import re
import subprocess
import time
from pathlib import Path

import two_processes as two

CELLS = Path(__file__).resolve().parents[2] / "models" / "cells"


class Refusals(two.VcanTestCase):
    def refused(self, command, *options):
        """The line that says why."""
        done = subprocess.run([two.PROGRAM, command, *map(str, options)], capture_output=True, text=True, timeout=60)
        self.assertEqual(done.returncode, 2, done.stdout + done.stderr)
        lines = [line for line in done.stderr.splitlines() if "on a real bus this would be refused" not in line]
        self.assertEqual(len(lines), 1, done.stderr)
        return lines[0]

    def refused_by_both(self, *options):
        line = self.refused("run", *options)
        self.assertEqual(line, self.refused("sim", *options))
        return line

    def test_an_interface_that_does_not_exist(self):
        line = self.refused_by_both("--bus", "vcan7")
        self.assertIn("bus vcan7: there is no such network interface; CAN interfaces here: vcan0, vcan1, vcan2", line)
        self.assertIn("ip link add dev vcan7 type vcan", line)
        self.assertIn("bus vcan7:", self.refused_by_both("--bus", "axes_1_3=vcan0,axes_4_6=vcan7,sensor=vcan2"))

    def test_an_interface_that_is_down(self):
        subprocess.run(["ip", "link", "set", "vcan3", "down"], check=True)
        line = self.refused_by_both("--bus", "axes_1_3=vcan0,axes_4_6=vcan1,sensor=vcan3")
        self.assertIn("bus vcan3: the interface is down; ip link set up vcan3", line)

    def test_an_interface_that_is_no_can(self):
        line = self.refused_by_both("--bus", "lo")
        self.assertIn("bus lo: is a network interface but not a CAN one; CAN interfaces here: vcan0", line)

    def test_a_bus_without_interface_or_unknown(self):
        self.assertIn("no interface for 'sensor'", self.refused_by_both("--bus", "axes_1_3=vcan0,axes_4_6=vcan1"))
        self.assertIn("a bus of the cell: axes_1_3, axes_4_6, sensor",
                      self.refused_by_both("--bus", "axes_1_3=vcan0,axes_4_6=vcan1,force=vcan2"))

    def test_nodes_that_overlap_on_one_interface(self):
        """Node 1 on axes_4_6, too: fine on two interfaces, not on one."""
        text = (CELLS / "default.yaml").read_text()
        head, tail = text.split("joint: axis_4", 1)
        self.assertIn("node: 4\n", tail)
        text = head + "joint: axis_4" + tail.replace("node: 4\n", "node: 1\n", 1)
        text = re.sub(r"(:\s*)(\.\./[\w./]+)", lambda m: m[1] + str((CELLS / m[2]).resolve()), text)
        cell = self.folder / "cell.yaml"
        cell.write_text(text)
        for bus in (two.ONE, "axes_1_3=vcan0,axes_4_6=vcan0,sensor=vcan2"):
            line = self.refused_by_both(cell, "--bus", bus)
            for word in ("node 1", "axis_1", "axis_4", "interface"):
                self.assertIn(word, line)
        with two.simulated_arm(two.THREE, cell), \
                two.controller(two.THREE, "0.2s", None, cell) as run:
            self.assertEqual(run.wait(), 0, run.errors())

    def test_nobody_there(self):
        begun = time.monotonic()
        line = self.refused("run", "--bus", two.THREE)
        self.assertIn("bus sensor: force sensor (ATI Net CAN OEM, base id 0x68), firmware version: found no answer", line)
        self.assertIn("is `proxarm sim` running on the same interfaces?", line)
        self.assertLess(time.monotonic() - begun, 1.5)

    def test_drives_that_do_not_answer(self):
        with two.simulated_arm("axes_1_3=vcan0,axes_4_6=vcan3,sensor=vcan2"):
            line = self.refused("run", "--bus", two.THREE)
        self.assertIn("bus axes_4_6, node 4, object 1000h:00 device type: drive of axis_4: found no answer", line)
        self.assertIn("is `proxarm sim` running on the same interfaces?", line)
        self.assertIn("also at fault: bus axes_4_6 node 5, bus axes_4_6 node 6", line)

    def test_an_arm_that_comes_within_a_second_is_waited_for(self):
        with two.controller(two.THREE, "0.2s") as run:
            time.sleep(0.7)
            with two.simulated_arm(two.THREE):
                self.assertEqual(run.wait(), 0, run.errors())
            self.assertEqual(json.loads(run.output())["faults"], [])

    def test_virtual_time_on_an_interface(self):
        self.assertIn("--pace", self.refused("run", "--bus", two.ONE, "--pace", "virtual"))

    def setUp(self):
        super().setUp()
        subprocess.run(["ip", "link", "set", "vcan3", "up"], check=True)


if __name__ == "__main__":
    two.main()
