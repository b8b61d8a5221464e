"""The whole main job on a real vcan: `proxarm run` and `proxarm sim` as two processes, candump as the witness."""
import json
import subprocess
import tempfile
import unittest

import can  # python3-can

import two_processes as two


class ClosedLoop:
    """6 s of the default scene: through free space, touch, and along the wall."""

    bus = None

    @classmethod
    def setUpClass(cls):
        cls.record = tempfile.TemporaryDirectory()
        cls.session = two.Session(cls.bus, "6s", cls.record.name)
        cls.recorded = cls.session.recorded() if cls.session.status == 0 else []

    @classmethod
    def tearDownClass(cls):
        cls.record.cleanup()

    def test_ends_well(self):
        self.assertEqual(self.session.status, 0, self.session.errors)
        self.assertEqual(self.session.arm_status, 0, self.session.arm_errors)
        summary = self.session.summary
        self.assertEqual(summary["faults"], [])
        self.assertEqual(summary["overruns"], 0)
        self.assertEqual(summary["held_samples"], 0, "every cycle had its own sample")
        # When the tool touches the wall, the gears' model asks more of axis 2 for a cycle than it may accelerate.
        self.assertLess(summary["limited_cycles"], 100)
        self.assertLessEqual(set(summary["active_limits"]), {"axis_2: max_acceleration_rad_per_s2"})
        self.assertAlmostEqual(summary["rendered_time_s"], 6.0)
        self.assertIn(" 0 lost, 0 not sent; 0 late", self.session.arm_errors)

    def test_feels_like_the_wall_and_the_mass(self):
        summary = self.session.summary
        self.assertEqual(summary["penetration_max_m"], 0.0)
        self.assertGreaterEqual(summary["contacts"], 1)
        self.assertGreater(summary["contact_time_s"], 2.0)
        self.assertGreater(summary["sliding_time_s"], 0.5)
        self.assertEqual(summary["pulling_force_max_N"], 0.0)
        self.assertAlmostEqual(summary["apparent_mass_kg"] / summary["wanted_mass_kg"], 1.0, delta=0.05)
        self.assertLess(summary["tracking_max_m"], 0.5e-3)
        # Encoders stand in for the simulation's truth here.
        self.assertEqual(summary["source"], "sensor and encoders")
        self.assertLess(summary["tool_penetration_touch_max_m"], 1e-3)
        self.assertLess(summary["tool_penetration_sliding_max_m"], 0.2e-3)

    def test_candump_saw_what_the_record_says(self):
        seen, recorded = two.by_identifier(self.session.seen), two.by_identifier(self.recorded)
        self.assertGreater(len(self.recorded), 6000 * 15)
        self.assertEqual(set(recorded) - set(seen), set())
        for key, frames in recorded.items():
            with self.subTest(key=key):
                self.assertEqual([f.data for f in frames], [f.data for f in seen[key][:len(frames)]])
        # Once the controller is gone, it records nothing, and nobody says a word: no drive that it misses the heartbeat
        # (8130h) or SYNC (8100h), which each session left in each drive before.
        self.assertEqual([frame for key, frames in seen.items() for frame in frames[len(recorded[key]):]], [])

    def test_drives_are_told_to_wait_for_nobody_before_sync_ends(self):
        """0 in 1016h:01, then in 1006h, confirmed by each drive while it still hears SYNC and heartbeat."""
        for node in two.NODES:
            asked = two.of_node(self.session.seen, two.SDO_REQUEST, node)[-2:]
            self.assertEqual([f.data for f in asked],
                             [bytes.fromhex("2316100100000000"), bytes.fromhex("2306100000000000")])
            told = two.of_node(self.session.seen, two.SDO_ANSWER, node)[-2:]
            self.assertEqual([f.data[:4] for f in told], [bytes.fromhex("60161001"), bytes.fromhex("60061000")])
            goodbye = next(f for f in self.session.seen if f.id == two.NMT and f.data == bytes([0x80, node])
                           and f.time_us > told[-1].time_us)
            last_sync = [f for f in self.session.seen if f.id == two.SYNC and f.interface == goodbye.interface][-1]
            self.assertLess(told[0].time_us, last_sync.time_us)
            self.assertLess(goodbye.time_us - last_sync.time_us, 1000)

    def test_candump_saw_it_when_the_record_says(self):
        """Both stamp each frame on the same kernel: the clocks' difference is one constant, within 0.1 ms."""
        seen, recorded = two.by_identifier(self.session.seen), two.by_identifier(self.recorded)
        offsets = [s.time_us - r.time_us for key in recorded for s, r in zip(seen[key], recorded[key])]
        self.assertLess(max(offsets) - min(offsets), 100)

    def test_the_record_replays_to_the_same_setpoints(self):
        """Although the frames came from a kernel, at times of their own."""
        done = subprocess.run([two.PROGRAM, "replay", self.record.name], capture_output=True, text=True, timeout=120)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn(f"{self.session.summary['cycles']} cycles from 0 on", done.stdout)

    def test_latencies_are_told(self):
        latencies = self.session.summary["latency_us"]
        self.assertEqual(set(latencies), {"wake_up", "compute", "sensor_to_setpoint"})
        for name, latency in latencies.items():
            with self.subTest(name):
                self.assertLessEqual(latency["median"], latency["p99"])
                self.assertLessEqual(latency["p99"], latency["max"] + 1)
                self.assertEqual(sum(n for _, n in latency["histogram"]), self.session.summary["cycles"])

    def test_the_cycle_waits_for_no_page_of_memory(self):
        """With all memory locked (the guest grants that) none has to be found any more once it runs."""
        self.assertEqual(self.session.summary["page_faults"], {"minor": 0, "major": 0})

    def test_targets_on_the_wire_have_the_hash_of_the_summary(self):
        summary = self.session.summary
        self.assertEqual(two.setpoints_sha256(self.session.seen, summary), summary["setpoint_sha256"])

    def test_every_interface_with_drives_has_its_sync_every_millisecond(self):
        with_drives = {f.interface for f in self.session.seen if f.id == two.RPDO + 1 or f.id == two.RPDO + 6}
        for interface in with_drives:
            syncs = [f.time_us for f in self.session.seen if f.id == two.SYNC and f.interface == interface]
            goodbye = len(syncs) - self.session.summary["cycles"]
            self.assertTrue(2 <= goodbye <= 30, f"{goodbye} periods of goodbye")
            steps = [b - a for a, b in zip(syncs, syncs[1:])]
            self.assertLess(max(abs(step - 1000) for step in steps), 10)

    def test_python_can_reads_the_record(self):
        read = sum(1 for _ in can.CanutilsLogReader(str(self.session.folder / "frames.log")))
        self.assertEqual(read, len(self.recorded))

    def test_drives_end_switched_off(self):
        for node in two.NODES:
            self.assertEqual(two.of_node(self.session.seen, two.TPDO, node)[-1].data[0] & 0x4F, 0x40, "switch on disabled")
        last = [f for f in self.session.seen if f.id == two.NMT][-6:]
        self.assertEqual(sorted(f.data for f in last), [bytes([0x80, node]) for node in two.NODES])


class OnOneInterface(ClosedLoop, unittest.TestCase):
    bus = two.ONE


class OnThreeInterfaces(ClosedLoop, unittest.TestCase):
    bus = two.THREE


class OverAVxcanPair(two.VcanTestCase):
    """A virtual cable, one process at each end: the other kind of interface on which drives may be enabled."""

    def test_ends_well(self):
        subprocess.run(["ip", "link", "add", "vxcan0", "type", "vxcan", "peer", "name", "vxcan1"], check=True)
        for end in ("vxcan0", "vxcan1"):
            subprocess.run(["ip", "link", "set", end, "up"], check=True)
        with two.simulated_arm("vxcan1"), two.controller("vxcan0", "0.5s") as run:
            self.assertEqual(run.wait(), 0, run.errors())
            summary = json.loads(run.output())
        self.assertEqual((summary["faults"], summary["overruns"], summary["held_samples"]), ([], 0, 0))


if __name__ == "__main__":
    two.main()
