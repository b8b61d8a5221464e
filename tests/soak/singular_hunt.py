#!/usr/bin/python3
"""Ways through and along a wrist's singularity, led with the orientation held: does the place go on, and does the hand
feel it?

    PROXARM_PROGRAM=build/release/controller/proxarm tests/soak/singular_hunt.py --sessions 1000 --seed 1

The ways are found with kinematics of the judge's own: straight ones from the start, along which the fifth joint of six,
or the sixth of seven, goes through zero or comes nearer to it than 0.05 rad. The hand leads along each, past the
singularity and back, at 0.05 to 0.24 m/s, which is 0.45 m/s in the middle: a faster hand pulls at the tool's speed limit,
singular or not. Judged by the records alone, while the joint is within 0.1 rad of zero:
  place        the tool is within 0.5 mm of the proxy's way, beside what the hand's force bends the gears by: in
               proportion to the force, as elsewhere on the way
  no stop      no fault; nor does the tool stand while the hand pulls with more than 5 N for 0.2 s
  speeds       of the tool, as sent, within the limit
  force        below twice the largest of the same session elsewhere on the way
Told, not judged: how far the orientation lags. Status 1, and the session's files in `--keep DIR`, where it isn't so.
"""
import json
import math
import random
import sys

import numpy

import hunting
from hunting import SOURCE

sys.path.insert(0, str(SOURCE / "tests/command_line"))
import tool_motion  # noqa: E402

CELLS = ("default", "cobot", "seven")
NEAR_RAD, ALONG_RAD = 0.1, 0.05
PLACE_M = 5e-4
STANDS_M_PER_S, PULL_N = 2e-3, 5.0  # for 0.2 s
STEP_M, MOST_STEPS, PAST_M = 0.005, 160, 0.1
SETTLED_S = 0.3  # after the way begins


class Arm:
    """Inverse kinematics of a shipped cell with the orientation of the start, for many ways at once."""

    def __init__(self, name):
        self.cell = tool_motion.Cell(SOURCE / f"models/cells/{name}.yaml")
        self.joints = tool_motion.Chain(self.cell).joints
        text = self.cell.file.read_text()
        self.start = numpy.array([float(x) for x in text.split("start_rad: [")[1].split("]")[0].split(",")])
        self.low, self.high = numpy.array([[float(x) for x in drive["range_rad"].strip("[]").split(",")]
                                           for drive in self.cell.drives]).T
        self.wrist = len(self.start) - 2
        self.home, self.R, _ = self.pose(self.start[None])

    def pose(self, q):
        """Places (n, 3), orientations (n, 3, 3) and Jacobians (n, 6, joints) for rows of joint angles."""
        n = len(q)
        R, p, axes = numpy.broadcast_to(numpy.eye(3), (n, 3, 3)), numpy.zeros((n, 3)), {}
        for joint in self.joints:
            p = p + R @ numpy.array(joint["at"])
            R = R @ numpy.array(joint["R"])
            if joint["axis"] is None:
                continue
            a = numpy.array(joint["axis"])
            axes[joint["drive"]] = (R @ a, p)
            K = numpy.cross(numpy.eye(3), a)
            angle = q[:, joint["drive"], None, None]
            R = R @ (numpy.eye(3) + numpy.sin(angle) * K + (1 - numpy.cos(angle)) * (K @ K))
        p = p + R @ numpy.array(self.cell.tool)
        J = numpy.zeros((n, 6, q.shape[1]))
        for drive, (axis, at) in axes.items():
            J[:, :3, drive] = numpy.cross(axis, p - at)
            J[:, 3:, drive] = axis
        return p, R, J

    def solve(self, q, place):
        for _ in range(6):
            p, R, J = self.pose(q)
            off = R @ numpy.swapaxes(self.R, 1, 2)
            turn = 0.5 * numpy.stack([off[:, 2, 1] - off[:, 1, 2], off[:, 0, 2] - off[:, 2, 0], off[:, 1, 0] - off[:, 0, 1]], 1)
            wanted = numpy.concatenate([place - p, -turn], 1)
            A = numpy.swapaxes(J, 1, 2) @ J + 1e-8 * numpy.eye(q.shape[1])
            q = q + numpy.linalg.solve(A, (numpy.swapaxes(J, 1, 2) @ wanted[:, :, None]))[:, :, 0]
        return q, numpy.abs(wanted).max(1) < 1e-4

    def ways(self, count, seed):
        """Directions along which the wrist comes to its singularity, and after how many metres."""
        chance = numpy.random.default_rng(seed)
        way = chance.normal(size=(count, 3))
        way /= numpy.linalg.norm(way, axis=1)[:, None]
        q, alive, found, reached = numpy.repeat(self.start[None], count, 0), numpy.ones(count, bool), {}, numpy.zeros(count)
        for k in range(1, MOST_STEPS):
            after, solved = self.solve(q, self.home + k * STEP_M * way)
            crossed = after[:, self.wrist] * q[:, self.wrist] < 0.0
            grazed = numpy.abs(after[:, self.wrist]) < ALONG_RAD
            alive &= solved & ((after > self.low + 0.1) & (after < self.high - 0.1)).all(1)
            for i in numpy.flatnonzero(alive & (crossed | grazed)):
                found.setdefault(int(i), k * STEP_M)
            reached = numpy.where(alive, k * STEP_M, reached)
            q = after
        return [(way[i], far_m) for i, far_m in found.items() if reached[i] > far_m + PAST_M + 0.01]


def made_hand(chance, way, far_m):
    speed = math.exp(chance.uniform(math.log(0.05), math.log(0.24)))
    reach = far_m + PAST_M
    ends_s = 0.5 + reach / speed
    lines = ["name: through the wrist", "mass_kg: 1", f"stiffness_N_per_m: {chance.uniform(300, 1500):.4g}",
             "damping_Ns_per_m: 40", "waypoints:", "  - {time_s: 0.5, offset_m: [0, 0, 0]}"]
    for time_s, share in ((ends_s, 1.0), (ends_s + 0.3, 1.0), (ends_s + 0.3 + reach / speed, 0.0)):
        lines.append(f"  - {{time_s: {time_s:.3f}, offset_m: [{', '.join(f'{share * reach * x:.5f}' for x in way)}]}}")
    return "\n".join(lines) + "\n", ends_s + 0.5 + reach / speed


def distances_to_way(points, way):
    """From each point to the nearest of the way's segments within 60 rows."""
    best = numpy.full(len(points), numpy.inf)
    for late in range(-60, 60):
        a, b = numpy.roll(way, late, axis=0), numpy.roll(way, late + 1, axis=0)
        along = a - b
        share = numpy.clip((along * (points - b)).sum(1) / numpy.maximum(1e-30, (along * along).sum(1)), 0, 1)
        best = numpy.minimum(best, numpy.linalg.norm(points - b - share[:, None] * along, axis=1))
    return best


def judge(record, arm):
    record = hunting.Record(record / "signals.csv")
    time_s = numpy.array(record.time)
    proxy, steel, force = numpy.array(record.proxy), numpy.array(record.steel), numpy.linalg.norm(record.hand, axis=1)
    wrist = numpy.array(record.column(f"{arm.cell.joints[arm.wrist]}_target_rad"))
    T = time_s[1] - time_s[0]
    near = (numpy.abs(wrist) < NEAR_RAD) & (time_s > 0.5 + SETTLED_S)
    if not near.any():
        return None
    sent = numpy.linalg.norm(numpy.diff(proxy, axis=0), axis=1) / T
    off, inner = distances_to_way(steel, proxy), numpy.arange(len(steel))
    inner = (inner > 60) & (inner < len(off) - 60)
    pulls = ~near & inner & (time_s > 0.5) & (force > max(PULL_N, 0.5 * force.max()))
    off = (off - force * (off[pulls] / force[pulls]).max(initial=0.0))[near & inner].max(initial=0.0)
    window = max(1, int(0.2 / T))
    way = numpy.cumsum(numpy.linalg.norm(numpy.diff(steel, axis=0, prepend=steel[:1]), axis=1))
    moved = (way[window:] - way[:-window]) / (window * T)
    pulled = numpy.lib.stride_tricks.sliding_window_view(force, window).min(1)
    stands = ((moved < STANDS_M_PER_S) & (pulled[:len(moved)] > PULL_N) & near[window:]).sum() * T
    elsewhere = ~near & (time_s > 0.5)
    four = lambda name: numpy.array(record.vectors(name, "", ("qx", "qy", "qz", "qw")))
    lag = 2 * numpy.arccos(numpy.minimum(1.0, numpy.abs((four("proxy") * four("true_tool")).sum(1))))
    return {"off mm": 1e3 * off, "stands s": stands,
            "speed": sent.max() / arm.cell.speed, "force": force[near].max() / max(2.0, force[elsewhere].max()),
            "lag rad": lag[near].max()}


def session(seed, folder, arms):
    chance = random.Random(seed)
    folder.mkdir()
    name = chance.choice(sorted(arms))
    arm, ways = arms[name]
    way, far_m = chance.choice(ways)
    hand, ended_s = made_hand(chance, way, far_m)
    (folder / "hand.yaml").write_text(hand)
    done = hunting.run(arm.cell.file, SOURCE / "scenes/free.yaml",
                       ["--hand", folder / "hand.yaml", "--mass", f"{chance.uniform(5, 10):.3g}", "--timestep",
                        f"{chance.choice((1, 1, 2))}ms", "--duration", f"{ended_s:.4g}s"], folder / "record")
    if done.returncode not in (0, 1) or not done.stdout:
        return {"refused": done.stderr.strip()[-150:]}
    summary = json.loads(done.stdout)
    out = {"cell": name, "wrong": [fault["fault"] for fault in summary["faults"]]}
    figures = judge(folder / "record", arm)
    if figures is None:
        return {"refused": "the hand didn't lead it there"}
    out |= figures
    if out["off mm"] > 1e3 * PLACE_M:
        out["wrong"].append(f"{out['off mm']:.3g} mm off the way")
    if out["stands s"] > 0.0:
        out["wrong"].append(f"stands for {out['stands s']:.2g} s")
    if out["speed"] > 1.0 + 1e-9:
        out["wrong"].append(f"{out['speed']:.6g} of the tool's speed")
    if out["force"] > 2.0:
        out["wrong"].append(f"{out['force']:.3g} times the force")
    if summary["oscillation"]["lasts"]:
        out["oscillates"] = 1.0
    if summary["guarded_cycles"] > 0:
        out["wrong"].append(f"guard: {summary['guarded_cycles']} cycles")
    return out


def main():
    given = hunting.options(__doc__)
    arms = {arm.cell.file.stem: (arm, arm.ways(500, given.seed)) for arm in map(Arm, CELLS)}
    results = hunting.sessions(given, session, arms)
    words = f"; {sum('oscillates' in r for _, r in results)} oscillate for long"
    return hunting.tell(results, ("off mm", "stands s", "speed", "force", "lag rad"), words)


if __name__ == "__main__":
    sys.exit(main())
