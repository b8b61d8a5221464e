"""A CAN interface of a real kernel fails under the controller in mid-motion: down and up again, removed, queue full."""
import json
import struct
import subprocess
import time

import two_processes as two

MID_MOTION_S = 1.6  # of the run: the hand moves from 0.5 s to 2.5 s, and set-up and tare take 0.3 s
FAILING, WORKING = "vcan1", "vcan0"  # of axes 4 to 6, and of axes 1 to 3
COUNTS_PER_RAD = 150 * 2**20 / 6.283185307  # of axes 1 to 3


def ip(*words):
    subprocess.run(["ip", "link", *words], check=True)


class InterfaceFaults(two.VcanTestCase):
    def session_with(self, fail, mend):
        """Calls fail() in mid-motion and mend() 0.3 s later. The summary, the time of the failure and what was seen on
        the bus that works."""
        with two.simulated_arm(two.THREE), two.candump(WORKING) as witness, \
                two.controller(two.THREE, "60s", None, "--black-box", self.folder / "box") as run:
            time.sleep(MID_MOTION_S)
            fail()
            failed_us = time.time_ns() // 1000
            time.sleep(0.3)
            mend()
            self.assertEqual(run.wait(), 1, run.errors())
            return json.loads(run.output()), failed_us, two.frames_of(witness)

    def assert_stop(self, outcome, fault):
        summary, failed_us, seen = outcome
        self.assertEqual([entry["fault"] for entry in summary["faults"]], [fault])
        text = summary["faults"][0]["text"]
        self.assertIn("bus " + FAILING, text)
        for node in (1, 2, 3):
            commands = [(f.time_us, *struct.unpack("<Hi", f.data)) for f in two.of_node(seen, two.RPDO, node)]
            before = [target for time_us, _, target in commands if time_us <= failed_us]
            # Those with which the drive is still led; then it is switched off, and told where it stands.
            after = [target for time_us, word, target in commands if time_us > failed_us and word & 0x8F == 0x0F]
            self.assertTrue(3 <= len(after) <= 100, "at rest, and then switched off")
            # Slower from setpoint to setpoint, from the second one after the failure on: the cycle in which it happened
            # may have been through with it. Each is rounded to a count.
            steps = [abs(b - a) for a, b in zip(after[1:], after[2:])]
            for one, next_one in zip(steps, steps[1:]):
                self.assertLessEqual(next_one, one + 1)
            self.assertLessEqual(steps[-1], max(1, max(steps) / 2))
            self.assertLess(abs(after[-1] - before[-1]), 5e-3 * COUNTS_PER_RAD)
            word = struct.unpack("<Hi", two.of_node(seen, two.TPDO, node)[-1].data)[0]
            self.assertNotIn(word & 0x6F, (0x27, 0x07), "off in the end")
        self.assertGreater(max(abs(before[-1] - before[0]) for before in two.setpoints(seen)[:3]), 100_000, "it moved")
        # The black box has the second before the failure, and what it recorded leads to the same setpoints again.
        self.assertGreater(len((self.folder / "box" / "signals.csv").read_text().splitlines()), 1_000)
        replayed = subprocess.run([two.PROGRAM, "replay", self.folder / "box"], capture_output=True, text=True)
        self.assertEqual(replayed.returncode, 0, replayed.stdout + replayed.stderr)
        return text

    def test_down_and_up_again(self):
        text = self.assert_stop(self.session_with(lambda: ip("set", "down", FAILING), lambda: ip("set", "up", FAILING)),
                                "interface_down")
        self.assertIn("down or was removed", text)

    def test_removed(self):
        def again():
            ip("add", "dev", FAILING, "type", "vcan")
            ip("set", "up", FAILING)

        text = self.assert_stop(self.session_with(lambda: ip("del", FAILING), again), "interface_down")
        self.assertIn("not every drive has confirmed", text, "a new interface of that name isn't the old one")

    def test_queue_full(self):
        """ENOBUFS from the kernel: netem holds every frame back for a second and has room for one."""
        def queue(*words):
            subprocess.run(["tc", "qdisc", *words], check=True)

        text = self.assert_stop(
            self.session_with(lambda: queue("add", "dev", FAILING, "root", "netem", "delay", "1s", "limit", "1"),
                              lambda: queue("del", "dev", FAILING, "root")), "send_failed")
        self.assertIn("queue is full", text)


if __name__ == "__main__":
    two.main()
