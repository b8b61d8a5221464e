"""Two runs on the virtual clock, in two kernels of their own side by side, are the same to the bit.

Runs on the machine itself, not through with-vcan: it starts with-vcan twice, each time with this file in the guest.
"""
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import two_processes as two

HERE = Path(__file__).resolve().parent
# timing.json too: on this clock even what computing takes is the same.
SAME = ("signals.csv", "frames.log", "summary.json", "timing.json", "effective.yaml")


def in_a_guest(folder):
    return subprocess.Popen([HERE / "with-vcan", "/usr/bin/python3", __file__, "--session", folder],
                            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


class Repeatability(unittest.TestCase):
    def test_two_runs_are_the_same_to_the_bit(self):
        with tempfile.TemporaryDirectory() as first, tempfile.TemporaryDirectory() as second:
            guests = [in_a_guest(folder) for folder in (first, second)]
            outputs = [guest.communicate()[0] for guest in guests]
            for guest, output in zip(guests, outputs):
                if guest.returncode == 77:
                    print(output, file=sys.stderr)
                    sys.exit(77)
                self.assertEqual(guest.returncode, 0, output)
            self.assertEqual(outputs[0].split()[-1], outputs[1].split()[-1])
            self.assertEqual(len(outputs[0].split()[-1]), 64)
            for name in SAME:
                with self.subTest(name=name):
                    one, other = Path(first, name).read_bytes(), Path(second, name).read_bytes()
                    self.assertGreater(len(one), 100)
                    self.assertTrue(one == other, f"{name} differs")


def session_in_guest(folder):
    session = two.Session(two.THREE, "2s", folder)
    if session.status != 0:
        sys.exit(session.errors)
    print(session.summary["setpoint_sha256"])


if __name__ == "__main__":
    if sys.argv[1:2] == ["--session"]:
        session_in_guest(sys.argv[2])
    else:
        unittest.main(verbosity=2)
