"""canplayer plays a recorded far end into a running controller.

What is recorded: a session with the simulated arm, by candump. What is played: only what the far end sent. So whatever
the controller does then, it does because of frames, in another order of processes and without our simulation.

canplayer knows nothing of requests, it sends at the log's times. In the cycle that is what answers look like: TPDOs and
samples come some 0.1 ms after SYNC and poll, and the controller takes them until 0.45 ms; on the virtual clock
canplayer (-g 0) is at most 0.06 ms late. Before the cycle an answer may only come after its request, which the
controller sends as soon as it has the answer before: there the log is stretched, so that each comes 10 ms later than
the one before and the controller is always waiting for it.
"""
import contextlib
import json
import tempfile
import time

import two_processes as two

DURATION = "2s"
TOGETHER_US = 20  # answers of several drives that come as one
STRETCHED_US = 10_000
IN_WINDOW_US = 100  # later than recorded, so that what is a little early is still after its SYNC


def is_from_sensor(frame):
    return frame.id in two.SENSOR_IDS and len(frame.data) >= 2  # requests have less


def is_from_far_end(frame):
    of_drive = (two.EMCY, two.TPDO, two.SDO_ANSWER, two.HEARTBEAT)
    return is_from_sensor(frame) or any(frame.id == function + node for function in of_drive for node in two.NODES)


def playable(frames, wanted):
    """The log for canplayer: the wanted frames, those of the set-up stretched."""
    first_sync_us = next(f.time_us for f in frames if f.id == two.SYNC)
    played, last, now_us, shift_us = [], None, 0, IN_WINDOW_US
    for frame in filter(wanted, frames):
        if last is not None:
            gap_us = frame.time_us - last.time_us
            if frame.time_us < first_sync_us:
                now_us += gap_us if gap_us <= TOGETHER_US else max(gap_us, STRETCHED_US)
            else:
                now_us += gap_us + shift_us
                shift_us = 0
        last = frame
        played.append(frame._replace(time_us=now_us))
    return played


class CanplayerAsTheFarEnd(two.VcanTestCase):
    @classmethod
    def setUpClass(cls):
        with tempfile.TemporaryDirectory() as folder:
            cls.recorded = two.Session(two.THREE, DURATION, folder)

    def setUp(self):
        super().setUp()
        self.assertEqual(self.recorded.status, 0, self.recorded.errors)

    def play(self, frames, arm=contextlib.nullcontext()):
        """A controller against canplayer: its summary, and what candump saw."""
        two.write_log(self.folder / "played.log", frames)
        with arm, two.candump(*two.INTERFACES) as witness, two.controller(two.THREE, DURATION) as run:
            time.sleep(0.05)
            with two.Process("canplayer", "-g", 0, "-I", self.folder / "played.log"):
                status = run.wait()
            self.assertEqual(status, 0, run.errors())
            summary = json.loads(run.output())
            self.assertEqual(summary["held_samples"], 0, "every sample came in its cycle")
            seen = two.frames_of(witness)
            self.assertEqual(two.setpoints_sha256(seen), summary["setpoint_sha256"])
            return summary, seen

    def play_sensor(self, frames):
        """The drives are simulated; the simulated sensor is on a wire of its own, that of canplayer is heard."""
        return self.play(frames, two.simulated_arm("axes_1_3=vcan0,axes_4_6=vcan1,sensor=vcan3"))

    def test_says_the_same_to_the_bit_when_it_hears_the_same(self):
        summary, seen = self.play(playable(self.recorded.seen, is_from_far_end))
        self.assertEqual(summary["setpoint_sha256"], self.recorded.summary["setpoint_sha256"])
        for node in two.NODES:
            for function in (two.RPDO, two.SDO_REQUEST):  # the set-up asks in the same order, too
                self.assertEqual([f.data for f in two.of_node(seen, function, node)],
                                 [f.data for f in two.of_node(self.recorded.seen, function, node)])
        self.assertGreater(max(max(counts) - min(counts) for counts in two.setpoints(seen)), 1_000_000, "it moved")

    def test_the_same_forces_move_the_targets_the_same_way(self):
        """Drives that answer by themselves start from a few counts elsewhere and answer at other instants. With them the
        sensor's direction differs a little, so the targets do: by 0.007 % of the way in trials. And their set-up may
        end a millisecond earlier or later, while canplayer goes on: the targets then do all that a cycle later."""
        _, seen = self.play_sensor(playable(self.recorded.seen, is_from_sensor))
        before, after = two.setpoints(self.recorded.seen), two.setpoints(seen)
        way = max(max(counts) - min(counts) for counts in before)

        def apart(shift):
            return max(abs(one - other) for counts, again in zip(before, after)
                       for one, other in zip(counts[max(0, -shift):], again[max(0, shift):]))

        self.assertLess(min(apart(shift) for shift in (-2, -1, 0, 1, 2)), 0.0005 * way)

    def test_a_force_that_stays_as_it_was_at_the_tare_moves_nothing(self):
        first = {}
        frames = []
        for frame in playable(self.recorded.seen, is_from_sensor):
            if frame.id in (0x680, 0x681):
                frame = frame._replace(data=first.setdefault(frame.id, frame.data))
            frames.append(frame)
        _, seen = self.play_sensor(frames)
        # Until the drives are enabled, targets follow the encoders, which may flicker by a count.
        for counts in two.setpoints(seen):
            self.assertLessEqual(max(counts) - min(counts), 3)


if __name__ == "__main__":
    two.main()
