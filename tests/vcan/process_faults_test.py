"""What becomes of the arm when one of the two processes is told to end, or dies, in mid-motion; on a real vcan."""
import csv
import json
import signal
import socket
import struct
import subprocess
import time

import two_processes as two

MID_MOTION_S = 1.6  # of the run: the hand moves from 0.5 s to 2.5 s, and set-up and tare take 0.3 s
COUNTS_PER_RAD = 150 * 2**20 / 6.283185307  # of axes 1 to 3, whose gears are the longest


def feedback(seen, node):
    """6041h and 6064h of a drive, with the time."""
    return [(f.time_us, *struct.unpack("<Hi", f.data)) for f in two.of_node(seen, two.TPDO, node)]


class ProcessFaults(two.VcanTestCase):
    def signal_controller(self, number, afterwards):
        """Runs both, signals the controller in mid-motion; its status and output, when it ended, and what candump saw
        until `afterwards` was done."""
        with two.simulated_arm(two.THREE), two.candump(*two.INTERFACES) as witness, \
                two.controller(two.THREE, "60s", self.folder / "record") as run:
            time.sleep(MID_MOTION_S)
            run.send(number)
            status = run.wait()
            ended_us = time.time_ns() // 1000
            afterwards()
            return status, run.output(), ended_us, two.frames_of(witness)

    def controlled_stop(self, number):
        status, output, _, seen = self.signal_controller(number, lambda: time.sleep(0.2))
        self.assertEqual(status, 0)
        summary = json.loads(output)
        self.assertEqual(summary["faults"], [])
        self.assertEqual(two.setpoints_sha256(seen, summary), summary["setpoint_sha256"])
        targets = two.setpoints(seen)
        self.assertGreater(max(max(counts) - min(counts) for counts in targets), 1_000_000, "in mid-motion")
        with open(self.folder / "record" / "signals.csv") as signals:
            phases = [row["phase"] for row in csv.DictReader(signals)]
        begin, end = phases.index("stopping"), phases.index("disabling")
        self.assertTrue(3 <= end - begin <= 100, end - begin)
        for counts in targets:  # slower from target to target (each is rounded to a count)
            steps = [abs(b - a) for a, b in zip(counts[begin - 2:end], counts[begin - 1:end])]
            for one, next_one in zip(steps, steps[1:]):
                self.assertLessEqual(next_one, one + 1)
            self.assertLessEqual(steps[-1], max(1, max(steps) / 2))
        self.assert_drives_off(seen)
        for node in two.NODES:
            commands = [struct.unpack("<Hi", f.data)[0] for f in two.of_node(seen, two.RPDO, node)]
            self.assertIn(0x0F, [command & 0x8F for command in commands])
            self.assertEqual(commands[-1] & 0x8F, 0x00, "disable voltage")
            states = [word & 0x4F for _, word, _ in feedback(seen, node)]
            self.assertNotIn(0x08, states[states.index(0x07):], "no fault since it was enabled")
        record = two.read_log(self.folder / "record" / "frames.log")
        self.assertEqual(len(record), len(seen), "nobody says anything after the goodbye")

    def test_sigterm_makes_a_controlled_stop(self):
        self.controlled_stop(signal.SIGTERM)

    def test_sigint_makes_a_controlled_stop(self):
        self.controlled_stop(signal.SIGINT)

    def test_sighup_makes_a_controlled_stop(self):
        """It killed the controller in motion: a terminal that was closed."""
        self.controlled_stop(signal.SIGHUP)

    def test_a_hold_by_the_socket_stops_the_arm_and_resume_goes_on(self):
        """From another process, while the hand leads: drives stay enabled, and stand."""
        control, record = self.folder / "control", self.folder / "record"
        self.folder.chmod(0o700)
        with two.simulated_arm(two.THREE), two.candump(*two.INTERFACES) as witness, \
                two.controller(two.THREE, "60s", record, "--control", control) as run:
            time.sleep(MID_MOTION_S)
            asked_us = time.time_ns() // 1000
            for order in ("hold", "resume"):
                done = subprocess.run([two.PROGRAM, order, "--control", control], capture_output=True, text=True,
                                      timeout=30)
                self.assertEqual((done.returncode, done.stderr), (0, ""))
                if order == "hold":
                    answered_us = time.time_ns() // 1000
                    time.sleep(0.5)
            time.sleep(0.3)
            self.assertEqual(run.stop(), 0, run.errors())
            summary = json.loads(run.output())
            seen = two.frames_of(witness)
        self.assertEqual((summary["faults"], summary["notices"]), ([], []))
        self.assertLess(answered_us - asked_us, 100_000)
        with open(record / "signals.csv") as signals:
            phases = [row["phase"] for row in csv.DictReader(signals)]
        begin = phases.index("holding")
        end = phases.index("rendering", begin)
        self.assertGreater(end - begin, 450)
        self.assertIn("stopping", phases[end:])
        first_us = next(f.time_us for f in seen if f.interface == "vcan0" and f.id == two.SYNC)
        self.assertLess(first_us + 1000 * begin - asked_us, 100_000, "from the order to the cycle that obeys it")
        for counts in two.setpoints(seen):
            # v²/2a is 6 mm at most: the targets stand after 100 cycles, and until it goes on.
            self.assertEqual(len(set(counts[begin + 100:end])), 1)
        for node in two.NODES:
            words = [word & 0x6F for time_us, word, _ in feedback(seen, node)
                     if begin < (time_us - first_us) // 1000 < end]
            self.assertEqual(set(words), {0x27}, "operation enabled")

    def test_drives_of_a_killed_controller_stop_by_themselves(self):
        status, _, killed_us, seen = self.signal_controller(signal.SIGKILL, send_syncs)
        self.assertEqual(status, -signal.SIGKILL)
        for node in two.NODES:
            emergencies = [(f.time_us - killed_us, f.data[:2]) for f in two.of_node(seen, two.EMCY, node)]
            # 8250h: no RPDO for 5 periods. 8130h: no heartbeat for 60 ms, one came every 20 ms.
            self.assertEqual([code for _, code in emergencies], [bytes([0x50, 0x82]), bytes([0x30, 0x81])])
            self.assertTrue(3_000 <= emergencies[0][0] <= 7_000, emergencies)
            self.assertTrue(35_000 <= emergencies[1][0] <= 65_000, emergencies)
            told = feedback(seen, node)
            at_kill = [position for time_us, _, position in told if time_us <= killed_us][-1]
            rest = told[-1][2]
            after_30_ms = [position for time_us, _, position in told if time_us > killed_us + 30_000]
            self.assertGreater(len(after_30_ms), 5, "until the drive leaves NMT operational at the lost heartbeat")
            # 20 counts are 0.8 µrad: the brakes' play. Seen: at rest after 13 ms and 0.37 mrad.
            self.assertLessEqual(max(abs(position - rest) for position in after_30_ms), 20)
            self.assertLess(abs(rest - at_kill), 5e-3 * COUNTS_PER_RAD)
        self.assert_drives_off(seen)

    def test_drives_of_a_stopped_controller_stop_by_themselves(self):
        """SIGSTOP: the process is there, its sockets too, and nothing comes any more. When it goes on, it finds that it
        was late and another master's SYNCs on the bus, and ends."""
        with two.simulated_arm(two.THREE), two.candump(*two.INTERFACES) as witness, \
                two.controller(two.THREE, "60s") as run:
            time.sleep(MID_MOTION_S)
            run.send(signal.SIGSTOP)
            stopped_us = time.time_ns() // 1000
            send_syncs()
            run.send(signal.SIGCONT)
            status = run.wait()
            seen = two.frames_of(witness)
        self.assertEqual(status, 1)
        self.assert_stopped_by_themselves(seen, stopped_us)

    def test_drives_stop_by_themselves_when_the_cycles_thread_alone_hangs(self):
        """The process lives, its other threads write the record: none of them may send a heartbeat on its behalf."""
        with two.simulated_arm(two.THREE), two.candump(*two.INTERFACES) as witness, \
                two.controller(two.THREE, "60s", self.folder / "record") as run:
            time.sleep(MID_MOTION_S)
            with two.hung(run):
                hung_us = time.time_ns() // 1000
                states = two.thread_states(run)
                send_syncs()
            status = run.wait()
            seen = two.frames_of(witness)
        self.assertEqual(states[0], "t")
        self.assertGreater(len(states), 1)
        self.assertNotIn("t", states[1:], "the others go on")
        self.assertEqual(status, 1)
        self.assert_stopped_by_themselves(seen, hung_us)
        silent = [f.id for f in seen if hung_us + 1_000 < f.time_us < hung_us + 290_000]
        for its_own in (two.MASTER_HEARTBEAT, *(two.RPDO + node for node in two.NODES)):
            self.assertNotIn(its_own, silent)

    def assert_stopped_by_themselves(self, seen, stopped_us):
        for node in two.NODES:
            emergencies = [(f.time_us - stopped_us, f.data[:2]) for f in two.of_node(seen, two.EMCY, node)]
            self.assertEqual([code for _, code in emergencies][:2], [bytes([0x50, 0x82]), bytes([0x30, 0x81])])
            self.assertTrue(3_000 <= emergencies[0][0] <= 7_000, emergencies)
            told = [(time_us, position) for time_us, _, position in feedback(seen, node)]
            at_stop = [position for time_us, position in told if time_us <= stopped_us][-1]
            still = [p for time_us, p in told if stopped_us + 30_000 < time_us < stopped_us + 300_000]
            self.assertLess(max(abs(position - at_stop) for position in still), 5e-3 * COUNTS_PER_RAD)
            self.assertLessEqual(max(still) - min(still), 20)

    def test_a_killed_arm_is_told_of_and_the_record_is_whole(self):
        record = self.folder / "record"
        with two.simulated_arm(two.THREE) as arm, two.controller(two.THREE, "60s", record) as run:
            time.sleep(MID_MOTION_S)
            arm.send(signal.SIGKILL)
            status = run.wait()
            summary = json.loads(run.output())
        self.assertEqual(status, 1)
        self.assertEqual([fault["fault"] for fault in summary["faults"]], ["sensor_lost"], "its limit is the lowest")
        text = summary["faults"][0]["text"]
        self.assertIn("not every drive has confirmed", text)
        self.assertNotIn("the drives were switched off", text)
        self.assertEqual(json.loads((record / "summary.json").read_text())["faults"], summary["faults"])
        self.assertEqual(len((record / "signals.csv").read_text().splitlines()), 1 + summary["cycles"])
        frames = two.read_log(record / "frames.log")
        self.assertEqual(two.setpoints_sha256(frames, summary), summary["setpoint_sha256"])

    def test_a_killed_drive_is_named(self):
        """The far end's fault script: one drive of six goes silent."""
        with two.simulated_arm(two.THREE, "--fault", "axis_5:silent@1.6s"), \
                two.controller(two.THREE, "60s") as run:
            status = run.wait()
            summary = json.loads(run.output())
        self.assertEqual(status, 1)
        self.assertEqual([fault["fault"] for fault in summary["faults"]], ["drive_silent"])
        self.assertIn("drive of axis_5, bus axes_4_6, node 5", summary["faults"][0]["text"])

    def test_the_next_controller_takes_the_arm_over(self):
        """With the same simulated arm: at once after a clean end, and after one that was killed."""
        with two.simulated_arm(two.THREE, "--hand", two.write_hand(self.folder, "at_rest")):
            for ending in (None, signal.SIGKILL, None):
                with two.controller(two.THREE, "0.3s") as run:
                    if ending:
                        time.sleep(0.5)
                        run.send(ending)
                    self.assertEqual(run.wait(), -ending if ending else 0, run.errors() + run.output())


def send_syncs():
    """Drives tell where they are at SYNC, which nobody sends any more."""
    buses = []
    for interface in ("vcan0", "vcan1"):
        buses.append(socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW))
        buses[-1].bind((interface,))
    for _ in range(300):
        for bus in buses:
            bus.send(struct.pack("=IB3x8x", two.SYNC, 0))
        time.sleep(0.001)
    for bus in buses:
        bus.close()


if __name__ == "__main__":
    two.main()
