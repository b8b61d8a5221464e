#!/usr/bin/python3
"""Ways through a wrist's singularity, led with the orientation held: does the place go on, and does the hand feel it?

    PROXARM_PROGRAM=build/release/controller/proxarm tests/soak/singular_hunt.py --sessions 1000 --seed 1

The ways are found with kinematics of the judge's own (tests/command_line/tool_motion.py): straight ones from the start,
along which the fifth joint of six, or the sixth of seven, goes through zero. The hand leads along each, past the
singularity and back. Judged by the records alone, while the joint is within 0.1 rad of zero:
  place        the steel is within 0.5 mm of where the proxy was when its setpoints were made
  no stop      no fault; the tool never slower than a fifth of the hand's way there
  speeds       of the tool, as sent, within the limit
  force        below twice the largest of the same session elsewhere on the way at that speed
Told, not judged: how far the orientation lags. Status 1, and the session's files in `--keep DIR`, where it isn't so.
"""
import argparse
import csv
import json
import math
import os
import pathlib
import random
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

import numpy

SOURCE = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(SOURCE / "tests/command_line"))
import tool_motion  # noqa: E402

NEAR_RAD = 0.1
PLACE_M = 5e-4
STEP_M = 0.005
SETTLED_S = 0.3  # after the way begins


class Arm:
    """Inverse kinematics of a shipped cell, with the orientation of the start."""

    def __init__(self, name):
        self.cell = tool_motion.Cell(SOURCE / f"models/cells/{name}.yaml")
        self.chain = tool_motion.Chain(self.cell, numpy)
        text = self.cell.file.read_text()
        self.start = numpy.array([float(x) for x in text.split("start_rad: [")[1].split("]")[0].split(",")])
        self.ranges = [tuple(float(x) for x in drive["range_rad"].strip("[]").split(",")) for drive in self.cell.drives]
        self.handle = self.cell.tool
        self.home, self.R = self.pose(self.start[:, None])
        self.wrist = len(self.start) - 2

    def pose(self, q):
        """Places, 3 x n, and orientations, 9 x n, for columns of joint angles."""
        ends = []
        for axis in (None, 0, 1, 2):
            self.cell.tool = self.handle if axis is None else tuple(
                x + (axis == i) for i, x in enumerate(self.handle))
            ends.append(numpy.array([numpy.broadcast_to(x, q.shape[1]) for x in self.chain.points(list(q))[0]]))
        self.cell.tool = self.handle
        return ends[0], numpy.concatenate([ends[k] - ends[0] for k in (1, 2, 3)])

    def solve(self, q, place):
        for _ in range(8):
            nudged = numpy.repeat(q[:, None], len(q) + 1, axis=1)
            nudged[range(len(q)), range(1, len(q) + 1)] += 1e-6
            p, R = self.pose(nudged)
            all_of = numpy.concatenate([p, 0.3 * R])
            J = (all_of[:, 1:] - all_of[:, :1]) / 1e-6
            wanted = numpy.concatenate([place[:, None], 0.3 * self.R])[:, 0] - all_of[:, 0]
            if numpy.abs(wanted).max() < 1e-9:
                return q
            q = q + numpy.linalg.solve(J.T @ J + 1e-8 * numpy.eye(len(q)), J.T @ wanted)
        return q if numpy.abs(wanted).max() < 1e-5 else None

    def crossing(self, way):
        """After how many metres along this direction the wrist's joint goes through zero, or None."""
        q = self.start
        for k in range(1, 120):
            after = self.solve(q, self.home[:, 0] + k * STEP_M * numpy.array(way))
            if after is None or any(not low + 0.1 < x < high - 0.1 for x, (low, high) in zip(after, self.ranges)):
                return None
            if after[self.wrist] * q[self.wrist] < 0.0:
                return k * STEP_M
            q = after
        return None


def made_hand(chance, way, far_m):
    speed = math.exp(chance.uniform(math.log(0.05), math.log(0.4)))
    reach = far_m + 0.1
    ends_s = 0.5 + reach / speed
    lines = ["name: through the wrist", "mass_kg: 1", f"stiffness_N_per_m: {chance.uniform(300, 1500):.4g}",
             "damping_Ns_per_m: 40", "waypoints:", "  - {time_s: 0.5, offset_m: [0, 0, 0]}"]
    for time_s, share in ((ends_s, 1.0), (ends_s + 0.3, 1.0), (ends_s + 0.3 + reach / speed, 0.0)):
        place = ", ".join(f"{share * reach * x:.5f}" for x in way)
        lines.append(f"  - {{time_s: {time_s:.3f}, offset_m: [{place}]}}")
    return "\n".join(lines) + "\n", ends_s + 0.5 + reach / speed, speed


def judge(record, arm, speed):
    with open(record / "signals.csv", newline="") as text:
        rows = csv.reader(text)
        at = {key: i for i, key in enumerate(next(rows))}
        rows = [row for row in rows if row[at["phase"]] == "rendering"]
    column = lambda names: numpy.array([[float(row[at[name]]) for name in names] for row in rows])
    time_s = column(["time_s"])[:, 0]
    three = lambda name, unit: column([f"{name}_W_{x}_{unit}" for x in "xyz"])
    proxy, steel, force = three("proxy", "m"), three("true_tool", "m"), numpy.linalg.norm(three("hand_force", "N"), axis=1)
    wrist = column([f"{arm.cell.joints[arm.wrist]}_target_rad"])[:, 0]
    T = time_s[1] - time_s[0]
    near = (numpy.abs(wrist) < NEAR_RAD) & (time_s > 0.5 + SETTLED_S)
    if not near.any():
        return None
    sent = numpy.linalg.norm(numpy.diff(proxy, axis=0), axis=1) / T
    # Where the steel is nearest to the proxy of the last 60 ms: the loop's delay is no deviation.
    late = range(0, int(0.06 / T))
    off = numpy.array([min(numpy.linalg.norm(steel[k] - proxy[k - n]) for n in late) for k in numpy.flatnonzero(near) if k > 60])
    moving = numpy.linalg.norm(steel[1:] - steel[:-1], axis=1) / T
    elsewhere = ~near & (time_s > 0.5)
    lag = numpy.array([abs(sum(a * b for a, b in zip(p, s))) for p, s in zip(
        column([f"proxy_W_q{x}" for x in ("x", "y", "z", "w")]), column([f"true_tool_W_q{x}" for x in ("x", "y", "z", "w")]))])
    return {"off mm": 1e3 * off.max(), "slowest": moving[near[1:]].min() / speed, "speed": sent.max() / arm.cell.speed,
            "force": force[near].max() / max(2.0, force[elsewhere].max()), "lag rad": 2 * math.acos(min(1.0, lag[near].min()))}


def session(seed, folder, keep, arms):
    chance = random.Random(seed)
    folder.mkdir()
    name = chance.choice(sorted(arms))
    arm, far_m = arms[name], None
    for _ in range(200):
        way = [chance.gauss(0, 1) for _ in range(3)]
        way = [x / math.hypot(*way) for x in way]
        far_m = arm.crossing(way)
        if far_m is not None:
            break
    if far_m is None:
        return {"refused": "no way through the singularity found"}
    hand, ended_s, speed = made_hand(chance, way, far_m)
    (folder / "hand.yaml").write_text(hand)
    command = [os.environ["PROXARM_PROGRAM"], "run", str(arm.cell.file), "--scene", str(SOURCE / "scenes/free.yaml"), "--hand",
               str(folder / "hand.yaml"), "--mass", f"{chance.uniform(5, 10):.3g}", "--duration", f"{ended_s:.4g}s", "--no-plot",
               "--json", "--record", str(folder / "record")]
    (folder / "command").write_text(" ".join(command) + "\n")
    done = subprocess.run(command, cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=600)
    if done.returncode not in (0, 1) or not done.stdout:
        return {"refused": done.stderr.strip()[-150:]}
    summary = json.loads(done.stdout)
    out = {"cell": name, "wrong": [fault["fault"] for fault in summary["faults"]]}
    figures = judge(folder / "record", arm, speed)
    if figures is None:
        return {"refused": "the hand didn't lead it there"}
    out |= figures
    if out["off mm"] > 1e3 * PLACE_M:
        out["wrong"].append(f"{out['off mm']:.3g} mm off")
    if out["speed"] > 1.0:
        out["wrong"].append(f"{out['speed']:.3g} of the tool's speed")
    if out["force"] > 2.0:
        out["wrong"].append(f"{out['force']:.3g} times the force")
    if out["wrong"] and keep:
        shutil.copytree(folder, keep / str(seed).replace("/", "-"), dirs_exist_ok=True)
    return out


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sessions", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--keep", type=pathlib.Path)
    options = parser.parse_args()
    names = ("default", "cobot", "seven")
    with tempfile.TemporaryDirectory() as scratch, ThreadPoolExecutor(options.jobs) as pool:
        def run(n):
            folder = pathlib.Path(scratch) / str(n)
            try:
                return n, session(f"{options.seed}/{n}", folder, options.keep, {name: Arm(name) for name in names})
            finally:
                shutil.rmtree(folder, ignore_errors=True)
        results = list(pool.map(run, range(options.sessions)))
    ran = [(n, r) for n, r in results if "refused" not in r]
    print(f"{len(ran)} ways through a wrist's singularity, {len(results) - len(ran)} refused")
    for key in ("off mm", "speed", "force", "lag rad"):
        values = sorted((r[key], n) for n, r in ran)
        if values:
            print(f"  {key:8s} median {values[len(values) // 2][0]:.4g}, most {values[-1][0]:.4g} in session {values[-1][1]}")
    wrong = [(n, r) for n, r in ran if r["wrong"]]
    print(f"something was wrong in {len(wrong)} sessions")
    for n, r in wrong[:40]:
        print(f"  {n} ({r['cell']}): {'; '.join(r['wrong'])}")
    return 1 if wrong or not ran else 0


if __name__ == "__main__":
    sys.exit(main())
