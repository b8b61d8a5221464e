"""How long things take: alone on the machine, in a build that is meant to be fast."""
import math
import os
import struct
import time
import unittest

from harness import SOURCE, ProgramTest


# The same program has been seen to take 2.7 times as long on one of our machines as on another (cycles of 14 and 5 µs), so
# what the targets say of a good machine is asked of a slow one with this factor.
SLOW_MACHINE = 2.0

# What slowness() measures with CPython 3.11 on the machine whose p99 with 328 thousand triangles is 5.3 µs alone on a
# processor and 7.4 to 8.2 among others.
REFERENCE_US = 8.5
# The default session's there. A machine whose caches others fill is slow at what arithmetic doesn't show: with the same
# program it has been 15 to 25 µs where arithmetic took 1.4 times as long.
REFERENCE_P99_US = 5.3


def bumpy_ball(file, rows=405, columns=406, radius_m=0.15, centre_m=(1.05, 0.0, 0.6)):
    """328 048 triangles as binary STL, with dents of 0.3 mm that a slide comes across, 0.2 m in front of the tool."""
    def point(i, j):
        polar, around = math.pi * i / rows, 2 * math.pi * (j % columns) / columns
        r = radius_m * (1 + 0.002 * math.sin(17 * polar) * math.cos(13 * around))
        return (centre_m[0] - r * math.sin(polar) * math.cos(around),
                centre_m[1] + r * math.sin(polar) * math.sin(around), centre_m[2] + r * math.cos(polar))

    points = [[point(i, j) for j in range(columns)] for i in range(rows + 1)]
    triangles = []
    for i in range(rows):
        for j in range(columns):
            a, b, c, d = points[i][j], points[i + 1][j], points[i + 1][(j + 1) % columns], points[i][(j + 1) % columns]
            if i < rows - 1:
                triangles.append((a, c, b))
            if i > 0:
                triangles.append((a, d, c))
    file.write_bytes(bytes(80) + struct.pack("<I", len(triangles)) + b"".join(
        struct.pack("<12fH", 0, 0, 0, *a, *b, *c, 0) for a, b, c in triangles))
    return len(triangles)


# Around a box tool of 120 × 80 × 40 mm at its start, 20 mm below it and in the way that sim/hands/tip.yaml leads it.
TEN_OBJECTS = """name: ten objects
objects:
  - plane: {name: table, point_m: [0, 0, 0.55], normal: [0, 0, 1], friction: 0.3}
  - box: {name: stop, centre_m: [0.83, 0, 0.57], size_m: [0.04, 0.2, 0.06], friction: 0.3}
  - box: {name: fence, centre_m: [0.7, 0.07, 0.57], size_m: [0.2, 0.02, 0.05], friction: 0.2}
  - box: {name: sill, centre_m: [0.78, 0, 0.55], size_m: [0.01, 0.2, 0.01], rpy_rad: [0, 0, 0.2], friction: 0.4}
  - box: {name: crate, centre_m: [0.6, -0.09, 0.58], size_m: [0.05, 0.05, 0.05], rpy_rad: [0, 0, 0.4], friction: 0.5}
  - box: {name: block, centre_m: [0.75, -0.08, 0.565], size_m: [0.08, 0.04, 0.03], friction: 0.3}
  - sphere: {name: under it, centre_m: [0.72, 0.01, 0.53], radius_m: 0.022, friction: 0.3}
  - sphere: {name: behind it, centre_m: [0.6, 0.03, 0.55], radius_m: 0.02, friction: 0.3}
  - sphere: {name: beside it, centre_m: [0.68, -0.07, 0.56], radius_m: 0.015, friction: 0.1}
  - sphere: {name: before it, centre_m: [0.8, 0.05, 0.6], radius_m: 0.02, friction: 0.3}
tool:
  box: {size_m: [0.12, 0.08, 0.04], position_m: [0, 0, 0.01]}
"""


def slowness():
    """How much longer a fixed piece of arithmetic takes than on the machine that docs/results/studies.md has its figures from.

    Its median over 0.2 s, so that it shows the processor and not who else runs."""
    def chunk_ns():
        begun, x = time.perf_counter_ns(), 0.0
        for i in range(400):
            x = x * 0.999 + i
        return time.perf_counter_ns() - begun

    times = sorted(chunk_ns() for _ in range(20_000))
    return max(1.0, 1e-3 * times[len(times) // 2] / REFERENCE_US)


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

    def test_with_328_thousand_triangles_it_takes_at_most_10(self):
        """Six axes, and a session that touches the mesh and slides on it."""
        self.assertEqual(bumpy_ball(self.folder / "ball.stl"), 328_048)
        scene = self.written("ball.yaml", "name: ball\nobjects:\n  - mesh: {name: ball, file: ball.stl, friction: 0.3}\n")
        measured = []
        for _ in range(5):
            before = slowness()
            among_none = self.summary("--duration", "9s")["compute_us"]["p99"]
            figures = self.summary("--scene", scene, "--duration", "9s")
            self.assertGreater(figures["sliding_time_s"], 0.5)
            slow = max(min(before, slowness()), among_none / REFERENCE_P99_US)
            measured.append((figures["compute_us"]["p99"], slow))
        self.assertLessEqual(min(p99_us / slow for p99_us, slow in measured), 10.0, measured)

    def test_with_a_box_tool_among_ten_objects_it_takes_at_most_100(self):
        """Whole cycles of a session that touches and slides most of the time; where the tool is jammed, steps take longer
        (docs/results/studies.md)."""
        scene = self.written("ten.yaml", TEN_OBJECTS)
        measured = []
        for _ in range(3):
            before = slowness()
            figures = self.summary("--scene", scene, "--hand", SOURCE / "sim/hands/tip.yaml", "--inertia", "0.05")
            self.assertGreater(figures["contact_time_s"], 5.0)
            self.assertGreater(figures["sliding_time_s"], 1.0)
            measured.append((figures["compute_us"]["p99"], min(before, slowness())))
        self.assertLessEqual(min(p99_us / slow for p99_us, slow in measured), 100.0, measured)


if __name__ == "__main__":
    unittest.main(verbosity=2)
