"""What the tests of the command line share: the program, a folder of their own, and copies of the shipped files to spoil.

The program's path comes in the environment variable PROXARM_PROGRAM; the shipped files lie two folders above this one.
"""
import json
import os
import pathlib
import resource
import shutil
import subprocess
import sys
import tempfile
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[2]
AXES = [f"axis_{i}" for i in range(1, 7)]


def program():
    path = os.environ.get("PROXARM_PROGRAM")
    if not path:
        sys.exit("PROXARM_PROGRAM must name the proxarm program")
    return path


def as_text(words):
    """The words of a command, with --signals csv where they record and don't say how: tests read signals as text."""
    words = [str(word) for word in words]
    return [*words, "--signals", "csv"] if "--record" in words and "--signals" not in words else words


class Outcome:
    def __init__(self, status, out, err, user_s):
        self.status, self.out, self.err, self.user_s = status, out, err, user_s

    @property
    def summary(self):
        return json.loads(self.out)


class ProgramTest(unittest.TestCase):
    """Runs the program in a folder of the test's own, so that what it writes by default lands there."""

    def setUp(self):
        # A killed session's black box is still being written, by the process that outlives it for that.
        folder = tempfile.TemporaryDirectory(prefix="proxarm-test-", ignore_cleanup_errors=True)
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def call(self, *arguments, timeout=600, env=None):
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        done = subprocess.run([program(), *as_text(arguments)], cwd=self.folder, stdin=subprocess.DEVNULL,
                              capture_output=True, text=True, timeout=timeout, env=env)
        user_s = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
        return Outcome(done.returncode, done.stdout, done.stderr, user_s)

    def summary(self, *arguments):
        """Of a run that must end well."""
        outcome = self.call("run", "--json", *arguments)
        self.assertEqual(outcome.status, 0, outcome.err + outcome.out)
        # Light masses aren't stable in every pose that their hands lead to; whether that is told rightly,
        # oscillation_test judges.
        told = [line for line in outcome.err.splitlines() if "isn't stable with this hand; it takes" not in line]
        self.assertEqual(told, [])
        return outcome.summary

    def copies(self):
        """The shipped cell, arm, sensor, scenes and hands, to be changed at will. Returns their folder."""
        root = self.folder / "copies"
        if not root.exists():
            for part in ("models/cells", "models/arms", "models/sensors", "scenes", "sim/hands"):
                shutil.copytree(SOURCE / part, root / part)
        return root

    def changed(self, path, *replacements):
        """A copied file with each (old, new) replaced once; what isn't there to be replaced is the test's mistake."""
        file = self.copies() / path
        text = file.read_text()
        for old, new in replacements:
            self.assertIn(old, text)
            text = text.replace(old, new, 1)
        file.write_text(text)
        return file

    def written(self, name, text):
        file = self.folder / name
        file.write_text(text)
        return file

    def assert_refused(self, outcome, *fragments):
        """Exit status 2, nothing on standard output, one clear line with all fragments."""
        self.assertEqual(outcome.status, 2, outcome.err + outcome.out)
        self.assertEqual(outcome.out, "")
        self.assertEqual(outcome.err.count("\n"), 1, outcome.err)
        self.assertTrue(outcome.err.startswith("proxarm: ") and outcome.err.endswith("\n"), outcome.err)
        for fragment in fragments:
            self.assertIn(fragment, outcome.err)
