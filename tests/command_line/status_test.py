"""`proxarm status`: how a running session is."""
import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from harness import program  # noqa: E402

PROGRAM = program()


def status(control, *words):
    return subprocess.run([PROGRAM, "status", "--control", control, *words], capture_output=True, text=True, timeout=60)


class Status(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        os.chmod(folder.name, 0o700)
        self.control = os.path.join(folder.name, "control")

    def test_says_phase_force_and_mass_of_a_session(self):
        run = subprocess.Popen([PROGRAM, "run", "--control", self.control, "--pace", "realtime", "--duration", "30s",
                                "--mass", "6kg", "--no-plot"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            until = time.monotonic() + 60
            said = {}
            while said.get("rendered_s", 0.0) < 1.0:
                self.assertLess(time.monotonic(), until, said)
                time.sleep(0.1)
                answer = status(self.control, "--json")
                if answer.returncode == 0:
                    said = json.loads(answer.stdout)
            self.assertEqual(said["version"], 1)
            self.assertEqual(said["phase"], "rendering")
            self.assertIsNone(said["fault"])
            self.assertAlmostEqual(said["felt_mass_kg"], 6.0)
            self.assertAlmostEqual(said["timestep_s"], 1e-3)
            self.assertLess(abs(said["tool_W_m"][2] - 0.6), 0.02, "the hand leads along x")
            self.assertLess(said["tool_speed_m_per_s"], 0.5)
            text = status(self.control).stdout
            self.assertIn("rendering: ", text)
            self.assertIn("6 kg", text)
            held = subprocess.run([PROGRAM, "hold", "--control", self.control], timeout=60)
            self.assertEqual(held.returncode, 0)
            watch = subprocess.Popen([PROGRAM, "status", "--watch", "--control", self.control],
                                     stdout=subprocess.PIPE, text=True)
            while "holding" not in watch.stdout.readline():
                self.assertLess(time.monotonic(), until)
            run.terminate()
            run.wait(timeout=60)
            watch.stdout.read()
            self.assertEqual(watch.wait(timeout=60), 0, "a watch ends with its session")
        finally:
            run.kill()
            run.wait()

    def test_a_suspended_session_is_said_to_be_one_and_keeps_nobody_waiting(self):
        run = subprocess.Popen([PROGRAM, "run", "--control", self.control, "--pace", "realtime", "--duration", "60s",
                                "--no-plot"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        waiting = []
        try:
            until = time.monotonic() + 60
            while status(self.control).returncode != 0:
                self.assertLess(time.monotonic(), until)
                time.sleep(0.1)
            run.send_signal(signal.SIGSTOP)
            # As many as its queue holds, and more: connecting would wait, too.
            for _ in range(200):
                waiting.append(socket.socket(socket.AF_UNIX))
                waiting[-1].setblocking(False)
                waiting[-1].connect_ex(self.control)
                if len(waiting) not in (1, 200):
                    continue
                begun = time.monotonic()
                answer = status(self.control)
                self.assertEqual(answer.returncode, 2)
                self.assertIn("found no answer", answer.stderr)
                self.assertIn("is the session suspended", answer.stderr)
                self.assertLess(time.monotonic() - begun, 3.0)
        finally:
            for one in waiting:
                one.close()
            run.kill()
            run.wait()

    def test_refuses_where_nobody_listens(self):
        answer = status(self.control)
        self.assertEqual(answer.returncode, 2)
        self.assertIn("no such socket", answer.stderr)


if __name__ == "__main__":
    unittest.main()
