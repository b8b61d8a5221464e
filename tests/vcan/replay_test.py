"""canplayer plays a recorded far end into a running controller.

What is recorded: a session with the simulated arm, by candump. What is played: only what the far end sent. So whatever
the controller does then, it does because of frames, in another order of processes and without our simulation.

canplayer knows nothing of requests, it sends at the log's times. In the cycle that is what answers look like: TPDOs and
samples come some 0.1 ms after SYNC and poll, and the controller takes them until 0.45 ms; a canplayer that is started
at the first SYNC is there within microseconds on the virtual clock, and with -g 0 at most 0.06 ms late from then on.
Before the cycle an answer may only come after its request, which the controller sends as soon as it has the answer
before: that part of the log is stretched, so that each comes 10 ms later than the one before and the controller is
always waiting for it.
"""
import contextlib
import json
import socket
import struct
import tempfile
import time

import two_processes as two

DURATION = "2s"
TOGETHER_US = 20  # answers of several drives that come as one
STRETCHED_US = 10_000
IN_WINDOW_US = 100  # later than recorded, all but the first: so far is the earliest from its SYNC


def is_from_sensor(frame):
    return frame.id in two.SENSOR_IDS and len(frame.data) >= 2  # requests have less


def is_from_far_end(frame):
    of_drive = (two.EMCY, two.TPDO, two.SDO_ANSWER, two.HEARTBEAT)
    return is_from_sensor(frame) or any(frame.id == function + node for function in of_drive for node in two.NODES)


def playable(frames, wanted):
    """Two logs for canplayer, of the wanted frames: those of the set-up, stretched, and those from the first SYNC on."""
    first_sync_us = next(f.time_us for f in frames if f.id == two.SYNC)
    cycles = [f._replace(time_us=f.time_us + IN_WINDOW_US) for f in frames if f.time_us >= first_sync_us and wanted(f)]
    cycles[0] = cycles[0]._replace(time_us=cycles[0].time_us - IN_WINDOW_US)
    set_up, last_us, now_us = [], None, 0
    for frame in frames:
        if frame.time_us >= first_sync_us or not wanted(frame):
            continue
        gap_us = frame.time_us - (last_us or frame.time_us)
        now_us += gap_us if gap_us <= TOGETHER_US else max(gap_us, STRETCHED_US)
        last_us = frame.time_us
        set_up.append(frame._replace(time_us=now_us))
    return set_up, cycles


@contextlib.contextmanager
def canplayer(log, frames):
    two.write_log(log, frames)
    with two.Process("canplayer", "-g", 0, "-I", log) as player:
        yield player


def listener_to_sync(interface):
    listener = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
    listener.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, struct.pack("=II", two.SYNC, socket.CAN_SFF_MASK))
    listener.bind((interface,))
    listener.settimeout(10)
    return listener


LISTENS_S = 0.3  # a controller hears who leads the bus before it asks anybody


class CanplayerAsTheFarEnd(two.VcanTestCase):
    @classmethod
    def setUpClass(cls):
        with tempfile.TemporaryDirectory() as folder:
            cls.recorded = two.Session(two.THREE, DURATION, folder)

    def setUp(self):
        super().setUp()
        self.assertEqual(self.recorded.status, 0, self.recorded.errors)

    def play(self, logs, arm=contextlib.nullcontext()):
        """A controller against canplayer: its summary, and what candump saw."""
        set_up, cycles = logs
        with arm, two.candump(*two.INTERFACES) as witness, listener_to_sync("vcan0") as sync, \
                two.controller(two.THREE, DURATION) as run:
            time.sleep(LISTENS_S + 0.02)
            with canplayer(self.folder / "set_up.log", set_up):
                sync.recv(16)
                with canplayer(self.folder / "cycles.log", cycles):
                    status = run.wait()
            self.assertEqual(status, 0, run.errors() + run.output())
            summary = json.loads(run.output())
            self.assertEqual(summary["held_samples"], 0, "every sample came in its cycle")
            seen = two.frames_of(witness)
            self.assertEqual(two.setpoints_sha256(seen, summary), summary["setpoint_sha256"])
            return summary, seen

    def play_sensor(self, logs):
        """The drives are simulated; the simulated sensor is on a wire of its own, that of canplayer is heard."""
        return self.play(logs, two.simulated_arm("axes_1_3=vcan0,axes_4_6=vcan1,sensor=vcan3"))

    def test_says_the_same_to_the_bit_when_it_hears_the_same(self):
        summary, seen = self.play(playable(self.recorded.seen, is_from_far_end))
        self.assertEqual(summary["setpoint_sha256"], self.recorded.summary["setpoint_sha256"])
        for node in two.NODES:
            for function in (two.RPDO, two.SDO_REQUEST):  # the set-up asks in the same order, too
                self.assertEqual([f.data for f in two.of_node(seen, function, node)],
                                 [f.data for f in two.of_node(self.recorded.seen, function, node)])
        self.assertGreater(max(max(counts) - min(counts) for counts in two.setpoints(seen)), 1_000_000, "it moved")

    def test_the_same_forces_move_the_targets_the_same_way(self):
        """Drives that answer by themselves do so at other instants, so their encoders and with them the sensor's direction
        differ by a few counts, and the targets by one in trials; their way is 7,000,000 counts."""
        _, seen = self.play_sensor(playable(self.recorded.seen, is_from_sensor))
        before, after = two.setpoints(self.recorded.seen), two.setpoints(seen)
        self.assertGreater(max(max(counts) - min(counts) for counts in after), 1_000_000, "it moved")
        for one, other in zip(before, after):
            self.assertEqual(len(one), len(other))
            self.assertLess(max(abs(a - b) for a, b in zip(one, other)), 100)

    def test_a_force_that_stays_as_it_was_at_the_tare_moves_nothing(self):
        """But for the last bit of one gauge, in turns: a reading that repeats to the last digit is a fault. What of it
        the tare doesn't average away moved the targets by 620 counts, 25 µrad, in trials."""
        set_up, cycles = playable(self.recorded.seen, is_from_sensor)
        first = {f.id: f.data for f in reversed(cycles)}
        other = {**first, 0x681: first[0x681][:5] + bytes([first[0x681][5] ^ 1])}
        held = [f._replace(data=(first, other)[i // 2 % 2][f.id]) for i, f in enumerate(cycles)]
        _, seen = self.play_sensor((set_up, held))
        for counts in two.setpoints(seen):
            self.assertLess(max(counts) - min(counts), 2000)


if __name__ == "__main__":
    two.main()
