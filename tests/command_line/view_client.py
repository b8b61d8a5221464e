"""What the tests of the view share: a session with --view, and a client made by hand, so that it can misbehave."""
import contextlib
import base64
import http.client
import json
import os
import pathlib
import re
import select
import signal
import socket
import struct
import subprocess
import time

from harness import as_text, program

PATIENCE_S = 20 * (5 if os.environ.get("PROXARM_SLOW_BUILD") else 1)
URL = re.compile(r"(http://127\.0\.0\.1:(\d+)/\?token=([0-9a-f]{64}))")


class Session:
    """`proxarm …` with a view; ended when the block is left."""

    def __init__(self, folder, *arguments, env=None):
        self.begun = time.monotonic()
        self.process = subprocess.Popen([program(), *as_text(arguments)], cwd=folder, stdin=subprocess.DEVNULL,
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=env)
        self.said = ""
        while not (found := URL.search(self.said)):
            if not self.read_line():
                self.process.kill()
                out, err = self.process.communicate()
                raise AssertionError(f"no address of the view: {self.said}{err}{out}")
        self.url, self.port, self.token = found[1], int(found[2]), found[3]

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.end()

    def end(self, sent=signal.SIGINT):
        """Ctrl-C until it has ended; returns status, standard output and standard error."""
        if self.process.stderr.closed:
            return self.process.returncode, "", self.said
        stays = "until Ctrl-C"
        stayed = stays in self.said
        if self.process.poll() is None:
            self.process.send_signal(sent)
        # A session that is stopped so makes a controlled stop, and its view stays until the next one.
        while not stayed and (line := self.read_line()):
            if stays in line:
                self.process.send_signal(sent)
                break
        try:
            out, err = self.process.communicate(timeout=PATIENCE_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise
        self.said += err
        return self.process.returncode, out, self.said

    def read_line(self):
        """The next of standard error; empty at its end, or where none comes."""
        ready, _, _ = select.select([self.process.stderr], [], [], PATIENCE_S)
        line = self.process.stderr.readline() if ready else ""
        self.said += line
        return line

    def until_said(self, words):
        while words not in self.said:
            if not self.read_line():
                raise AssertionError(f"not said: {words}; but: {self.said}")

    def view_process(self):
        """The process identifier of the view's server."""
        children = pathlib.Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text().split()
        return next(pid for pid in children if pathlib.Path(f"/proc/{pid}/comm").read_text() == "proxarm-view\n")

    @staticmethod
    def sockets(pid):
        """How many a process has open."""
        count = 0
        for link in pathlib.Path(f"/proc/{pid}/fd").iterdir():
            with contextlib.suppress(FileNotFoundError):  # closed since it was listed
                count += os.readlink(link).startswith("socket:")
        return count

    @property
    def host(self):
        return f"127.0.0.1:{self.port}"

    @property
    def origin(self):
        return f"http://{self.host}"

    def request(self, target="/", method="GET", host=None, body=None, **headers):
        """Status, headers and body of an answer. Headers by their names with _ for -; None leaves one out."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE_S)
        connection.putrequest(method, target, skip_host=True, skip_accept_encoding=True)
        for name, value in {"Host": host or self.host, **headers}.items():
            for one in value if isinstance(value, list) else [value]:
                connection.putheader(name.replace("_", "-"), one)
        if body is not None:
            connection.putheader("Content-Length", str(len(body)))
        connection.endheaders(body)
        answer = connection.getresponse()
        result = answer.status, dict((k.lower(), v) for k, v in answer.getheaders()), answer.read()
        connection.close()
        return result

    def cookie(self):
        status, headers, _ = self.request(f"/?token={self.token}")
        assert status == 303, status
        return headers["set-cookie"].split(";")[0]

    def open_socket(self, target="/live", **headers):
        return WebSocket(self, target, **{"Origin": self.origin, "Cookie": self.cookie(), **headers})


class Refused(Exception):
    def __init__(self, status):
        super().__init__(f"status {status}")
        self.status = status


class WebSocket:
    """RFC 6455 from the client's side; `send_frame` sends whatever it is told."""

    def __init__(self, session, target, host=None, receive_buffer=None, **headers):
        self.socket = socket.socket()
        if receive_buffer:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        self.socket.settimeout(PATIENCE_S)
        self.socket.connect(("127.0.0.1", session.port))
        lines = [f"GET {target} HTTP/1.1", f"Host: {host or session.host}", "Upgrade: websocket", "Connection: Upgrade",
                 "Sec-WebSocket-Version: 13", "Sec-WebSocket-Key: " + base64.b64encode(os.urandom(16)).decode()]
        lines += [f"{name.replace('_', '-')}: {value}" for name, value in headers.items() if value is not None]
        self.socket.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
        self.buffer = b""
        while b"\r\n\r\n" not in self.buffer:
            more = self.socket.recv(65536)
            if not more:
                raise Refused(None)
            self.buffer += more
        head, self.buffer = self.buffer.split(b"\r\n\r\n", 1)
        self.head = head.decode()
        status = int(head.split()[1])
        if status != 101:
            self.socket.close()
            raise Refused(status)

    def close(self):
        self.socket.close()

    def send_frame(self, payload, opcode=1, final=True, masked=True, length=None):
        length = len(payload) if length is None else length
        first = (0x80 if final else 0) | opcode
        mask_bit = 0x80 if masked else 0
        if length < 126:
            head = struct.pack("!BB", first, mask_bit | length)
        elif length < 1 << 16:
            head = struct.pack("!BBH", first, mask_bit | 126, length)
        else:
            head = struct.pack("!BBQ", first, mask_bit | 127, length)
        mask = os.urandom(4) if masked else b""
        data = bytes(b ^ mask[i % 4] for i, b in enumerate(payload)) if masked else payload
        self.socket.sendall(head + mask + data)

    def send(self, value):
        self.send_frame(json.dumps(value).encode())

    def _take(self, count):
        while len(self.buffer) < count:
            more = self.socket.recv(65536)
            if not more:
                raise ConnectionError("closed")
            self.buffer += more
        taken, self.buffer = self.buffer[:count], self.buffer[count:]
        return taken

    def receive(self):
        """The next message: a string, or bytes. ConnectionError where the other side has closed."""
        while True:
            first, second = self._take(2)
            length = second & 0x7F
            if length == 126:
                length, = struct.unpack("!H", self._take(2))
            elif length == 127:
                length, = struct.unpack("!Q", self._take(8))
            payload = self._take(length)
            opcode = first & 0x0F
            if opcode == 8:
                raise ConnectionError("closed")
            if opcode in (1, 2):
                return payload.decode() if opcode == 1 else payload

    def receive_json(self, name):
        """The value of the next text message of this name."""
        while True:
            message = self.receive()
            if isinstance(message, str) and name in (value := json.loads(message)):
                return value[name]

    def receive_moment(self, fields, contact_fields=None):
        """The fields of the next moment, by their names; with contact_fields those of its contacts as "touches"."""
        while True:
            message = self.receive()
            if isinstance(message, bytes) and struct.unpack_from("<d", message)[0] == 1.0:
                moment = dict(zip(fields, struct.unpack_from(f"<{len(fields)}d", message, 8)))
                if contact_fields:
                    at, width = 8 * (1 + len(fields)), len(contact_fields)
                    count = int(struct.unpack_from("<d", message, at)[0])
                    numbers = struct.unpack_from(f"<{count * width}d", message, at + 8)
                    moment["touches"] = [dict(zip(contact_fields, numbers[i:])) for i in range(0, len(numbers), width)]
                return moment

    def is_closed(self, within_s=PATIENCE_S):
        """Whether the other side ends it in this time."""
        self.socket.settimeout(within_s)
        try:
            while True:
                self.receive()
        except (ConnectionError, OSError) as error:
            return not isinstance(error, TimeoutError)
