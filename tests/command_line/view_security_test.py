"""The web server of `--view` from outside: whom it refuses, and that noise does nothing to it."""
import os
import random
import socket
import struct
import tempfile
import time
import unittest

from harness import ProgramTest
from view_client import PATIENCE_S, Refused, Session, WebSocket

# What pages and other tools say, for noise to be made of.
SAID = ('{"ask": "mass=5kg", "id": 1}', '{"at": 100}', '{"window": [0, 10], "rows": 4}', '{"frames": 3}',
        '{"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 1}, {"id": 2, "channelId": 8}]}',
        '{"op": "unsubscribe", "subscriptionIds": [1]}', '{"op": "getParameters", "parameterNames": ["mass"], "id": "a"}',
        '{"op": "setParameters", "parameters": [{"name": "mass", "value": 4.5}], "id": "b"}',
        '{"op": "subscribeParameterUpdates", "parameterNames": ["mass"]}')
TOOLS = "foxglove.websocket.v1"
# With words of their own: noise may make other pings.
PING, PONG = b"\x89\x84\0\0\0\0ours", b"\x8a\x04ours"


class Noise:
    """Random bytes and spoiled messages in place of requests and of frames."""

    def __init__(self, session, dice):
        self.session, self.dice = session, dice
        self.cookie = session.cookie()
        self.taken_in = 0  # requests and frames that the server has read
        self.granted = 0   # requests that were answered as if they were good

    def spoiled(self, data):
        """The same with some bytes changed, doubled or left out."""
        data, dice = bytearray(data), self.dice
        for _ in range(dice.randrange(1, 6)):
            at = dice.randrange(len(data)) if data else 0
            what = dice.randrange(4)
            if what == 0:
                data[at:at + 1] = dice.randbytes(1)
            elif what == 1:
                data[at:at] = data[at:at + dice.randrange(1, 40)]
            elif what == 2:
                del data[at:at + dice.randrange(1, 10)]
            else:
                data[at:at] = dice.choice((b'"', b"{", b"[", b"\\", b"\0", b"1e999", b"-1", b"null", b"\r\n", b"\xff"))
        return bytes(data)

    def send_some(self):
        self.dice.choice((self.bytes_for_a_request, self.spoiled_request, self.frames, self.frames))()

    def request(self, data):
        with socket.create_connection(("127.0.0.1", self.session.port), timeout=PATIENCE_S) as raw:
            try:
                raw.sendall(data)
                raw.shutdown(socket.SHUT_WR)
                answer = raw.recv(4096)
            except OSError:  # it was dropped, perhaps before anything was read
                return b""
        self.taken_in += 1
        return answer

    def bytes_for_a_request(self):
        self.granted += b" 200 " in self.request(self.dice.randbytes(self.dice.randrange(1, 4000)) + b"\r\n\r\n")[:32]

    def spoiled_request(self):
        """Without the secret, so that no luck makes a good one of it."""
        head = (f"GET /{self.dice.choice(('', 'main.js', 'live', 'mesh/object/0'))} HTTP/1.1\r\nHost: {self.session.host}\r\n"
                f"Origin: {self.session.origin}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"
                f"Cookie: proxarm={self.dice.randbytes(32).hex()}\r\nContent-Length: {self.dice.randrange(3)}\r\n\r\n")
        answer = self.request(self.spoiled(head.encode()))
        self.granted += b" 200 " in answer[:32] or b" 101 " in answer[:32]

    def frame(self):
        dice = self.dice
        payload = dice.choice(SAID).encode()
        what = dice.randrange(8)
        if what == 0:
            return dice.randbytes(dice.randrange(2, 2000))
        if what < 6:
            payload = self.spoiled(payload)[:1000]
        opcode = dice.choice((1, 1, 1, 1, 2, 0, 9, 10)) if what < 7 else dice.randrange(16)
        length = struct.pack("!B", 0x80 | len(payload)) if len(payload) < 126 else struct.pack("!BH", 0xFE, len(payload))
        mask = dice.randbytes(4)
        whole = struct.pack("!B", 0x80 | opcode) + length + mask + bytes(b ^ mask[i % 4] for i, b in enumerate(payload))
        return self.spoiled(whole) if what == 1 else whole

    def frames(self):
        """Up to sixteen on one connection, each before a ping. The server answers pings in order, so as many frames were
        taken in as pongs come back, and the one that it refused."""
        tools = self.dice.randrange(2)
        headers = {"Sec_WebSocket_Protocol": TOOLS} if tools else {}
        try:
            target = f"/?token={self.session.token}" if tools else "/live"
            page = WebSocket(self.session, target, Origin=self.session.origin, Cookie=self.cookie, **headers)
        except Refused as refused:
            if refused.status not in (429, 503):  # those before it aren't all gone yet, or were too many in a second
                raise
            time.sleep(0.01)
            return
        sent = 0
        try:
            for _ in range(self.dice.randrange(1, 17)):
                page.socket.sendall(self.frame() + PING)
                sent += 1
            page.socket.shutdown(socket.SHUT_WR)
        except OSError:
            pass
        self.taken_in += min(sent, self.pongs(page) + 1)
        page.close()

    @staticmethod
    def pongs(page):
        """How many come until the server ends it."""
        data = bytearray(page.buffer)
        try:
            while more := page.socket.recv(1 << 20):
                data += more
        except OSError:
            pass
        at = pongs = 0
        while at + 4 <= len(data):
            length, head = data[at + 1] & 0x7F, 2
            if length == 126:
                length, head = struct.unpack_from("!H", data, at + 2)[0], 4
            elif length == 127:
                if at + 10 > len(data):
                    break
                length, head = struct.unpack_from("!Q", data, at + 2)[0], 10
            pongs += data[at:at + head + length] == PONG
            at += head + length
        return pongs


class Security(ProgramTest):
    """One session for all of it."""

    @classmethod
    def setUpClass(cls):
        cls.place = tempfile.TemporaryDirectory(prefix="proxarm-test-")
        cls.session = Session(cls.place.name, "run", "--view", "--no-plot", "--duration", "3600s", "--scene",
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
        """The seed is fixed; PROXARM_TEST_SCALE=3400 makes it a million requests and frames, as `.ci/nightly noise`."""
        noise = Noise(self.session, random.Random(18))
        while noise.taken_in < round(300 * float(os.environ.get("PROXARM_TEST_SCALE", "1"))):
            noise.send_some()
        self.assertEqual(noise.granted, 0, "what isn't a whole request with the secret is answered by no page")
        self.assert_it_still_answers()
        self.assertIsNone(self.session.process.poll())

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



class SlowReader(ProgramTest):
    def test_who_takes_nothing_is_dropped_and_the_others_notice_nothing(self):
        """A page and a tool that never read, with little room in their kernel's buffers."""
        with Session(self.folder, "run", "--view", "--no-plot", "--duration", "120s") as session:
            view = session.view_process()
            page = session.open_socket()
            fields = page.receive_json("stage")["fields"]
            page.receive_moment(fields)
            time.sleep(0.3)  # the request for the cookie is closed by now
            without = session.sockets(view)
            slow = [session.open_socket(receive_buffer=4096)]
            slow.append(session.open_socket(f"/?token={session.token}", receive_buffer=4096, Sec_WebSocket_Protocol=TOOLS))
            slow[1].send({"op": "subscribe", "subscriptions": [{"id": i, "channelId": i} for i in range(1, 9)]})
            moments = [page.receive_moment(fields)]
            arrivals = [time.monotonic()]
            while session.sockets(view) != without + 2 and arrivals[-1] < arrivals[0] + 2:
                moments.append(page.receive_moment(fields))
                arrivals.append(time.monotonic())
            self.assertEqual(session.sockets(view), without + 2)
            # What a kernel holds for who doesn't read is full after some seconds; five more, and it is over.
            while session.sockets(view) > without and arrivals[-1] < arrivals[0] + 3 * PATIENCE_S:
                moments.append(page.receive_moment(fields))
                arrivals.append(time.monotonic())
            self.assertEqual(session.sockets(view), without, f"after {arrivals[-1] - arrivals[0]:.0f} s")
            self.assertGreater(arrivals[-1] - arrivals[0], 4.0, "nobody is dropped for a moment's rest")
            gaps = [b["time_s"] - a["time_s"] for a, b in zip(moments, moments[1:])]
            self.assertLess(max(gaps), 1.0, "moments as before, to who reads")
            self.assertGreater(len(moments) / (arrivals[-1] - arrivals[0]), 20)
            for one in slow:
                self.assertTrue(one.is_closed())


class Flood(ProgramTest):
    def test_who_floods_without_the_secret_locks_nobody_out(self):
        with Session(self.folder, "run", "--view", "--no-plot", "--duration", "60s") as session:
            self.assertEqual({session.request("/")[0] for _ in range(2000)}, {403, 429})
            page = session.open_socket()
            page.receive_json("stage")
            page.close()


if __name__ == "__main__":
    unittest.main()
