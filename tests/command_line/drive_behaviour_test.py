#!/usr/bin/python3
"""Drives as they are: what they refuse by its value, show late, never say, or do by themselves. Taken, or named in words."""
import re
import shutil
import unittest

import eds_styles
from eds_styles import I8
from harness import SOURCE, ProgramTest

DISPLAY = "    feedback: [{object: '0x6061', bits: 8}]\n"


class DriveBehaviour(ProgramTest):
    def run_to_fault(self, *arguments):
        """The one fault of a session that it ends."""
        outcome = self.call("run", "--json", "--no-plot", *arguments)
        self.assertEqual(outcome.status, 1, outcome.err + outcome.out)
        self.assertEqual(len(outcome.summary["faults"]), 1)
        return outcome.summary["faults"][0]

    def of_shoulder(self, *lines):
        """The bench, with these lines at its first drive."""
        return self.changed("models/cells/bench.yaml", ("    device_type: 0x00020192\n", "".join(lines)))

    def test_a_drive_that_is_not_enabled_is_named_with_its_state_and_what_to_look_for(self):
        cases = {
            "sto": ("it stayed in switch on disabled (statusword 0x0250)", "is STO closed"),
            "bit12": ("it stayed in operation enabled", "bit 12 of the statusword", "enable_timeout_s"),
        }
        for kind, words in cases.items():
            with self.subTest(kind):
                fault = self.run_to_fault("--fault", f"axis_2:{kind}")
                self.assertEqual(fault["fault"], "drive_not_enabled")
                for word in ("axis_2", *words):
                    self.assertIn(word, fault["text"])

    def test_sto_that_opens_in_motion_is_a_drive_that_left_operation(self):
        self.assertEqual(self.run_to_fault("--fault", "axis_2:sto@2s")["fault"], "drive_disabled")

    def test_a_slow_brake_is_waited_for_as_long_as_the_cell_says(self):
        slow = ("    simulation:\n", "    simulation:\n      brake_release_s: 8\n")
        cell = self.changed("models/cells/bench.yaml", slow)
        fault = self.run_to_fault(cell, "--duration", "0.2s")
        self.assertEqual(fault["fault"], "drive_not_enabled")
        self.assertIn("bit 12", fault["text"])
        self.changed("models/cells/bench.yaml",
                     ("    device_type: 0x00020192\n", "    bring_up: {enable_timeout_s: 12}\n"))
        # The cell's own hand would be on its way by then.
        rests = self.written("rests.yaml", "name: at rest\nmass_kg: 1.0\nstiffness_N_per_m: 500\ndamping_Ns_per_m: 20\n"
                                           "waypoints:\n  - {time_s: 0.5, offset_m: [0, 0, 0]}\n")
        self.assertEqual(self.summary(cell, "--no-plot", "--duration", "0.2s", "--hand", rests)["faults"], [])

    def test_a_mode_that_shows_once_enabled_is_looked_at_in_the_cycle(self):
        late = ("--no-plot", "--duration", "0.2s", "--timestep", "2ms", "--fault", "shoulder:mode_late")
        cell = self.of_shoulder(DISPLAY)
        self.assert_refused(self.call("run", cell, *late), "6061h:00 modes of operation display", "found 0x00 (0)")
        self.changed("models/cells/bench.yaml", (DISPLAY, DISPLAY + "    bring_up: {mode_shown: enabled}\n"))
        self.assertEqual(self.summary(cell, *late)["faults"], [])
        fault = self.run_to_fault(cell, "--timestep", "2ms", "--fault", "shoulder:mode_late", "--fault",
                                  "shoulder:mode=3")
        self.assertEqual(fault["fault"], "drive_not_enabled")
        self.assertIn("6061h shows mode 3 and not 8", fault["text"])
        blind = self.changed("models/cells/bench.yaml", (DISPLAY, ""))
        self.assert_refused(self.call("run", blind), "bench.yaml", "mode_shown", "feedback")

    def test_a_drive_that_changes_its_mode_by_itself_is_stopped_where_the_cycle_sees_it(self):
        cell = self.of_shoulder(DISPLAY)
        fault = self.run_to_fault(cell, "--timestep", "2ms", "--fault", "shoulder:mode=1@2s")
        self.assertEqual(fault["fault"], "drive_fault")
        self.assertIn("changed its mode of operation by itself", fault["text"])

    def test_two_drives_with_one_node_number_are_noticed(self):
        fault = self.run_to_fault("--fault", "axis_2:twin")
        self.assertEqual(fault["fault"], "drive_fault")
        self.assertIn("two drives answer with this node number", fault["text"])

    def test_what_a_drive_refuses_by_its_value_is_its_makers_and_said(self):
        # The simulated drive has 605Ah, 605Eh and 1029h:01 at what is wanted before anything is written.
        for index in (0x605B00, 0x606500, 0x608500, 0x100600, 0x140005):
            with self.subTest(hex(index)):
                lines = self.summary("--no-plot", "--duration", "0.1s", "--fault", f"axis_1:refuses=0x{index:X}")["drives_lack"]
                name = f"{index >> 8:04X}h:{index & 0xFF:02X} is 0x"
                self.assertTrue(any(name in line and "can't be set to" in line for line in lines), lines)
        self.assert_refused(self.call("run", "--fault", "axis_1:refuses=0x606000"), "6060h:00", "06090030")
        self.assert_refused(self.call("run", "--fault", "axis_1:refuses=0x606000@2s"), "no time")

    def eds_cell(self, table):
        folder = self.copies() / "models/cells"
        (folder / "drive.eds").write_text(eds_styles.plain(table))
        (folder / "mine.yaml").write_text((folder / "default.yaml").read_text().replace(
            "    device_type: 0x00020192\n", "    eds: drive.eds\n"))
        return folder / "mine.yaml"

    def test_the_default_of_what_shows_a_state_is_no_requirement(self):
        for value in ("0", "1", "6"):
            table = eds_styles.usual()
            table[(0x6061, 0)] = ("Mode Display", I8, "ro", 1, value)
            self.assertEqual(self.summary(self.eds_cell(table), "--no-plot", "--duration", "0.1s")["faults"], [])

    def test_an_interpolation_period_that_is_the_drives_own_is_taken_where_it_fits(self):
        table = eds_styles.usual()
        table[(0x60C2, 2)] = ("Interpolation Index", I8, "ro", 0, "-3")
        cell = self.eds_cell(table)
        self.assertEqual(self.summary(cell, "--no-plot", "--duration", "0.1s")["faults"], [])
        self.assert_refused(self.call("run", cell, "--timestep", "1250us"), "[60C2sub2]", "can't be written")

    def test_faults_of_torque_drives_act_or_are_refused(self):
        usual = self.summary("models/cells/light.yaml", "--no-plot", "--duration", "2s")["setpoint_sha256"]
        for kind in ("reversed", "ignored"):
            outcome = self.call("run", "models/cells/light.yaml", "--json", "--no-plot", "--duration", "2s", "--fault", f"shoulder:{kind}@1s")
            self.assertNotEqual(outcome.summary["setpoint_sha256"], usual, kind)
        self.assert_refused(self.call("run", "models/cells/light.yaml", "--fault", "shoulder:runaway=0.5rad/s"), "takes torques",
                            "reversed", "ignored")

    def test_a_sensor_whose_answers_come_too_late_is_refused_for_that(self):
        for delay in (150000, 500000):
            self.assert_refused(self.call("run", "--fault", f"sensor:delay={delay}"), "bus sensor", "too late", "each within 100 ms")

    def test_a_cell_of_modbus_lines_alone_is_rendered(self):
        text = (SOURCE / "models/cells/rail.yaml").read_text()
        drives = re.split(r"(?m)^(?=  - joint: )", text[text.index("drives:\n") + 8:text.index("\nsensor:")])[1:]
        on_lines = []
        for node, drive in enumerate(drives, 1):
            drive = re.sub(r"(?m)^    (device_type|mode|word_order_tried): .*\n", "", drive)
            drive = re.sub(r"(?m)^    (bus): .*$", rf"    \1: line_{node}", drive)
            drive = re.sub(r"(?m)^    node: .*$", f"    node: {node}", drive)
            drive = re.sub(r"(?m)^    profile: .*$", "    profile: modbus\n    word_order_tried: true", drive)
            drive = re.sub(r"(?m)^    description: .*\n", "", drive)
            on_lines.append(drive.replace("    profile: modbus\n",
                                          "    profile: modbus\n    description: ../drives/generic_absolute.yaml\n"))
        lines = "".join(f"  - {{name: line_{n}, host: 127.0.0.1, port: {15030 + n}}}\n" for n in range(1, 8))
        sensor = ("sensor:\n  description: ../sensors/robotiq_ft300.yaml\n  bus: line_7\n  base_id: 9\n  link: flange\n"
                  "  pose_link: {position_m: [0, 0, 0.03], rpy_rad: [0, 0, 0]}\n  sample_rate_Hz: 100\n")
        after = text[text.index("\nsensor:") + 1:]
        rest = after[re.search(r"(?m)^(?!sensor:)\w", after).start():]
        cell = self.copies() / "models/cells/lines.yaml"
        shutil.copytree(SOURCE / "models/drives", self.copies() / "models/drives")
        cell.write_text(text[:text.index("buses:\n")] + "buses: []\nmodbus_lines:\n" + lines + "\ndrives:\n" +
                        "".join(on_lines) + "\n" + sensor + rest)
        outcome = self.call("run", cell, "--json", "--no-plot", "--duration", "0.5s", "--scene", SOURCE / "scenes/free.yaml",
                            "--timestep", "4ms", "--mass", "200", "--damping", "500")
        self.assertEqual(outcome.status, 0, outcome.err)
        self.assertEqual(outcome.summary["faults"], [])
        self.assertEqual(outcome.err.count("exchanges/s of"), 6, outcome.err)


if __name__ == "__main__":
    unittest.main()
