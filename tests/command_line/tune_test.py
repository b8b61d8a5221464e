"""What `proxarm tune` says while it looks for an advice, which takes some seconds."""
import os
import pty
import select
import subprocess
import time
import unittest

from harness import SOURCE, ProgramTest, program

PATIENCE_S = 900.0


class Tune(ProgramTest):
    def drawn_at_a_terminal(self, *arguments):
        """What is drawn on standard error, a terminal, with the time of each part; and standard output."""
        terminal, its_end = pty.openpty()
        self.addCleanup(os.close, terminal)
        process = subprocess.Popen([program(), "tune", *map(str, arguments)], cwd=self.folder, stdin=subprocess.DEVNULL,
                                   stdout=subprocess.PIPE, stderr=its_end, env={**os.environ, "TERM": "xterm"})
        os.close(its_end)
        begun, parts = time.monotonic(), []
        while select.select([terminal], [], [], PATIENCE_S)[0]:
            try:
                parts.append((time.monotonic() - begun, os.read(terminal, 4096).decode()))
            except OSError:  # closed at the other end
                break
        out = process.communicate(timeout=PATIENCE_S)[0].decode()
        self.assertEqual(process.returncode, 0, out)
        return parts, time.monotonic() - begun, out

    def test_what_is_looked_for_is_drawn_on_a_terminal_and_taken_away(self):
        parts, took_s, out = self.drawn_at_a_terminal("--scene", SOURCE / "scenes/rod_over_edge.yaml", "--hand",
                                                      SOURCE / "sim/hands/lean.yaml", "--mass", "4", "--inertia", "0.05")
        drawn = "".join(text for _, text in parts)
        for what in (r"smallest mass, \d+ poses\x1b", r"mass with margins, \d+ poses\x1b", r"trying [\d.]+ kg\x1b",
                     r"inertia with margins, \d+ poses\x1b", r"trying [\d.]+ kg m²\x1b", r"what limits the mass, \d+ poses\x1b"):
            self.assertRegex(drawn, what)
        self.assertLess(parts[0][0], 0.2 * took_s, "it says so at once")
        longest_s = max(b - a for (a, _), (b, _) in zip(parts, parts[1:]))
        self.assertLess(longest_s, 0.7 * took_s)
        self.assertTrue(drawn.endswith("\r\x1b[K"), "nothing of it stays")
        self.assertNotIn("\x1b", out)
        self.assertIn("advice: with 4 kg --inertia", out)

    def test_nothing_is_drawn_elsewhere(self):
        outcome = self.call("tune")
        self.assertEqual((outcome.status, outcome.err), (0, ""))
        self.assertNotIn("%", outcome.out.replace("20 % more delay", ""))


if __name__ == "__main__":
    unittest.main()
