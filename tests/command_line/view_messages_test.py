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
          "peg": ("--scene", SOURCE / "scenes/peg_in_hole.yaml", "--hand", SOURCE / "sim/hands/insert.yaml", "--inertia", "0.05"),
          "rod": ("--scene", SOURCE / "scenes/rod_over_edge.yaml", "--hand", SOURCE / "sim/hands/lean.yaml", "--inertia", "0.05"),
          "valve key": ("--scene", SOURCE / "scenes/valve_key.yaml", "--hand", SOURCE / "sim/hands/wrench.yaml", "--inertia",
                        "0.05"),
          "foam and table": ("--scene", SOURCE / "scenes/soft_corner.yaml", "--hand", SOURCE / "sim/hands/explore.yaml")}
# Both print doubles so that they read back to the same; a rotation goes through a matrix in between, some roundings.
ROUNDING = 1e-12


def rows_by_time(folder):
    with open(folder / "signals.csv", newline="") as file:
        return {round(1e9 * float(row["time_s"])): row for row in csv.DictReader(file)}


def turned_by(one, other):
    """The angle between two orientations, rad; by their difference, since an arccosine loses half of the digits."""
    apart = min(math.dist(one, other), math.dist(one, [-part for part in other]))
    return 4.0 * math.asin(min(1.0, apart / 2.0))


def vector_in(row, name, unit):
    return [float(row[f"{name}_W_{axis}_{unit}"]) for axis in "xyz"]


def orientation_in(row, name="proxy_W"):
    return [float(row[f"{name}_q{part}"]) for part in "xyzw"]


class Messages(ProgramTest):
    def assert_proxy(self, pose, row):
        place = [pose["position"][axis] for axis in "xyz"]
        self.assertEqual(place, [float(row[f"proxy_W_{axis}_m"]) for axis in "xyz"])
        self.assertLess(turned_by([pose["orientation"][part] for part in "xyzw"], orientation_in(row)), ROUNDING)

    def contacts_of(self, folder):
        """The rows of contacts.csv, by the time in ns."""
        found = {}
        with open(folder / "contacts.csv", newline="") as file:
            for row in csv.DictReader(file):
                found.setdefault(round(1e9 * float(row["time_s"])), []).append(row)
        return found

    def assert_contacts(self, contacts, rows):
        self.assertEqual(len(contacts), len(rows))
        for contact, row in zip(contacts, rows):
            self.assertEqual((contact["part"], contact["state"]), (int(row["part"]), row["state"]))
            self.assertEqual((contact["friction"], contact["gap_m"]), (float(row["friction_1"]), float(row["gap_m"])))
            for name, unit in (("point", "m"), ("normal", "1"), ("force", "N"), ("torque", "Nm")):
                self.assertEqual([contact[name][axis] for axis in "xyz"], vector_in(row, name, unit))

    def assert_arrows(self, update, rows):
        """An arrow for each contact that presses: it begins at its point, points along its force, 5 mm for 1 N."""
        entity, = update["entities"]
        self.assertEqual((entity["id"], entity["frame_id"]), ("contacts", "W"))
        pressing = [row for row in rows if any(vector_in(row, "force", "N"))]
        self.assertEqual(len(entity["arrows"]), len(pressing))
        for arrow, row in zip(entity["arrows"], pressing):
            force = vector_in(row, "force", "N")
            self.assertEqual([arrow["pose"]["position"][axis] for axis in "xyz"], vector_in(row, "point", "m"))
            x, y, z, w = (arrow["pose"]["orientation"][part] for part in "xyzw")
            along = (1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y))  # what x is turned to
            apart = math.dist(along, [part / math.hypot(*force) for part in force])
            self.assertLess(apart, 1e-7)  # the square root of the roundings, where the force points against x
            self.assertAlmostEqual(arrow["shaft_length"] + arrow["head_length"], 0.005 * math.hypot(*force), places=12)

    def assert_wrenches_add_up(self, kept):
        """The contacts' forces and torques are those of the signals. A solver's tool is placed to 1e-10 m or so, which
        100 N make 1e-8 Nm of; it settles torques to 1e-5 Nm."""
        rows = rows_by_time(self.folder / "session")
        for time_ns, contacts in kept.items():
            row = rows[time_ns]
            self.assertEqual(len(contacts), min(8, int(row["contacts"])))
            if int(row["contacts"]) > 8 or "unresolved" in row["flags"]:
                continue
            for name, unit, rounding in (("force", "N", 1e-6), ("torque", "Nm", 1e-4)):
                total = [sum(parts) for parts in zip(*(vector_in(contact, name, unit) for contact in contacts))]
                size = max(1.0, math.hypot(*(float(row[f"contact_force_W_{axis}_N"]) for axis in "xyz")))
                self.assertLess(math.dist(total, vector_in(row, f"contact_{name}", unit)), rounding * size, row["time_s"])


class Recorded(Messages):
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
                if name != "foam and table":
                    self.assertGreater(turned_by(last, [0, 0, 0, 1]), 0.01, "a session that tells both apart")
                for time_ns, message in said["/contact"]:
                    for distance in ("proxy_clearance_m", "tool_clearance_m"):
                        self.assertAlmostEqual(message[distance], float(rows[time_ns][distance]), delta=1e-9)


    def test_each_contact_is_told_with_its_place(self):
        """No message had one; of a tool nobody could say where it touches."""
        for name, arguments in SCENES.items():
            with self.subTest(name):
                self.call("run", "--no-plot", "--record", "session", "--duration", "4s", *arguments)
                kept = self.contacts_of(self.folder / "session")
                said = mcap_reader.messages(self.folder / "session" / "session.mcap")
                told = dict(said["/contacts"])
                self.assertLessEqual(set(kept), set(told))
                for time_ns, message in told.items():
                    self.assert_contacts(message["contacts"], kept.get(time_ns, []))
                for time_ns, message in said["/contact_arrows"]:
                    self.assert_arrows(message, kept.get(time_ns, []))
                self.assertGreater(len(told), 100)
                self.assert_wrenches_add_up(kept)


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
                _, moments = self.live("--duration", "20s", *arguments, count=180,
                                       topics=("/proxy", "/contact", "/contacts", "/contact_arrows"))
                kept = self.contacts_of(self.folder / "session")
                near = 0
                for said, row in moments:
                    self.assert_proxy(said["/proxy"]["pose"], row)
                    contact = said["/contact"]
                    contacts = kept.get(round(1e9 * float(row["time_s"])), [])
                    self.assert_contacts(said["/contacts"]["contacts"], contacts)
                    self.assert_arrows(said["/contact_arrows"], contacts)
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
