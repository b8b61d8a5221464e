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
