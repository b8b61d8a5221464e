"""A rigid tool that touches with its sides, from the files through the chain: what is judged here is judged from the record
alone, by the shapes that the files state."""
import csv
import math
import unittest

from harness import SOURCE, ProgramTest

SCENES, HANDS = SOURCE / "scenes", SOURCE / "sim/hands"
# A position of a metre in double precision, turned once.
ROUNDING_M = 1e-12


def turned(q, v):
    """The vector v, turned by the quaternion x y z w."""
    x, y, z, w = q
    tx, ty, tz = 2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])
    return (v[0] + w * tx + y * tz - z * ty, v[1] + w * ty + z * tx - x * tz, v[2] + w * tz + x * ty - y * tx)


def vector(row, name, unit):
    return [float(row[f"{name}_{axis}_{unit}"]) for axis in "xyz"]


def pose(row):
    return vector(row, "proxy_W", "m"), [float(row[f"proxy_W_q{part}"]) for part in "xyzw"]


def placed(row, point):
    place, q = pose(row)
    return [a + b for a, b in zip(place, turned(q, point))]


def furthest_of_circle(x, y, u, v, radius):
    """How far a circle about (x, y), spanned by u and v, comes from the z axis: by Newton's method in the angle, from the
    farthest of 16 places."""
    def place(angle):
        c, s = radius * math.cos(angle), radius * math.sin(angle)
        return (x + c * u[0] + s * v[0], y + c * u[1] + s * v[1]), (c * v[0] - s * u[0], c * v[1] - s * u[1])

    angle = max((k * math.pi / 8 for k in range(16)), key=lambda a: math.hypot(*place(a)[0]))
    for _ in range(8):
        (px, py), (dx, dy) = place(angle)
        slope = px * dx + py * dy
        bend = dx * dx + dy * dy - (px * (px - x) + py * (py - y))
        if bend >= 0.0:
            break
        angle -= max(-0.1, min(0.1, slope / bend))
    return math.hypot(*place(angle)[0])


class RigidTool(ProgramTest):
    def session(self, scene, hand, *options, folder="session", inertia="0.05"):
        turning = ("--inertia", inertia) if inertia else ()
        summary = self.summary("--scene", SCENES / scene, "--hand", HANDS / hand, *turning, "--duration", "8s",
                               "--record", folder, *options)
        with open(self.folder / folder / "signals.csv", newline="") as file:
            rows = [row for row in csv.DictReader(file) if row["phase"] == "rendering"]
        return summary, rows

    def test_a_tool_longer_than_the_arm_is_wondered_at(self):
        for length, wondered in ((2.9, False), (5.0, True)):  # from its middle; the arm reaches 1.55 m
            tool = self.written("tool.yaml", f"box: {{size_m: [{length}, 0.06, 0.06]}}\n")
            done = self.call("run", "--tool", tool, "--scene", SCENES / "free.yaml", "--duration", "0.2s")
            self.assertEqual(done.status, 0, done.err)
            said = "the tool comes 2.5 m from its reference point, and the arm reaches 1.55 m" in done.err
            self.assertEqual(said, wondered, done.err)

    def test_a_box_stands_on_its_table(self):
        summary, rows = self.session("box_on_table.yaml", "tip.yaml")
        corners = [(sx * 0.06, sy * 0.04, 0.01 + sz * 0.02) for sx in (-1, 1) for sy in (-1, 1) for sz in (-1, 1)]
        lowest = [min(placed(row, corner)[2] for corner in corners) for row in rows]
        self.assertGreaterEqual(min(lowest), 0.55 - ROUNDING_M)
        self.assertFalse(summary["oscillation"] and summary["oscillation"]["lasts"])
        touching = [row for row in rows if row["contact"] != "free" and "unresolved" not in row["flags"]]
        self.assertLessEqual(summary["unresolved_steps"], 8)  # of 8000, none of them hidden
        self.assertGreater(len(touching), 2000)
        # On its face it touches with more than an edge: the third contact is there.
        self.assertGreater(sum(int(row["contacts"]) >= 3 for row in rows), 500)
        # The table doesn't pull, and friction stays in its cone.
        for row in touching:
            x, y, z = vector(row, "contact_force_W", "N")
            self.assertGreater(z, -1e-9)
            self.assertLessEqual(math.hypot(x, y), 0.4 * z * (1 + 1e-9) + 1e-9)

    def test_a_box_rides_on_a_belt(self):
        """It comes from above onto a plate that goes to and fro under it, and never into it. (With half the inertia it
        bounces at 15 Hz, and how often it touches is chance.)"""
        summary, rows = self.session("box_on_belt.yaml", "tip.yaml", inertia="0.1")
        self.assertFalse(summary["oscillation"]["lasts"])
        corners = [(sx * 0.06, sy * 0.04, 0.01 + sz * 0.02) for sx in (-1, 1) for sy in (-1, 1) for sz in (-1, 1)]
        lowest = [min(placed(row, corner)[2] for corner in corners) for row in rows]
        self.assertGreaterEqual(min(lowest), 0.55 - ROUNDING_M)
        touching = [row for row in rows if row["contact"] != "free" and "unresolved" not in row["flags"]]
        self.assertGreater(len(touching), 4000)
        self.assertLessEqual(summary["unresolved_steps"], 8)  # of 8000
        for row in touching:
            x, y, z = vector(row, "contact_force_W", "N")
            if int(row["contacts"]) == 1:
                self.assertLessEqual(math.hypot(x, y), 0.4 * z * (1 + 1e-9) + 1e-9)

    def test_a_tool_whose_orientation_is_held_finds_its_forces_where_it_lies_flat(self):
        """A tenth to four tenths of these steps found none, and took a millisecond each."""
        for scene, hand in (("box_on_belt", "tip"), ("box_on_table", "tip"), ("key_in_slot", "wiggle"), ("valve_key", "wrench")):
            summary, rows = self.session(f"{scene}.yaml", f"{hand}.yaml", inertia=None)
            self.assertGreater(sum(row["contact"] != "free" for row in rows), 300, scene)
            self.assertLessEqual(summary["unresolved_steps"], 4, scene)
            # 1e8 Nm/rad hold it; where it is hit, by a tenth of a metre a second in one step, with some hundred Nm.
            start = [float(rows[0][f"proxy_W_q{part}"]) for part in "xyzw"]
            for row in rows:
                q = [float(row[f"proxy_W_q{part}"]) for part in "xyzw"]
                self.assertLess(2 * math.dist(q, start), 1e-5, scene)

    def test_what_sticks_to_a_belt_moves_as_the_belt_does(self):
        """A soft hand presses the box down: friction takes it along until the hand pulls harder than that. (The hand of
        tip.yaml draws it sideways whenever the belt turns round, so there it always slides.)"""
        soft = self.written("press.yaml", (HANDS / "tip.yaml").read_text().split("waypoints:")[0].replace("500", "50") +
                            "waypoints:\n  - {time_s: 0.5, offset_m: [0, 0, 0]}\n"
                            "  - {time_s: 3, offset_m: [0, 0, -0.3]}\n")
        _, rows = self.session("box_on_belt.yaml", soft)
        belt = [0.15 * math.sin(math.pi / 2 * 1e-3 * (k + 1)) for k in range(len(rows))]  # after each row's step
        corners = [(sx * 0.06, sy * 0.04, -0.01) for sx in (-1, 1) for sy in (-1, 1)]
        flat = [k for k in range(1, len(rows)) if int(rows[k]["contacts"]) in (3, 4)]  # not tipping, nor at the post
        riding = [k for k in flat if rows[k]["contact"] == "stick"]
        sliding = [k for k in flat if rows[k]["contact"] == "slip"]
        self.assertGreater(len(riding), 1000)
        self.assertGreater(len(sliding), 1000)
        for k in riding:
            for corner in corners:
                was, now = placed(rows[k - 1], corner), placed(rows[k], corner)
                self.assertLessEqual(math.dist((was[0], was[1] + belt[k] - belt[k - 1], was[2]), now), ROUNDING_M)

    def test_the_torque_of_an_edge_is_felt(self):
        """While it leans on an edge at rest, the hand's torque is the contact's: to less than the sensor's noise."""
        still = self.written("lean.yaml", (HANDS / "tip.yaml").read_text().split("waypoints:")[0] + "waypoints:\n"
                             "  - {time_s: 0.5, offset_m: [0, 0, 0]}\n"
                             "  - {time_s: 2, offset_m: [0, 0, -0.03], turn_rad: [0, 0.2, 0]}\n")
        _, rows = self.session("box_on_table.yaml", still)
        rest = rows[-1000:]
        self.assertTrue(all(row["contact"] != "free" for row in rest))
        error = [sum(vector(row, "hand_torque_W", "Nm")[axis] + vector(row, "contact_torque_W", "Nm")[axis]
                     for row in rest) / len(rest) for axis in range(3)]
        largest = max(abs(value) for row in rest for value in vector(row, "contact_torque_W", "Nm"))
        self.assertGreater(largest, 0.1)
        self.assertLess(math.hypot(*error), 0.001)  # noise_Nm of the default cell

    def test_a_key_stays_in_its_slot(self):
        _, rows = self.session("key_in_slot.yaml", "wiggle.yaml")
        corners = [(sx * 0.015, sy * 0.004991, z) for sx in (-1, 1) for sy in (-1, 1) for z in (0.0, 0.04)]
        furthest = max(abs(placed(row, corner)[1]) for row in rows for corner in corners)
        self.assertLessEqual(furthest, 0.005009 + ROUNDING_M)
        self.assertGreater(furthest, 0.005009 - 1e-8)  # it has touched
        travel = [pose(row)[0][2] for row in rows]
        self.assertGreater(max(travel) - min(travel), 0.05)  # and gone up and down

    def test_friction_changes_while_it_is_touched(self):
        """set OBJECT.friction acts on a rigid tool as on a point: by 1 a second, felt where it slips, replayed."""
        _, rows = self.session("box_on_table.yaml", "tip.yaml", "--set", "table.friction=0@1s")
        begin = float(rows[0]["time_s"])
        ratios = []
        for row in rows:
            x, y, z = vector(row, "contact_force_W", "N")
            if float(row["time_s"]) - begin > 1.5 and z > 0.5 and "unresolved" not in row["flags"]:
                ratios.append(math.hypot(x, y) / z)
        self.assertGreater(len(ratios), 1000)
        # Without friction the table gives no force along itself, beyond rounding of forces of some 10 N.
        self.assertLess(max(ratios), 1e-9)
        outcome = self.call("replay", "session")
        self.assertEqual(outcome.status, 0, outcome.err + outcome.out)

    def test_a_peg_stays_in_its_bore(self):
        summary, rows = self.session("peg_in_hole.yaml", "insert.yaml")
        furthest = 0.0
        for row in rows:
            _, q = pose(row)
            u, v = turned(q, (1, 0, 0)), turned(q, (0, 1, 0))
            for z in (0.0, 0.04):
                x, y, _ = placed(row, (0, 0, z))
                furthest = max(furthest, furthest_of_circle(x - 0.69998, y, u, v, 0.00999325))
        self.assertLessEqual(furthest, 0.01000525 + ROUNDING_M)
        self.assertGreater(furthest, 0.01000525 - 1e-9)  # it has touched
        heights = [pose(row)[0][2] for row in rows]
        self.assertGreater(max(heights) - min(heights), 0.1)  # and gone in and out
        self.assertGreater(sum(int(row["contacts"]) >= 2 for row in rows), 4000)  # at both ends
        self.assertLessEqual(summary["unresolved_steps"], 8)
        self.assertFalse(summary["oscillation"]["lasts"])

    def test_replays_to_the_bit(self):
        pin = self.written("pin.yaml", "capsule: {length_m: 0.02, radius_m: 0.01, position_m: [0.03, 0, 0]}\n")
        self.session("box_on_table.yaml", "tip.yaml", "--tool", pin)
        outcome = self.call("replay", "session")
        self.assertEqual(outcome.status, 0, outcome.err + outcome.out)

    def test_a_point_is_what_it_was(self):
        with_option = self.summary("--tool", "point", "--duration", "3s")
        without = self.summary("--duration", "3s")
        self.assertEqual(with_option["setpoint_sha256"], without["setpoint_sha256"])

    def refuse(self, *arguments):
        outcome = self.call("run", "--json", *arguments)
        self.assertEqual(outcome.status, 2, outcome.err)
        self.assertEqual(len(outcome.err.splitlines()), 1, outcome.err)
        return outcome.err

    def test_what_is_refused(self):
        rod = SCENES / "tools/rod.yaml"
        self.assertIn("order 2", self.refuse("--tool", rod, "--order", "2"))
        self.assertIn("--lookahead", self.refuse("--tool", rod, "--lookahead", "auto", "--mass", "10", "--orientation",
                                                 "free"))
        self.assertIn("impedance", self.refuse(SOURCE / "models/cells/light.yaml", "--tool", rod))
        self.assertIn("six axes", self.refuse(SOURCE / "models/cells/scara.yaml", "--tool", rod))
        self.assertIn("has a layer", self.refuse("--tool", rod, "--scene", SCENES / "soft_wall.yaml"))
        self.assertIn("a medium acts on a point", self.refuse("--tool", rod, "--scene", SCENES / "honey.yaml"))
        self.assertIn("--tool", self.refuse("--tool", "nothing.yaml"))
        self.assertIn("give it as --scene", self.refuse("--tool", SCENES / "wall.yaml"))

    def test_a_tool_that_is_larger_than_its_hole(self):
        thick = self.written("thick.yaml", "box: {size_m: [0.03, 0.0102, 0.04], position_m: [0, 0, 0.02]}\n")
        told = self.refuse("--scene", SCENES / "key_in_slot.yaml", "--tool", thick)
        self.assertIn("thick.yaml", told)
        self.assertIn("0.091 mm inside", told)  # (10.2 − 10.018)/2
        self.assertIn("a smaller tool (or a larger hole)", told)

    def test_how_deep_the_steel_is_in_something(self):
        """The key's steel is as deep in its slot as its corners say, which the controller's filter and the arm's gears
        let it be."""
        summary, rows = self.session("key_in_slot.yaml", "wiggle.yaml")
        corners = [(sx * 0.015, sy * 0.004991, z) for sx in (-1, 1) for sy in (-1, 1) for z in (0.0, 0.04)]
        deepest = 0.0
        for row in rows:
            place = vector(row, "true_tool_W", "m")
            q = [float(row[f"true_tool_W_q{part}"]) for part in "xyzw"]
            for corner in corners:
                deepest = max(deepest, abs(place[1] + turned(q, corner)[1]) - 0.005009)
        self.assertGreater(deepest, 1e-5)
        self.assertAlmostEqual(summary["tool_penetration_max_m"], deepest, delta=1e-9)

    def test_a_mesh_that_is_not_convex(self):
        # A cube of 20 mm whose top has a dent of 5 mm in the middle.
        corners = [(x, y, z) for x in (0, 20) for y in (0, 20) for z in (0, 20)] + [(10, 10, 15)]
        faces = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6),
                 (0, 6, 4), (1, 5, 8), (5, 7, 8), (7, 3, 8), (3, 1, 8)]
        self.written("dented.obj", "".join("v %g %g %g\n" % c for c in corners) +
                     "".join("f %d %d %d\n" % tuple(i + 1 for i in f) for f in faces))
        tool = self.written("tool.yaml", "convex: {file: dented.obj, scale_m: 0.001}\n")
        told = self.refuse("--scene", SCENES / "free.yaml", "--tool", tool)
        self.assertIn("tool.yaml", told)
        self.assertIn("a convex mesh", told)
        self.assertIn("which has dents of up to 5 mm", told)
        self.assertIn("hull: true", told)
        hull = self.written("hull.yaml", "convex: {file: dented.obj, scale_m: 0.001, hull: true}\n")
        self.summary("--scene", SCENES / "wall.yaml", "--tool", hull, "--duration", "1s")

    def test_a_tool_that_is_a_mesh(self):
        """The same cube with its dent, as it is: pressed onto a table, it rests on its rim."""
        corners = [(x, y, z) for x in (-10, 10) for y in (-10, 10) for z in (0, 20)] + [(0, 0, 5)]
        faces = [(0, 8, 4), (4, 8, 6), (6, 8, 2), (2, 8, 0), (1, 5, 7), (1, 7, 3), (0, 5, 1), (0, 4, 5), (2, 3, 7),
                 (2, 7, 6), (0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5)]
        text = "".join("v %g %g %g\n" % c for c in corners)
        text += "".join("f %d %d %d\n" % tuple(i + 1 for i in f) for f in faces)
        self.written("dented.obj", text)
        self.written("open.obj", text.rsplit("f", 1)[0])
        tool = self.written("tool.yaml", "mesh: {file: dented.obj, scale_m: 0.001, position_m: [0, 0, 0.03], "
                                         "rpy_rad: [3.141592653589793, 0, 0]}\n")
        alone = self.written("scene.yaml", "dimensions: 3\ntool:\n  mesh: {file: dented.obj, scale_m: 0.001}\n")
        self.assertIn("mesh of 14 triangles", self.call("explain", alone).out)
        found, rows = self.session("box_on_table.yaml", "tip.yaml", "--tool", tool)
        self.assertGreater(found["contact_time_s"], 1.0)
        lowest = min(placed(row, (x, y, 0.03))[2] for row in rows for x in (-0.01, 0.01) for y in (-0.01, 0.01))
        self.assertAlmostEqual(lowest, 0.55, delta=ROUNDING_M)
        self.assertEqual(found["unresolved_steps"], 0)
        broken = self.written("open.yaml", "mesh: {file: open.obj, scale_m: 0.001}\n")
        told = self.refuse("--scene", SCENES / "wall.yaml", "--tool", broken)
        self.assertIn("open.yaml", told)
        self.assertIn("which is open, with a hole of ", told)
        self.assertIn("close_holes_m", told)
        # An edge of the rim has a corner in it on one side alone: a triangle without an area would close it.
        rim = [tuple(i + 1 for i in f) for f in faces if f != (0, 8, 4)] + [(1, 9, 10), (10, 9, 5)]
        self.written("seam.obj", "".join("v %g %g %g\n" % c for c in corners + [(0, -10, 0)]) +
                     "".join("f %d %d %d\n" % f for f in rim))
        seam = self.refuse("--scene", SCENES / "wall.yaml", "--tool",
                           self.written("seam.yaml", "mesh: {file: seam.obj, scale_m: 0.001}\n"))
        self.assertNotIn("a hole", seam)
        self.assertIn("open along an edge that faces of one side have whole and those of the other in parts, at x ", seam)
        # The last face turned round: every edge still has two faces.
        last = text.rsplit("f", 1)[1].split()
        self.written("flipped.obj", text.rsplit("f", 1)[0] + "f " + " ".join(last[::-1]) + "\n")
        flipped = self.refuse("--scene", SCENES / "wall.yaml", "--tool",
                              self.written("flipped.yaml", "mesh: {file: flipped.obj, scale_m: 0.001}\n"))
        self.assertIn("which has faces turned against the others: 1, the first at x ", flipped)
        # Two faces of the same three corners, back to back, are one surface; closed, nothing is inside of them.
        self.written("flat.obj", "v 0 0 0\nv 10 0 0\nv 0 10 0\nf 1 2 3\nf 3 2 1\n")
        flat = self.refuse("--scene", SCENES / "wall.yaml", "--tool",
                           self.written("flat.yaml", "mesh: {file: flat.obj, scale_m: 0.001}\n"))
        self.assertIn("is open, with a hole of 5.86 mm", flat)
        flat = self.refuse("--scene", SCENES / "wall.yaml", "--tool",
                           self.written("flat.yaml", "mesh: {file: flat.obj, scale_m: 0.001, close_holes_m: 0.01}\n"))
        self.assertIn("has 2 triangles, and the smallest body has 4", flat)
        # A cube beside the first one, inside out.
        turned = text + "".join("v %g %g %g\n" % (x + 50, y, z) for x, y, z in corners)
        self.written("turned.obj", turned + "".join("f %d %d %d\n" % tuple(i + 10 for i in f[::-1]) for f in faces))
        unclear = self.call("check", self.written("turned.yaml", "mesh: {file: turned.obj, scale_m: 0.001}\n"))
        self.assertNotEqual(unclear.status, 0)
        self.assertIn("turned.yaml:1: tool: a mesh as a tool can't have faces of which some have their fronts outside",
                      unclear.out + unclear.err)

    CUBE = ([(x, y, z) for x in (-10, 10) for y in (-10, 10) for z in (0, 20)],
            [(0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3), (0, 5, 1), (0, 4, 5), (2, 3, 7), (2, 7, 6), (0, 1, 3),
             (0, 3, 2), (4, 6, 7), (4, 7, 5)])

    def mesh(self, name, corners, faces):
        return self.written(name, "".join("v %g %g %g\n" % c for c in corners) +
                            "".join("f %d %d %d\n" % tuple(i + 1 for i in f) for f in faces))

    def test_check_says_that_a_mesh_whose_faces_cross_is_for_a_point_tool(self):
        corners, faces = self.CUBE
        told = self.call("check", self.mesh("cube.obj", corners, faces))
        self.assertEqual(told.status, 0, told.err)
        self.assertRegex(told.out, r"cube\.obj: fine, a mesh\n$")
        again = [(x + 5, y + 6, z + 7) for x, y, z in corners]
        told = self.call("check", self.mesh("two.obj", corners + again,
                                            faces + [tuple(i + 8 for i in f) for f in faces]))
        self.assertEqual(told.status, 0, told.err)
        self.assertIn("pairs of faces that cross or lie on one another, such as at x ", told.out)
        self.assertRegex(told.out, r"two\.obj: fine, a mesh for a point tool; with a rigid tool it is refused, as an "
                                   r"object and as the tool\n$")

    def test_a_closed_hole_that_makes_faces_lie_on_one_another_is_told_as_that(self):
        """An edge of the bottom has a corner beside its middle, on a side of the cube: what closes the hole lies on
        that side."""
        corners, faces = self.CUBE
        faces = [f for f in faces if f != (0, 6, 4)] + [(0, 6, 8), (8, 6, 4)]
        self.mesh("seam.obj", corners + [(0, -10, 0.01)], faces)
        shape = "mesh: {file: seam.obj, scale_m: 0.001, close_holes_m: 0.001}\n"
        scene = "dimensions: 3\nobjects:\n  - mesh: {file: seam.obj, scale_m: 0.001, close_holes_m: 0.001}\n"
        ball = self.written("ball.yaml", "sphere: {radius_m: 0.01}\n")
        for told in (self.refuse("--scene", SCENES / "wall.yaml", "--tool", self.written("seam.yaml", shape)),
                     self.refuse("--scene", self.written("scene.yaml", scene), "--tool", ball)):
            self.assertIn("has faces that cross or lie on one another: ", told)
            self.assertIn("close_holes_m has added 1 triangle over holes, which may be what does: ", told)
            self.assertIn("put a corner into that edge as well", told)

    def test_check_and_explain_know_tools(self):
        outcome = self.call("check", SCENES / "tools/rod.yaml", SCENES / "box_on_table.yaml")
        self.assertEqual(outcome.status, 0, outcome.err)
        self.assertIn("a tool", outcome.out)
        self.assertIn("tried with a point", outcome.out)  # the scene has a tool
        self.assertIn("a rigid tool", self.call("explain", SCENES / "box_on_table.yaml").out)

    def test_a_key_that_is_no_shape_is_named(self):
        for text, words in (("cone: {radius_m: 1}\n", ("cone: unknown key", "convex")),
                            ("tool:\n  capsule: {length_m: 0.1, radius_m: 0.01}\n", ("tool: unknown key", "capsule")),
                            ("name: nothing\n", ("expected a tool's shape",))):
            outcome = self.call("run", "--tool", self.written("odd.yaml", text))
            self.assertEqual((outcome.status, outcome.err.count("\n")), (2, 1), outcome.err)
            for word in words:
                self.assertIn(word, outcome.err)


if __name__ == "__main__":
    unittest.main()
