"""`proxarm run --view` from outside: what it shows, whom it refuses, and that a session doesn't notice it."""
import json
import os
import pathlib
import pty
import re
import select
import signal
import socket
import subprocess
import time
import unittest

from harness import ProgramTest, program
from view_client import PATIENCE_S, URL, Session

QUICK = ("--pace", "virtual", "--duration", "0.5s", "--no-plot")
PLATE = """name: a plate that is pushed
objects:
  - plane: {name: wall, point_m: [0.9, 0, 0.6], normal: [-1, 0, 0], friction: 0.3}
  - box: {name: plate, centre_m: [0.5, 0.4, 0.6], size_m: [0.05, 0.1, 0.1], friction: 0.2, motion: {driven: true}}
"""
# Of a session: C and C++, MuJoCo and what it stands on, meshes, cells, Modbus, hashes. Nothing of a web server.
LIBRARIES = {"ld-linux-x", "libc", "libm", "libgcc_s", "libstdc", "libmujoco", "libccd", "libqhull_r", "liblodepng",
             "libtinyxml", "libassimp", "libdraco", "libminizip", "libz", "libyaml-cpp", "libmodbus", "libcrypto",
             "libzstd"}


def processes_of(pid):
    """The program names of a process's children."""
    names = {}
    for status in pathlib.Path("/proc").glob("[0-9]*/stat"):
        try:
            text = status.read_text()
        except OSError:
            continue
        name, rest = text[text.index("(") + 1:].rsplit(")", 1)
        if int(rest.split()[1]) == pid:
            names[int(text.split()[0])] = name
    return names


def listeners(pid):
    """(address, port) of each TCP socket that a process listens on, as /proc has them in hexadecimal."""
    inodes = set()
    for link in pathlib.Path(f"/proc/{pid}/fd").iterdir():
        try:
            if found := re.match(r"socket:\[(\d+)\]", os.readlink(link)):
                inodes.add(found[1])
        except OSError:
            continue
    found = []
    for table in ("tcp", "tcp6"):
        for line in pathlib.Path(f"/proc/{pid}/net/{table}").read_text().splitlines()[1:]:
            words = line.split()
            if words[3] == "0A" and words[9] in inodes:
                address, port = words[1].split(":")
                found.append((address, int(port, 16)))
    return found


class Shown(ProgramTest):
    def test_what_is_shown_is_what_the_session_does(self):
        with Session(self.folder, "run", "--view", "--duration", "6s", "--no-plot", "--json") as session:
            page = session.open_socket()
            stage = page.receive_json("stage")
            self.assertEqual(stage["mode"], "live")
            self.assertFalse(stage["control"])
            self.assertEqual([o["name"] for o in stage["scene"]["objects"]], ["wall"])
            self.assertEqual(len(stage["links"]), 8)  # base, six, flange
            first = page.receive_moment(stage["fields"])
            moments = [first]
            while moments[-1]["phase"] < 3 or moments[-1]["time_s"] < 3.0:
                moments.append(page.receive_moment(stage["fields"]))
            self.assertAlmostEqual(first["tool_x"], 0.7, places=3)
            self.assertGreater(moments[-1]["tool_x"], 0.72)  # it is on its way to the wall
            self.assertAlmostEqual(moments[-1]["mass_kg"], 4.0, places=9)
            self.assertAlmostEqual(moments[-1]["proxy_clearance_m"], 0.9 - moments[-1]["proxy_x"], places=9)
            times = [m["time_s"] for m in moments]
            self.assertEqual(times, sorted(times))
            # At most 60 a second, and in the pace of the clock.
            self.assertLess(len(moments), 70 * (times[-1] - times[0]) + 5)

    def test_the_end_is_told_and_stays_until_it_is_asked_to_go(self):
        with Session(self.folder, "run", "--view", *QUICK, "--json") as session:
            session.until_said("until Ctrl-C")
            page = session.open_socket()
            self.assertEqual(page.receive_json("status")["exit_status"], 0)
            stage_is_there, _, _ = session.request("/", Cookie=session.cookie())
            self.assertEqual(stage_is_there, 200)
            status, out, _ = session.end()
            self.assertEqual(status, 0)
            self.assertEqual(json.loads(out)["end"]["reason"], "duration")

    def test_a_fault_is_told_in_words(self):
        with Session(self.folder, "run", "--view", "--pace", "virtual", "--duration", "2s", "--no-plot", "--fault",
                     "axis_3:silent@1s") as session:
            session.until_said("until Ctrl-C")
            told = session.open_socket().receive_json("status")
            self.assertIn("drive_silent (drive of axis_3)", told["fault"])
            self.assertEqual(told["exit_status"], 1)
            self.assertEqual(session.end()[0], 1)

    def test_who_comes_later_has_the_last_seconds(self):
        with Session(self.folder, "run", "--view", "--duration", "30s", "--no-plot") as session:
            time.sleep(2.0)
            page = session.open_socket()
            page.receive_json("stage")
            history = page.receive()
            self.assertIsInstance(history, bytes)
            self.assertGreater(len(history), 60 * 8 * 20)

    def test_objects_that_are_driven_are_where_the_cycle_has_them(self):
        scene = self.written("plate.yaml", PLATE)
        with Session(self.folder, "run", "--view", "--scene", scene, "--duration", "8s", "--no-plot", "--set",
                     "plate.position_m=0,0.1,0@100ms") as session:
            page = session.open_socket()
            stage = page.receive_json("stage")
            moment, poses = None, None
            while moment is None or moment["rendered_s"] < 1.6:
                message = page.receive()
                if isinstance(message, bytes) and message[:8] == b"\0\0\0\0\0\0\xf0\x3f":
                    fields = memoryview(message)[8:8 + 8 * len(stage["fields"])].cast("d")
                    moment = dict(zip(stage["fields"], fields))
                    contacts_at = 8 + 8 * len(stage["fields"])
                    contacts = int(memoryview(message)[contacts_at:contacts_at + 8].cast("d")[0])
                    poses = memoryview(message)[contacts_at + 8 * (1 + contacts * len(stage["contact_fields"])):].cast("f")
            plate = poses[7 * (len(stage["links"]) + 1):]
            self.assertAlmostEqual(plate[1], 0.1, places=5)


class Apart(ProgramTest):
    def test_without_the_flag_there_is_nothing_of_it(self):
        """What the session has, by itself and in full: three threads, these libraries, no socket, and the keeper of the black
        box; and the same beside a view."""
        process = subprocess.Popen([program(), "run", "--pace", "realtime", "--duration", "20s", "--no-plot",
                                    "--verbose"], cwd=self.folder,
                                   stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        try:
            time.sleep(1.5)
            self.assertEqual(sorted(processes_of(process.pid).values()), ["proxarm-box"])
            for one in (process.pid, *processes_of(process.pid)):
                self.assertEqual(self.sockets(one), [])
                self.assertEqual(listeners(one), [])
                self.assertFalse([name for name in self.descriptors(one) if "memfd" in name])
                # Those of the instruments, in builds with them, and no other.
                unknown = {re.match(r"[a-z_]+(-[a-z]+)*", name)[0] for name in self.libraries(one)} - LIBRARIES
                self.assertEqual({name for name in unknown if not re.fullmatch("lib([atl]|ub)san", name)}, set())
            if not os.environ.get("PROXARM_SLOW_BUILD"):
                self.assertEqual(self.threads(process.pid), ["proxarm"] * 3)  # the cycle; signals; the poses' stability
            without = self.libraries(process.pid)
            threads = self.threads(process.pid)
        finally:
            process.send_signal(signal.SIGINT)
            out, _ = process.communicate()
        self.assertIn("\n  view:                     none; no network port\n", out)
        # Nothing of the server is in the program either.
        for words in (b"beast", b"Sec-WebSocket", b"three.module", b"text/html"):
            self.assertNotIn(words, pathlib.Path(program()).read_bytes(), words)
        with Session(self.folder, "run", "--view", "--duration", "20s", "--no-plot") as session:
            time.sleep(1.0)
            self.assertEqual(sorted(processes_of(session.process.pid).values()), ["proxarm-box", "proxarm-view"])
            self.assertEqual(listeners(session.process.pid), [])
            self.assertEqual(len(self.sockets(session.process.pid)), 1)  # to the view, which tells where it is
            self.assertEqual(self.libraries(session.process.pid), without)
            self.assertEqual(self.threads(session.process.pid), threads)
            view = next(pid for pid, name in processes_of(session.process.pid).items() if name == "proxarm-view")
            self.assertEqual(listeners(view), [("0100007F", session.port)])  # 127.0.0.1, and no other
            maps = pathlib.Path(f"/proc/{view}/maps").read_text()
            box = [line.split()[1] for line in maps.splitlines() if "proxarm-black-box" in line]
            self.assertEqual(box, ["r--s"])
            out = session.end()[1]
        self.assertIn(f"\n  view:                     127.0.0.1:{session.port}, 16 viewers at most, who may only look\n", out)

    def test_the_summary_for_programs_has_the_view(self):
        self.assertIsNone(json.loads(self.call("run", "--json", *QUICK).out)["view"])
        with Session(self.folder, "run", "--view-control", "--json", *QUICK) as session:
            session.until_said("until Ctrl-C")
            self.assertEqual(json.loads(session.end()[1])["view"], {"address": "127.0.0.1", "port": session.port,
                                                                    "most_viewers": 16, "may_change": True})

    @staticmethod
    def libraries(pid):
        """The file names of the libraries that a process has mapped."""
        maps = pathlib.Path(f"/proc/{pid}/maps").read_text()
        return sorted(set(re.findall(r"/([^/\s]+\.so\S*)$", maps, re.MULTILINE)))

    @staticmethod
    def threads(pid):
        return [(task / "comm").read_text().strip() for task in pathlib.Path(f"/proc/{pid}/task").iterdir()]

    @staticmethod
    def descriptors(pid):
        return [os.readlink(fd) for fd in pathlib.Path(f"/proc/{pid}/fd").iterdir()]

    def sockets(self, pid):
        return [name for name in self.descriptors(pid) if name.startswith("socket:")]

    def test_setpoints_are_the_same_to_the_bit(self):
        arguments = ("run", "--json", "--no-plot", "--duration", "4s")
        without = json.loads(self.call(*arguments).out)["setpoint_sha256"]
        with Session(self.folder, *arguments, "--view", "--pace", "virtual") as session:
            session.until_said("until Ctrl-C")
            self.assertEqual(json.loads(session.end()[1])["setpoint_sha256"], without)
        with Session(self.folder, *arguments, "--view-control") as session:  # in the pace of the clock
            page = session.open_socket()
            page.receive_json("stage")
            session.until_said("until Ctrl-C")
            self.assertEqual(json.loads(session.end()[1])["setpoint_sha256"], without)

    def test_killing_the_view_changes_nothing(self):
        without = json.loads(self.call("run", "--json", "--no-plot", "--duration", "2s").out)["setpoint_sha256"]
        with Session(self.folder, "run", "--view", "--json", "--no-plot", "--duration", "2s") as session:
            view = next(pid for pid, name in processes_of(session.process.pid).items() if name == "proxarm-view")
            time.sleep(0.7)
            os.kill(view, signal.SIGKILL)
            status, out, err = session.process.wait(), *session.process.communicate()
            self.assertEqual(status, 0, err)
            self.assertEqual(json.loads(out)["setpoint_sha256"], without)
            self.assertNotIn("until Ctrl-C", err)

    def test_the_view_ends_with_a_session_that_is_killed(self):
        with Session(self.folder, "run", "--view", "--no-plot", "--duration", "20s") as session:
            view = next(pid for pid, name in processes_of(session.process.pid).items() if name == "proxarm-view")
            page = session.open_socket()
            session.process.kill()
            session.process.wait()
            self.assertTrue(page.is_closed())
            until = time.monotonic() + PATIENCE_S
            while pathlib.Path(f"/proc/{view}").exists() and time.monotonic() < until:
                time.sleep(0.05)
            self.assertFalse(pathlib.Path(f"/proc/{view}").exists())


class Desktop(ProgramTest):
    """With somebody at a terminal and a desktop, the address is opened there; an xdg-open of ours tells how."""

    def setUp(self):
        super().setUp()
        for name in ("bin", "runtime"):
            (self.folder / name).mkdir()
        opener = self.folder / "bin" / "xdg-open"
        told = self.folder / "told"
        opener.write_text(f'#!/bin/sh\n{{ stat -c %a "$1" "$(dirname "$1")"; echo "$#:$1"; cat "$1"; }} > {told}.new\n'
                          f"mv {told}.new {told}\n")
        opener.chmod(0o700)
        self.told = told
        self.env = {**os.environ, "XDG_RUNTIME_DIR": str(self.folder / "runtime"), "DISPLAY": ":9",
                    "PATH": f"{opener.parent}:{os.environ['PATH']}"}

    def run_at_a_terminal(self, env, *command):
        """Returns the address that was said, once the view stays, and the process."""
        terminal, its_end = pty.openpty()
        self.addCleanup(os.close, terminal)
        process = subprocess.Popen(command, cwd=self.folder, stdin=subprocess.DEVNULL, env=env,
                                   stdout=subprocess.DEVNULL, stderr=its_end, text=True)
        os.close(its_end)
        said = b""
        while b"until Ctrl-C" not in said:
            ready, _, _ = select.select([terminal], [], [], PATIENCE_S)
            self.assertTrue(ready, said)
            said += os.read(terminal, 4096)
        return URL.search(said.decode())[1], process

    def test_the_address_goes_to_the_browser_and_to_nobody_else(self):
        url, process = self.run_at_a_terminal(self.env, program(), "run", "--view", *QUICK)
        until = time.monotonic() + PATIENCE_S
        while not self.told.exists() and time.monotonic() < until:
            time.sleep(0.01)
        modes_of_file, modes_of_folder, words, page = self.told.read_text().splitlines()
        self.assertEqual((modes_of_file, modes_of_folder), ("600", "700"))
        count, file = words.split(":", 1)
        self.assertEqual(count, "1")
        self.assertNotIn(url[-64:], file, "a command line is for everybody to read")
        self.assertIn(f"url={url}", page)
        self.assertTrue(pathlib.Path(file).exists())
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(PATIENCE_S), 0)
        self.assertFalse(pathlib.Path(file).exists(), "it is gone with the session")

    def test_nothing_is_opened_without_a_desktop(self):
        env = {name: value for name, value in self.env.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
        _, process = self.run_at_a_terminal(env, program(), "run", "--view", *QUICK)
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(PATIENCE_S), 0)
        self.assertFalse(self.told.exists())

    def test_what_others_have_put_there_is_left_alone(self):
        """A link in place of the file that leads to the address: it is neither followed nor removed."""
        elsewhere = self.written("elsewhere", "mine")
        folder = self.folder / "runtime" / "proxarm"
        folder.mkdir(mode=0o700)
        script = f'ln -s {elsewhere} {folder}/view-$$.html; exec {program()} "$@"'
        _, process = self.run_at_a_terminal(self.env, "/bin/sh", "-c", script, "sh", "run", "--view", *QUICK)
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(PATIENCE_S), 0)
        self.assertEqual(elsewhere.read_text(), "mine")
        self.assertEqual(len(list(folder.glob("*.html"))), 1)
        self.assertFalse(self.told.exists())


class Refusals(ProgramTest):
    def test_mistakes_are_told_as_all_others(self):
        env = {**os.environ, "PROXARM_THREE": str(self.folder)}
        for arguments, said, surroundings in (
                (("--view",), ("three.module.js", "libjs-three", "apt-get install"), env),
                (("--view-port", "80"), ("--view-port", "1024 to 65535"), None),
                (("--view-port", "8080"), ("--view-port", "no view", "--view with it"), None),
                (("--view", "--allow-origin", "*"), ("--allow-origin", '"*"', "https://"), None),
                (("--allow-origin", "https://a.example"), ("--allow-origin", "--view with it"), None),
                (("models/cells/light.yaml", "--view-control"), ("--view-control", "impedance"), None)):
            with self.subTest(arguments):
                self.assert_refused(self.call("run", *arguments, env=surroundings), *said)
        with socket.create_server(("127.0.0.1", 0)) as taken:
            port = taken.getsockname()[1]
            self.assert_refused(self.call("run", "--view", "--view-port", port), "--view-port", str(port), "free")

    def test_a_pipe_cant_be_shown(self):
        reading, writing = os.pipe()
        os.write(writing, PLATE.encode())
        os.close(writing)
        done = subprocess.run([program(), "run", "--view", "--scene", f"/dev/fd/{reading}", *QUICK], cwd=self.folder,
                              pass_fds=[reading], capture_output=True, text=True, timeout=60)
        os.close(reading)
        self.assertEqual(done.returncode, 2)
        self.assertIn("can be read only once", done.stderr)


class Control(ProgramTest):
    def test_every_page_has_what_the_session_is_set_to(self):
        """Fields took the values of the start, and never followed: a second page, or one that was loaded anew, lied."""
        scene = self.written("plate.yaml", PLATE)
        with Session(self.folder, "run", "--view-control", "--no-plot", "--control", "ear", "--scene", scene, "--duration",
                     "60s") as session:
            first, second = session.open_socket(), session.open_socket()
            fields = first.receive_json("stage")["fields"]
            self.assertEqual(second.receive_json("stage")["settings"]["friction"], [0.3, 0.2])
            while first.receive_moment(fields)["phase"] < 3:
                pass

            def told(page, name, value):
                """The settings of the message that brings this value."""
                while (settings := page.receive_json("settings"))[name] != value:
                    pass
                return settings

            first.send({"ask": "spring=50N/m", "id": 1})
            self.assertEqual(first.receive_json("answer")["text"], "ok: spring=50N/m")
            for page in (first, second):
                told(page, "spring_N_per_m", 50.0)
            # The terminal's way, which no page has asked for.
            done = self.call("set", "--control", "ear", "wall.friction=0.5", "plate.position_m=0,0.05,0")
            self.assertEqual(done.status, 0, done.err)
            self.assertEqual(self.call("set", "--control", "ear", "damping=5Ns/m").status, 0)
            self.assertEqual(self.call("set", "--control", "ear", "timestep=2ms").status, 0)
            for page in (first, second):
                settings = told(page, "period_s", 0.002)
                self.assertEqual(settings["friction"], [0.5, 0.2])
                self.assertEqual(settings["position_m"][1], [0.0, 0.05, 0.0])
                self.assertEqual(settings["damping_Ns_per_m"], 5.0)
            late = session.open_socket().receive_json("stage")["settings"]
            self.assertEqual(late, settings)
            self.assertAlmostEqual(late["mass_kg"], 4.0, places=12)

    def test_changes_and_orders_are_those_of_the_socket(self):
        runtime = self.folder / "runtime"
        runtime.mkdir()
        env = {**os.environ, "XDG_RUNTIME_DIR": str(runtime)}
        with Session(self.folder, "run", "--view-control", "--no-plot", "--record", "session", "--duration", "4s", env=env) as session:
            page = session.open_socket()
            stage = page.receive_json("stage")
            self.assertTrue(stage["control"])
            asked = 0

            def ask(line):
                nonlocal asked
                asked += 1
                page.send({"ask": line, "id": asked})
                while (answer := page.receive_json("answer"))["id"] != asked:
                    pass
                return answer["text"]

            while page.receive_moment(stage["fields"])["phase"] < 3:
                pass
            self.assertEqual(ask("mass=6kg"), "ok: mass=6kg")
            moment = page.receive_moment(stage["fields"])
            until = time.monotonic() + PATIENCE_S
            while abs(moment["mass_kg"] - 6.0) > 1e-9 and time.monotonic() < until:
                moment = page.receive_moment(stage["fields"])
            self.assertAlmostEqual(moment["mass_kg"], 6.0, places=9)
            self.assertIn("refused: ", ask("mass=0.01kg"))
            self.assertIn("from 0 to 10", ask("wall.friction=99"))
            self.assertEqual(ask("hold"), "ok: hold")
            while page.receive_moment(stage["fields"])["phase"] != 4:
                pass
            self.assertEqual(ask("resume"), "ok: resume")
            session.until_said("until Ctrl-C")
            self.assertIn("refused: ", ask("mass=5kg"))  # nobody listens any more
            self.assertEqual(session.end()[0], 0)
        self.assertEqual(list((runtime / "proxarm").iterdir()), [])
        rows = (self.folder / "session" / "signals.csv").read_text()
        self.assertIn(",holding,", rows)


if __name__ == "__main__":
    unittest.main()
