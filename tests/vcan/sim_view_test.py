"""`proxarm sim --view` on a real vcan: the simulated arm is seen while a controller in another process leads it."""
import json
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import two_processes as two

os.environ.setdefault("PROXARM_PROGRAM", two.PROGRAM)
sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "command_line"))

from view_client import Session  # noqa: E402


class SimView(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory(prefix="proxarm-test-")
        self.addCleanup(self.folder.cleanup)

    def until(self, page, fields, is_it):
        """All moments up to one."""
        moments = [page.receive_moment(fields)]
        while not is_it(moments[-1]):
            moments.append(page.receive_moment(fields))
        return moments

    def test_the_arm_is_shown_as_its_own_process_knows_it(self):
        with Session(self.folder.name, "sim", "--bus", two.ONE, "--view") as arm:
            page = arm.open_socket()
            stage = page.receive_json("stage")
            self.assertEqual((stage["mode"], stage["control"]), ("arm", False))
            self.assertEqual(stage["scene"]["objects"], [], "what is rendered isn't known here")
            self.assertEqual(stage["words"]["phases"][0]["name"], "drives off")
            begin = page.receive_moment(stage["fields"])
            self.assertEqual(stage["words"]["phases"][int(begin["phase"])]["name"], "drives off")
            self.assertAlmostEqual(begin["tool_x"], 0.7, places=3)
            self.assertGreater(begin["sensor_N"], 1.0)  # the handle's weight
            done = subprocess.Popen([two.PROGRAM, "run", "--bus", two.ONE, "--duration", "5s", "--no-plot", "--json"],
                                    cwd=self.folder.name, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                    stderr=subprocess.PIPE, text=True)
            led = self.until(page, stage["fields"], lambda m: m["tool_x"] > 0.8)
            self.assertEqual(stage["words"]["phases"][int(led[-1]["phase"])]["name"], "drives on")
            self.assertGreater(max(m["hand_N"] for m in led), 1.0)  # 4 kg, 0.1 m in half a second
            times = [m["time_s"] for m in led]
            self.assertEqual(times, sorted(times))
            page.close()
            out, err = done.communicate(timeout=600)
            self.assertEqual(done.returncode, 0, err)
            self.assertEqual(json.loads(out)["faults"], [])
            again = arm.open_socket()
            fields = again.receive_json("stage")["fields"]
            self.until(again, fields, lambda m: stage["words"]["phases"][int(m["phase"])]["name"] == "drives off")
            again.close()
            status, _, said = arm.end()
            self.assertEqual(status, 0, said)
            self.assertIn(" 0 lost, 0 not sent; 0 late", said)

    def test_a_scene_is_drawn_where_one_is_named(self):
        scene = Path(__file__).resolve().parents[2] / "scenes" / "room.yaml"
        with Session(self.folder.name, "sim", "--bus", two.ONE, "--scene", scene, "--view") as arm:
            page = arm.open_socket()
            self.assertGreater(len(page.receive_json("stage")["scene"]["objects"]), 2)
            page.close()

    def test_options_of_a_view_want_one(self):
        done = subprocess.run([two.PROGRAM, "sim", "--bus", two.ONE, "--view-port", "8080"], cwd=self.folder.name,
                              stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=120, check=False)
        self.assertEqual(done.returncode, 2)
        self.assertIn("--view with it", done.stderr)


if __name__ == "__main__":
    unittest.main()
