"""What proxarm writes and says, read by programs of others: @mcap/core and @foxglove/ws-protocol, from npm by a lock
file. For the night: nobody needs Node.js to build or test proxarm otherwise. Skipped (77) where there is none."""
import csv
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "command_line"))

import unittest  # noqa: E402

from harness import ProgramTest  # noqa: E402
from view_client import Session  # noqa: E402

TOPICS = {"/tool", "/proxy", "/wrench", "/contact", "/joint_states", "/session", "/tf", "/scene", "/contacts",
          "/contact_arrows"}
if not shutil.which("node") or not shutil.which("npm"):
    print("no node and npm: peers from npm can't be asked")
    sys.exit(77)


class Peers(ProgramTest):
    @classmethod
    def setUpClass(cls):
        cls.place = tempfile.TemporaryDirectory(prefix="proxarm-peers-")
        for name in ("package.json", "package-lock.json", "read_mcap.mjs", "foxglove_client.mjs"):
            shutil.copy(HERE / name, cls.place.name)
        done = subprocess.run(["npm", "ci", "--no-audit", "--no-fund", "--ignore-scripts"], cwd=cls.place.name,
                              capture_output=True, text=True, timeout=600)
        if done.returncode != 0:
            print("npm ci failed: " + done.stderr[-500:])
            sys.exit(77)

    @classmethod
    def tearDownClass(cls):
        cls.place.cleanup()

    def ask(self, *words):
        done = subprocess.run(["node", *map(str, words)], cwd=self.place.name, capture_output=True, text=True, timeout=300)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def test_an_independent_reader_finds_every_message_and_schema(self):
        summary = self.summary("--record", "session")
        found = self.ask("read_mcap.mjs", self.folder / "session" / "session.mcap")
        cycles = summary["cycles"]
        self.assertEqual(set(found["indexed"]), TOPICS)
        self.assertEqual(found["indexed"], found["streamed"])
        self.assertEqual(found["indexed"], found["statistics"])
        for topic in ("/wrench", "/contact", "/joint_states"):
            self.assertEqual(found["indexed"][topic], cycles)
        for topic in ("/tool", "/proxy", "/session", "/tf"):
            self.assertEqual(found["indexed"][topic], (cycles + 9) // 10)
        self.assertEqual(found["indexed"]["/scene"], 1)
        with open(self.folder / "session" / "signals.csv", newline="") as file:
            touching = [row["contacts"] != "0" for row in csv.DictReader(file)]
        ends = sum(before and not now for before, now in zip(touching, touching[1:]))
        self.assertEqual(found["indexed"]["/contacts"], sum(touching) + ends)
        for name, (encoding, title) in found["schemas"].items():
            self.assertEqual((encoding, title), ("jsonschema", name))
        last = found["samples"]["/session"]
        with open(self.folder / "session" / "signals.csv", newline="") as file:
            row = next(row for row in csv.DictReader(file) if int(row["cycle"]) == last["cycle"])
        self.assertEqual((last["phase"], last["energy_hand_J"]), (row["phase"], float(row["energy_hand_J"])))
        self.assertEqual(len(found["samples"]["/joint_states"]["measured_rad"]), 6)
        ids = {entity["id"] for entity in found["samples"]["/scene"]["entities"]}
        self.assertTrue({"link link_2", "object wall"} <= ids)

    def test_a_client_of_others_sees_and_sets_under_both_names(self):
        for protocol, mass in (("foxglove.websocket.v1", 6.5), ("foxglove.sdk.v1", 9)):
            with self.subTest(protocol), Session(self.folder, "run", "--view-control", "--no-plot", "--duration", "30s",
                                                 "--scene", "scenes/free.yaml") as session:
                found = self.ask("foxglove_client.mjs", f"ws://{session.host}/?token={session.token}", protocol, mass)
                self.assertEqual(found["protocol"], protocol)
                self.assertIn("parameters", found["info"]["capabilities"])
                self.assertEqual(set(found["messages"]), TOPICS)
                self.assertEqual(found["messages"]["/scene"], 1)
                self.assertGreater(found["messages"]["/tool"], 30)
                self.assertEqual(found["status"], [])
                first = next(p["parameters"] for p in found["parameters"] if p.get("id") == "first")
                self.assertEqual({p["name"]: p["value"] for p in first}, {"mass": 4, "damping": 0, "spring": 0})
                last = [p for p in found["parameters"] if not p.get("id")][-1]["parameters"]
                self.assertAlmostEqual(last[0]["value"], mass)  # it acts: this is what the cycle has
                self.assertAlmostEqual(found["samples"]["/session"]["mass_kg"], mass)


if __name__ == "__main__":
    unittest.main()
