"""The timestep changed in a running session on a real vcan: both processes go on with the new one."""
import json

import two_processes as two


class Timestep(two.VcanTestCase):
    def session(self, bus, *options):
        with two.simulated_arm(bus, *self.arm_options) as arm, two.candump(*two.INTERFACES) as witness:
            with two.controller(bus, "3s", self.folder / "record", *options) as run:
                self.assertEqual(run.wait(), 0, run.errors())
                summary, errors = json.loads(run.output()), run.errors()
            seen = two.frames_of(witness)
            self.assertEqual(arm.stop(), 0, arm.errors())
        return summary, errors, seen

    arm_options = ()

    def periods_ms(self, seen):
        """Between SYNCs on the first interface, each once in a row."""
        times = [f.time_us for f in seen if f.interface == "vcan0" and f.id == two.SYNC]
        periods = [round((b - a) / 1000) for a, b in zip(times, times[1:])]
        return [p for p, before in zip(periods, [None] + periods) if p != before]

    def test_follows_from_1_to_2_to_1_ms(self):
        for bus in (two.ONE, two.THREE):
            with self.subTest(bus):
                summary, errors, seen = self.session(bus, "--set", "timestep=2ms@1s", "--set", "timestep=1ms@2s")
                self.assertEqual(summary["faults"], [])
                self.assertEqual([(t["from_s"], t["to_s"], t["refused"]) for t in summary["timesteps"]],
                                 [(0.001, 0.002, ""), (0.002, 0.001, "")])
                self.assertAlmostEqual(summary["rendered_time_s"], 3.0)
                self.assertEqual(summary["overruns"], 0)
                self.assertEqual(self.periods_ms(seen), [1, 2, 1])
                self.assertIn("all drives have confirmed it", errors)
                with two.Process(two.PROGRAM, "replay", self.folder / "record") as replay:
                    self.assertEqual(replay.wait(), 0, replay.output() + replay.errors())

    def test_stays_where_a_drive_refuses(self):
        self.arm_options = ("--fault", "axis_4:period")
        summary, errors, seen = self.session(two.THREE, "--set", "timestep=2ms@1s")
        self.assertEqual(summary["faults"], [])
        self.assertIn("axis_4, 60C2h:01: SDO abort 08000022", summary["timesteps"][0]["refused"])
        self.assertEqual(self.periods_ms(seen), [1])
        self.assertIn("it stays 1 ms", errors)


if __name__ == "__main__":
    two.main()
