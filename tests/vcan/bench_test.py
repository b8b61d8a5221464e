"""The bench, two drives and a sensor on one bus, as two processes on one interface of a real kernel.

What candump sees is held against `proxarm plan`: the same frames, and the load that it says, by the lengths of these
frames on a wire (a virtual one has no bit timing).
"""
import json
import struct
import subprocess
import sys
from pathlib import Path

import two_processes as two

sys.path.append(str(Path(__file__).resolve().parents[1] / "command_line"))
import plan_test  # not its classes: they would run here, too

CELL = Path(__file__).resolve().parents[2] / "models/cells/bench.yaml"
NODES = (1, 2)
SENSOR = (0x120, 0x121)


class Bench(two.VcanTestCase):
    def session(self, timestep, duration):
        options = (CELL, "--timestep", timestep)
        with two.simulated_arm("vcan0", *options) as arm, two.candump("vcan0") as witness:
            with two.controller("vcan0", duration, self.folder, *options) as run:
                self.assertEqual(run.wait(), 0, run.errors())
                summary = json.loads(run.output())
            seen = two.frames_of(witness)
            self.assertEqual(arm.stop(), 0, arm.errors())
        return summary, seen

    def planned(self, timestep):
        done = subprocess.run([two.PROGRAM, "plan", CELL, "--timestep", timestep], capture_output=True, text=True,
                              check=True)
        load = next(found for line in done.stdout.splitlines() if (found := plan_test.LOAD.search(line)))
        return {name: float(load[name]) / 100 for name in ("worst", "least", "most", "typical")}, {
            int(found[2], 16) for line in done.stdout.splitlines() if (found := plan_test.FRAME.match(line))}

    def assert_works(self, timestep, period_us, duration_s):
        summary, seen = self.session(timestep, f"{duration_s}s")
        self.assertEqual(summary["faults"], [])
        self.assertEqual(summary["held_samples"], 0, "every cycle had its own sample")
        self.assertGreaterEqual(summary["contacts"], 1)
        self.assertEqual(summary["penetration_max_m"], 0.0)
        self.assertEqual(summary["pulling_force_max_N"], 0.0)
        self.assertAlmostEqual(summary["apparent_mass_kg"] / summary["wanted_mass_kg"], 1.0, delta=0.05)
        # The hash of the summary out of nothing but the wire: targets of both nodes, cycle by cycle.
        targets = [[struct.unpack("<Hi", f.data)[1] for f in two.of_node(seen, two.RPDO, node)] for node in NODES]
        self.assertEqual(two.sha256_of_counts(targets, summary["cycles"]), summary["setpoint_sha256"])
        # While it rendered: between the first second and the last half.
        syncs = [f.time_us for f in seen if f.id == two.SYNC]
        self.assertLess(max(abs(b - a - period_us) for a, b in zip(syncs, syncs[1:])), 10)
        first, last = syncs[len(syncs) // 8], syncs[-len(syncs) // 8]
        during = [f for f in seen if first <= f.time_us < last]
        load, names = self.planned(timestep)
        self.assertEqual({f.id for f in during}, names)
        bits = sum(plan_test.bits_on_the_wire(f.id, False, f.data) for f in during)
        on_the_wire = bits / (last - first)  # µs at 1 Mbit/s
        print(f"  {timestep}: {100 * on_the_wire:.2f} % of 1 Mbit/s seen, {100 * load['typical']:.2f} % planned; "
              f"{summary['apparent_mass_kg']:.3f} kg felt of {summary['wanted_mass_kg']:.3f}, "
              f"tool {1e6 * summary['tool_penetration_touch_max_m']:.1f} µm deep at the touch")
        self.assertLess(abs(on_the_wire - load["typical"]), 0.01, f"{on_the_wire:.4f} seen, {load} planned")
        self.assertLessEqual(on_the_wire, load["most"])
        # Each cycle: SYNC, a poll and its two answers, and of each drive its feedback and its setpoint.
        cycles = round((last - first) / period_us)
        for identifier, times in ((two.SYNC, 1), (SENSOR[0], 2), (SENSOR[1], 1), (two.TPDO + 1, 1), (two.TPDO + 2, 1),
                                  (two.RPDO + 1, 1), (two.RPDO + 2, 1)):
            self.assertAlmostEqual(sum(f.id == identifier for f in during), times * cycles, delta=2, msg=hex(identifier))

    def test_touches_at_1_ms(self):
        self.assert_works("1ms", 1000, 6)

    def test_touches_at_2_ms(self):
        self.assert_works("2ms", 2000, 6)


if __name__ == "__main__":
    two.main()
