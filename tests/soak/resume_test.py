"""A soak that is killed goes on from its checkpoint, and ends as one that wasn't: with the same setpoints to the bit."""

import pathlib
import subprocess
import sys
import tempfile
import time
import unittest

PROGRAM = sys.argv.pop(1)
HOURS = "0.03"


def soak(*arguments):
    return subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, timeout=500)


def result(run):
    """All that it printed but for its memory, which is a process's own."""
    return [line for line in run.stdout.splitlines() if not line.startswith("memory")]


class Resume(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.checkpoint = pathlib.Path(folder.name) / "soak.txt"

    def test_after_sigkill_it_ends_as_an_uninterrupted_one(self):
        killed = subprocess.Popen([PROGRAM, "--hours", HOURS, "--checkpoint", self.checkpoint], stdout=subprocess.DEVNULL)
        deadline = time.monotonic() + 400
        while not self.checkpoint.exists():  # after the first session, of several
            self.assertIsNone(killed.poll(), "it ended before it could be killed")
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.005)
        killed.kill()
        killed.wait()
        kept = self.checkpoint.read_text().split()
        self.assertLess(float(kept[3]), 3600 * float(HOURS), "it was to be killed on the way")
        resumed = soak("--hours", HOURS, "--checkpoint", self.checkpoint)
        self.assertEqual(resumed.returncode, 0, resumed.stdout + resumed.stderr)
        whole = soak("--hours", HOURS)
        self.assertEqual(whole.returncode, 0, whole.stdout + whole.stderr)
        self.assertEqual(result(resumed), result(whole))
        self.assertTrue(any(line.startswith("setpoints: ") for line in result(whole)))

    def test_what_is_no_checkpoint_or_of_another_seed_is_refused(self):
        self.checkpoint.write_text("yesterday\n")
        run = soak("--hours", HOURS, "--checkpoint", self.checkpoint)
        self.assertEqual((run.returncode, run.stderr), (2, f"soak: {self.checkpoint}: not a soak's checkpoint\n"))
        self.checkpoint.write_text("1 1 100 10 0 0 0 1\n")
        run = soak("--hours", HOURS, "--checkpoint", self.checkpoint, "--seed", "2")
        self.assertEqual((run.returncode, run.stderr), (2, f"soak: {self.checkpoint} is of seed 1\n"))


if __name__ == "__main__":
    unittest.main()
