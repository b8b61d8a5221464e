#!/usr/bin/python3
"""The Python package, with numpy: against closed forms, against the program's own files, and for what a call costs."""
import csv
import json
import math
import os
import pathlib
import pydoc
import re
import subprocess
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


class Help(unittest.TestCase):
    def test_each_public_name_says_what_it_is(self):
        told = pydoc.render_doc(proxarm, renderer=pydoc.plaintext)
        for name in proxarm.__all__:
            thing = getattr(proxarm, name)
            self.assertTrue((thing.__doc__ or "").strip(), name)
            self.assertIn(name, told)
            if not isinstance(thing, type) or issubclass(thing, Exception):
                continue
            for member, value in vars(thing).items():
                if member.startswith("_") and member not in ("__call__",):
                    continue
                if callable(value) or isinstance(value, property):
                    self.assertTrue((getattr(thing, member).__doc__ or "").strip(), f"{name}.{member}")


class World(unittest.TestCase):
    def test_a_wall_with_friction_is_equation_4(self):
        # The wall x = 0.9, free at smaller x, mu 0.3: r = p where p is free; else on the wall, dragged back by at most
        # mu times the depth.
        world = proxarm.World("scenes/wall.yaml")
        random = numpy.random.default_rng(1)
        for _ in range(1000):
            q = numpy.array([0.9 - random.uniform(0, 0.01), *random.uniform(-0.1, 0.1, 2)])
            p = q + random.uniform(-0.02, 0.02, 3)
            got = world(random.uniform(10, 1e6), p, q)
            expected = p.copy()
            if p[0] > 0.9:
                expected[0] = 0.9
                way = p[1:] - q[1:]  # where it sticks: at q's own place along the wall
                most = 0.3 * (p[0] - 0.9)
                expected[1:] = q[1:] if numpy.linalg.norm(way) <= most else p[1:] - most * way / numpy.linalg.norm(way)
            # Rounding of positions of a metre, some ten operations.
            numpy.testing.assert_allclose(got, expected, rtol=0, atol=1e-14)

    def test_takes_arrays_tuples_and_lists_alike(self):
        world = proxarm.World("scenes/wall.yaml")
        p, q = [0.95, 0.0, 0.6], [0.9, 0.0, 0.6]
        expected = world(4000.0, numpy.array(p), numpy.array(q))
        for kind in (tuple, list, lambda x: numpy.array(x, dtype=numpy.float32).astype(float),
                     lambda x: numpy.repeat(x, 2)[::2]):
            numpy.testing.assert_allclose(world(4000, kind(p), kind(q)), expected, atol=1e-7)
        self.assertEqual(world.dimensions, 3)
        self.assertEqual(world.objects, ["wall"])
        [(number, _, slips, normal)] = world.contacts
        self.assertEqual((number, slips), (0, False))
        numpy.testing.assert_array_equal(normal, [-1, 0, 0])
        self.assertAlmostEqual(world.clearance_m([0.8, 0, 0]), 0.1, delta=1e-15)

    def test_what_isnt_a_point_is_refused(self):
        world = proxarm.World("scenes/wall.yaml")
        for arguments in ((0.0, [0, 0, 0], [0, 0, 0]), (math.nan, [0, 0, 0], [0, 0, 0]), (1.0, [0, 0], [0, 0, 0]),
                          (1.0, [0, 0, math.inf], [0, 0, 0]), (1.0, ["a", 0, 0], [0, 0, 0]), (1.0, 3, [0, 0, 0])):
            with self.subTest(arguments), self.assertRaises(ValueError):
                world(*arguments)


class Sessions(ProgramTest):
    def test_moves_the_arm_as_the_program_does(self):
        here = self.summary("--mass", "5", "--duration", "2s")
        result = proxarm.Session(mass="5kg", duration="2s").run()
        self.assertEqual(result.summary["setpoint_sha256"], here["setpoint_sha256"])
        self.assertEqual(set(result.summary), set(here))

    def test_signals_are_the_records(self):
        self.summary("--duration", "2s", "--record", self.folder / "record")
        record = proxarm.load(self.folder / "record")
        signals = proxarm.Session(duration="2s").run().signals
        self.assertEqual(list(signals), list(record.signals))
        with open(self.folder / "record" / "signals.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        for name, values in record.signals.items():
            numpy.testing.assert_array_equal(values, signals[name], name)
            told = [row[name] for row in rows]
            if values.dtype.kind == "U":
                self.assertEqual(list(values), told)
            else:
                numpy.testing.assert_array_equal(values, [float(text or "nan") for text in told], name)
        self.assertEqual(set(record.meanings), set(rows[0]))
        self.assertEqual(record.signals.vector("proxy_W_m").shape, (len(rows), 3))
        chosen = proxarm.load(self.folder / "record", columns=["phase", "tool_W_x_m"]).signals
        self.assertEqual(list(chosen), ["phase", "tool_W_x_m"])
        numpy.testing.assert_array_equal(chosen["tool_W_x_m"], signals["tool_W_x_m"])
        record.signals.save(self.folder / "saved")
        saved = proxarm.load(self.folder / "saved")
        for name in signals:
            numpy.testing.assert_array_equal(saved[name], signals[name], name)

    def test_contacts_are_the_records(self):
        """A row for each contact of each cycle, from either form and from a session in Python."""
        scene, hand = SOURCE / "scenes/valve_key.yaml", SOURCE / "sim/hands/wrench.yaml"
        for form in ("csv", "binary"):
            self.call("run", "--no-plot", "--record", form, "--signals", form, "--duration", "3s", "--scene", scene, "--hand", hand,
                      "--inertia", "0.05")
            contacts = proxarm.load(self.folder / form).contacts
            with open(self.folder / "csv" / "contacts.csv", newline="") as file:
                rows = list(csv.DictReader(file))
            self.assertGreater(len(rows), 1000)
            self.assertEqual(list(contacts), list(rows[0]))
            self.assertEqual(list(contacts["state"]), [row["state"] for row in rows])
            for name in set(contacts) - {"state"}:
                self.assertEqual(list(contacts[name]), [float(row[name]) for row in rows], name)
            self.assertEqual(contacts.vector("point_W_m").shape, (len(rows), 3))
        (self.folder / "csv" / "contact_columns.json").unlink()
        with self.assertRaisesRegex(proxarm.SetupError, "contact_columns.json"):
            proxarm.load(self.folder / "csv").contacts
        result = proxarm.Session(scene=SOURCE / "scenes/wall.yaml", duration=5).run()
        touching = result.signals["contacts"] > 0
        self.assertEqual(list(result.contacts["cycle"]), list(result.signals["cycle"][touching]))
        self.assertTrue((result.contacts.vector("force_W_N") == result.signals.vector("contact_force_W_N")[touching]).all())

    def test_a_long_records_columns_are_kept_until_it_changes(self):
        record = self.folder / "record"
        words = ("--duration", "1s", "--record", record)
        self.summary(*words)
        whole = proxarm.load(record).signals
        self.assertFalse((record / "numpy").exists(), "it isn't long")
        before, proxarm.KEEP_FROM_BYTES = proxarm.KEEP_FROM_BYTES, 1
        self.addCleanup(setattr, proxarm, "KEEP_FROM_BYTES", before)
        proxarm.load(record, keep=False)
        self.assertFalse((record / "numpy").exists(), "nobody wants it to be kept")
        for columns in (["phase", "tool_W_x_m"], ["tool_W_x_m", "flags"], None, None):
            signals = proxarm.load(record, columns).signals
            self.assertEqual(list(signals), columns or list(whole))
            self.assertIsInstance(signals["tool_W_x_m"], numpy.memmap)
            for name in signals:
                numpy.testing.assert_array_equal(signals[name], whole[name], name)
        # A file that has changed is read again, and what was kept of the old one goes.
        text = (record / "signals.csv").read_text().splitlines(keepends=True)
        (record / "signals.csv").write_text("".join(text[:100]))
        self.assertEqual(proxarm.load(record, ["time_s"]).signals["time_s"].size, 99)
        self.assertEqual(len(list((record / "numpy").iterdir())), 1)
        # So does all of it, by a session that is recorded in its place; not where there is something of somebody's.
        self.summary(*words)
        self.assertFalse((record / "numpy").exists())
        proxarm.load(record)
        kept = next((record / "numpy").iterdir())
        (kept / "thesis.txt").write_text("ten years")
        self.assert_refused(self.call("run", *words), "numpy")
        # Where nothing can be written it is read all the same.
        for file in (*kept.iterdir(), kept, record / "numpy"):
            file.unlink() if file.is_file() else file.rmdir()
        (record / "numpy").write_text("no folder")
        numpy.testing.assert_array_equal(proxarm.load(record).signals["time_s"], whole["time_s"])

    def test_packed_numbers_are_those_of_the_text(self):
        for folder, form in (("text", "csv"), ("packed", "packed")):
            self.call("run", "--no-plot", "--duration", "5s", "--fault", "axis_3:silent@4s", "--record", folder, "--signals", form)
        text, packed = (proxarm.load(self.folder / folder) for folder in ("text", "packed"))
        self.assertEqual(list(packed.signals), list(text.signals))
        for name in text.signals:
            numpy.testing.assert_array_equal(packed.signals[name], text.signals[name], name)
        for name in text.contacts:
            numpy.testing.assert_array_equal(packed.contacts[name], text.contacts[name], name)
        chosen = proxarm.load(self.folder / "packed", columns=["phase", "tool_W_x_m"]).signals
        numpy.testing.assert_array_equal(chosen["phase"], text.signals["phase"])
        with self.assertRaisesRegex(proxarm.SetupError, '"torque"'):
            proxarm.load(self.folder / "packed", columns=["torque"])
        file = self.folder / "packed" / "signals.bin"
        whole = file.read_bytes()
        begin = int.from_bytes(whole[12:16], "little")
        first = 4 + int.from_bytes(whole[begin:begin + 4], "little")
        for end, rows in ((begin, 0), (begin + 3, 0), (begin + first - 1, 0), (begin + first, 512), (begin + first + 9, 512)):
            file.write_bytes(whole[:end])
            numpy.testing.assert_array_equal(proxarm.load(self.folder / "packed").signals["time_s"], text.signals["time_s"][:rows])
        file.write_bytes(whole[:begin + 40] + b"damage" + whole[begin + 46:])
        with self.assertRaisesRegex(proxarm.SetupError, "a block that is damaged"):
            proxarm.load(self.folder / "packed")

    def test_numbers_in_columns_are_those_of_the_text(self):
        for folder, form in (("text", "csv"), ("numbers", "binary")):
            self.call("run", "--no-plot", "--duration", "5s", "--fault", "axis_3:silent@4s", "--record", folder, "--signals", form)
        text, numbers = (proxarm.load(self.folder / folder) for folder in ("text", "numbers"))
        self.assertEqual(list(numbers.signals), list(text.signals))
        self.assertEqual(numbers.meanings, text.meanings)
        for name in text.signals:
            numpy.testing.assert_array_equal(numbers.signals[name], text.signals[name], name)
        self.assertGreater(len(set(numbers.signals["flags"])), 2)
        self.assertIn("drive_silent", set(numbers.signals["fault"]))
        chosen = proxarm.load(self.folder / "numbers", columns=["phase", "tool_W_x_m"]).signals
        self.assertEqual(list(chosen), ["phase", "tool_W_x_m"])
        numbers.signals.save(self.folder / "saved")
        numpy.testing.assert_array_equal(proxarm.load(self.folder / "saved")["phase"], text.signals["phase"])
        with self.assertRaisesRegex(proxarm.SetupError, '"torque"'):
            proxarm.load(self.folder / "numbers", columns=["torque"])
        file = self.folder / "numbers" / "signals.bin"
        whole = file.read_bytes()
        begin, columns = (int.from_bytes(whole[at:at + 4], "little") for at in (12, 20))
        for blocks in (0, 3):  # cut off within the next one
            file.write_bytes(whole[:begin + blocks * 4096 * columns + 4095])
            numpy.testing.assert_array_equal(proxarm.load(self.folder / "numbers").signals["time_s"],
                                             text.signals["time_s"][:512 * blocks])
        for data, found in ((whole[:8] + b"\3" + whole[9:], "version 3"), (b"cycle,time_s\n0,0\n" * 9, "another kind"),
                            (whole[:10], "another kind|cut off"), (whole[:4000], "cut off")):
            file.write_bytes(data)
            with self.subTest(found), self.assertRaisesRegex(proxarm.SetupError, found):
                proxarm.load(self.folder / "numbers")

    def test_a_table_of_many_parts_is_read_whole(self):
        # A part is a MiB at least, with a thread each; words come in another order in each part.
        rows = [(i, f"{i / 7!r}", "abc"[i // 20000 % 3], "" if i % 3 else "1e300") for i in range(200_000)]
        for end in ("", "\n"):
            file = self.written("many.csv", "count,seventh,word,some\n" + "\n".join(",".join(map(str, row)) for row in rows) + end)
            count, seventh, word, some = (values for _, *values in proxarm._read_table(str(file), [], []))
            numpy.testing.assert_array_equal(count[0], [row[0] for row in rows])
            numpy.testing.assert_array_equal(seventh[0], [row[0] / 7 for row in rows])
            numpy.testing.assert_array_equal(numpy.array(word[1])[word[0]], [row[2] for row in rows])
            numpy.testing.assert_array_equal(some[0], [float(row[3] or "nan") for row in rows])
        for wrong, found in (("3,4,x\n", "3,4,x"), ("3,y,x,1\n", '"y"')):
            with self.subTest(wrong), self.assertRaisesRegex(proxarm.SetupError, found):
                proxarm._read_table(str(self.written("wrong.csv", file.read_text() + wrong)), [], [])

    def test_a_world_and_a_hand_in_python(self):
        stop_m = 0.75

        def wall(kappa, p, q):
            return [min(p[0], stop_m), p[1], p[2]], [proxarm.Contact([-1, 0, 0])] * int(p[0] > stop_m)

        def hand(time_s, position, velocity):  # not before the sensor is tared
            return 5 * (time_s > 0.5) - 20 * velocity[0], -20 * velocity[1], -20 * velocity[2]

        result = proxarm.Session(duration=3.0).run(world=wall, hand=hand)
        proxy = result.signals.vector("proxy_W_m")
        self.assertEqual(proxy[:, 0].max(), stop_m)
        self.assertGreater(result.summary["contact_time_s"], 1.0)
        self.assertEqual(result.summary["faults"], [])
        # At rest on the wall: the wall holds what the hand pushes. 2 % of 5 N for the sensor's noise.
        self.assertAlmostEqual(result.signals["contact_force_W_x_N"][2500:3000].mean(), -5.0, delta=0.1)

    def test_what_the_functions_raise_comes_out(self):
        def world(kappa, p, q):
            raise LookupError("no world here")

        def hand(time_s, position, velocity):
            return [0.0, math.nan, 0.0]

        for functions, error in (({"world": world}, LookupError), ({"hand": hand}, ValueError),
                                 ({"world": lambda k, p, q: "nowhere"}, ValueError), ({"hand": lambda: None}, TypeError)):
            with self.subTest(error=error), self.assertRaises(error):
                proxarm.Session(duration=1).run(**functions)

    def test_is_refused_with_the_words_of_the_command_line(self):
        cases = [({"mass": -1}, ["--mass", "-1"]), ({"mass": "3 furlongs"}, ["--mass", "3 furlongs"]),
                 ({"mass": 0.5}, ["--mass", "0.5"]), ({"timestep": "0.5ms"}, ["--timestep", "0.5ms"]),
                 ({"scene": "absent.yaml"}, ["--scene", "absent.yaml"]), ({"lookahead": "far"}, ["--lookahead", "far"]),
                 ({"scene": "models/cells/default.yaml"}, ["--scene", "models/cells/default.yaml"])]
        for options, words in cases:
            with self.subTest(options):
                outcome = self.call("run", *words)
                self.assertEqual(outcome.status, 2)
                with self.assertRaises(proxarm.SetupError) as caught:
                    proxarm.Session(**options)
                self.assertEqual(f"proxarm: {caught.exception}\n", outcome.err)
        with self.assertRaises(proxarm.SetupError) as caught:
            proxarm.World(str(self.written("bad.yaml", "objects:\n  - plane: {friction: -1}\n")))
        self.assertEqual(caught.exception.line, 2)
        self.assertTrue(caught.exception.file.endswith("bad.yaml"))
        with self.assertRaisesRegex(proxarm.SetupError, "a real arm is run by the program alone"):
            proxarm.Session(bus="can0")

    def test_other_threads_go_on_meanwhile(self):
        seen = []
        watcher = threading.Thread(target=lambda: [seen.append(time.monotonic()) or time.sleep(0.01) for _ in range(10)])
        begun = time.monotonic()
        watcher.start()
        proxarm.Session(duration=10).run()
        ended = time.monotonic()
        watcher.join()
        self.assertGreater(sum(begun < moment < ended for moment in seen), 2)


class Around(ProgramTest):
    def setUp(self):
        super().setUp()
        os.environ["PROXARM_PROGRAM"] = program()

    def test_a_live_session_is_asked_and_changed(self):
        path = self.folder / "control"
        self.folder.chmod(0o700)
        with subprocess.Popen([program(), "run", "--pace", "realtime", "--duration", "60s", "--control", path, "--no-plot"],
                              stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=self.folder) as session:
            try:
                live = proxarm.Live(path)
                deadline = time.monotonic() + 60
                while True:
                    try:
                        if live.status()["phase"] == "rendering":
                            break
                    except proxarm.SetupError:
                        self.assertLess(time.monotonic(), deadline)
                    time.sleep(0.1)
                live.set(mass=6)
                deadline = time.monotonic() + 60
                while live.status()["felt_mass_kg"] != 6.0:
                    self.assertLess(time.monotonic(), deadline)
                    time.sleep(0.05)
                with self.assertRaisesRegex(proxarm.SetupError, "mass"):
                    live.set(mass=0.3)
                live.hold()
            finally:
                session.terminate()
        with self.assertRaisesRegex(proxarm.SetupError, "a session that listens there"):
            live.status()

    def test_a_process_of_its_own_gives_its_summary(self):
        self.assertEqual(proxarm.run("--duration", "1s")["rendered_time_s"], 1.0)
        with self.assertRaisesRegex(proxarm.SetupError, "^--mass: "):
            proxarm.run("--mass", "-1")

    def test_every_studys_table_is_one(self):
        # That of `skip` had commas in its words, and five rows of more fields than names.
        study = proxarm.study("skip", out=self.folder / "skip", quick=True)
        self.assertIn("default session with lookahead", study.table["name"])
        self.assertEqual(study.table["kind"][0], "objects")

    def test_the_examples_of_the_page_are_the_files_and_run(self):
        page = (SOURCE / "docs/how_to/python.md").read_text()
        blocks = re.findall(r"^```python\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
        for name, expected in (("figure5.py", r"\(5\): pulls with 0\.421 N, kicks with 0\.313 N"), ("torus.py", r"^[1-9]\.\d\d s of touch; .* x = 0\.9\d\d\d m")):
            file = SOURCE / "docs/examples" / name
            self.assertEqual(sum(block in file.read_text() for block in blocks), 1, name)
            done = subprocess.run(["/usr/bin/python3", file], cwd=self.folder, capture_output=True, text=True,
                                  env={**os.environ, "PYTHONPATH": str(PACKAGE)})
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertRegex(done.stdout, expected)
        self.assertEqual(json.loads((self.folder / "figure5/figure5.json").read_text())["pull_force_N"]["23"], 0.0)

    def test_the_first_hour_prints_what_its_page_shows(self):
        page = (SOURCE / "docs/tutorial/first_python.md").read_text()
        blocks = re.findall(r"^```python\n(.*?)^```$\n+(?:```text\n(.*?)^```$)?", page, re.MULTILINE | re.DOTALL)
        self.assertGreater(len(blocks), 8)
        script = "print('--')\n".join(code for code, _ in blocks)
        done = subprocess.run(["/usr/bin/python3", self.written("first_hour.py", script)], cwd=self.folder, text=True,
                              capture_output=True, env={**os.environ, "PYTHONPATH": str(PACKAGE)})
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stdout.split("--\n"), [shown for _, shown in blocks])


class CallTiming(unittest.TestCase):
    def test_a_step_costs_a_microsecond_more_than_a_bare_call(self):
        # What the machine does beside comes and goes: the quickest of many short rounds, each of both by turns.
        world, bare = proxarm.World("scenes/wall.yaml"), proxarm._proxarm._bare
        p, q = numpy.array([0.95, 0.0, 0.6]), numpy.array([0.9, 0.0, 0.6])

        def took_s(function, times=2000):
            begun = time.perf_counter()
            for _ in range(times):
                function(4000.0, p, q)
            return (time.perf_counter() - begun) / times

        rounds = [(took_s(world), took_s(bare)) for _ in range(100)]
        step_s, bare_s = (min(column) for column in zip(*rounds))
        print(f"a step {1e9 * step_s:.0f} ns, a bare call {1e9 * bare_s:.0f} ns, ratio {step_s / bare_s:.1f}")
        # A guest's processor is at times half as fast, and the bare call (150 ns) as well.
        self.assertLess(step_s - bare_s, 1e-6 * max(1.0, bare_s / 150e-9))


if __name__ == "__main__":
    unittest.main(verbosity=2)
