"""How long things take: alone on the machine, in a build that is meant to be fast."""
import os
import unittest

from harness import ProgramTest


# The same program has been seen to take 2.7 times as long on one of our machines as on another (cycles of 14 and 5 µs), so
# what the targets say of a good machine is asked of a slow one with this factor.
SLOW_MACHINE = 2.0


@unittest.skipIf(os.environ.get("PROXARM_SLOW_BUILD"), "a debug or sanitizer build says nothing about speed")
class Timing(ProgramTest):
    """Best of several, so that another process on the machine spoils nothing.

    Wall time is judged where the machine let the program run; where it didn't (wall time well above processor time),
    the processor time is, which doesn't depend on who else runs.
    """

    def test_ten_seconds_take_less_than_one(self):
        taken_s = []
        for _ in range(3):
            outcome = self.call("run", "--json")
            self.assertEqual(outcome.status, 0, outcome.err)
            taken_s.append(min(outcome.summary["wall_time_s"], outcome.user_s))
        self.assertLess(min(taken_s), SLOW_MACHINE * 1.0)

    def test_a_cycles_computing_takes_less_than_20_microseconds(self):
        p99_us = [self.summary()["compute_us"]["p99"] for _ in range(5)]
        self.assertLess(min(p99_us), SLOW_MACHINE * 20.0, p99_us)


if __name__ == "__main__":
    unittest.main(verbosity=2)
