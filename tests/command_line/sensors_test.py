"""Runs with the sensors that are known by their files alone: a new sensor is a new file, no code."""
import json
import re
import unittest

from harness import SOURCE, ProgramTest

MAKES = {"aidin_aft200": "", "robotous_rft": "base_id: 0x1F0", "onrobot_hex": "", "wacoh_dynpick": "base_id: 7"}


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

    def test_their_faults_end_the_run_with_a_name(self):
        for fault, name in (("half", "sensor_lost"), ("checksum", "sensor_lost"), ("saturated", "sensor_saturated"),
                            ("frozen", "sensor_frozen"), ("status=0x0400", "sensor_status")):
            with self.subTest(fault):
                outcome = self.call("run", "--json", self.cell_with("onrobot_hex"), "--fault", f"sensor:{fault}@0.5s",
                                    "--duration", "1s")
                self.assertEqual(outcome.status, 1, outcome.err)
                self.assertIn(name, json.dumps(outcome.summary["faults"]))

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
            self.assertIn(name, json.dumps(outcome.summary["faults"]))
        refused = self.call("run", cell, "--fault", "sensor:half@1s")
        self.assertEqual(refused.status, 2)
        self.assertIn("a fault of CAN frames for a sensor on Modbus", refused.err)

    def test_faults_that_a_sensor_cannot_have_are_refused(self):
        for name, fault in (("aidin_aft200", "checksum"), ("aidin_aft200", "status=0x1"), ("wacoh_dynpick", "checksum")):
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


if __name__ == "__main__":
    unittest.main()
