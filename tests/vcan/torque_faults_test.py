"""The light device on a real vcan: torques from a controller that ends well, and from one that is killed, stopped or
hung in mid-motion."""
import json
import signal
import socket
import struct
import time
from pathlib import Path

import two_processes as two

CELL = Path(__file__).resolve().parents[2] / "models/cells/light.yaml"
BUSES = "axes=vcan0,sensor=vcan1"
NODES = (1, 2, 3)
COUNTS_PER_RAD = 12 * 65536 / 6.283185307
MID_MOTION_S = 1.8  # the hand moves from 0.5 s to 2.5 s, and set-up and tare take 0.3 s


def feedback(seen, node):
    """6041h, 6064h and 6077h of a drive, with the time."""
    return [(f.time_us, *struct.unpack("<Hih", f.data)) for f in two.of_node(seen, two.TPDO, node)]


class Torques(two.VcanTestCase):
    def test_a_session_ends_well(self):
        with two.simulated_arm(BUSES, CELL) as arm, two.candump("vcan0") as witness, \
                two.controller(BUSES, "1s", None, CELL) as run:
            status, output, errors = run.wait(), run.output(), run.errors()
            seen = two.frames_of(witness)
            arm.stop()
        self.assertEqual((status, json.loads(output)["faults"]), (0, []), errors)
        for node in NODES:
            torques = [struct.unpack("<Hh", f.data)[1] for f in two.of_node(seen, two.RPDO, node)]
            self.assertGreater(len(torques), 1_000)
            self.assertNotIn(struct.unpack("<Hih", two.of_node(seen, two.TPDO, node)[-1].data)[0] & 0x6F, (0x27, 0x07))
        shoulder = [struct.unpack("<Hh", f.data)[1] for f in two.of_node(seen, two.RPDO, 2)]
        self.assertGreater(max(abs(torque) for torque in shoulder), 100, "it carries the device against gravity")

    def test_torques_of_a_killed_controller_end_within_three_setpoints(self):
        with two.simulated_arm(BUSES, CELL), two.candump("vcan0") as witness, \
                two.controller(BUSES, "60s", None, CELL) as run:
            time.sleep(MID_MOTION_S)
            run.send(signal.SIGKILL)
            run.wait()
            send_syncs()
            seen = two.frames_of(witness)
        self.assert_safe_torque(seen)

    def test_torques_of_a_stopped_controller_end_within_three_setpoints(self):
        """SIGSTOP, and then SIGCONT: it finds that it was late and another master's SYNCs on the bus, and ends."""
        with two.simulated_arm(BUSES, CELL), two.candump("vcan0") as witness, \
                two.controller(BUSES, "60s", None, CELL) as run:
            time.sleep(MID_MOTION_S)
            run.send(signal.SIGSTOP)
            send_syncs()
            ended_us = time.time_ns() // 1000
            run.send(signal.SIGCONT)
            status = run.wait()
            seen = two.frames_of(witness)
        self.assertEqual(status, 1)
        self.assert_safe_torque([f for f in seen if f.time_us < ended_us])

    def test_torques_end_within_three_setpoints_when_the_cycles_thread_alone_hangs(self):
        with two.simulated_arm(BUSES, CELL), two.candump("vcan0") as witness, \
                two.controller(BUSES, "60s", None, CELL) as run:
            time.sleep(MID_MOTION_S)
            with two.hung(run):
                send_syncs()
                ended_us = time.time_ns() // 1000
            status = run.wait()
            seen = two.frames_of(witness)
        self.assertEqual(status, 1)
        self.assert_safe_torque([f for f in seen if f.time_us < ended_us])

    def assert_safe_torque(self, seen):
        for node in NODES:
            last_us = two.of_node(seen, two.RPDO, node)[-1].time_us
            emergencies = [(f.time_us - last_us, f.data[:2]) for f in two.of_node(seen, two.EMCY, node)]
            self.assertEqual(emergencies[0][1], bytes([0x50, 0x82]), "8250h: no RPDO in time")
            # The timer of three periods, and a tick of the firmware: before a fourth setpoint was due.
            self.assertTrue(3_000 <= emergencies[0][0] <= 4_000, emergencies)
            told = feedback(seen, node)
            after = [word for time_us, word, _, _ in told if time_us > last_us + 4_000]
            self.assertNotIn(0x27, [word & 0x6F for word in after], "no torque of the controller's acts any more")
            at_kill = [position for time_us, _, position, _ in told if time_us <= last_us][-1]
            rest = told[-1][2]
            self.assertLess(abs(rest - at_kill), 0.02 * COUNTS_PER_RAD)
            still = [p for t, _, p, _ in told if t > last_us + 30_000]  # until the lost heartbeat ends the TPDOs
            self.assertGreater(len(still), 5)
            self.assertLessEqual(max(abs(p - rest) for p in still), 20)
        moved = [abs(feedback(seen, node)[-1][2] - feedback(seen, node)[0][2]) for node in NODES]
        self.assertGreater(max(moved), 0.05 * COUNTS_PER_RAD, "in mid-motion")


def send_syncs():
    """Drives tell where they are at SYNC, which nobody sends any more."""
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as bus:
        bus.bind(("vcan0",))
        for _ in range(200):
            bus.send(struct.pack("=IB3x8x", two.SYNC, 0))
            time.sleep(0.001)


if __name__ == "__main__":
    two.main()
