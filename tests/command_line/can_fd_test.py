"""Drives whose PDOs are CAN FD frames: all six and the sensor on one bus, at a millisecond, which classic CAN can't carry."""
import re
import unittest

from harness import SOURCE, ProgramTest

SENSOR = ("name: FD sensor\nprotocol: described\nforce_range_N: [300, 300, 300]\ntorque_range_Nm: [15, 15, 15]\n"
          "format: {fd: true, bit_rate_switch: true}\nframes: [{id: 0x123, bytes: 12}]\nrate_Hz: 1000\nsignals:\n" +
          "".join(f"  {name}: {{byte: {2 * i}, bits: 16, type: signed, scale: {scale}}}\n" for i, (name, scale) in
                  enumerate((("fx", 0.01), ("fy", 0.01), ("fz", 0.01), ("tx", 0.001), ("ty", 0.001), ("tz", 0.001)))))
# The error code, and the mode: 9 bytes with statusword and position, 12 on the wire.
FEEDBACK = "[{object: \"0x603F\", bits: 16}, {object: \"0x6061:00\", bits: 8}]"
# 14 of 32 bits and one of 16 more: 64 bytes.
LONGEST = "[" + "{object: \"0x606C\", bits: 32}, " * 14 + "{object: \"0x603F\", bits: 16}]"


def fd_cell(folder):
    """Of the default cell's text: one bus, CAN FD at 1 and 8 Mbit/s."""
    text = (SOURCE / "models/cells/default.yaml").read_text()
    for path in ("../arms", "../sensors", "../../scenes", "../../sim"):
        text = text.replace(path + "/", str((SOURCE / "models/cells" / path).resolve()) + "/")
    (folder / "sensor.yaml").write_text(SENSOR)
    text = re.sub(r"/\S*ati_net_can_oem.yaml", str(folder / "sensor.yaml"), text).replace("  base_id: 0x68\n", "")
    text = re.sub(r"buses:\n(  - .*\n)+", "buses:\n  - {name: all, bitrate: 1000000, data_bitrate: 8000000}\n", text)
    text = re.sub(r"bus: (axes_1_3|axes_4_6|sensor)\n", "bus: all\n", text)
    feedback = iter([FEEDBACK] * 5 + [LONGEST])
    text = re.sub(r"    mode: csp\n", lambda _: f"    mode: csp\n    fd: true\n    feedback: {next(feedback)}\n", text)
    file = folder / "fd.yaml"
    file.write_text(text)
    return file


class CanFd(ProgramTest):
    def test_six_drives_and_the_sensor_share_a_bus(self):
        cell = fd_cell(self.folder)
        plan = self.call("plan", cell)
        self.assertEqual(plan.status, 0, plan.out)
        self.assertIn("1/8 Mbit/s", plan.out)
        summary = self.summary(cell, "--duration", "2s", "--record", "session")
        self.assertEqual(summary["faults"], [])
        log = (self.folder / "session" / "frames.log").read_text()
        # Flags 1: the data phase is at the higher bitrate.
        for node in range(1, 6):
            self.assertRegex(log, rf" 18{node}##1[0-9A-F]{{18}}000000\n")
        self.assertRegex(log, r" 186##1[0-9A-F]{128}\n")
        self.assertRegex(log, r" 201##1[0-9A-F]{12}\n")
        self.assertRegex(log, r" 080#\n")
        for request in ("601", "581", "701", "77F"):
            self.assertRegex(log, rf" {request}#[0-9A-F]+\n", "all that isn't a PDO stays classic")
            self.assertNotIn(f" {request}##", log)
        replay = self.call("replay", "session")
        self.assertEqual(replay.status, 0, replay.out + replay.err)
        self.assertEqual(self.call("check", cell).status, 0)

    def test_classic_and_fd_on_one_bus_are_refused(self):
        cell = fd_cell(self.folder)
        text = cell.read_text()
        cell.write_text(text.replace(", data_bitrate: 8000000", ""))
        self.assert_refused(self.call("run", cell), ".fd: found true", "bus all is classic CAN")
        cell.write_text(text.replace("    fd: true\n", "", 1).replace(f"    feedback: {FEEDBACK}\n", "", 1))
        self.assert_refused(self.call("run", cell), "axis_1 is classic CAN but the bus carries CAN FD", "fd: true")
        sensor = self.folder / "sensor.yaml"
        sensor.write_text(SENSOR.replace("format: {fd: true, bit_rate_switch: true}\n", "").replace(
            "[{id: 0x123, bytes: 12}]", "[{id: 0x123, bytes: 6}, {id: 0x124, bytes: 6}]"))
        cell.write_text(text)
        self.assert_refused(self.call("run", cell, "--timestep", "2ms"), "is classic CAN but the bus carries CAN FD")

    def test_feedback_beyond_a_frame_is_refused(self):
        cell = fd_cell(self.folder)
        text = cell.read_text()
        cell.write_text(text.replace("bits: 16}]", "bits: 32}]"))
        self.assert_refused(self.call("run", cell), "drives[5]", "feedback", "66 bytes", "64 bytes")
        cell.write_text(text.replace("bits: 16}]", "bits: 24}]"))
        self.assert_refused(self.call("run", cell), "bits: found 24, expected 8, 16 or 32")
        cell.write_text(text.replace("    fd: true\n", "").replace(", data_bitrate: 8000000", ""))
        self.assert_refused(self.call("run", cell), "feedback", "at most 8 bytes", "64 with fd: true")


if __name__ == "__main__":
    unittest.main()
