#!/usr/bin/python3
"""Masses that `proxarm run` accepts, that `proxarm tune` advises, and that are refused: does the steel swing or not?

    PROXARM_PROGRAM=build/release/controller/proxarm tests/soak/stable_masses_hunt.py --combinations 100 --seed 1

Random hands, timesteps and cells. The judge counts how often the simulated steel turns round, by the record alone
(tests/command_line/oscillation_test.py), and damps nothing. Three questions to each combination:
  advised    the mass that tune advises: steady
  accepted   one that run accepts, drawn between the least and five times that: steady
  refused    0.8 times the least one of the start pose: swings
Status 1 if an answer is another; each such session is printed with its files.
"""
import argparse
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
from oscillation_test import swings  # noqa: E402
from steel import Track  # noqa: E402

# An arm that rings after a blow does so for up to 1.4 s (controller/report/oscillation.hpp).
SWINGS_S = 1.5
FELT = re.compile(r"smallest stable mass: ([\d.]+) kg felt, .*; ([\d.]+) kg in the start pose")
ADVICE = re.compile(r"advice: --mass ([\d.]+) kg")


def log_uniform(chance, low, high):
    return math.exp(chance.uniform(math.log(low), math.log(high)))


def made_hand(chance, reach_m):
    """One that goes to and fro, and jerks: what rings is rung."""
    lines = ["name: jerks", f"mass_kg: {chance.uniform(0.3, 2.0):.3g}",
             f"stiffness_N_per_m: {log_uniform(chance, 150, 1200):.4g}",
             f"damping_Ns_per_m: {log_uniform(chance, 6, 40):.4g}", "waypoints:",
             "  - {time_s: 0.5, offset_m: [0, 0, 0]}"]
    time_s = 0.5
    while time_s < 8.0:
        time_s += chance.uniform(0.25, 1.5)
        place = ", ".join(f"{chance.uniform(-reach_m, reach_m):.4f}" for _ in range(3))
        lines.append(f"  - {{time_s: {time_s:.3f}, offset_m: [{place}]}}")
    return "\n".join(lines) + "\n"


class Hunt:
    def __init__(self, program, folder):
        self.program, self.folder = program, pathlib.Path(folder)
        self.counts, self.found = {}, 0

    def call(self, *words):
        done = subprocess.run([self.program, *map(str, words)], cwd=self.folder, capture_output=True, text=True)
        return done.returncode, done.stdout, done.stderr

    def ask(self, question, should_swing, cell, hand, timestep, mass, *words):
        record = self.folder / "record"
        subprocess.run(["rm", "-rf", record])
        session = [cell, "--hand", hand, "--timestep", f"{timestep}ms", "--mass", f"{mass:.4g}kg", "--passivity",
                   "observe", *words]
        status, _, said = self.call("run", *session, "--no-plot", "--duration", "10s", "--record", record)
        if status == 2:
            return self.count(question, "refused")
        if "FAULT" in said or not (record / "signals.csv").exists():
            return self.count(question, "fault")
        seconds, hertz, metres = swings(Track(record))
        swung = seconds > SWINGS_S
        self.count(question, "swings" if swung else "steady")
        if swung != should_swing:
            self.found += 1
            print(f"{question}: {seconds:.2f} s of {hertz:.1f} Hz, {1e3 * metres:.2f} mm: run {' '.join(map(str, session))}\n"
                  f"{hand.read_text()}", flush=True)

    def count(self, question, answer):
        key = (question, answer)
        self.counts[key] = self.counts.get(key, 0) + 1

    def combination(self, chance, cells):
        cell, timestep = SOURCE / chance.choice(cells), chance.choice((1, 2, 4))
        hand = self.folder / "hand.yaml"
        hand.write_text(made_hand(chance, 0.08))
        free = ("--scene", SOURCE / "scenes/free.yaml")
        status, out, said = self.call("tune", cell, "--hand", hand, "--timestep", f"{timestep}ms")
        felt = FELT.search(out)
        if not felt:
            return self.count("tune", "no mass" if status < 2 else "refused: " + said.strip()[:80])
        least, start = float(felt.group(1)), float(felt.group(2))
        advised = ADVICE.search(out)
        if advised:
            self.ask("advised", False, cell, hand, timestep, float(advised.group(1)), *free)
        else:
            self.count("advised", "none is")
        # tune rounds masses up, to two digits.
        self.ask("accepted", False, cell, hand, timestep, log_uniform(chance, 1.0, 5.0) * least, *free)
        self.ask("refused", True, cell, hand, timestep, 0.8 * start, *free, "--force-unstable")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--combinations", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--cells", nargs="+", default=["models/cells/default.yaml"])
    options = parser.parse_args()
    program = os.path.abspath(os.environ.get("PROXARM_PROGRAM", "build/release/controller/proxarm"))
    with tempfile.TemporaryDirectory(prefix="proxarm-masses-") as folder:
        hunt = Hunt(program, folder)
        for i in range(options.combinations):
            hunt.combination(random.Random(f"{options.seed} {i}"), options.cells)
        for key, count in sorted(hunt.counts.items()):
            print(f"{key[0]}: {key[1]} {count}")
    return 1 if hunt.found else 0


if __name__ == "__main__":
    sys.exit(main())
