"""Meshes as programs export them: what `check` says of them, and what a point that touches them meets."""
import math
import random
import struct
import time
import unittest

from harness import ProgramTest


def stl(triangles):
    words = [b" " * 80, struct.pack("<I", len(triangles))]
    for triangle in triangles:
        words += [struct.pack("<3f", 0, 0, 0)] + [struct.pack("<3f", *corner) for corner in triangle] + [b"\0\0"]
    return b"".join(words)


def globe(rings, sectors, radius):
    """Triangles of a sphere about the origin, fronts outside; `radius` by the polar angle and the azimuth."""
    def at(i, j):
        t, p = math.pi * i / rings, 2 * math.pi * (j % sectors) / sectors
        if i in (0, rings):
            p = 0.0
        r = radius(t, p)
        return (r * math.sin(t) * math.cos(p), r * math.sin(t) * math.sin(p), r * math.cos(t))
    found = []
    for i in range(rings):
        for j in range(sectors):
            a, b, c, d = at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)
            if i + 1 < rings:
                found.append((a, b, c))
            if i > 0:
                found.append((a, c, d))
    return found


def torn(triangles, by, seed):
    """Each triangle with corners of its own, off by up to `by` in each coordinate."""
    rng = random.Random(seed)
    return [tuple(tuple(x + rng.uniform(-by, by) for x in corner) for corner in t) for t in triangles]


HAND = """mass_kg: 1.0
stiffness_N_per_m: 500
damping_Ns_per_m: 20
waypoints:
  - {time_s: 0.5, offset_m: [0, 0, 0]}
  - {time_s: 2, offset_m: [0.13, 0.01, 0.01]}
  - {time_s: 3.5, offset_m: [0.15, 0.04, 0.02]}
  - {time_s: 5, offset_m: [0.15, -0.04, -0.03]}
  - {time_s: 6.5, offset_m: [0.15, 0.03, -0.03]}
"""


class Meshes(ProgramTest):
    def scene(self, name, triangles, keys="position_m: [0.9, 0, 0.6], friction: 0.1"):
        (self.folder / (name + ".stl")).write_bytes(stl(triangles))
        return self.written(name + ".yaml", "objects:\n  - mesh: {name: m, file: %s.stl, %s}\n" % (name, keys))

    def test_corners_that_differ_by_rounding_hold_a_point_and_are_told(self):
        # A point fell through such cracks, 57 mm deep.
        ball = globe(24, 36, lambda t, p: 0.1)
        hand = self.written("hand.yaml", HAND)
        for seed, share in enumerate([1e-9, 1e-8, 1e-7, 1e-6]):
            scene = self.scene("ball%d" % seed, torn(ball, 0.2 * share, seed))
            outcome = self.call("check", scene)
            self.assertEqual((outcome.status, outcome.err), (0, ""), outcome.out)
            self.assertRegex(outcome.out, r"m: .* corners welded within 1\.5\d* µm, moved by ")
            summary = self.summary( "--scene", scene, "--hand", hand, "--duration", "7s")
            self.assertEqual(summary["penetration_max_m"], 0.0)
            self.assertLess(summary["tool_penetration_max_m"], 2e-3)
            self.assertGreater(summary["tool_penetration_max_m"], 1e-6, "it was touched")
        self.assertIn("small holes", self.call("run", "--scene", self.scene(
            "open", torn(ball, 2e-8, 1), "position_m: [0.9, 0, 0.6], weld_m: 0"), "--duration", "0.1s").err)

    def test_faces_that_are_there_twice_are_one_surface_with_the_same_penetration(self):
        # Told as "penetration, tool: 0", where the same sphere once has some micrometres.
        ball = globe(24, 36, lambda t, p: 0.1)
        turned = [(a, c, b) for a, b, c in ball]
        hand = self.written("hand.yaml", HAND)
        deep = {}
        for name, triangles in [("once", ball), ("twice", ball + ball), ("sides", ball + turned)]:
            scene = self.scene(name, triangles)
            out = self.call("check", scene, "--states", "200").out
            if name != "once":
                self.assertIn("%d faces left out that are there already" % len(ball), out)
            deep[name] = self.summary( "--scene", scene, "--hand", hand,
                                      "--duration", "4s")["tool_penetration_max_m"]
        self.assertGreater(deep["once"], 1e-6)
        self.assertAlmostEqual(deep["twice"], deep["once"], delta=0.05 * deep["once"])
        self.assertAlmostEqual(deep["sides"], deep["once"], delta=0.05 * deep["once"])

    def test_borders_that_end_at_other_faces_are_told_in_words(self):
        # A hole of "-nan m".
        file = self.written("fins.obj", "v 0.2 -0.1 -0.1\nv 0.2 0.1 -0.1\nv 0.2 0.1 0.1\nv 0.3 0 -0.2\nv 0.1 0 -0.25\n"
                            "v 0.3 0.2 0\nv 0.1 0.25 0\nf 1 2 3\nf 1 2 4\nf 1 2 5\nf 2 3 6\nf 2 3 7\n")
        out = self.call("check", file).out
        self.assertNotIn("nan", out.replace(str(file), ""))
        self.assertRegex(out, r"5 borders that end at other faces: a border of 1 edge, 283 mm long, at [^;]*; of 2 edges, ")

    def test_stacked_triangles_take_a_bounded_time_and_say_so(self):
        # 80 kB of them kept `check` busy for 19 s.
        fan = [((0, 0, 0), (0.1, 0, 0), (0.05, 0.1 + 1e-4 * k, 0)) for k in range(1600)]
        begin = time.monotonic()
        outcome = self.call("check", self.scene("stack", fan))
        self.assertLess(time.monotonic() - begin, 10.0, "5 s of states, and a margin for a loaded machine")
        if "stopped after" in outcome.out:
            self.assertRegex(outcome.out, r"stopped after \S+ s, of 20000 states: \S+ ms each, as where hundreds of faces")

    def test_noisy_and_smooth_spheres_with_friction_break_no_law(self):
        # The walk slides over one face and is held by the next; that was called a broken law.
        rng = random.Random(7)
        for k, (rings, noise) in enumerate([(50, 0.0), (50, 1e-3), (70, 3e-3), (100, 0.0), (150, 1e-3)]):
            rough = {}
            ball = globe(rings, 2 * rings, lambda t, p: 0.2 + rough.setdefault((t, p), rng.uniform(-noise, noise)))
            outcome = self.call("check", self.scene("rough%d" % k, ball, "position_m: [1.1, 0, 0.6], friction: 0.3"))
            self.assertEqual((outcome.status, outcome.err), (0, ""), outcome.out)
            self.assertIn("force within its laws: worst 0 of", outcome.out)

    def test_without_a_contact_there_is_no_verdict(self):
        # "fine in 20000 states, 0 in contact".
        ball = self.scene("ball", globe(24, 36, lambda t, p: 0.1))
        self.assertNotIn(", 0 in contact", self.call("check", ball, "--depth", "0.1mm").out)
        beside = self.written("beside.yaml", "dimensions: 2\nspace: {origin_m: [0.7, 0, 0.6], axes: [[1, 0, 0], [0, 0, 1]]}\n"
                              "objects:\n  - sphere: {centre_m: [0.9, 0.5, 0.6], radius_m: 0.1}\n")
        outcome = self.call("check", beside, "--states", "500")
        self.assertEqual(outcome.status, 2, outcome.out)
        self.assertIn("no verdict", outcome.err)
        self.assertIn("NO VERDICT in 500 states, 0 in contact", outcome.out)

    def test_the_summary_counts_steps_of_a_point_that_keep_not_all_laws(self):
        # Only a rigid tool's were. The inside of a funnel of 100 planes has more of them near than a step tries.
        planes = []
        for k in range(100):
            a = 2 * math.pi * k / 100
            planes.append("  - plane: {point_m: [0.75, 0, 0.6], normal: [%.15g, %.15g, %.15g], friction: 0.3}\n"
                          % (-0.7, 0.7 * math.cos(a), 0.7 * math.sin(a)))
        summary = self.summary("--scene", self.written("funnel.yaml", "objects:\n" + "".join(planes)), "--duration", "4s")
        self.assertGreater(summary["unresolved_steps"], 0)

    def test_a_mesh_is_placed_by_its_box(self):
        part = [tuple((x + 3, y - 2, z + 1) for x, y, z in t) for t in globe(24, 36, lambda t, p: 0.1)]
        low = self.scene("low", part, "position_m: [0.9, 0, 0.6], anchor: low")
        self.assertIn("200 mm × 200 mm × 200 mm, from x 0.8, y -0.1, z 0.6 m to x 1, y 0.1, z 0.8 m",
                      self.call("check", low, "--states", "200").out)
        centre = self.scene("centre", part, "position_m: [0.9, 0, 0.6], anchor: centre")
        self.assertIn("from x 0.8, y -0.1, z 0.5 m to x 1, y 0.1, z 0.7 m",
                      self.call("check", centre, "--states", "200").out)
        bad = self.scene("bad", part, "position_m: [0.9, 0, 0.6], anchor: top")
        self.assert_refused(self.call("check", bad), "anchor: found \"top\"", "low", "centre", "origin")

    def test_a_unit_that_is_hardly_meant_is_told(self):
        scene = self.scene("mm", globe(24, 36, lambda t, p: 150.0), "position_m: [0.9, 0, 0.6]")
        self.assertIn("m: it is 300 m long: looks like mm; write scale_m: 0.001",
                      self.call("check", scene, "--states", "200").out)


if __name__ == "__main__":
    unittest.main()
