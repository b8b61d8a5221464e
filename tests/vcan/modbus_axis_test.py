"""An axis on Modbus TCP under five on CAN: the controller and the simulated arm as two processes, on real interfaces of
both kinds."""
import json
import subprocess
import time
import unittest
from pathlib import Path

import two_processes as two

CELL = Path(__file__).resolve().parents[2] / "models/cells/rail.yaml"
BUSES = "axes_2_3=vcan0,axes_4_6=vcan1,sensor=vcan2"


class ModbusAxis(two.VcanTestCase):
    @classmethod
    def setUpClass(cls):
        subprocess.run(["ip", "link", "set", "lo", "up"], check=True)

    def run_both(self, *faults):
        with two.Process(two.PROGRAM, "sim", CELL, "--bus", BUSES, *faults) as arm:
            time.sleep(0.3)
            with two.Process(two.PROGRAM, "run", CELL, "--bus", BUSES, "--duration", "2s", "--json",
                             "--no-plot") as run:
                status, output, errors = run.wait(), run.output(), run.errors()
            self.assertEqual(arm.stop(), 0, arm.errors())
        self.assertTrue(output, errors)
        return status, json.loads(output), errors

    def test_ends_well(self):
        status, summary, errors = self.run_both()
        self.assertEqual(status, 0, errors)
        self.assertEqual(summary["faults"], [])
        self.assertRegex(errors, r"rail on Modbus line rail, unit 1: \d+(\.\d+)? exchanges/s of 200 wanted")

    def test_a_connection_that_is_closed_stops_the_arm(self):
        status, summary, errors = self.run_both("--fault", "rail:closed@1.5s")
        self.assertEqual(status, 1, errors)
        self.assertEqual([fault["fault"] for fault in summary["faults"]], ["modbus_silent"])
        self.assertIn("Modbus connection was closed", summary["faults"][0]["text"])


if __name__ == "__main__":
    two.main()
