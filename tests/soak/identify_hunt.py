#!/usr/bin/python3
"""Random tools on simulated arms: does `proxarm identify` find them, and is its interval true?

    PROXARM_PROGRAM=build/release/controller/proxarm tests/soak/identify_hunt.py --tools 100 --seed 1

The controller knows a shipped cell; the arm is given another tool (0.1 to 8 kg, its centre up to 0.2 m from S), a sensor
that is mounted 0.5 degrees off, a base that stands up to as much off, noise, and gears with friction, hysteresis and
another stiffness than the cell says. The judge reads the truth from the files that it wrote and from the sensor's
(zero = matrix · bias_counts / counts). Wanted:
  mass    within 1 % + 10 g, each time
  centre  within 2 mm, each time
  95 %    the mass, and each component of centre and zero, within its stated interval in 95 of 100
Status 1 where it isn't so; each tool that is missed is printed.
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

from hunting import SOURCE, direction, log_uniform

CELLS = ("default", "cobot", "seven")
MOUNTING_RAD = math.radians(0.5)


def flow(values):
    return "[" + ", ".join(f"{value:.9g}" for value in values) + "]"


def rooted(text, cell=SOURCE / "models/cells/default.yaml"):
    """The text of a shipped cell, to lie in another folder."""
    return re.sub(r"(urdf|description|default_\w+|eds): (\.\./[^\s,}]+)",
                  lambda found: f"{found[1]}: {(cell.parent / found[2]).resolve()}", text)


def replaced(text, pattern, fresh, count=1):
    text, found = re.subn(pattern, fresh, text, count=count)
    if found == 0:
        raise ValueError(f"no {pattern} in the cell")
    return text


def made_arm(chance, text):
    """The text of an arm that differs from its cell's, and what hangs there: kg, m."""
    mass_kg = log_uniform(chance, 0.1, 8.0)
    far_m = chance.uniform(0.0, 0.2)
    centre_m = [far_m * x for x in direction(chance)]
    inertia = mass_kg * 0.03 ** 2  # of a body of 3 cm about its centre
    text = replaced(text, r"\n  mass_kg: [\d.]+", f"\n  mass_kg: {mass_kg:.9g}")
    text = replaced(text, r"centre_of_mass_S_m: \[[^]]*\]", f"centre_of_mass_S_m: {flow(centre_m)}")
    text = replaced(text, r"inertia_kg_m2: \[[^]]*\]", f"inertia_kg_m2: {flow([inertia] * 3 + [0] * 3)}")
    text = replaced(text, r"(pose_link: \{position_m: \[[^]]*\], rpy_rad: )\[0, 0, 0\]",
                    lambda found: found[1] + flow([MOUNTING_RAD * x for x in direction(chance)]))
    text = replaced(text, r"(base_W: \{position_m: \[[^]]*\], rpy_rad: )\[0, 0, 0\]",
                    lambda found: found[1] + flow([chance.uniform(0, MOUNTING_RAD) * x for x in direction(chance)]))
    text = replaced(text, r"\n  noise_N: [\d.]+", f"\n  noise_N: {log_uniform(chance, 0.005, 0.05):.4g}")
    text = replaced(text, r"\n  noise_Nm: [\d.]+", f"\n  noise_Nm: {log_uniform(chance, 0.0003, 0.003):.4g}")

    def friction_and_gear(found):
        between = ", " if found[1] == "{" else found[1]
        return (f"{found[1]}coulomb_friction_Nm: {chance.uniform(0.5, 2.0) * float(found[2]):.4g}"
                f"{between}gear_hysteresis_rad: {chance.uniform(0, 1e-4):.3g}"
                f"{between}gear_stiffness_ratio: {chance.uniform(0.85, 1.15):.4g}")
    text = replaced(text, r"(\n      |\{)coulomb_friction_Nm: ([\d.]+)", friction_and_gear, count=0)
    return text, mass_kg, centre_m


def zero_of_sensor():
    """What the shipped ATI sensor reads without a load: N and Nm."""
    text = (SOURCE / "models/sensors/ati_net_can_oem.yaml").read_text()
    rows = [[float(x) for x in row.split(",")] for row in re.findall(r"\n    - \[([^]]*)\]", text)]
    bias = [float(x) for x in re.search(r"bias_counts: \[([^]]*)\]", text)[1].split(",")]
    per = [float(re.search(rf"counts_per_{unit}: (\d+)", text)[1]) for unit in ("N", "Nm")]
    wrench = [sum(a * b for a, b in zip(row, bias)) for row in rows]
    return [x / per[0] for x in wrench[:3]], [x / per[1] for x in wrench[3:]]


def identified(cell, arm, folder, *arguments):
    call = [os.environ["PROXARM_PROGRAM"], "identify", str(cell), "--arm", str(arm), "--json", *arguments]
    done = subprocess.run(call, cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, text=True)
    return done.returncode, json.loads(done.stdout) if done.stdout else {}, done.stderr


class Judge:
    """Counts misses and intervals that are true."""

    def __init__(self):
        self.tools, self.missed = 0, []
        self.true = {"mass": [], "centre": [], "zero force": [], "zero torque": []}
        self.off = {"mass": 0.0, "centre": 0.0}  # largest, as a share of what is allowed
        self.half = {"mass": 0.0, "centre": 0.0}  # largest, likewise

    def take(self, name, result, mass_kg, centre_m):
        self.tools += 1
        if not result.get("identified"):
            self.missed.append(f"{name}: {result.get('failure') or result}")
            return
        zero_N, zero_Nm = zero_of_sensor()
        mass = result["mass_kg"]
        off_kg, most_kg = abs(mass["value"] - mass_kg), 0.01 * mass_kg + 0.01
        self.true["mass"].append(off_kg <= mass["uncertainty"])
        for kind, key, truth in (("centre", "centre_of_mass_S_m", centre_m), ("zero force", "zero_force_S_N", zero_N),
                                 ("zero torque", "zero_torque_S_Nm", zero_Nm)):
            got = result[key]
            self.true[kind] += [abs(a - b) <= u for a, b, u in zip(got["value"], truth, got["uncertainty"])]
        centre = result["centre_of_mass_S_m"]
        off_m = math.dist(centre["value"], centre_m)
        self.off["mass"] = max(self.off["mass"], off_kg / most_kg)
        self.off["centre"] = max(self.off["centre"], off_m / 0.002)
        self.half["mass"] = max(self.half["mass"], mass["uncertainty"] / most_kg)
        self.half["centre"] = max(self.half["centre"], max(centre["uncertainty"]) / 0.002)
        if off_kg > most_kg or off_m > 0.002:
            self.missed.append(f"{name}: {mass_kg:.4g} kg by {1e3 * off_kg:.2g} g, centre by {1e3 * off_m:.2g} mm")

    def share_true(self, kind):
        return sum(self.true[kind]) / max(1, len(self.true[kind]))

    def text(self):
        shares = ", ".join(f"{kind} {100 * self.share_true(kind):.1f} %" for kind in self.true)
        return (f"{self.tools} tools, {len(self.missed)} missed; worst, as a share of what is allowed: mass "
                f"{self.off['mass']:.2f}, centre {self.off['centre']:.2f}; widest interval: mass {self.half['mass']:.2f}, "
                f"centre {self.half['centre']:.2f}; interval true: {shares}")


def session(judge, seed, folder, cells=CELLS):
    chance = random.Random(seed)
    name = chance.choice(cells)
    cell = SOURCE / f"models/cells/{name}.yaml"
    text, mass_kg, centre_m = made_arm(chance, rooted(cell.read_text()))
    arm = pathlib.Path(folder) / "arm.yaml"
    arm.write_text(text)
    status, result, err = identified(cell, arm, folder)
    if not result:
        result = {"failure": f"status {status}: {err}"}
    judge.take(f"seed {seed}, {name}", result, mass_kg, centre_m)
    return result


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tools", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    judge = Judge()
    with tempfile.TemporaryDirectory() as folder:
        for n in range(options.tools):
            missed = len(judge.missed)
            session(judge, f"{options.seed}/{n}", folder)
            for line in judge.missed[missed:]:
                print("MISSED", line, flush=True)
    print(judge.text())
    rare = [kind for kind in judge.true if judge.share_true(kind) < 0.95]
    return 1 if judge.missed or rare else 0


if __name__ == "__main__":
    sys.exit(main())
