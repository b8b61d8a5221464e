#!/usr/bin/python3
"""Random gears, rotors and frictions of simulated arms: are the intervals of `proxarm identify --joints` true?

    PROXARM_PROGRAM=build/release/controller/proxarm tests/soak/identify_joints_hunt.py --sessions 100 --jobs 1

The controller knows a shipped cell, with rated_torque_Nm added; of the arm, each joint's stiffness is 0.7 to 1.4 times
that, its rotor 0.8 to 1.25 times, damping and frictions half to twice; each link's mass and inertia is up to 4 % other
than the URDF says, and the sensor's noise is 5 to 50 mN. The judge reads the truth from the files that it wrote. Wanted:
  a result each time, and of each kind of figure 95 of 100 that are given within their interval
Status 1 where it isn't so.
"""
import json
import os
import pathlib
import random
import re
import subprocess
import sys

import hunting
from hunting import SOURCE, log_uniform
from identify_hunt import replaced, rooted

CELLS = ("default", "cobot", "seven")
RANGES = {"gear_stiffness_Nm_per_rad": (0.7, 1.4), "rotor_inertia_kg_m2": (0.8, 1.25),
          "gear_damping_Nms_per_rad": (0.5, 2.0), "coulomb_friction_Nm": (0.5, 2.0),
          "viscous_friction_Nms_per_rad": (0.5, 2.0)}


def shipped(name):
    """The text of a shipped cell that says what its drives' torques count in."""
    path = SOURCE / f"models/cells/{name}.yaml"
    return re.sub(r"(\n    |, )max_torque_Nm: ([\d.]+)(?=[,\n])", r"\1rated_torque_Nm: \2\1max_torque_Nm: \2",
                  rooted(path.read_text(), path))


def other_links(chance, urdf):
    """A URDF whose links are up to 4 % heavier or lighter."""
    def link(found):
        share = chance.uniform(0.96, 1.04)
        scaled = lambda value: f'{value[1]}"{share * float(value[2]):.9g}"'
        text = re.sub(r'(<mass\s+value=)"([^"]*)"', scaled, found[0])
        return re.sub(r'(\bi[xyz][xyz]=)"([^"]*)"', scaled, text)
    return re.sub(r"<inertial>.*?</inertial>", link, urdf, flags=re.S)


def made_arm(chance, text, folder):
    """The text of an arm that differs from its cell's, and each joint's truth by the key that is told."""
    parts = re.split(r"(?=\n  - \{?joint: )", text)
    truth = {}
    for n, part in enumerate(parts):
        joint = re.match(r"\n  - \{?joint: ([^\s,]+)", part)
        if not joint:
            continue
        values = {}
        for key, (low, high) in RANGES.items():
            share = log_uniform(chance, low, high)
            nominal = float(re.search(rf"\b{key}: ([\d.]+)", part)[1])
            values[("simulation." if "friction" in key else "") + key] = share * nominal
            part = replaced(part, rf"(\b{key}: )[\d.]+", rf"\g<1>{share * nominal:.9g}", count=0)
        parts[n], truth[joint[1]] = part, values
    text = "".join(parts)
    noise = log_uniform(chance, 0.005, 0.05)
    text = replaced(text, r"\n  noise_N: [\d.]+", f"\n  noise_N: {noise:.4g}")
    text = replaced(text, r"\n  noise_Nm: [\d.]+", f"\n  noise_Nm: {0.05 * noise:.4g}")
    urdf = pathlib.Path(re.search(r"\nurdf: (\S+)", text)[1])
    (folder / "arm.urdf").write_text(other_links(chance, urdf.read_text()))
    return replaced(text, r"\nurdf: \S+", "\nurdf: arm.urdf"), truth


def judged(told, truth):
    """(joint and key, kind, error as a share of the interval, interval as a share of the truth) of what was given."""
    rows = []
    for joint, values in truth.items():
        for key, true in values.items():
            got = told["joints"][joint][key]
            if got["value"] is not None:
                rows.append((f"{joint}.{key}", key, (got["value"] - true) / got["uncertainty"], got["uncertainty"] / true))
    return rows


def session(seed, folder):
    chance = random.Random(seed)
    folder.mkdir(parents=True)
    name = chance.choice(CELLS)
    text = shipped(name)
    cell, arm = folder / "cell.yaml", folder / "arm.yaml"
    cell.write_text(text)
    arm_text, truth = made_arm(chance, text, folder)
    arm.write_text(arm_text)
    call = [os.environ["PROXARM_PROGRAM"], "identify", str(cell), "--arm", str(arm), "--joints", "--json"]
    done = subprocess.run(call, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=600)
    told = json.loads(done.stdout) if done.stdout else {}
    if not told.get("identified"):
        return {"cell": name, "wrong": [told.get("failure") or done.stderr], "rows": []}
    rows = judged(told, truth)
    return {"cell": name, "wrong": [], "rows": rows, "given": len(rows), "left_over": told["left_over_share"]}


def main():
    given = hunting.options(__doc__, sessions=100)
    results = hunting.sessions(given, session)
    status = hunting.tell(results, ("given", "left_over"))
    rows = [(n, r["cell"], *row) for n, r in results for row in r["rows"]]
    for kind in sorted({row[3] for row in rows}):
        of = [row for row in rows if row[3] == kind]
        true = sum(abs(row[4]) <= 1.0 for row in of)
        offered = sum(len(r["rows"]) > 0 for _, r in results)
        width = sorted(row[5] for row in of)[len(of) // 2]
        print(f"  {kind:40s} {len(of)} given in {offered} arms, {100 * true / len(of):.1f} % true, "
              f"median interval {100 * width:.1f} %, mean error {sum(row[4] for row in of) / len(of):+.2f} intervals")
        status = status or (1 if true < 0.95 * len(of) else 0)
    for row in sorted(rows, key=lambda row: -abs(row[4]))[:12]:
        print(f"    session {row[0]}, {row[1]}: {row[2]} off by {row[4]:+.2f} intervals of {100 * row[5]:.1f} %")
    return status


if __name__ == "__main__":
    sys.exit(main())
