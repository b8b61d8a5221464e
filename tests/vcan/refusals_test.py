"""What `proxarm run` and `proxarm sim` refuse on a real kernel's interfaces: one clear line, exit status 2."""
import json
import os
import pty
import re
import subprocess
import time
from pathlib import Path

import two_processes as two

CELLS = Path(__file__).resolve().parents[2] / "models" / "cells"


# No `proxarm zero` has been at this sensor, whose zero is that of a simulated one.
NEW_SENSOR = ("--accept-force", "100N")


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
        # Only `run` can do without interfaces.
        tail = "; without --bus, `proxarm run` simulates the buses too"
        self.assertEqual(line.removesuffix(tail), self.refused("sim", *options))
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

    def as_if_real(self, *options, typed=None):
        """A run on interfaces that are to be taken for real ones; status and standard error. `typed`: on a terminal."""
        environment = {**os.environ, "PROXARM_TREAT_AS_REAL": "vcan0"}
        command = [two.PROGRAM, "run", "--bus", two.THREE, "--duration", "0.2s", "--json", "--no-plot",
                   *map(str, options)]
        if typed is None:
            done = subprocess.run(command, capture_output=True, text=True, timeout=60, env=environment,
                                  stdin=subprocess.DEVNULL)
            return done.returncode, done.stderr
        ours, theirs = pty.openpty()
        with subprocess.Popen(command, stdin=theirs, stderr=theirs, stdout=subprocess.DEVNULL, env=environment) as run:
            os.close(theirs)
            os.write(ours, typed.encode() + b"\n")
            shown = b""
            try:
                while part := os.read(ours, 4096):
                    shown += part
            except OSError:  # the terminal is gone with the process
                pass
            os.close(ours)
            return run.wait(60), shown.decode()

    def test_a_real_interface_needs_its_option_a_checklist_and_an_enabling_input(self):
        text = (CELLS / "default.yaml").read_text()
        text = re.sub(r"(:\s*)(\.\./[\w./]+)", lambda m: m[1] + str((CELLS / m[2]).resolve()), text)
        cell = self.folder / "cell.yaml"
        cell.write_text(text + "enabling_input: {drive: axis_2, bit: 16}\n")
        status, errors = self.as_if_real()
        self.assertEqual(status, 2)
        self.assertIn("bus vcan0: this is no virtual CAN interface", errors)
        self.assertIn("for a real arm --hardware", errors)
        status, errors = self.as_if_real("--hardware=checked")
        self.assertEqual(status, 2)
        self.assertIn("enabling_input: found none, expected one", errors)
        status, errors = self.as_if_real(cell, "--hardware", "--without-proof")
        self.assertEqual(status, 2)
        self.assertIn("no terminal to confirm on", errors)
        self.assertIn("E-stop and STO act in hardware", errors)
        self.assertEqual(self.as_if_real(cell, "--hardware=yes")[0], 2)
        status, shown = self.as_if_real(cell, "--hardware", "--without-proof", typed="yes")
        self.assertEqual(status, 2, shown)
        self.assertIn('found "yes", expected "checked"', shown)
        with two.simulated_arm(two.THREE, cell):
            for options in (("--hardware=checked",), ("--hardware=checked", "--without-enabling-input")):
                status, shown = self.as_if_real(cell, *options, "--without-proof", *NEW_SENSOR)
                self.assertEqual(status, 0, shown)
                self.assertIn("bit 16 of the inputs of axis_2" if len(options) == 1 else "NONE", shown)

    def test_a_real_interface_needs_a_proof_of_this_very_cell_on_a_real_arm(self):
        text = (CELLS / "default.yaml").read_text()
        text = re.sub(r"(:\s*)(\.\./[\w./]+)", lambda m: m[1] + str((CELLS / m[2]).resolve()), text)
        cell, proof = self.folder / "cell.yaml", self.folder / "cell.yaml.proof"
        cell.write_text(text + "enabling_input: {drive: axis_2, bit: 16}\n")
        status, errors = self.as_if_real(cell, "--hardware=checked")
        self.assertEqual(status, 2)
        self.assertIn("cell.yaml.proof: found no proof, expected a proof of this cell on a real arm", errors)
        self.assertIn("--without-proof", errors)
        done = subprocess.run([two.PROGRAM, "prove", cell], capture_output=True, text=True, timeout=60)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        status, errors = self.as_if_real(cell, "--hardware=checked")
        self.assertEqual(status, 2)
        self.assertIn("found a proof on a simulated arm", errors)
        # No hand is there that would push: the file as such a proof would have left it.
        proof.write_text(proof.read_text().replace("arm: simulated", "arm: real"))
        with two.simulated_arm(two.THREE, cell):
            status, shown = self.as_if_real(cell, "--hardware=checked", *NEW_SENSOR)
        self.assertEqual(status, 0, shown)
        cell.write_text(cell.read_text() + "# another cell\n")
        status, errors = self.as_if_real(cell, "--hardware=checked")
        self.assertEqual(status, 2)
        self.assertIn("or of this one before it", errors)

    def setUp(self):
        super().setUp()
        subprocess.run(["ip", "link", "set", "vcan3", "up"], check=True)


if __name__ == "__main__":
    two.main()
