"""What proxarm says to other tools (session.mcap, Foxglove's WebSocket), read from the bytes alone and held against
signals.csv."""
import csv
import json
import math
import struct
import unittest

import mcap_reader
from harness import SOURCE, ProgramTest
from view_client import Session

FREE_HAND = ("--orientation", "free")
SCENES = {"a point that turns": FREE_HAND,
          "peg": ("--scene", SOURCE / "scenes/peg_in_hole.yaml"),
          "rod": ("--scene", SOURCE / "scenes/rod_over_edge.yaml", "--hand", SOURCE / "sim/hands/lean.yaml", "--inertia", "0.05"),
          "valve key": ("--scene", SOURCE / "scenes/valve_key.yaml")}
# Both print doubles so that they read back to the same; a rotation goes through a matrix in between, some roundings.
ROUNDING = 1e-12


def rows_by_time(folder):
    with open(folder / "signals.csv", newline="") as file:
        return {round(1e9 * float(row["time_s"])): row for row in csv.DictReader(file)}


def turned_by(one, other):
    """The angle between two orientations, rad; by their difference, since an arccosine loses half of the digits."""
    apart = min(math.dist(one, other), math.dist(one, [-part for part in other]))
    return 4.0 * math.asin(min(1.0, apart / 2.0))


def orientation_in(row, name="proxy_W"):
    return [float(row[f"{name}_q{part}"]) for part in "xyzw"]


class Messages(ProgramTest):
    def assert_proxy(self, pose, row):
        place = [pose["position"][axis] for axis in "xyz"]
        self.assertEqual(place, [float(row[f"proxy_W_{axis}_m"]) for axis in "xyz"])
        self.assertLess(turned_by([pose["orientation"][part] for part in "xyzw"], orientation_in(row)), ROUNDING)

    def test_the_proxy_is_turned_as_in_the_signals(self):
        """Every message had the identity, whatever orientation the proxy had."""
        for name, arguments in SCENES.items():
            with self.subTest(name):
                self.call("run", "--no-plot", "--record", "session", "--duration", "4s", *arguments)
                rows = rows_by_time(self.folder / "session")
                said = mcap_reader.messages(self.folder / "session" / "session.mcap")
                self.assertGreater(len(said["/proxy"]), 300)
                for time_ns, message in said["/proxy"]:
                    self.assert_proxy(message["pose"], rows[time_ns])
                last = orientation_in(rows[said["/proxy"][-1][0]])
                self.assertGreater(turned_by(last, [0, 0, 0, 1]), 0.01, "a session that tells both apart")
                for time_ns, message in said["/contact"]:
                    for distance in ("proxy_clearance_m", "tool_clearance_m"):
                        self.assertAlmostEqual(message[distance], float(rows[time_ns][distance]), delta=1e-9)


class Client:
    """Of Foxglove's protocol: what comes on some topics, by the cycle that it is of."""

    def __init__(self, session, topics):
        self.socket = session.open_socket(f"/?token={session.token}", Sec_WebSocket_Protocol="foxglove.sdk.v1",
                                          Origin=None, Cookie=None)
        self.info = json.loads(self.socket.receive())
        channels = {channel["topic"]: channel["id"] for channel in json.loads(self.socket.receive())["channels"]}
        self.topics = dict(enumerate(("/session", *topics)))
        self.socket.send({"op": "subscribe", "subscriptions": [{"id": number, "channelId": channels[topic]}
                                                               for number, topic in self.topics.items()]})

    def moments(self, count):
        """{time: {topic: message}} of the first moments of which all topics came."""
        found = {}
        while sum(len(topics) == len(self.topics) for topics in found.values()) < count:
            message = self.socket.receive()
            if isinstance(message, bytes):
                subscription, time_ns = struct.unpack_from("<IQ", message, 1)
                found.setdefault(time_ns, {})[self.topics[subscription]] = json.loads(message[13:])
        return [topics for topics in found.values() if len(topics) == len(self.topics)]


class Live(Messages):
    def live(self, *arguments, topics, count=60):
        with Session(self.folder, "run", "--view", "--no-plot", "--record", "session", *arguments) as session:
            client = Client(session, topics)
            moments = client.moments(count)
            self.addCleanup(client.socket.close)
            session.end()
        with open(self.folder / "session" / "signals.csv", newline="") as file:
            rows = {int(row["cycle"]): row for row in csv.DictReader(file)}
        return client, [(moment, rows[moment["/session"]["cycle"]]) for moment in moments]

    def test_proxy_and_distances_are_those_of_the_record(self):
        """With a tool that has a shape, the distances were those of the handle's point: 69.4 mm at a touch."""
        for name, arguments in SCENES.items():
            with self.subTest(name):
                _, moments = self.live("--duration", "20s", *arguments, topics=("/proxy", "/contact"), count=180)
                near = 0
                for said, row in moments:
                    self.assert_proxy(said["/proxy"]["pose"], row)
                    contact = said["/contact"]
                    if row["phase"] != "rendering":
                        continue
                    distance = float(row["proxy_clearance_m"])
                    if math.isfinite(distance):
                        self.assertAlmostEqual(contact["proxy_clearance_m"], distance, delta=1e-9)
                        near += distance < 1e-3
                    else:
                        self.assertIsNone(contact["proxy_clearance_m"])
                self.assertTrue(near > 10 or name == "a point that turns", f"{near} moments at a touch")

    def test_a_session_has_an_identifier_of_its_own(self):
        """It was "0" for every session that nobody had looked at yet; tools keep their state by it."""
        seen = set()
        for _ in range(2):
            with Session(self.folder, "run", "--view", "--no-plot", "--duration", "20s") as session:
                clients = [Client(session, ()) for _ in range(2)]
                identifiers = {client.info["sessionId"] for client in clients}
                for client in clients:
                    client.socket.close()
                self.assertEqual(len(identifiers), 1, "the same for all who look at one session")
                seen |= identifiers
        self.assertEqual(len(seen), 2)
        self.assertNotIn("0", seen)


if __name__ == "__main__":
    unittest.main()
