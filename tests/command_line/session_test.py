"""What a session leaves: the summary for programs, the record, exit statuses, and the end by a signal."""
import csv
import hashlib
import json
import os
import re
import signal
import struct
import subprocess
import time
import unittest

from harness import AXES, SOURCE, ProgramTest, program

number = (int, float)
maybe = (int, float, type(None))
SUMMARY = {
    "simulated_time_s": number, "wall_time_s": number, "figures_s": number, "cycles": int, "overruns": int, "compute_us": dict,
    "bus_load": dict, "penetration_max_m": number, "tool_penetration_max_m": number, "tracking_rms_m": maybe,
    "tracking_max_m": maybe, "apparent_mass_kg": maybe, "contact_force_error_N": maybe, "friction_ratio_error": maybe,
    "pulling_force_max_N": number, "faults": list, "setpoint_sha256": str,
}
BUS_OF = {node: "axes_1_3" if node <= 3 else "axes_4_6" for node in range(1, 7)}


class Frame:
    pattern = re.compile(r"\((\d{10,}\.\d{6})\) (\S+) ([0-9A-F]{3})#(R\d?|(?:[0-9A-F]{2})*)$")

    def __init__(self, line):
        match = self.pattern.match(line)
        if not match:
            raise ValueError(f"not a line of candump -L: {line!r}")
        self.time_s, self.bus, self.id = float(match[1]), match[2], int(match[3], 16)
        self.data = b"" if match[4].startswith("R") else bytes.fromhex(match[4])

    def bits(self):
        """The least and the most that the frame occupies: without stuff bits, and with one in four at worst."""
        bits = 47 + 8 * len(self.data)  # ISO 11898-1: SOF to EOF is 44, and three of interframe space
        return bits, bits + (34 + 8 * len(self.data) - 1) // 4


def frames_of(record):
    return [Frame(line) for line in (record / "frames.log").read_text().splitlines()]


def signals_of(record):
    with open(record / "signals.csv", newline="") as file:
        return list(csv.DictReader(file))


def targets(row):
    return [int(row[f"{axis}_target_counts"]) for axis in AXES]


class Json(ProgramTest):
    def test_one_object_with_all_keys_and_nothing_else(self):
        outcome = self.call("run", "--json")
        self.assertEqual((outcome.status, outcome.err), (0, ""))
        self.assertEqual(outcome.out.count("\n"), 1)
        summary = outcome.summary
        for key, kind in SUMMARY.items():
            self.assertIn(key, summary)
            self.assertIsInstance(summary[key], kind, key)
        self.assertEqual(set(summary["compute_us"]), {"median", "p99", "max", "total"})
        self.assertEqual(set(summary["bus_load"]), {"axes_1_3", "axes_4_6", "sensor"})
        self.assertRegex(summary["setpoint_sha256"], "^[0-9a-f]{64}$")
        self.assertEqual(summary["cycles"], round(summary["simulated_time_s"] / 1e-3))
        self.assertGreater(summary["simulated_time_s"], 10.0)
        self.assertEqual(list(self.folder.iterdir()), [], "nothing is written that wasn't asked for")

    def test_a_fault_ends_with_status_1_and_its_name(self):
        outcome = self.call("run", "--json", "--fault", "axis_2:silent@1s", "--duration", "3s")
        self.assertEqual(outcome.status, 1)
        self.assertEqual(outcome.out.count("\n"), 1)
        [fault] = outcome.summary["faults"]
        self.assertIn("drive_silent", json.dumps(fault))
        self.assertIn("axis_2, bus axes_1_3, node 2", json.dumps(fault))

    def test_files_are_found_from_any_folder(self):
        self.summary("--scene", "scenes/free.yaml", "--hand", "sim/hands/sweep.yaml", "--duration", "0.1s")
        self.summary(SOURCE / "models/cells/default.yaml", "--duration", "0.1s")
        relative = os.path.relpath(SOURCE / "models/cells/default.yaml", self.folder)
        self.summary(relative, "--duration", "0.1s")

    def test_people_get_a_table_and_a_plot(self):
        outcome = self.call("run", "--duration", "0.5s")
        self.assertEqual((outcome.status, outcome.err), (0, ""))
        for word in ("4 kg felt", "loop delay", "kg at the tip", "verdict:", "faults:", "proxarm-run.svg"):
            self.assertIn(word, outcome.out)
        self.assertIn("<svg", (self.folder / "proxarm-run.svg").read_text())
        self.assertNotIn("\x1b", outcome.out, "a live line is for terminals")


class Record(ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.shared = cls("run_both")
        cls.shared.setUp()
        cls.addClassCleanup(cls.shared.doCleanups)
        cls.first, cls.second = cls.shared.folder / "first", cls.shared.folder / "second"
        cls.summaries = [cls.shared.summary("--record", folder, "--duration", "6s") for folder in (cls.first, cls.second)]
        cls.frames, cls.signals = frames_of(cls.first), signals_of(cls.first)

    def run_both(self):
        """Stands for the two runs that the tests of this class share."""

    def test_two_runs_are_the_same_to_the_byte(self):
        names, others = (sorted(str(file.relative_to(folder)) for file in folder.rglob("*") if file.is_file())
                         for folder in (self.first, self.second))
        self.assertEqual(names, others)
        self.assertLessEqual({"signals.csv", "columns.json", "session.mcap", "frames.log", "effective.yaml", "summary.json",
                              "timing.json"}, set(names))
        for name in names:
            if name != "timing.json":  # wall-clock figures, and nothing else
                self.assertEqual((self.first / name).read_bytes(), (self.second / name).read_bytes(), name)
        timing = json.loads((self.first / "timing.json").read_text())
        self.assertLessEqual({"wall_time_s", "compute_us", "figures_s"}, set(timing))
        # What went by is the cycles', their records', and the simulated arm's.
        cycles_s = 1e-6 * timing["compute_us"]["total"]
        self.assertGreater(min(cycles_s, timing["figures_s"]), 0.0)
        self.assertLess(cycles_s + timing["figures_s"], timing["wall_time_s"])

    def test_the_hash_is_of_the_setpoints_in_the_signals(self):
        digest = hashlib.sha256()
        for row in self.signals:
            digest.update(struct.pack("<6i", *targets(row)))
        self.assertEqual(len(self.signals), self.summaries[0]["cycles"])
        self.assertEqual(digest.hexdigest(), self.summaries[0]["setpoint_sha256"])

    def goodbye(self):
        """Periods after the last cycle, in which the drives are told to wait for nobody: ten on each bus or so."""
        syncs = [frame for frame in self.frames if frame.bus == "axes_1_3" and frame.id == 0x080]
        periods = len(syncs) - len(self.signals)
        self.assertTrue(1 <= periods <= 30, periods)
        return periods

    def test_the_frames_hold_the_setpoints_of_the_signals(self):
        for node in range(1, 7):
            sent = [struct.unpack("<Hi", frame.data) for frame in self.frames
                    if frame.id == 0x200 + node and frame.bus == BUS_OF[node]]
            # A standing order in every cycle, the first one included; then the goodbye, where all stand.
            wanted = [targets(row)[node - 1] for row in self.signals]
            self.assertEqual([counts for _, counts in sent], wanted + wanted[-1:] * self.goodbye())
            self.assertTrue(all(word == 0 for word, _ in sent[len(wanted):]), "disable voltage")
            self.assertIn(0x0F, {word for word, _ in sent}, "enable operation")

    def test_the_frames_hold_the_feedback_of_the_signals(self):
        for node in range(1, 7):
            received = [struct.unpack("<Hi", frame.data)[1] for frame in self.frames
                        if frame.id == 0x180 + node and frame.bus == BUS_OF[node]]
            told = [int(row[f"axis_{node}_actual_counts"]) for row in self.signals]
            # The frame of each SYNC; the last one's comes after what is recorded.
            last = len(received) - self.goodbye()
            self.assertEqual(received[last - len(told):last], told)

    def test_times_rise_and_syncs_come_every_millisecond(self):
        for bus in ("axes_1_3", "axes_4_6", "sensor"):
            times = [frame.time_s for frame in self.frames if frame.bus == bus]
            self.assertEqual(times, sorted(times))
        syncs = [frame.time_s for frame in self.frames if frame.bus == "axes_1_3" and frame.id == 0x080]
        self.assertEqual(len(syncs), len(self.signals) + self.goodbye())
        for before, after in zip(syncs, syncs[1:]):
            self.assertAlmostEqual(after - before, 1e-3, delta=0.135e-3)  # it may wait for one frame of 135 bits

    def test_the_bus_load_is_that_of_the_frames(self):
        first = next(frame.time_s for frame in self.frames if frame.id == 0x080)
        for bus, load in self.summaries[0]["bus_load"].items():
            cyclic = [frame for frame in self.frames if frame.bus == bus and frame.time_s >= first - 1e-3]
            span_bits = 1e6 * len(self.signals) * 1e-3
            least, most = (sum(frame.bits()[i] for frame in cyclic) / span_bits for i in (0, 1))
            self.assertGreater(load, 0.99 * least, bus)  # 1 %: where in a cycle it is taken
            self.assertLess(load, 1.01 * most, bus)

    def test_the_effective_configuration_names_what_was_used(self):
        text = (self.first / "effective.yaml").read_text()
        for line in ("period_s: 0.001", "mass_kg: 4", "scene: wall.yaml", "hand: touch.yaml", "duration_s: 6"):
            self.assertIn(line, text)
        self.assertNotIn(str(self.shared.folder), text)

    def test_an_earlier_record_is_replaced_whole(self):
        self.shared.summary("--record", self.second, "--duration", "0.1s")
        self.assertLess((self.second / "signals.csv").stat().st_size, (self.first / "signals.csv").stat().st_size)
        self.summaries[1] = self.shared.summary("--record", self.second, "--duration", "6s")


class Signals(ProgramTest):
    def stop_by(self, number):
        record = self.folder / "record"
        process = subprocess.Popen([program(), "run", "--pace", "realtime", "--duration", "20s", "--record", record,
                                    "--signals", "csv", "--json"], cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.kill)
        begun = time.monotonic()
        while time.monotonic() < begun + 60 and "rendering" not in self.tail(record / "signals.csv"):
            time.sleep(0.05)  # the record is written in blocks: it comes some time after the fact
        process.send_signal(number)
        out, err = process.communicate(timeout=300)
        self.assertEqual((process.returncode, err), (0, ""))
        summary = json.loads(out)
        self.assertEqual(summary["faults"], [])
        self.assertEqual(summary["end"]["reason"], "signal")
        self.assertGreater(summary["rendered_time_s"], 0.0)
        self.assertLess(summary["rendered_time_s"], 20.0)
        self.assert_switched_off(frames_of(record))
        phases = [row["phase"] for row in signals_of(record)]
        order = [phase for i, phase in enumerate(phases) if i == 0 or phase != phases[i - 1]]
        self.assertEqual(order, [p for p in ("enabling", "taring", "rendering", "stopping", "disabling", "done")
                                 if p in order])
        self.assertIn(order[-1], ("disabling", "done"))

    @staticmethod
    def tail(file):
        try:
            return file.read_text()[-2000:]
        except FileNotFoundError:
            return ""

    def assert_switched_off(self, frames):
        for node in range(1, 7):
            of_bus = [frame for frame in frames if frame.bus == BUS_OF[node]]
            words = [struct.unpack("<H", frame.data[:2])[0] for frame in of_bus if frame.id == 0x200 + node]
            self.assertIn(words[-1], (0x0006, 0x0000), f"node {node}: shutdown or disable voltage comes last")
            states = [struct.unpack("<H", frame.data[:2])[0] for frame in of_bus if frame.id == 0x180 + node]
            self.assertNotEqual(states[-1] & 0x6F, 0x27, f"node {node} is still in operation enabled")
            orders = [frame.data for frame in of_bus if frame.id == 0x000 and frame.data[1] in (0, node)]
            self.assertIn(orders[-1][0], (0x80, 0x02), f"node {node}: NMT pre-operational or stop comes last")

    def test_sigint_ends_a_session_properly(self):
        self.stop_by(signal.SIGINT)

    def test_sigterm_ends_a_session_properly(self):
        self.stop_by(signal.SIGTERM)


class Scenes(ProgramTest):
    def test_a_press_that_closes_on_the_proxy_is_a_fault(self):
        press = ("objects:\n"
                 "  - plane: {name: anvil, point_m: [0.71, 0, 0.6], normal: [-1, 0, 0]}\n"
                 "  - box: {name: hammer, centre_m: [0.64, 0, 0.6], size_m: [0.02, 1, 1],\n"
                 "          motion: {velocity_m_per_s: [0.05, 0, 0]}}\n")
        outcome = self.call("run", "--json", "--scene", self.written("press.yaml", press), "--duration", "3s")
        self.assertEqual(outcome.status, 1, outcome.err)
        [fault] = outcome.summary["faults"]
        self.assertIn("proxy_squeezed", json.dumps(fault))

    def test_all_shipped_scenes_run_without_a_fault(self):
        scenes = sorted((SOURCE / "scenes").glob("*.yaml"))
        self.assertGreaterEqual(len(scenes), 5)
        for scene in scenes:
            with self.subTest(scene.name):
                summary = self.summary("--scene", scene)
                self.assertEqual(summary["faults"], [])
                self.assertEqual(summary["pulling_force_max_N"], 0.0)
                self.assertLessEqual(summary["penetration_max_m"], 1e-12)
                if summary["friction_ratio_error"] is not None:
                    self.assertLessEqual(abs(summary["friction_ratio_error"]), 0.02)

    def test_a_line_keeps_the_tool_on_it(self):
        # n = 1: along x; the wall of the default scene is a point on it.
        self.summary("--scene", "scenes/line.yaml", "--record", self.folder / "record")
        rows = [row for row in signals_of(self.folder / "record") if row["phase"] == "rendering"]
        start = rows[0]
        for row in rows[::50]:
            for axis in "yz":
                self.assertEqual(row[f"proxy_W_{axis}_m"], start[f"proxy_W_{axis}_m"])
        self.assertGreater(max(float(row["proxy_W_x_m"]) for row in rows), 0.899)

    def test_a_plane_keeps_the_tool_on_it(self):
        # n = 2: x and y; the tool stays at its height.
        summary = self.summary("--scene", "scenes/plane_2d.yaml", "--record", self.folder / "record")
        rows = [row for row in signals_of(self.folder / "record") if row["phase"] == "rendering"]
        self.assertEqual({row["proxy_W_z_m"] for row in rows}, {rows[0]["proxy_W_z_m"]})
        self.assertGreater(max(float(row["proxy_W_y_m"]) for row in rows), 0.1)
        self.assertEqual(summary["penetration_max_m"], 0.0)

    def test_options_of_the_proxy(self):
        for options in (["--orientation", "free"], ["--damping", "20"], ["--spring", "50"], ["--order", "2"],
                        ["--timestep", "2ms"], ["--order", "2", "--damping", "10", "--orientation", "free"]):
            with self.subTest(options):
                summary = self.summary(*options)
                self.assertEqual(summary["faults"], [])
                self.assertGreaterEqual(summary["contacts"], 1)
                self.assertLessEqual(summary["penetration_max_m"], 1e-12)


if __name__ == "__main__":
    unittest.main(verbosity=2)
