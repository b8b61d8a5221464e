"""Runs with the sensors that are known by their files alone: a new sensor is a new file, no code."""
import csv
import json
import math
import re
import unittest

from harness import SOURCE, ProgramTest

ROBOTOUS_IDS = "settings: {command_id: 0x1F0, first_id: 0x1F1, second_id: 0x1F2}"
MAKES = {"aidin_aft200": "", "robotous_rft": ROBOTOUS_IDS, "onrobot_hex": "", "wacoh_dynpick": "base_id: 7"}


class OtherSensors(ProgramTest):
    def cell_with(self, name, text=None):
        """The default cell with this sensor; `text` instead of the shipped file's, if given."""
        cell = (SOURCE / "models/cells/default.yaml").read_text()
        for path in ("../arms", "../../scenes", "../../sim"):
            cell = cell.replace(path + "/", str((SOURCE / "models/cells" / path).resolve()) + "/")
        sensor = SOURCE / f"models/sensors/{name}.yaml"
        if text is not None:
            sensor = self.folder / f"{name}.yaml"
            sensor.write_text(text)
        cell = cell.replace("../sensors/ati_net_can_oem.yaml", str(sensor))
        cell = re.sub(r"  base_id: 0x68\n", f"  {MAKES[name]}\n" if MAKES[name] else "", cell)
        file = self.folder / f"cell_{name}.yaml"
        file.write_text(cell)
        return file

    def test_each_make_renders_the_default_scene(self):
        for name in MAKES:
            with self.subTest(name):
                summary = self.summary(self.cell_with(name), "--duration", "1s")
                self.assertEqual(summary["faults"], [])

    def test_a_sensor_is_as_the_cell_sets_it(self):
        """Identifiers as delivered, another number, another model's divisors: no copy of the sensor's file."""
        cells = {"robotous_rft": ("", "settings: {force_divisor: 100, torque_divisor: 4000}\n  force_range_N: [150, 150, 150]"),
                 "aidin_aft200": ("settings: {sensor_number: 9, force_id: 0x101, torque_id: 0x103}",)}
        for name, settings in cells.items():
            for text in settings:
                with self.subTest(name, settings=text):
                    cell = self.cell_with(name)
                    changed = cell.read_text().replace(MAKES[name] or "link: ", text if MAKES[name] else text + "\n  link: ", 1)
                    cell.write_text(changed)
                    self.assertEqual(self.summary(cell, "--duration", "1s")["faults"], [])
        plan = self.call("plan", cell)
        self.assertRegex(plan.out, r"(?i)0?x?101\b")
        cell.write_text(changed.replace("torque_id: 0x103", "torque_id: 0x101"))
        refused = self.call("run", cell, "--duration", "1s")
        self.assertEqual(refused.status, 2)
        self.assertIn("force_id and torque_id with one value", refused.err)

    def test_a_sensor_on_can_fd_needs_a_bus_of_its_own_with_a_data_rate(self):
        """All six values in one frame of 12 bytes, at the data phase's rate."""
        text = ("name: FD sensor\nprotocol: described\nforce_range_N: [300, 300, 300]\ntorque_range_Nm: [15, 15, 15]\n"
                "format: {fd: true, bit_rate_switch: true}\nframes: [{id: 0x123, bytes: 12}]\nrate_Hz: 1000\nsignals:\n" +
                "".join(f"  {name}: {{byte: {2 * i}, bits: 16, type: signed, scale: {scale}}}\n" for i, (name, scale) in
                        enumerate((("fx", 0.01), ("fy", 0.01), ("fz", 0.01), ("tx", 0.001), ("ty", 0.001), ("tz", 0.001)))))
        cell = self.cell_with("aidin_aft200", text)
        classic = self.call("run", cell, "--duration", "1s")
        self.assertEqual(classic.status, 2)
        self.assertIn("CAN FD on a classic bus", classic.err)
        fd = cell.read_text().replace("name: sensor, bitrate: 1000000", "name: sensor, bitrate: 1000000, data_bitrate: 5000000")
        cell.write_text(fd)
        self.assertEqual(self.summary(cell, "--duration", "1s")["faults"], [])
        plan = self.call("plan", cell)
        self.assertEqual(plan.status, 0, plan.out)
        self.assertIn("5 Mbit/s", plan.out)
        cell.write_text(fd.replace("name: axes_1_3, bitrate: 1000000", "name: axes_1_3, bitrate: 1000000, data_bitrate: 5000000"))
        mixed = self.call("run", cell, "--duration", "1s")
        self.assertEqual(mixed.status, 2)
        self.assertIn("is classic CAN but the bus carries CAN FD", mixed.err)

    def test_a_sensor_on_a_modbus_line_renders_the_default_scene(self):
        cell = self.cell_with("aidin_aft200", (SOURCE / "models/sensors/robotiq_ft300.yaml").read_text())
        on_can = self.call("check", cell)
        self.assertEqual(on_can.status, 2)
        self.assertIn('sensor.bus: found "sensor", expected a Modbus line', on_can.err)
        text = cell.read_text().replace("  bus: sensor\n", "  bus: ft\n  base_id: 9\n")
        cell.write_text(text.replace("\ndrives:", "\nmodbus_lines:\n"
                                     "  - {name: ft, device: /dev/ttyUSB0, baud: 19200, parity: none}\ndrives:"))
        summary = self.summary(cell, "--duration", "5s")
        self.assertEqual(summary["faults"], [])
        self.assertGreater(summary["contact_time_s"], 0.5)
        for fault, name in (("silent", "sensor_lost"), ("frozen", "sensor_frozen")):
            outcome = self.call("run", "--json", cell, "--fault", f"sensor:{fault}@1s", "--duration", "5s")
            self.assertIn(name + " (bus ft", json.dumps(outcome.summary["faults"]))
        refused = self.call("run", cell, "--fault", "sensor:half@1s")
        self.assertEqual(refused.status, 2)
        self.assertIn("a fault of CAN frames for a sensor on Modbus", refused.err)

    def test_faults_that_a_sensor_cannot_have_are_refused(self):
        for name, fault in (("aidin_aft200", "checksum"), ("aidin_aft200", "status=0x1"), ("wacoh_dynpick", "checksum"),
                            ("robotous_rft", "status=0x0400")):
            with self.subTest(name + fault):
                outcome = self.call("run", self.cell_with(name), "--fault", f"sensor:{fault}@0.5s")
                self.assertEqual(outcome.status, 2, outcome.err)
                self.assertIn("sensor:" + fault[:6], outcome.err)

    def test_the_plan_names_their_frames_and_what_outranks_sync(self):
        outcome = self.call("plan", self.cell_with("aidin_aft200"))
        self.assertEqual(outcome.status, 0, outcome.err + outcome.out)
        self.assertIn("sensor frame 2", outcome.out)
        one_bus = self.call("plan", self.cell_with("aidin_aft200"), "--bus", "vcan0", "--timestep", "4ms")
        self.assertIn("outrank SYNC: sensor frame 1", one_bus.out)

    def test_a_sensor_that_streams_is_planned_by_its_own_clock_at_any_timestep(self):
        # Two frames of 135 us a millisecond, alone on their bus: 27 %, whatever the timestep is.
        for timestep in ("1ms", "3ms", "5ms", "10ms", "20ms"):
            with self.subTest(timestep):
                outcome = self.call("plan", self.cell_with("aidin_aft200"), "--timestep", timestep)
                self.assertEqual(outcome.status, 0, outcome.err + outcome.out)
                of_sensor = outcome.out[outcome.out.index("sensor: 1 Mbit/s"):]
                self.assertIn("at most 27 %", of_sensor)
                self.assertEqual(of_sensor.count("sensor frame 1 "), 1)
        outcome = self.call("run", self.cell_with("aidin_aft200"), "--timestep", "10ms", "--mass", "60", "--duration", "0.5s")
        self.assertNotIn("can't carry", outcome.err)

    def test_check_tells_where_a_files_figures_are_from(self):
        sensors = SOURCE / "models/sensors"
        for file in sorted(sensors.glob("*.yaml")):
            outcome = self.call("check", file)
            self.assertEqual(outcome.status, 0, outcome.err)
            self.assertIn("from: ", outcome.out, file.name)
        self.assertIn("not held against a second source: ", self.call("check", sensors / "wacoh_dynpick.yaml").out)
        self.assertNotIn("second source", self.call("check", sensors / "robotiq_ft300.yaml").out)

    def test_a_mistake_in_the_file_is_named_with_its_line(self):
        text = (SOURCE / "models/sensors/onrobot_hex.yaml").read_text()
        outcome = self.call("run", self.cell_with("onrobot_hex", text.replace("byte: 18", "byte: 21")))
        self.assertEqual(outcome.status, 2)
        self.assertRegex(outcome.err, r"onrobot_hex\.yaml:\d+: signals\.tz\.byte: found")

    def test_a_scan_names_its_interface_and_refuses_a_guess(self):
        self.assertEqual(self.call("scan").status, 2)
        outcome = self.call("scan", "--bus", "nosuch0")
        self.assertEqual(outcome.status, 2)
        self.assertEqual(len(outcome.err.strip().splitlines()), 1, outcome.err)
        self.assertEqual(self.call("scan", "--bus", "nosuch0", "--poll-sensor", "0x80").status, 2)
        self.assertIn("to scan a simulated arm: proxarm sim", self.call("scan", "--bus", "sim").err)


class SensorsThatFail(ProgramTest):
    cell_with = OtherSensors.cell_with

    def stop_of(self, cell, fault):
        """Summary of a session whose sensor fails in mid-motion, and cycles from there to the stop (None: there is
        none). A stop's setpoints come to rest without a jump, and the black box has the second before it."""
        # Power on to the first SYNC takes each sensor another time; the hand moves from 0.5 s to 2.5 s after it.
        outcome = self.call("run", "--json", "--no-plot", cell, "--fault", f"sensor:{fault}@1.9s", "--duration", "2.5s",
                            "--record", "session")
        self.assertIn(outcome.status, (0, 1), outcome.err)
        folder = self.folder / "session"
        sync = next(line for line in (folder / "frames.log").read_text().splitlines() if " 080#" in line)
        failed = math.ceil(1000 * (1.9 - float(sync[1:sync.index(")")])))
        rows = list(csv.DictReader((folder / "signals.csv").read_text().splitlines()))
        stopping = [int(row["cycle"]) for row in rows if row["phase"] == "stopping"]
        if not stopping:
            return outcome.summary, None
        for axis in range(1, 7):
            targets = [int(row[f"axis_{axis}_target_counts"]) for row in rows[stopping[0] - 2:stopping[-1] + 2]]
            steps = [abs(b - a) for a, b in zip(targets, targets[1:])]
            for one, next_one in zip(steps, steps[1:]):
                self.assertLessEqual(next_one, one + 1, "slower from setpoint to setpoint, but for rounding")
            self.assertLessEqual(steps[-1], 1)
        boxed = (folder / "black-box/signals.csv").read_text().splitlines()
        self.assertGreater(len(boxed) - 1, stopping[-1] - stopping[0] + 1000)
        return outcome.summary, stopping[0] - failed

    def test_what_each_make_does_when_it_fails(self):
        """Cycles to the reaction: three samples may be missing, and the first may be that of the cycle before. Which
        cable, and what came through it, is in the message."""
        table = (
            ("silent", "sensor_lost", 4, "no faulty frame"),
            ("samples", "sensor_lost", 4, "no faulty frame"),
            ("half", "sensor_lost", 4, r"samples incomplete|frames late, repeated or out of order"),
            ("swapped", "sensor_lost", 4, "frames late, repeated or out of order"),
            ("short", "sensor_lost", 4, "frames of a wrong length"),
            ("lost=2", "sensor_lost", 5, None),
            ("checksum", "sensor_lost", 4, "samples with a bad checksum"),
            ("status=0x0400", "sensor_status", 1, "status 0x0400"),
            ("saturated", "sensor_saturated", 1, None),
            ("frozen", "sensor_frozen", 22, None),
            ("duplicated", None, None, None),
            ("delay=1500", None, None, None),
        )
        cannot = {("aidin_aft200", "checksum"), ("robotous_rft", "checksum"), ("wacoh_dynpick", "checksum"),
                  ("aidin_aft200", "status=0x0400"), ("robotous_rft", "status=0x0400"),
                  ("wacoh_dynpick", "status=0x0400")}
        for make in MAKES:
            cell = self.cell_with(make)
            for fault, name, cycles, words in table:
                if (make, fault) in cannot:
                    continue
                with self.subTest(make=make, fault=fault):
                    summary, reaction = self.stop_of(cell, fault)
                    if name is None:
                        self.assertEqual(summary["faults"], [])
                        self.assertLessEqual(summary["held_samples"], 1)
                        continue
                    self.assertEqual([entry["fault"] for entry in summary["faults"]], [name])
                    self.assertTrue(0 <= reaction <= cycles, reaction)
                    text = summary["faults"][0]["text"]
                    self.assertIn(name + " (bus sensor", text)
                    self.assertIn("the arm made a controlled stop and the drives were switched off", text)
                    if words:
                        self.assertRegex(text, words)


if __name__ == "__main__":
    unittest.main()
