"""`proxarm run --view` from outside: what it shows, whom it refuses, and that a session doesn't notice it."""
import csv
import json
import os
import pathlib
import random
import re
import signal
import socket
import subprocess
import time
import unittest

from harness import SOURCE, ProgramTest, program
from view_client import PATIENCE_S, Refused, Session, WebSocket

QUICK = ("--pace", "virtual", "--duration", "0.5s", "--no-plot")
PLATE = """name: a plate that is pushed
objects:
  - plane: {name: wall, point_m: [0.9, 0, 0.6], normal: [-1, 0, 0], friction: 0.3}
  - box: {name: plate, centre_m: [0.5, 0.4, 0.6], size_m: [0.05, 0.1, 0.1], friction: 0.2, motion: {driven: true}}
"""


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
                    poses = memoryview(message)[8 + 8 * len(stage["fields"]):].cast("f")
            plate = poses[7 * (len(stage["links"]) + 1):]
            self.assertAlmostEqual(plate[1], 0.1, places=5)


class Apart(ProgramTest):
    def test_without_the_flag_there_is_nothing_of_it(self):
        """No listener, no process, no library, no descriptor."""
        process = subprocess.Popen([program(), "run", "--pace", "realtime", "--duration", "5s", "--no-plot"], cwd=self.folder,
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            time.sleep(1.5)
            self.assertEqual(listeners(process.pid), [])
            self.assertEqual(sorted(processes_of(process.pid).values()), ["proxarm-box"])
            for child in processes_of(process.pid):
                self.assertEqual(listeners(child), [])
            without = set(self.libraries(process.pid))
            threads = len(list(pathlib.Path(f"/proc/{process.pid}/task").iterdir()))
            memory = [os.readlink(fd) for fd in pathlib.Path(f"/proc/{process.pid}/fd").iterdir()]
            self.assertFalse([name for name in memory if "memfd" in name])
        finally:
            process.send_signal(signal.SIGINT)
            process.wait()
        with Session(self.folder, "run", "--view", "--duration", "20s", "--no-plot") as session:
            time.sleep(1.0)
            self.assertEqual(sorted(processes_of(session.process.pid).values()), ["proxarm-box", "proxarm-view"])
            # The session itself has no more threads, libraries or listeners with it.
            self.assertEqual(listeners(session.process.pid), [])
            self.assertEqual(set(self.libraries(session.process.pid)), without)
            self.assertEqual(len(list(pathlib.Path(f"/proc/{session.process.pid}/task").iterdir())), threads)
            view = next(pid for pid, name in processes_of(session.process.pid).items() if name == "proxarm-view")
            self.assertEqual(listeners(view), [("0100007F", session.port)])  # 127.0.0.1, and no other
            maps = pathlib.Path(f"/proc/{view}/maps").read_text()
            box = [line.split()[1] for line in maps.splitlines() if "proxarm-black-box" in line]
            self.assertEqual(box, ["r--s"])

    @staticmethod
    def libraries(pid):
        return re.findall(r"(/\S+\.so\S*)$", pathlib.Path(f"/proc/{pid}/maps").read_text(), re.MULTILINE)

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


class Security(ProgramTest):
    """One session for all of it."""

    @classmethod
    def setUpClass(cls):
        import tempfile
        cls.place = tempfile.TemporaryDirectory(prefix="proxarm-test-")
        cls.session = Session(cls.place.name, "run", "--view", "--no-plot", "--duration", "300s", "--scene",
                              "scenes/free.yaml")

    @classmethod
    def tearDownClass(cls):
        cls.session.end()
        cls.place.cleanup()

    def assert_it_still_answers(self):
        page = self.session.open_socket()
        fields = page.receive_json("stage")["fields"]
        page.receive_moment(fields)
        page.close()

    def status(self, *arguments, **headers):
        return self.session.request(*arguments, **headers)[0]

    def test_the_page_protects_itself(self):
        status, headers, body = self.session.request("/", Cookie=self.session.cookie())
        self.assertEqual(status, 200)
        self.assertTrue(headers["content-security-policy"].startswith("default-src 'self'"))
        self.assertNotIn("unsafe", headers["content-security-policy"])
        self.assertEqual(headers["x-content-type-options"], "nosniff")
        self.assertEqual(headers["x-frame-options"], "DENY")
        self.assertEqual(headers["referrer-policy"], "no-referrer")
        self.assertEqual(headers["cross-origin-resource-policy"], "same-origin")
        # No script or style in the page's text that the policy would have to allow.
        self.assertNotRegex(body.decode(), r"<script(?![^>]*src=)|\son\w+=|\sstyle=|<style|javascript:")
        self.assertNotIn("access-control-allow-origin", headers)

    def test_the_cookie_takes_the_tokens_place(self):
        status, headers, _ = self.session.request(f"/?token={self.session.token}")
        self.assertEqual((status, headers["location"]), (303, "/"))
        self.assertIn("HttpOnly", headers["set-cookie"])
        self.assertIn("SameSite=Strict", headers["set-cookie"])
        self.assertNotIn(self.session.token, headers["set-cookie"])

    def test_dns_rebinding_and_foreign_origins_are_refused(self):
        cookie = self.session.cookie()
        self.assertEqual(self.status("/", host="rebound.example", Cookie=cookie), 403)
        self.assertEqual(self.status("/", host=f"localhost:{self.session.port}", Cookie=cookie), 403)
        self.assertEqual(self.status("/", Cookie=cookie, Origin="http://evil.example"), 403)
        self.assertEqual(self.status("/main.js", Cookie=cookie, Sec_Fetch_Site="cross-site"), 403)
        for headers in ({"Origin": "http://evil.example"}, {"Origin": "null"}, {"Origin": None}, {"Cookie": None},
                        {"Cookie": "proxarm=1"}, {"host": "rebound.example"}):
            with self.subTest(headers), self.assertRaises(Refused) as refused:
                self.session.open_socket(**headers)
            self.assertEqual(refused.exception.status, 403)

    def test_without_the_secret_there_is_nothing(self):
        for target in ("/", "/?token=" + "0" * 64, "/main.js", "/three/build/three.module.js", "/mesh/object/0"):
            self.assertEqual(self.status(target), 403, target)

    def test_forms_and_bodies_are_refused(self):
        cookie = self.session.cookie()
        for method in ("POST", "PUT", "DELETE", "OPTIONS"):
            self.assertEqual(self.status("/", method, Cookie=cookie), 405, method)
        self.assertEqual(self.status("/", "POST", body=b"ask=hold", Cookie=cookie,
                                     Content_Type="application/x-www-form-urlencoded"), 405)
        self.assertEqual(self.status("/", "GET", body=b"x" * 10, Cookie=cookie), 400)

    def test_no_path_leads_out_of_the_page(self):
        cookie = self.session.cookie()
        for target in ("/../../../../etc/passwd", "/..%2f..%2fetc/passwd", "//etc/passwd", "/three/../main.js",
                       "/style.css%00.html", "/mesh/object/../../x", "/mesh/object/999", "/mesh/link/-1/0"):
            self.assertEqual(self.status(target, Cookie=cookie), 404, target)

    def test_large_heads_and_messages_are_refused(self):
        self.assertEqual(self.status("/", Cookie=self.session.cookie(), X_Long="a" * 9000), 431)
        page = self.session.open_socket()
        page.send_frame(b"a" * 2000)
        self.assertTrue(page.is_closed())
        page = self.session.open_socket()
        page.send_frame(b"", length=1 << 62)
        self.assertTrue(page.is_closed())

    def test_who_asks_too_much_is_dropped(self):
        page = self.session.open_socket()
        with self.assertRaises(OSError):
            for i in range(20000):
                page.send({"ask": "mass=5kg", "id": i})
            while True:
                page.receive()
        self.assert_it_still_answers()

    def test_malformed_frames_are_refused(self):
        for broken in (dict(payload=b"{}", masked=False), dict(payload=b"{}", opcode=3), dict(payload=b"\xff\xfe"),
                       dict(payload=b"a" * 200, opcode=9), dict(payload=b"[]"), dict(payload=b'{"ask": 1, "id": 2}'),
                       dict(payload=b'{"ask": "hold"}'), dict(payload=b"{" * 900), dict(payload=b"\0" * 16, opcode=2),
                       dict(payload=b'{"ask": "hold", "id": -1}'), dict(payload=b"x", opcode=0)):
            with self.subTest(broken):
                page = self.session.open_socket()
                page.send_frame(**broken)
                self.assertTrue(page.is_closed())
        self.assert_it_still_answers()

    def test_noise_is_refused(self):
        """Random bytes in place of a request, and in place of frames; the seed is fixed. PROXARM_TEST_SCALE=7000: a
        million."""
        dice = random.Random(18)
        for i in range(round(150 * float(os.environ.get("PROXARM_TEST_SCALE", "1")))):
            if i % 2:
                with socket.create_connection(("127.0.0.1", self.session.port), timeout=PATIENCE_S) as raw:
                    raw.sendall(dice.randbytes(dice.randrange(1, 4000)) + b"\r\n\r\n")
                    raw.settimeout(PATIENCE_S)
                    try:
                        answer = raw.recv(4096)
                    except ConnectionError:
                        answer = b""
                    self.assertNotIn(b" 200 ", answer[:32])
            else:
                page = self.session.open_socket()
                page.socket.sendall(dice.randbytes(dice.randrange(2, 3000)))
                page.close()
        self.assert_it_still_answers()

    def test_slow_and_many_connections_dont_keep_others_out(self):
        slow = []
        try:
            for i in range(1000):
                one = socket.create_connection(("127.0.0.1", self.session.port), timeout=PATIENCE_S)
                one.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Slow: ")
                slow.append(one)
                if i % 100 == 99:
                    self.assert_it_still_answers()
            open_ones = self.still_open(slow)
            self.assertLessEqual(open_ones, 64)
            begun = time.monotonic()
            while self.still_open(slow) and time.monotonic() < begun + 15:
                for one in slow:
                    try:
                        one.sendall(b"a")
                    except OSError:
                        pass
                time.sleep(0.5)
            self.assertEqual(self.still_open(slow), 0)  # five seconds for a head, however it trickles
        finally:
            for one in slow:
                one.close()

    @staticmethod
    def still_open(connections):
        count = 0
        for one in connections:
            one.setblocking(False)
            try:
                count += 0 if one.recv(4096) == b"" else 1
            except BlockingIOError:
                count += 1
            except OSError:
                pass
            one.setblocking(True)
        return count

    def test_no_more_than_sixteen_look_at_once(self):
        pages = []
        with self.assertRaises(Refused) as refused:
            for _ in range(30):
                pages.append(self.session.open_socket())
        self.assertEqual(refused.exception.status, 503)
        self.assertLessEqual(len(pages), 16)
        for page in pages:
            page.close()
        time.sleep(0.3)
        self.assert_it_still_answers()

    def test_a_page_that_may_only_look_can_change_nothing(self):
        page = self.session.open_socket()
        page.send({"ask": "hold", "id": 7})
        answer = page.receive_json("answer")
        self.assertEqual(answer["id"], 7)
        self.assertIn("refused: this page may only look", answer["text"])


class Records(ProgramTest):
    def record(self, *arguments):
        self.call("run", "--no-plot", "--record", "session", "--duration", "5s", *arguments)
        return self.folder / "session"

    def opened(self, folder):
        session = Session(self.folder, "view", folder)
        self.addCleanup(session.end)
        page = session.open_socket()
        self.addCleanup(page.close)
        return page, page.receive_json("stage")

    def test_a_record_opens_at_its_fault_and_any_cycle_can_be_had(self):
        folder = self.record("--fault", "axis_3:silent@4s")
        fault = json.loads((folder / "summary.json").read_text())["faults"][0]
        for played in (folder, folder / "black-box"):
            with self.subTest(played.name):
                with open(played / "signals.csv", newline="") as file:
                    rows = list(csv.DictReader(file))
                page, stage = self.opened(played)
                record = stage["record"]
                self.assertEqual(record["cycles"], len(rows))
                self.assertEqual(int(rows[record["open_at"]]["cycle"]), fault["cycle"])
                told = page.receive_json("status")["fault"]
                self.assertIn("drive_silent (drive of axis_3", told)
                self.assertEqual(page.receive_moment(stage["fields"])["cycle"], fault["cycle"])
                self.assertTrue({"contact", "phase", "fault"} <= {event["kind"] for event in record["events"]})
                for index in (0, 1000, len(rows) - 1):
                    page.send({"at": index})
                    moment = page.receive_moment(stage["fields"])
                    for field, column in (("cycle", "cycle"), ("proxy_x", "proxy_W_x_m"), ("force_y", "force_W_y_N"),
                                          ("contact_force_x", "contact_force_W_x_N"), ("time_s", "time_s"),
                                          ("friction", "friction_1"), ("tool_clearance_m", "tool_clearance_m")):
                        self.assertAlmostEqual(moment[field], float(rows[index][column]), places=9, msg=field)

    def test_the_frames_of_a_cycle_are_decoded(self):
        page, stage = self.opened(self.record())
        page.send({"frames": 3000})
        frames = page.receive_json("frames")
        self.assertEqual(frames["at"], 3000)
        with open(self.folder / "session" / "signals.csv", newline="") as file:
            row = list(csv.DictReader(file))[3000]
        said = {(frame["from"], frame["words"]) for frame in frames["list"]}
        self.assertIn(("controller", "SYNC"), said)
        for axis in (f"axis_{i}" for i in range(1, 7)):
            whole = " ".join(words for whose, words in said if whose == axis)
            self.assertIn(f"position 6064h: {row[axis + '_actual_counts']} = ", whole)
            self.assertIn("statusword 6041h: ", whole)
            whole = " ".join(words for whose, words in said if whose == "to " + axis)
            self.assertIn(f"target position 607Ah: {row[axis + '_target_counts']} = ", whole)
        self.assertIn(("sensor", "sample"), said)

    def test_what_is_asked_for_beyond_the_record_is_refused(self):
        folder = self.record()
        for asked in ({"at": 10 ** 9}, {"at": -1}, {"at": 1.5}, {"window": [0]}, {"window": [0, 10 ** 9]}, {"frames": "1"},
                      {"at": 1, "frames": 1}, {}):
            with self.subTest(asked):
                page, _ = self.opened(folder)
                page.send(asked)
                self.assertTrue(page.is_closed())

    def test_what_is_no_record_is_refused(self):
        self.assert_refused(self.call("view", "."), "cycles.bin", "no such file")
        self.assert_refused(self.call("view"), "folder is required")
        folder = self.record()
        (folder / "signals.csv").write_text("a,b\n1,2\n")
        self.assert_refused(self.call("view", folder), "signals.csv", "another kind of file")
        (folder / "signals.csv").write_bytes(b"")
        self.assert_refused(self.call("view", folder), "signals.csv", "empty")


class Control(ProgramTest):
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
