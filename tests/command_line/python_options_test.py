#!/usr/bin/python3
"""Every option of `proxarm run --help` as a session in Python has it: the same setpoints and the same summary, the same
files, the same words where it is refused. What touches in a world of one's own."""
import json
import os
import pathlib
import re
import sys
import threading
import time
import unittest

from harness import SOURCE, ProgramTest, program

PACKAGE = pathlib.Path(program()).parent / "python"
if not (PACKAGE / "proxarm/__init__.py").exists():
    print("no Python package in this build: pybind11-dev or python3-dev isn't installed, or sanitizers are on")
    sys.exit(77)
sys.path.insert(0, str(PACKAGE))
os.environ["PROXARM_DATA"] = str(SOURCE)

import numpy  # noqa: E402
import proxarm  # noqa: E402

# What the program and a session don't have in common: the machine's times, and where files are.
APART = {"wall_time_s", "figures_s", "compute_us", "black_box", "overruns", "latency_us"}
# Cell, scene and hand of those that show more than the default cell.
LIGHT = {"cell": "models/cells/light.yaml"}
TURNING = {"scene": "scenes/free.yaml", "hand": "sim/hands/wrench.yaml"}

# Option -> options with which it can be seen to do something. `None`: they are the same without it.
SEEN = {
    "cell": {"cell": "models/cells/seven.yaml"},
    "scene": {"scene": "scenes/room.yaml"},
    "hand": {"hand": "sim/hands/sweep.yaml"},
    "mass": {"mass": 6},
    "damping": {"damping": "12Ns/m"},
    "spring": {"spring": 40.0},
    "stiffness": {**LIGHT, "stiffness": 500, "duration": 5},
    "scheme": {**LIGHT, "scheme": "impedance"},
    "timestep": {"timestep": 0.002},
    "extra-delay": {"mass": 8, "extra_delay": "4ms"},
    "lookahead": {"lookahead": 0.004},
    "gear-damping": {"gear_damping": "off"},
    "duration": {"duration": 1},
    "bus": {"bus": "sim"},
    "fault": {"fault": ["axis_2:silent@1.8s", "sensor:drift=0.1@1s"]},
    "do": {"do": ["hold@1s", "resume@1.5s"]},
    "handle": {"handle": "held", "hand": "sim/hands/touch.yaml"},
    "wait-after-fault": {"fault": "sensor:frozen@1s..1.2s", "wait_after_fault": 3, "do": ["reset@3s", "resume@3.5s"]},
    "accept-force": {"accept_force": 20},
    "pace": {"pace": "realtime", "duration": 0.5},
    "order": {"order": 2},
    "orientation": {**TURNING, "orientation": "free"},
    "tool": {**TURNING, "tool": "scenes/tools/rod.yaml", "inertia": 0.1},
    "inertia": {**TURNING, "inertia": 0.08},
    "turning-damping": {**TURNING, "inertia": 0.08, "turning_damping": 0.4},
    "turning-spring": {**TURNING, "inertia": 0.08, "turning_spring": 5},
    "passivity": {"passivity": "off"},
    "set": {"set": ["mass=6kg@0.5s", "wall.friction=0.6@1s"]},
    "force-unstable": {"mass": 1, "force_unstable": True},
}
SAME_WITHOUT = {"scheme", "bus", "gear-damping", "accept-force", "handle"}
# Those of the program alone, and what is said of them.
REFUSED = {"bus": ("can0", "real arm"), "hardware": (True, "real arm"), "without-proof": (True, "real arm"),
           "view": (True, "proxarm view DIR"), "view-port": (8080, "proxarm view DIR"),
           "view-control": (True, "proxarm view DIR"), "allow-origin": ("https://example.org", "proxarm view DIR"),
           "json": (True, "its summary"), "verbose": (True, "its summary")}
# Tried by a test of its own, below.
BY_ITSELF = {"arm", "enabling", "without-enabling-input", "record", "signals", "control", "black-box", "plot", "no-plot"}


def words_of(options):
    """The command line of a session's options: the units are what its help asks for."""
    words = []
    for name, value in options.items():
        option = "--" + name.replace("_", "-")
        times = name in ("timestep", "extra_delay", "lookahead", "duration", "wait_after_fault")
        for one in value if isinstance(value, list) else [value]:
            text = f"{one}s" if times and not isinstance(one, str) else str(one)
            words += [text] if name == "cell" else [option] if one is True else [option, text]
    return words


class Options(ProgramTest):
    def told(self, summary):
        return {key: value for key, value in summary.items() if key not in APART}

    def of_the_program(self, options):
        """The summary, whatever its end."""
        outcome = self.call("run", "--json", "--no-plot", *words_of(options))
        self.assertIn(outcome.status, (0, 1), outcome.err)
        return self.told(outcome.summary)

    def of_a_session(self, options):
        return self.told(json.loads(json.dumps(proxarm.Session(**options).run().summary)))

    def with_an_enabling_input(self):
        return self.changed("models/cells/default.yaml", ("gravity_W_m_per_s2:", "enabling_input: {drive: axis_6, bit: 16}\ngravity_W_m_per_s2:"))

    def test_every_option_of_the_help_is_one_of_these(self):
        told = set(re.findall(r"^  --([a-z-]+)", self.call("run", "--help").out, re.MULTILINE)) - {"help-all"}
        self.assertEqual(told | {"cell"}, SEEN.keys() | REFUSED.keys() | BY_ITSELF)

    def test_moves_and_tells_as_the_program_does(self):
        for name, options in SEEN.items():
            whole = {"duration": 2, **options}
            with self.subTest(name):
                here, there = self.of_a_session(whole), self.of_the_program(whole)
                if name == "pace":  # how many cycles came late is the machine's
                    here, there = ({**summary, "verdict": None} for summary in (here, there))
                self.assertEqual(here, there)
                own = name.replace("-", "_")
                rest = {key: value for key, value in whole.items() if key != own}
                if name in SAME_WITHOUT:
                    continue
                if name == "force-unstable":
                    with self.assertRaises(proxarm.SetupError):
                        proxarm.Session(**rest)
                elif name != "pace":
                    self.assertNotEqual(here, self.of_a_session({"duration": 2, **rest}))
                else:
                    began = time.monotonic()
                    self.of_a_session(whole)
                    self.assertGreater(time.monotonic() - began, whole["duration"])
                    self.assertGreater(proxarm.Session(**whole).run().summary["latency_us"]["wake_up"]["max"], 0)

    def test_a_simulated_arm_that_is_another_one(self):
        arm = self.changed("models/cells/default.yaml", ("gear_stiffness_Nm_per_rad: 115000", "gear_stiffness_Nm_per_rad: 80000"))
        options = {"arm": arm, "duration": 2}
        self.assertEqual(self.of_a_session(options), self.of_the_program(options))
        self.assertNotEqual(self.of_a_session(options), self.of_a_session({"duration": 2}))
        with self.assertRaisesRegex(proxarm.SetupError, "--arm: found other buses or joints"):
            proxarm.Session(arm="models/cells/scara.yaml").run()

    def test_an_enabling_switch(self):
        cell = self.with_an_enabling_input()
        options = {"cell": cell, "duration": 2}
        for more in ({"enabling": ["0.2s..1.2s", "1.5s..9s"]}, {"without_enabling_input": True}):
            with self.subTest(more):
                self.assertEqual(self.of_a_session({**options, **more}), self.of_the_program({**options, **more}))
        switched = self.of_a_session({**options, "enabling": ["0.2s..1.2s", "1.5s..9s"]})
        self.assertNotEqual(switched, self.of_a_session(options))
        with self.assertRaisesRegex(proxarm.SetupError, "^--enabling: found a cell without an enabling input"):
            proxarm.Session(enabling="0.2s..1s")

    def test_a_record_is_the_programs(self):
        """File by file, to the byte, but for times of the machine and what holds them."""
        for form in ("packed", "binary", "csv"):
            with self.subTest(form):
                here, there = self.folder / f"here-{form}", self.folder / f"there-{form}"
                proxarm.Session(duration=2, record=here, signals=form, no_plot=True).run()
                self.call("run", "--duration", "2s", "--record", there, "--signals", form, "--no-plot")
                names = sorted(file.name for file in there.iterdir() if file.is_file())
                self.assertEqual(sorted(file.name for file in here.iterdir() if file.is_file()), names)
                self.assertGreater(len(names), 6)
                for name in set(names) - {"timing.json", "summary.json"}:
                    self.assertEqual((here / name).read_bytes(), (there / name).read_bytes(), name)
                self.assertEqual(self.told(json.loads((here / "summary.json").read_text())),
                                 self.told(json.loads((there / "summary.json").read_text())))
                replayed = self.call("replay", here, "--json")
                self.assertEqual(replayed.status, 0, replayed.err)
        self.assertEqual(proxarm.load(here, columns=["time_s"]).signals["time_s"].size, 2241)

    def test_plots(self):
        proxarm.Session(duration=1, record=self.folder / "record").run()
        self.assertIn("<svg", (self.folder / "record/plot.svg").read_text())
        proxarm.Session(duration=1, plot=self.folder / "mine.svg").run()
        self.assertIn("<svg", (self.folder / "mine.svg").read_text())
        proxarm.Session(duration=1, record=self.folder / "record", no_plot=True).run()
        self.assertFalse((self.folder / "record/plot.svg").exists())
        with self.assertRaisesRegex(proxarm.SetupError, r'^--plot: .* ends in \.svg'):
            proxarm.Session(plot="mine.png")

    def test_a_black_box_after_a_fault_alone(self):
        box = self.folder / "box"
        summary = proxarm.Session(duration=2, fault="axis_3:silent@1s", black_box=box).run().summary
        self.assertEqual(summary["black_box"], str(box))
        self.assertIn("drive", (box / "reason.txt").read_text())
        self.assertEqual(self.call("replay", box).status, 0)
        record = self.folder / "record"
        proxarm.Session(duration=2, fault="axis_3:silent@1s", record=record).run()
        self.assertTrue((record / "black-box/reason.txt").exists())
        before = set(pathlib.Path.cwd().iterdir())
        proxarm.Session(duration=2, fault="axis_3:silent@1s").run()
        self.assertEqual(set(pathlib.Path.cwd().iterdir()), before, "nobody has asked for one")

    def test_a_session_with_a_world_of_its_own_has_a_record_without_a_replay(self):
        record = self.folder / "record"
        result = proxarm.Session(duration=1, record=record).run(world=lambda kappa, p, q: p)
        self.assertFalse((record / "cycles.bin").exists())
        kept = proxarm.load(record)
        numpy.testing.assert_array_equal(kept.signals["tool_W_x_m"], result.signals["tool_W_x_m"])

    def test_a_socket_takes_changes(self):
        self.folder.chmod(0o700)
        path = self.folder / "control"
        session = proxarm.Session(duration=60, pace="realtime", control=path)
        runner = threading.Thread(target=lambda: answers.append(session.run().summary))
        answers, live = [], proxarm.Live(path)
        runner.start()
        deadline = time.monotonic() + 60
        while True:
            try:
                if live.status()["phase"] == "rendering":
                    break
            except proxarm.SetupError:
                self.assertLess(time.monotonic(), deadline)
            time.sleep(0.05)
        live.set(mass=6)
        while session.status()["felt_mass_kg"] != 6.0:
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.02)
        with self.assertRaisesRegex(proxarm.SetupError, "^mass=0.3"):
            session.set(mass=0.3)
        session.stop()
        runner.join()
        self.assertEqual(answers[0]["end"]["reason"], "asked")
        self.assertFalse(path.exists())

    def test_is_asked_and_changed_from_its_own_functions(self):
        session = proxarm.Session(duration=4)
        said = []

        def hand(time_s, position, velocity):
            if time_s > 1 and not said:
                said.append(session.set({"mass": 8}, damping=5))
            if time_s > 2 and len(said) == 1:
                said.append(session.hold())
            if time_s > 2.5 and len(said) == 2:
                said.append(session.resume())
            return [5.0 * (time_s > 0.5) - 20 * velocity[0], -20 * velocity[1], -20 * velocity[2]]

        signals = session.run(hand=hand).signals
        self.assertEqual(said, ["mass=8\tdamping=5", "hold", "resume"])
        self.assertEqual(signals["proxy_mass_kg"][-600], 8 - 0.25, "without the handle's")
        self.assertIn("holding", set(signals["phase"]))
        with self.assertRaisesRegex(proxarm.SetupError, '^found "hold", expected a session that runs'):
            session.hold()
        light, refused = proxarm.Session(duration=1, **LIGHT), []

        def pushes(time_s, position, velocity):
            if time_s > 0.5 and not refused:
                with self.assertRaisesRegex(proxarm.SetupError, "^hold: found the impedance type"):
                    light.hold()
                refused.append(light.status()["phase"])
            return -20 * velocity

        light.run(hand=pushes)
        self.assertEqual(refused, ["rendering"])

    def test_those_of_the_program_alone_are_refused_and_listed(self):
        page = (SOURCE / "docs/how_to/python.md").read_text()
        for name, (value, words) in REFUSED.items():
            with self.subTest(name), self.assertRaisesRegex(proxarm.SetupError, f"^--{name}: found .*{words}"):
                proxarm.Session(**{name.replace("-", "_"): value})
            self.assertIn(f"`{name.replace('-', '_')}`", page)
        proxarm.Session(bus="sim", json=False, view=None)

    def test_whatever_is_wrong_is_said_as_the_program_says_it(self):
        for options, words in (({"mas": 4}, ["--mas=4.0"]), ({"turning": 1}, ["--turning=1.0"]), ({"order": 3}, ["--order", "3"]),
                               ({"signals": "csv"}, ["--signals", "csv"]), ({"mass": True}, ["--mass"]),
                               ({"mass": ""}, ["--mass", ""]), ({"record": True, "duration": 1}, ["--record", "--duration=1s"]),
                               ({"fault": "axis_9:silent"}, ["--fault", "axis_9:silent"]), ({"set": "mass=3"}, ["--set", "mass=3"]),
                               ({"do": ["jump@1s"]}, ["--do", "jump@1s"]), ({"inertia": -1}, ["--inertia", "-1"]),
                               ({"tool": "absent.yaml"}, ["--tool", "absent.yaml"]), ({"passivity": "perhaps"}, ["--passivity", "perhaps"]),
                               ({"cell": "-x.yaml"}, ["--", "-x.yaml"])):
            with self.subTest(options):
                outcome = self.call("run", *words)
                self.assertEqual(outcome.status, 2)
                with self.assertRaises(proxarm.SetupError) as caught:
                    proxarm.Session(**options).run()
                text = re.sub(r'"--(mas|turning)=[^"]*"', r'"--\1"', str(caught.exception))
                self.assertEqual(f"proxarm: {text}\n", outcome.err)
        with self.assertRaisesRegex(proxarm.SetupError, '^--no-plot: found "3", expected true or false'):
            proxarm.Session(no_plot=3)
        for value in ({"mass": 4}, object(), b"4kg"):
            with self.assertRaisesRegex(proxarm.SetupError, "^--mass: found .*, expected a number, a text"):
                proxarm.Session(mass=value)

    def test_what_is_hardly_meant_is_a_warning(self):
        cell = self.changed("models/cells/default.yaml", ("gravity_W_m_per_s2: [0, 0, -9.80665]", "gravity_W_m_per_s2: [0, 0, 9.80665]"))
        with self.assertWarnsRegex(proxarm.SetupWarning, "gravity_W_m_per_s2"):
            proxarm.Session(cell)


class Contacts(ProgramTest):
    def touched(self, world, duration=4):
        def hand(time_s, position, velocity):
            return 5 * (time_s > 0.5) - 20 * velocity[0], -20 * velocity[1], -20 * velocity[2]

        return proxarm.Session(mass=4, duration=duration).run(world=world, hand=hand)

    def test_a_world_that_names_none_has_none(self):
        """A detent holds the proxy at each centimetre, all the time. It was counted as one touch that never ended."""

        def detent(kappa, p, q):
            notch = round(q[0], 2)
            most = 3.0 / kappa
            return [p[0] - numpy.clip(p[0] - notch, -most, most), p[1], p[2]]

        result = self.touched(detent)
        self.assertEqual((result.summary["contacts"], result.summary["contact_time_s"]), (0, 0.0))
        self.assertGreater(numpy.abs(result.signals["contact_force_W_x_N"]).max(), 2.0, "it holds, all the same")
        self.assertEqual((len(result.contacts["cycle"]), result.objects), (0, []))

    def test_a_detent_before_a_wall_touches_at_the_wall_alone(self):
        stop_m = 0.75

        def world(kappa, p, q):
            x = p[0] - numpy.clip(p[0] - round(q[0], 2), -2.0 / kappa, 2.0 / kappa)
            if x < stop_m:
                return [x, p[1], p[2]]
            return [stop_m, p[1], p[2]], [proxarm.Contact(normal=[-2, 0, 0], object="stop", point=[stop_m, p[1], p[2] + 0.01])]

        result = self.touched(world)
        rendering = result.signals["phase"] == "rendering"
        proxy = result.signals.vector("proxy_W_m")[rendering, 0]
        touching = result.signals["contacts"][rendering] > 0
        numpy.testing.assert_array_equal(touching[proxy == stop_m], True)
        numpy.testing.assert_array_equal(touching[proxy < stop_m], False)
        self.assertEqual(result.objects, ["stop"])
        self.assertGreater(result.summary["contact_time_s"], 1.0)
        self.assertEqual(set(result.contacts["object"]), {0})
        self.assertEqual(set(result.contacts["normal_W_x_1"]), {-1.0})
        apart = result.contacts.vector("point_W_m") - result.signals.vector("proxy_W_m")[result.signals["contacts"] > 0]
        numpy.testing.assert_allclose(apart, [[0, 0, 0.01]] * len(apart), atol=1e-15)

    def test_objects_have_their_numbers_and_slip_or_stick(self):
        def corner(kappa, p, q):
            contacts = []
            if p[0] > 0.75:
                contacts.append(proxarm.Contact([-1, 0, 0], "front", slips=True))
            if p[2] < 0.58:
                contacts.append(proxarm.Contact([0, 0, 1], "floor"))
            return [min(p[0], 0.75), p[1], max(p[2], 0.58)], contacts

        def hand(time_s, position, velocity):
            push = 5.0 * (time_s > 0.5)
            return push - 20 * velocity[0], -20 * velocity[1], -push - 20 * velocity[2]

        result = proxarm.Session(mass=4, duration=5).run(world=corner, hand=hand)
        self.assertEqual(sorted(result.objects), ["floor", "front"])
        front = result.contacts["object"] == result.objects.index("front")
        self.assertEqual(set(result.contacts["state"][front]), {"slip"})
        self.assertEqual(set(result.contacts["state"][~front]), {"stick"})
        self.assertEqual(result.signals["contacts"].max(), 2)
        # Each bears what is along its normal.
        self.assertTrue((result.contacts["force_W_x_N"][front] <= 0).all())

    def test_what_is_no_contact_comes_out_of_the_run(self):
        for contact, error in (("wall", AttributeError), (proxarm.Contact([0, 0, 0]), ValueError), (proxarm.Contact([0, 1]), ValueError),
                               (proxarm.Contact([1, 0, 0], point=[numpy.nan, 0, 0]), ValueError)):
            with self.subTest(contact), self.assertRaises(error):
                proxarm.Session(duration=1).run(world=lambda kappa, p, q: (p, [contact]))  # noqa: B023

    def test_a_tool_with_a_shape_has_no_world_of_ones_own(self):
        with self.assertRaisesRegex(proxarm.SetupError, "^--tool: found a tool with a shape, and a world"):
            proxarm.Session(tool="scenes/tools/rod.yaml", inertia=0.1).run(world=lambda kappa, p, q: p)


if __name__ == "__main__":
    unittest.main(verbosity=2)
