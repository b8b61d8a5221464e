#!/usr/bin/python3
"""The example of an arm whose own controller takes joint positions over UDP (docs/examples/udp_arm.cpp), against a
controller that is written from docs/how_to/own_interface.md alone, and judges each datagram. tests/library compiles the example."""
import contextlib
import math
import pathlib
import re
import signal
import socket
import struct
import subprocess
import threading
import time
import unittest

from harness import SOURCE, ProgramTest, program

DATAGRAM = struct.Struct("<4sIII6d")
OFF, FOLLOW, STOP = 0, 1, 2  # what is asked
STANDS_OFF, FOLLOWS, STOPS, FAULT = 0, 1, 2, 3  # what is answered
VALIDATED_S = 0.3  # so long all setpoints are at the arm's own position, before it follows: then its brakes are open
NEAR_RAD = 1e-3
WATCHDOG_S = 0.25  # of this test, for a busy machine; the page has 20 ms


def start_of_the_cell():
    text = (SOURCE / "models/cells/default.yaml").read_text()
    start = [float(x) for x in re.search(r"start_rad: \[(.*?)\]", text)[1].split(",")]
    speeds = [float(x) for x in re.findall(r"max_speed_rad_per_s: ([\d.]+)", text)]
    accelerations = [float(x) for x in re.findall(r"max_acceleration_rad_per_s2: ([\d.]+)", text)]
    ranges = [tuple(map(float, r.split(","))) for r in re.findall(r"range_rad: \[(.*?)\]", text)]
    return start, speeds[:6], accelerations[:6], ranges[:6]


class Controller:
    """The arm's controller with an ideal arm: its joints are where they were told to be a setpoint ago."""

    def __init__(self, start=None):
        self.q, self.speeds, self.accelerations, self.ranges = start_of_the_cell()
        self.q = list(start or self.q)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.settimeout(0.002)
        self.port = self.socket.getsockname()[1]
        self.state, self.good, self.last, self.heard = STANDS_OFF, 0.0, None, None
        self.braked = None  # when the last piece of braking ended
        self.velocity, self.period_s = [0.0] * 6, 0.001
        self.setpoints, self.times, self.mistakes, self.wishes = [], [], [], []
        self.silent_after, self.fault_after, self.ended = math.inf, math.inf, False
        self.master, self.strangers = None, []
        self.stopped_at = None  # when it braked by itself
        self.thread = threading.Thread(target=self.serve, daemon=True)
        self.thread.start()

    def serve(self):
        while not self.ended:
            with contextlib.suppress(socket.timeout, ConnectionError):
                data, peer = self.socket.recvfrom(200)
                self.take(data, peer)
            if self.state == FOLLOWS and time.monotonic() - self.heard > WATCHDOG_S:
                self.stop(STOPS)
                self.stopped_at = time.monotonic()
            if self.state in (STOPS, FAULT):
                self.brake()

    def stop(self, state):
        """From now on the arm brakes, and reports this state."""
        self.state, self.braked = state, time.monotonic()

    def brake(self):
        """Slows down along the path, as hard as each joint may, until the arm stands."""
        now = time.monotonic()
        seconds, self.braked = now - self.braked, now
        stands_in = max(abs(speed) / limit for limit, speed in zip(self.accelerations, self.velocity))
        kept = 1.0 - seconds / stands_in if seconds < stands_in else 0.0
        went = (1.0 + kept) / 2 * min(seconds, stands_in)
        self.q = [q + speed * went for q, speed in zip(self.q, self.velocity)]
        self.velocity = [kept * speed for speed in self.velocity]

    def refuse(self, what):
        self.mistakes.append(what)
        if self.state == FOLLOWS:
            self.stop(FAULT)

    def take(self, data, peer):
        if self.master is not None and peer != self.master:
            return self.strangers.append(peer)
        if len(data) != DATAGRAM.size:
            return self.refuse(f"{len(data)} bytes")
        word, number, wish, period_us, *q = DATAGRAM.unpack(data)
        if word != b"PXA1" or wish > STOP or not all(map(math.isfinite, q)):
            return self.refuse(f"a datagram {data!r}")
        self.master = peer
        if self.last is not None and number != self.last + 1:
            self.refuse(f"number {number} after {self.last}")
        self.last, self.heard, self.period_s = number, time.monotonic(), period_us * 1e-6
        self.wishes.append(wish)
        self.obey(wish, q)
        if self.state == FOLLOWS and len(self.setpoints) > self.fault_after:
            self.stop(FAULT)
        if len(self.setpoints) > self.silent_after:
            return None
        return self.socket.sendto(DATAGRAM.pack(b"PXS1", number, self.state, period_us, *self.q), peer)

    def obey(self, wish, q):
        if wish != FOLLOW:
            self.good = 0.0
            if self.state == FOLLOWS:
                self.stop(STOPS)  # asked for off, it brakes before it is off
            if wish == OFF and self.state == STOPS and not any(self.velocity):
                self.state = STANDS_OFF
            return
        if self.state == STANDS_OFF:
            self.good = self.good + self.period_s if max(abs(a - b) for a, b in zip(q, self.q)) < NEAR_RAD else 0.0
            if self.good < VALIDATED_S:
                return
            self.state, self.velocity = FOLLOWS, [0.0] * 6
        if self.state != FOLLOWS:
            return
        for i, (now, before) in enumerate(zip(q, self.q)):
            velocity = (now - before) / self.period_s
            if not self.ranges[i][0] <= now <= self.ranges[i][1]:
                return self.refuse(f"joint {i + 1} at {now:.3g} rad")
            if abs(velocity) > self.speeds[i] * 1.01:
                return self.refuse(f"joint {i + 1} at {velocity:.3g} rad/s")
            if abs(velocity - self.velocity[i]) / self.period_s > self.accelerations[i] * 1.05:
                return self.refuse(f"joint {i + 1}: {(velocity - self.velocity[i]) / self.period_s:.3g} rad/s2")
        self.velocity = [(now - before) / self.period_s for now, before in zip(q, self.q)]
        self.q = list(q)
        self.setpoints.append(q)
        self.times.append(time.monotonic())

    def close(self):
        self.ended = True
        self.thread.join()
        self.socket.close()


class Master:
    """Sends setpoints one at a time, and reads what the controller answers."""

    period_s = 0.004

    def __init__(self, port):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.connect(("127.0.0.1", port))
        self.socket.settimeout(5)
        self.number = 0

    def send(self, wish, q):
        self.number += 1
        self.socket.send(DATAGRAM.pack(b"PXA1", self.number, wish, round(1e6 * self.period_s), *q))

    def say(self, wish, q):
        """State and joints of the answer."""
        self.send(wish, q)
        _, number, state, _, *joints = DATAGRAM.unpack(self.socket.recv(200))
        assert number == self.number
        return state, joints


class TimingOfTheController(unittest.TestCase):
    """The reference controller itself keeps what docs/how_to/own_interface.md demands of a controller."""

    def setUp(self):
        self.controller = Controller()
        self.addCleanup(self.controller.close)
        self.master = Master(self.controller.port)
        self.addCleanup(self.master.socket.close)
        self.q = list(self.controller.q)

    def validate(self):
        for _ in range(round(VALIDATED_S / self.master.period_s) + 2):
            state, _ = self.master.say(FOLLOW, self.q)
        self.assertEqual(state, FOLLOWS)

    def move(self):
        """Gets joint 1 to 0.1 rad/s in steps that its acceleration allows."""
        self.validate()
        speed = 0.0
        while speed < 0.1:
            speed = min(speed + 0.5 * self.controller.accelerations[0] * self.master.period_s, 0.1)
            self.q[0] += speed * self.master.period_s
            state, joints = self.master.say(FOLLOW, self.q)
        self.assertEqual((state, joints[0], self.controller.mistakes), (FOLLOWS, self.q[0], []))

    def assert_brakes(self, state, wish):
        """From 0.1 rad/s of joint 1: it goes on, no further than an even ramp takes it, and stands."""
        begun, braking, until = self.q[0], [], time.monotonic() + 5
        while not (len(braking) > 1 and braking[-1] == braking[-2]) and time.monotonic() < until:
            time.sleep(0.02)  # many times the controller's 2 ms
            now, joints = self.master.say(wish, self.q)
            self.assertEqual(now, state)
            braking.append(joints[0])
        ramp = 0.1**2 / (2 * self.controller.accelerations[0])
        self.assertGreater(braking[-1], begun, "not at once")
        self.assertLess(braking[-1] - begun, 1.01 * ramp)
        self.assertEqual(braking, sorted(braking))
        self.assertEqual(braking[-1], braking[-2], "it stands")

    def test_a_fault_brakes_the_arm(self):
        self.move()
        state, _ = self.master.say(FOLLOW, [self.q[0] + 1.0, *self.q[1:]])
        self.assertEqual(state, FAULT)
        self.assert_brakes(FAULT, FOLLOW)
        self.assertEqual(len(self.controller.mistakes), 1)

    def test_asked_to_stop_it_brakes_and_follows_only_after_off_and_validation(self):
        self.move()
        state, _ = self.master.say(STOP, self.q)
        self.assertEqual(state, STOPS)
        self.assert_brakes(STOPS, STOP)
        self.q = list(self.controller.q)
        for _ in range(200):
            self.assertEqual(self.master.say(FOLLOW, self.q), (STOPS, self.q))
        self.assertEqual(self.master.say(OFF, self.q), (STANDS_OFF, self.q))
        self.assertEqual(self.master.say(FOLLOW, self.q), (STANDS_OFF, self.q))
        self.validate()

    def test_from_the_first_setpoint_on_only_its_sender_is_heard(self):
        self.master.say(OFF, self.q)
        stranger = Master(self.controller.port)
        self.addCleanup(stranger.socket.close)
        for wish in (OFF, FOLLOW):
            stranger.send(wish, [0.1] * 6)
        self.validate()
        for wish in (OFF, STOP, FOLLOW):
            stranger.send(wish, [0.1] * 6)
        self.assertEqual(self.master.say(FOLLOW, self.q), (FOLLOWS, self.q))
        stranger.socket.setblocking(False)
        self.assertRaises(BlockingIOError, stranger.socket.recv, 200)
        self.assertEqual((len(self.controller.strangers), self.controller.mistakes), (5, []))

    def test_a_first_setpoint_elsewhere_is_not_followed(self):
        elsewhere = [self.q[0] + 0.01, *self.q[1:]]
        for _ in range(3 * round(VALIDATED_S / self.master.period_s)):
            self.assertEqual(self.master.say(FOLLOW, elsewhere), (STANDS_OFF, self.q))
        good = 0
        while self.master.say(FOLLOW, self.q)[0] == STANDS_OFF:
            good += 1
        self.assertAlmostEqual(good * self.master.period_s, VALIDATED_S, delta=2 * self.master.period_s)
        self.assertEqual(self.controller.q, self.q)


class UdpArm(ProgramTest):
    def setUp(self):
        super().setUp()
        self.example = pathlib.Path(program()).parents[1] / "tests/library/example_udp_arm"
        if not self.example.exists():
            self.skipTest("the examples aren't built")

    def start(self, controller, rate_Hz, seconds):
        self.addCleanup(controller.close)
        return subprocess.Popen([self.example, str(controller.port), str(rate_Hz), str(seconds)], cwd=self.folder,
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


class TimingOfTheArm(UdpArm):
    """On the machine's clock: each setpoint is answered in time, and the watchdogs run. So this runs alone."""

    def test_the_hand_leads_the_arm_at_250_and_at_1000_setpoints_a_second(self):
        for rate_Hz in (250, 1000):
            with self.subTest(rate_Hz):
                controller = Controller()
                start = list(controller.q)
                run = self.start(controller, rate_Hz, 4)
                out, err = run.communicate(timeout=200)
                self.assertEqual(run.returncode, 0, out + err)
                print(out.splitlines()[-1])
                self.assertEqual(controller.mistakes + controller.strangers, [])
                self.assertGreater(len(controller.setpoints), 3.9 * rate_Hz, "one each cycle")
                moved = max(abs(a - b) for q in controller.setpoints for a, b in zip(q, start))
                self.assertGreater(moved, 0.05, "the hand has led it somewhere")
                self.assertEqual(controller.wishes[-1], OFF)
                self.assertEqual(controller.state, STANDS_OFF)

    def test_an_arm_that_is_off_is_looked_at_before_it_is_asked_to_follow(self):
        controller = Controller()
        run = self.start(controller, 250, 1)
        run.communicate(timeout=100)
        first = controller.wishes.index(FOLLOW)
        self.assertGreater(len(controller.setpoints), 100)
        self.assertGreaterEqual(first, 1)
        self.assertEqual(controller.mistakes, [])

    def test_an_arm_that_stands_elsewhere_is_refused(self):
        start = start_of_the_cell()[0]
        controller = Controller([*start[:5], start[5] + 0.01])
        run = self.start(controller, 250, 1)
        out, err = run.communicate(timeout=100)
        self.assertEqual(run.returncode, 2, out + err)
        self.assertIn("axis_6 at 0.01", err)
        self.assertNotIn(FOLLOW, controller.wishes)

    def test_a_controller_that_falls_silent_ends_the_session(self):
        controller = Controller()
        controller.silent_after = 250
        run = self.start(controller, 250, 6)
        out, err = run.communicate(timeout=100)
        self.assertEqual(run.returncode, 1, out + err)
        self.assertIn("drive_silent", out)
        stopped = next(i for i, wish in enumerate(controller.wishes) if wish == FOLLOW)
        self.assertIn(OFF, controller.wishes[stopped:], "it is asked to switch off")

    def test_a_fault_of_the_controller_ends_the_session(self):
        controller = Controller()
        controller.fault_after = 250
        run = self.start(controller, 250, 6)
        out, err = run.communicate(timeout=100)
        self.assertEqual(run.returncode, 1, out + err)
        self.assertIn("drive_fault", out)

    def test_the_arm_stops_by_itself_when_the_session_is_killed(self):
        controller = Controller()
        run = self.start(controller, 250, 30)
        while len(controller.setpoints) < 500 and run.poll() is None:
            time.sleep(0.01)
        run.send_signal(signal.SIGKILL)
        killed = time.monotonic()
        run.communicate(timeout=100)
        while controller.stopped_at is None and time.monotonic() < killed + 5:
            time.sleep(0.01)
        self.assertIsNotNone(controller.stopped_at)
        self.assertLess(controller.stopped_at - killed, WATCHDOG_S + 0.5)
        count = len(controller.setpoints)
        time.sleep(0.2)
        self.assertEqual(len(controller.setpoints), count)
        self.assertEqual(controller.mistakes, [])

    def test_a_session_that_was_suspended_does_not_go_on_moving(self):
        controller = Controller()
        run = self.start(controller, 250, 6)
        while len(controller.setpoints) < 500 and run.poll() is None:
            time.sleep(0.01)
        run.send_signal(signal.SIGSTOP)
        time.sleep(WATCHDOG_S + 0.3)
        stands = list(controller.q)
        run.send_signal(signal.SIGCONT)
        out, err = run.communicate(timeout=100)
        self.assertIsNotNone(controller.stopped_at)
        self.assertEqual(run.returncode, 1, out + err)
        self.assertIn("FAULT", out)
        self.assertEqual(controller.q, stands)
        self.assertEqual(controller.mistakes, [])


class Refusals(UdpArm):
    def test_words_that_are_no_port_rate_or_duration_are_refused(self):
        for words, name in ((("70000",), "PORT"), (("0",), "PORT"), (("-1",), "PORT"), (("arm",), "PORT"),
                            (("4000", "0"), "RATE_HZ"), (("4000", "-250"), "RATE_HZ"), (("4000", "1e9"), "RATE_HZ"),
                            (("4000", "nan"), "RATE_HZ"), (("4000", "250Hz"), "RATE_HZ"), (("4000", "250", "0"), "SECONDS"),
                            (("4000", "250", "inf"), "SECONDS")):
            with self.subTest(words):
                done = subprocess.run([self.example, *words], capture_output=True, text=True, timeout=20)
                self.assertEqual(done.returncode, 2, done.stderr)
                self.assertIn(name, done.stderr)
                self.assertIn(f"{words[-1]}, expected a number from", done.stderr)

    def test_without_a_controller_there_is_no_session(self):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as unused:
            unused.bind(("127.0.0.1", 0))
            port = unused.getsockname()[1]
        done = subprocess.run([self.example, str(port)], capture_output=True, text=True, timeout=100)
        self.assertEqual(done.returncode, 2)
        self.assertIn("no answer for two seconds", done.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
