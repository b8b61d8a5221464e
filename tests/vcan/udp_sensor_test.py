"""The default cell's arm on three CAN interfaces with its force sensor on UDP: controller and simulated arm as two
processes, at 1 ms."""
import json
import os
import re
import subprocess
from pathlib import Path

import two_processes as two

CELLS = Path(__file__).resolve().parents[2] / "models/cells"
BUSES = "axes_1_3=vcan0,axes_4_6=vcan1,sensor=vcan2"


class UdpSensor(two.VcanTestCase):
    @classmethod
    def setUpClass(cls):
        subprocess.run(["ip", "link", "set", "lo", "up"], check=True)

    def cell(self, rate_Hz, host="127.0.0.1", more=""):
        text = (CELLS / "default.yaml").read_text().replace("ati_net_can_oem", "ati_net_ft")
        text = re.sub(r"(:\s*)(\.\./[\w./]+)", lambda m: m[1] + str((CELLS / m[2]).resolve()), text)
        text = text.replace("  bus: sensor\n  base_id: 0x68\n", f"  host: {host}\n  settings: {{rate: {rate_Hz}}}\n")
        file = self.folder / f"cell_{rate_Hz}.yaml"
        file.write_text(text + more)
        return file

    def run_both(self, cell, *faults, duration="4s"):
        with two.simulated_arm(BUSES, cell, *faults) as arm:
            with two.Process(two.PROGRAM, "run", cell, "--bus", BUSES, "--duration", duration, "--json", "--no-plot") as run:
                status, output, errors = run.wait(), run.output(), run.errors()
            self.assertEqual(arm.stop(), 0, arm.errors())
        self.assertTrue(output, errors)
        return status, json.loads(output), errors

    def test_a_wall_is_touched_at_each_rate_of_the_sensor(self):
        for rate_Hz in (1000, 7000):
            with self.subTest(rate_Hz):
                status, summary, errors = self.run_both(self.cell(rate_Hz))
                self.assertEqual((status, summary["faults"]), (0, []), errors)
                print(rate_Hz, "Hz: held samples", summary["held_samples"], flush=True)
                self.assertLess(summary["held_samples"], 40)

    def test_a_sensor_that_falls_silent_stops_the_arm(self):
        status, summary, errors = self.run_both(self.cell(1000), "--fault", "sensor:silent@3s")
        self.assertEqual(status, 1, errors)
        self.assertEqual([fault["fault"] for fault in summary["faults"]], ["sensor_lost"])
        self.assertIn("UDP 127.0.0.1", summary["faults"][0]["text"])

    def test_a_sensor_in_the_network_needs_consent(self):
        cell = self.cell(1000, "10.77.0.1", "enabling_input: {drive: axis_2, bit: 16}\n")
        for options, words in (((), "sensor.host: this force sensor isn't a process of this machine"),
                               (("--hardware=checked",), "found no proof")):
            done = subprocess.run([two.PROGRAM, "run", cell, "--bus", BUSES, *options], capture_output=True, text=True,
                                  timeout=60, stdin=subprocess.DEVNULL, env=dict(os.environ))
            self.assertEqual(done.returncode, 2, done.stdout + done.stderr)
            self.assertIn(words, done.stderr)
        done = subprocess.run([two.PROGRAM, "run", cell, "--bus", BUSES, "--hardware", "--without-proof"], capture_output=True,
                              text=True, timeout=60, stdin=subprocess.DEVNULL)
        self.assertIn("drives of a real arm on 10.77.0.1, UDP port 49152", done.stderr)
        self.assertIn("no terminal to confirm on", done.stderr)


if __name__ == "__main__":
    two.main()
