"""`proxarm check` says of a cell what `proxarm run` does with it: both refuse it, or neither does.

200 cells are made out of the shipped ones by one to three changes each, most of them bad; none of the reader's code is used
to judge them, only what both commands answer.
"""
import os
import random
import re
import subprocess
import sys
import tempfile
import unittest
from concurrent.futures import ThreadPoolExecutor

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from harness import program  # noqa: E402

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
CELLS = ["default", "seven", "scara", "gantry", "linear", "bench"]
COUNT = 200


def number_of(key, factor):
    """Multiplies one of the numbers of that key."""
    def change(rng, text):
        places = list(re.finditer(r"(\b%s: )(-?[0-9.e+]+)" % key, text))
        if not places:
            return text
        place = rng.choice(places)
        return text[:place.start(2)] + "%.6g" % (float(place.group(2)) * factor) + text[place.end(2):]
    return change


def replaced(pattern, by):
    return lambda rng, text: re.sub(pattern, by, text, count=1)


def start_at(value):
    def change(rng, text):
        start = re.search(r"start_rad: \[(.*)\]", text)
        angles = start.group(1).split(",")
        angles[rng.randrange(len(angles))] = str(value)
        return text[:start.start(1)] + ", ".join(angles) + text[start.end(1):]
    return change


CHANGES = [
    start_at(0), start_at(0.3), start_at(2.0), start_at(-9),
    replaced(r"start_rad: \[.*\]", "start_rad: [0, 0, 0, 0, 0, 0]"),
    replaced(r"bitrate: 1000000", "bitrate: 250000"), replaced(r"bitrate: 1000000", "bitrate: 500000"),
    number_of("default_mass_kg", 0.1), number_of("default_mass_kg", 0.5), number_of("default_mass_kg", 4),
    number_of("default_period_s", 0.5), number_of("default_period_s", 2), number_of("default_period_s", 4),
    number_of("default_period_s", 1.2345678), number_of("servo_rate_Hz", 0.25), number_of("servo_rate_Hz", 2),
    number_of("servo_rate_Hz", 0.7), number_of("gear_damping_Nms_per_rad", 50), number_of("gear_stiffness_Nm_per_rad", 0.05),
    number_of("gear_stiffness_Nm_per_rad", 100), number_of("rotor_inertia_kg_m2", 0.01), number_of("rotor_inertia_kg_m2", 0),
    number_of("node", 1), replaced(r"node: 2", "node: 1"), replaced(r"node: 3", "node: 130"),
    replaced(r"urdf: .*", "urdf: none.urdf"), replaced(r"joint: axis_2", "joint: nobody"),
    replaced(r"link: flange", "link: nowhere"), replaced(r"base_id: 0x..", "base_id: 0x08"),
    replaced(r"leash_m: 0.02", "leash_m: 0"), replaced(r"limits:\n", "limits:\n  workspace_m: {min: [-9, -9, -9], max: [9, 9, 0.1]}\n"),
    replaced(r"direction: 1", "direction: 2"), replaced(r"max_torque_Nm: \d+", "max_torque_Nm: 1"),
    replaced(r"range_rad: \[[^\]]*\]", "range_rad: [0.1, 0.2]"), number_of("bandwidth_Hz", 0.05), number_of("sample_rate_Hz", 0.01),
]

SCENES = [
    "objects:\n  - plane: {point_m: [9, 0, 0], normal: [-1, 0, 0], friction: 0.3}\n",
    "objects:\n  - sphere: {centre_m: [0.7, 0, 0.6], radius_m: 0.3}\n",  # where most arms begin
    "objects:\n  - plane: {point_m: [0, 0, 2], normal: [0, 0, 1]}\n",  # all begin behind it
    "dimensions: 2\nspace: {origin_m: [0.7, 0, 0.6], axes: [[1, 0, 0], [0, 0, 1]]}\nobjects: []\n",
    "dimensions: 1\nspace: {origin_m: [0, 0, 0], axes: [[0, 1, 0]]}\nobjects: []\n",
    "guide: {line: {point_m: [0, 0, 0], direction: [1, 0, 0]}}\n",
    "objects:\n  - box: {centre_m: [3, 0, 0], size_m: [1, 1, -1]}\n",
    "objects:\n  - mesh: {file: star.obj, scale_m: 0.001}\n",
    *[""] * 16,  # the cell's own
]


def made(rng, folder, index):
    cell = rng.choice(CELLS)
    with open(os.path.join(ROOT, "models", "cells", cell + ".yaml"), encoding="utf-8") as file:
        text = file.read()
    text = re.sub(r"(: )(\.\./[^\s,}]*)", lambda m: ": " + os.path.normpath(os.path.join(ROOT, "models/cells", m.group(2))), text)
    for _ in range(rng.choice([0, 0, 0, 0, 1, 1, 2])):
        text = rng.choice(CHANGES)(rng, text)
    place = os.path.join(folder, "%03d_%s.yaml" % (index, cell))
    with open(place, "w", encoding="utf-8") as file:
        file.write(text)
    words = [place]
    scene = rng.choice(SCENES)
    if scene:
        with open(place + ".scene.yaml", "w", encoding="utf-8") as file:
            file.write(scene)
        words += ["--scene", place + ".scene.yaml"]
    return words


class CheckAgrees(unittest.TestCase):
    def test_with_run_on_200_cells_and_scenes(self):
        rng = random.Random(19)
        with tempfile.TemporaryDirectory() as folder:
            with open(os.path.join(ROOT, "scenes/meshes/star.obj"), "rb") as file, \
                    open(os.path.join(folder, "star.obj"), "wb") as copy:
                copy.write(file.read())
            cells = [made(rng, folder, i) for i in range(COUNT)]

            def asked(words):
                check = subprocess.run([program(), "check", *words], capture_output=True, text=True, cwd=folder, timeout=600)
                run = subprocess.run([program(), "run", *words, "--duration", "20ms", "--no-plot"],
                                     capture_output=True, text=True, cwd=folder, timeout=600)
                return words, check, run

            with ThreadPoolExecutor(os.cpu_count()) as pool:
                answers = list(pool.map(asked, cells))
        refused = 0
        for words, check, run in answers:
            story = "%s\ncheck (%d): %s%s\nrun (%d): %s%s" % (words, check.returncode, check.stdout, check.stderr,
                                                              run.returncode, run.stdout[-500:], run.stderr)
            self.assertIn(check.returncode, (0, 2), story)
            self.assertIn(run.returncode, (0, 1, 2), story)
            self.assertEqual(check.returncode == 2, run.returncode == 2, story)
            if check.returncode == 2:
                refused += 1
        print("%d refused by both, %d by none" % (refused, COUNT - refused))
        self.assertGreater(refused, COUNT // 4)
        self.assertGreater(COUNT - refused, COUNT // 4)


if __name__ == "__main__":
    unittest.main()
