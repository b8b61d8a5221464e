#!/usr/bin/python3
"""The examples of docs/how_to/library.md: the page shows what the files have, and the closed loop of the library is that of the
program, to the bit. tests/library runs them all, tests/install builds them against the installed package."""
import os
import pathlib
import re
import subprocess
import unittest

from harness import SOURCE, ProgramTest, program

PAGE = SOURCE / "docs/how_to/library.md"
EXAMPLES = SOURCE / "docs/examples"


class Library(ProgramTest):
    def test_the_page_shows_what_the_files_have(self):
        text = PAGE.read_text()
        blocks = re.findall(r"^```(cpp|cmake)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
        self.assertGreaterEqual(len(blocks), 8)
        files = {"cpp": [f.read_text() for f in EXAMPLES.glob("*.cpp")],
                 "cmake": [re.sub(r"^ +", "", (EXAMPLES / "CMakeLists.txt").read_text(), flags=re.MULTILINE)]}
        for language, block in blocks:
            with self.subTest(block.splitlines()[0]):
                if language == "cmake":
                    for line in block.splitlines():
                        self.assertIn(line + "\n", files[language][0])
                else:
                    self.assertEqual(sum(block in file for file in files[language]), 1)
        for file in EXAMPLES.glob("*.cpp"):
            self.assertIn(f"[{file.name}](../examples/{file.name})", text)

    def test_the_library_moves_the_arm_as_the_program_does(self):
        example = pathlib.Path(program()).parents[1] / "tests/library/example_closed_loop"
        done = subprocess.run([example], capture_output=True, text=True, timeout=600, cwd=self.folder)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        here = self.call("run", "--scene", "scenes/wall.yaml", "--mass", "5", "--duration", "6s", "--no-plot",
                         "--verbose")
        self.assertEqual(here.status, 0, here.err)
        # All but the machine's times.
        figures = [line for line in here.out.splitlines() if line.startswith("  ")
                   and not re.match(r"  (time|compute per cycle):", line)]
        self.assertGreater(len(figures), 12)
        for line in figures:
            self.assertIn(line, done.stdout.splitlines())

    def test_a_session_that_is_refused_says_what_the_program_says(self):
        example = pathlib.Path(program()).parents[1] / "tests/library/example_own_world"
        done = subprocess.run([example], capture_output=True, text=True, timeout=600, cwd=self.folder,
                              env={**os.environ, "PROXARM_DATA": str(self.folder / "absent")})
        here = self.call("run", env={**os.environ, "PROXARM_DATA": str(self.folder / "absent")})
        self.assertEqual((done.returncode, here.status), (2, 2))
        self.assertEqual("proxarm: " + done.stderr, here.err)


if __name__ == "__main__":
    unittest.main(verbosity=2)
