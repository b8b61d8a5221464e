"""Controllers that end well, by a fault and by SIGKILL, again and again, with drives whose stacks watch in different ways.

The bench on one interface, `simulation: {stack: strict, latching, lazy, holding or insisting}`. After each SIGKILL at a random moment of
rendering every drive must fault within what the cell promises (`supervision.bus_loss_stop_s`, 60 ms); a clean end, and
one by a fault, must leave no EMCY; the next controller must come up each time. Times are candump's, from the last SYNC on.
"""
import json
import os
import random
import re
import signal
import subprocess
import time
from pathlib import Path

import two_processes as two

CELLS = Path(__file__).resolve().parents[2] / "models/cells"
NODES = (1, 2)
KILLS = int(os.environ.get("PROXARM_KILLS", "50"))
PROMISED_US = 60_000
# The last heartbeat left up to a period before the last SYNC's cycle ended; the drives look every 2 ms at most.
SLACK_US = 3_000
SYNC_LOST, HEARTBEAT_LOST = bytes([0x00, 0x87]), bytes([0x30, 0x81])
ALIEN = bytes([0x10, 0x42])  # 4210h, device temperature: what this test says in a drive's name


class Kills(two.VcanTestCase):
    begins_s = 0.8  # from a controller's start to where it surely renders

    def cell(self, stack):
        text = re.sub(r"(\n +simulation:\n)( +)", rf"\1\2stack: {stack}\n\2", (CELLS / "bench.yaml").read_text())
        for path in ("../arms", "../sensors", "../../scenes", "../../sim"):
            text = text.replace(f" {path}/", f" {(CELLS / path).resolve()}/")
        self.assertEqual(text.count(f"stack: {stack}"), len(NODES))
        file = self.folder / "bench.yaml"
        file.write_text(text)
        return file

    def killed(self, cell, chance, code):
        """From the last SYNC to the EMCY by which each drive stops."""
        with two.candump("vcan0") as witness:
            with two.controller("vcan0", "60s", None, cell) as run:
                time.sleep(self.begins_s + chance.uniform(0.0, 1.7))
                run.send(signal.SIGKILL)
                self.assertEqual(run.wait(), -signal.SIGKILL, run.errors() + run.output())
            time.sleep(0.2)
            seen = two.frames_of(witness)
        syncs = [f.time_us for f in seen if f.id == two.SYNC]
        self.assertGreater(len(syncs), 100, "it rendered")
        stops = {}
        for node in NODES:
            told = [f for f in two.of_node(seen, two.EMCY, node) if f.time_us > syncs[-1]]
            stops[node] = next((f.time_us - syncs[-1] for f in told if f.data[:2] == code), None)
            self.assertIsNotNone(stops[node], f"node {node}: {told}")
        return stops

    def assert_no_emcy_since_enabled(self, seen):
        """By any drive, from when it first said that it is enabled until 0.2 s after the controller's end."""
        for node in NODES:
            enabled_us = next(f.time_us for f in two.of_node(seen, two.TPDO, node) if f.data[0] & 0x6F == 0x27)
            told = [f for f in two.of_node(seen, two.EMCY, node) if f.time_us > enabled_us and f.data[:2] != ALIEN]
            self.assertEqual(told, [], f"node {node}")

    def ended(self, cell):
        with two.candump("vcan0") as witness:
            with two.controller("vcan0", "0.3s", None, cell) as run:
                self.assertEqual(run.wait(), 0, run.errors() + run.output())
            time.sleep(0.2)
            self.assert_no_emcy_since_enabled(two.frames_of(witness))

    def faulted(self, cell, node):
        """By an EMCY in a drive's name that it never sent: the controller ends, the drives have nothing to say."""
        with two.candump("vcan0") as witness:
            with two.controller("vcan0", "60s", None, cell) as run:
                time.sleep(self.begins_s)
                data = (ALIEN + bytes([0x01])).hex().upper().ljust(16, "0")
                subprocess.run(["cansend", "vcan0", f"{two.EMCY + node:03X}#{data}"], check=True)
                self.assertEqual(run.wait(), 1, run.errors() + run.output())
                self.assertEqual([fault["fault"] for fault in json.loads(run.output())["faults"]], ["drive_fault"])
            time.sleep(0.2)
            self.assert_no_emcy_since_enabled(two.frames_of(witness))

    def assert_stops(self, stack, code, within_us):
        chance, cell = random.Random(stack), self.cell(stack)
        slowest = 0
        # A hand that leads goes on while nobody renders, and the next controller couldn't tare.
        with two.simulated_arm("vcan0", cell, "--hand", two.write_hand(self.folder, "at_rest")) as arm:
            for kill in range(KILLS):
                for node, stop_us in self.killed(cell, chance, code).items():
                    self.assertLessEqual(stop_us, within_us, f"node {node}, kill {kill}")
                    slowest = max(slowest, stop_us)
                self.ended(cell)
                self.faulted(cell, NODES[kill % len(NODES)])
            self.assertEqual(arm.stop(), 0, arm.errors())
        print(f"  {stack}: {KILLS} of each end, slowest after a kill {slowest / 1000:.2f} ms")

    def test_strict_drives_stop_when_sync_is_missing(self):
        self.assert_stops("strict", SYNC_LOST, 5_000)

    def test_latching_drives_stop_and_are_reset(self):
        self.assert_stops("latching", SYNC_LOST, 5_000)

    def test_lazy_drives_stop_by_the_heartbeat(self):
        self.assert_stops("lazy", HEARTBEAT_LOST, PROMISED_US + SLACK_US)

    # Drives that hold NMT back are helped before they start.
    def test_holding_drives_are_started_by_the_next_controller(self):
        self.begins_s = 2.0
        self.assert_stops("holding", HEARTBEAT_LOST, PROMISED_US + SLACK_US)

    def test_insisting_drives_are_started_by_the_next_controller(self):
        self.begins_s = 2.0
        self.assert_stops("insisting", HEARTBEAT_LOST, PROMISED_US + SLACK_US)


if __name__ == "__main__":
    two.main()
