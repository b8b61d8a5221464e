#!/usr/bin/python3
"""Swings that die away, and swings that don't: does a session call the first an oscillation, or the second none?

    PROXARM_PROGRAM=build/release/controller/proxarm tests/soak/decaying_hunt.py --sessions 1000 --seed 1

A random hand jerks a shipped cell's tool along x, y, z or another line and holds it for eight seconds, with a mass that
`run` accepts (up to twice the least) and, every fourth time, with one that it refuses. The judge is the steel's
amplitude over time, by the record's true places alone:
  decays   half of what it moves from peak to peak in the last half second, a straight line taken off, is below 20 µm
  swings   it turned round at 3 Hz or more, by 1 mm or more each time, all through the last three seconds
Status 1 if a swing that decays is told to last, or one that goes on isn't; each such session is printed with its hand.
"""
import argparse
import json
import math
import os
import pathlib
import random
import re
import subprocess
import sys
import tempfile

SOURCE = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(SOURCE / "tests/command_line"))
import oscillation_test  # noqa: E402
from steel import Track  # noqa: E402
from hunting import log_uniform  # noqa: E402

CELLS = ("default", "bench", "gantry", "linear", "rail", "scara", "cobot", "seven")
CALM_M = 20e-6
LEAST = re.compile(r"at least ([\d.e+]+) kg")


def jerk(chance, cell):
    """A hand of a damping ratio of 0.05 to 0.6 on 5 kg."""
    stiffness, mass = log_uniform(chance, 100, 3000), chance.uniform(0.5, 2.0)
    damping = 2.0 * chance.uniform(0.05, 0.6) * math.sqrt(stiffness * (mass + 4.0))
    size = min(log_uniform(chance, 0.005, 0.1), 3.0 / math.sqrt(stiffness))
    line = [chance.gauss(0.0, 1.0) for _ in range(3)]
    axis = chance.randrange(4)
    if axis < 3:
        line = [float(i == axis) for i in range(3)]
    if cell == "linear":
        line = [1.0, 0.0, 0.0]
    to = [size * part / math.hypot(*line) * chance.choice((-1.0, 1.0)) for part in line]
    return (f"name: jerk\nmass_kg: {mass:.4g}\nstiffness_N_per_m: {stiffness:.5g}\ndamping_Ns_per_m: {damping:.4g}\n"
            "waypoints:\n  - {time_s: 1.0, offset_m: [0, 0, 0]}\n"
            f"  - {{time_s: {1.0 + chance.uniform(0.06, 0.5):.3f}, offset_m: [{', '.join(f'{p:.5f}' for p in to)}]}}\n")


def decays(track):
    """The steel's largest amplitude in the last half second of rendering is below CALM_M."""
    last = [place for place, phase in zip(track.place, track.phase) if phase == "rendering"]
    last = last[-round(0.5 / (track.time_s[1] - track.time_s[0])):]
    for axis in range(3):
        x = [place[axis] for place in last]
        n, mean = len(x), sum(x) / len(x)
        slope = sum((i - (n - 1) / 2) * (v - mean) for i, v in enumerate(x)) / sum((i - (n - 1) / 2) ** 2 for i in range(n))
        rest = [v - mean - slope * (i - (n - 1) / 2) for i, v in enumerate(x)]
        if (max(rest) - min(rest)) / 2 > CALM_M:
            return False
    return True


def goes_on(track):
    seconds, _, metres = oscillation_test.swings(track)
    turns = max((oscillation_test.turning_points(track, axis) for axis in range(3)), key=len)
    return seconds > 3.0 and metres > 1e-3 and turns[-1][0] > track.time_s[-1] - 1.0


class Hunt:
    def __init__(self, program, folder):
        self.program, self.folder = program, pathlib.Path(folder)
        self.counts, self.found = {}, 0

    def session(self, chance):
        cell, refused = chance.choice(CELLS), chance.random() < 0.25
        hand = self.folder / "hand.yaml"
        hand.write_text(jerk(chance, cell))
        period = chance.choice(("1ms", "1ms", "2ms", "4ms"))
        words = [SOURCE / f"models/cells/{cell}.yaml", "--scene", SOURCE / "scenes/free.yaml", "--hand", hand, "--timestep",
                 period, "--duration", "8s", "--no-plot", "--json"]
        least = LEAST.search(self.call("run", *words, "--mass", "0.26").stderr)
        share = chance.uniform(0.3, 0.95) if refused else chance.uniform(1.0, 2.0)
        if not least:
            return self.count("none stable")
        mass = max(0.26, share * float(least[1]))
        record = self.folder / "record"
        subprocess.run(["rm", "-rf", record])
        done = self.call("run", *words, "--mass", f"{mass:.4g}", "--record", record, "--passivity", "observe",
                         *(["--force-unstable"] if refused else []))
        try:
            summary = json.loads(done.stdout)
        except ValueError:
            return self.count("refused")
        if summary["end"]["reason"] != "duration":
            return self.count("fault")
        track, lasts = Track(record), summary["oscillation"]["lasts"]
        kind = "decays" if decays(track) else "swings" if goes_on(track) else "between"
        self.count(kind + (", told" if lasts else ", not told"))
        if (kind == "decays" and lasts) or (kind == "swings" and not lasts):
            self.found += 1
            print(f"{kind}, told: {lasts}: {cell} {period} {mass:.4g} kg, {summary['oscillation']}\n{hand.read_text()}",
                  flush=True)

    def call(self, *words):
        return subprocess.run([self.program, *map(str, words)], cwd=self.folder, capture_output=True, text=True)

    def count(self, what):
        self.counts[what] = self.counts.get(what, 0) + 1


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--sessions", type=int, default=100)
    options.add_argument("--seed", type=int, default=1)
    given = options.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        hunt = Hunt(os.environ["PROXARM_PROGRAM"], folder)
        for k in range(given.sessions):
            hunt.session(random.Random(f"{given.seed} {k}"))
    print(f"seed {given.seed}: " + ", ".join(f"{n} {what}" for what, n in sorted(hunt.counts.items())))
    return 1 if hunt.found else 0


if __name__ == "__main__":
    sys.exit(main())
