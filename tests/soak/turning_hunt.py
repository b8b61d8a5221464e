#!/usr/bin/python3
"""Random hands that lead and turn the tool at once, beyond the limits of turning: does what is sent keep them?

    PROXARM_PROGRAM=build/release/controller/proxarm tests/soak/turning_hunt.py --cycles 2000000 --seed 1

Judged by the records alone, with kinematics of the judge's own (tests/command_line/tool_motion.py), the gears' twist by
gravity taken off. Angles from the start, tilt, twist and turning speed of what is sent must keep the limits, but for the
rounding to counts. What the simulated steel does is told. A hand that pulls too hard ends its session, which is wrong
unless it does so without these limits, too. Status 1 and the session's files, in `--keep DIR`, where it isn't so.
"""
import json
import random
import sys

import numpy

import hunting
from hunting import SOURCE, log_uniform

sys.path.insert(0, str(SOURCE / "tests/command_line"))
import tool_motion  # noqa: E402

DURATION_S = 6.0
ANGLE_RAD = 1e-6
# A count at each end of a step, about 4e-8 rad for each of seven axes, at 1 ms.
COUNTS_RAD_PER_S = 3e-4


def made_cell(chance, name, folder):
    """A shipped cell with limits of turning, and these limits."""
    text = (SOURCE / f"models/cells/{name}.yaml").read_text()
    for kind in ("arms", "drives", "sensors"):
        text = text.replace(f"../{kind}/", f"{SOURCE}/models/{kind}/")
    limits = {"max_turn_rad": chance.choice((0.7, log_uniform(chance, 0.03, 0.7))), "max_turning_speed_rad_per_s": 2.0}
    if chance.random() < 0.3:
        limits["max_turning_speed_rad_per_s"] = log_uniform(chance, 0.1, 2.0)
    if chance.random() < 0.3:
        limits |= {"max_tilt_rad": log_uniform(chance, 0.03, 0.4), "max_twist_rad": log_uniform(chance, 0.03, 0.4)}
    lines = "".join(f"  {key}: {value:.6g}\n" for key, value in limits.items())
    (folder / "cell.yaml").write_text(text.replace("\nlimits:\n", f"\nlimits:\n{lines}", 1))
    (folder / "loose.yaml").write_text(text.replace("\nlimits:\n", "\nlimits:\n  max_turn_rad: 3\n", 1))
    return limits


def made_hand(chance):
    lines = ["name: leads and turns", f"mass_kg: {chance.uniform(0.5, 1.3):.3g}",
             f"stiffness_N_per_m: {chance.uniform(200, 800):.4g}", f"damping_Ns_per_m: {chance.uniform(15, 40):.3g}",
             "inertia_kg_m2: 0.003", f"turning_stiffness_Nm_per_rad: {chance.uniform(5, 30):.3g}",
             f"turning_damping_Nms_per_rad: {chance.uniform(0.3, 2):.3g}", "waypoints:",
             "  - {time_s: 0.3, offset_m: [0, 0, 0], turn_rad: [0, 0, 0]}"]
    time_s, far_m, far_rad = 0.3, chance.uniform(0.02, 0.25), chance.uniform(0.1, 0.6)
    while time_s < DURATION_S:
        time_s += chance.uniform(0.3, 1.5)
        place = ", ".join(f"{chance.gauss(0, far_m):.4f}" for _ in range(3))
        turn = ", ".join(f"{chance.gauss(0, far_rad):.4f}" for _ in range(3))
        lines.append(f"  - {{time_s: {time_s:.3f}, offset_m: [{place}], turn_rad: [{turn}]}}")
    return "\n".join(lines) + "\n"


def turned_tool(cell, motors):
    """The tool's orientations for columns of motors' angles, as arrays of 3 x 3 matrices."""
    chain = tool_motion.Chain(cell, numpy)
    handle = cell.tool
    ends = []
    for axis in (None, 0, 1, 2):
        cell.tool = handle if axis is None else tuple(x + (axis == i) for i, x in enumerate(handle))
        ends.append(numpy.array(chain.at_motors(motors)[0]))
    cell.tool = handle
    return numpy.stack([ends[k] - ends[0] for k in (1, 2, 3)], axis=1).transpose(2, 0, 1)


def angles_of(turns):
    """Of rotation matrices: by the sine below a right angle, which keeps the digits of small ones."""
    sines = numpy.linalg.norm(numpy.stack([turns[:, 2, 1] - turns[:, 1, 2], turns[:, 0, 2] - turns[:, 2, 0],
                                           turns[:, 1, 0] - turns[:, 0, 1]], axis=1), axis=1) / 2
    return numpy.arctan2(sines, (numpy.trace(turns, axis1=1, axis2=2) - 1) / 2)


def figures(turns, time_s):
    """The largest angle from the start, tilt and twist of the z axis, and speed."""
    from_start = numpy.einsum("ji,njk->nik", turns[0], turns)
    tilts = numpy.arctan2(numpy.hypot(from_start[:, 0, 2], from_start[:, 1, 2]), from_start[:, 2, 2])
    # R = S W with W about z: for a rotation vector's quaternion (w, z) the twist is 2 atan2(z, w).
    twists = numpy.abs(numpy.arctan2(from_start[:, 1, 0] - from_start[:, 0, 1], from_start[:, 0, 0] + from_start[:, 1, 1]))
    steps = angles_of(numpy.einsum("nij,nkj->nik", turns[1:], turns[:-1]))
    return {"max_turn_rad": angles_of(from_start).max(), "max_tilt_rad": tilts.max(), "max_twist_rad": twists.max(),
            "max_turning_speed_rad_per_s": (steps / numpy.diff(time_s)).max()}


def steel_turns(record):
    x, y, z, w = numpy.array(record.vectors("true_tool", "", ("qx", "qy", "qz", "qw"))).T
    return numpy.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]).transpose(2, 0, 1)


def session(seed, folder):
    chance = random.Random(seed)
    folder.mkdir()
    name = chance.choice(("default", "cobot", "seven"))
    limits = made_cell(chance, name, folder)
    (folder / "hand.yaml").write_text(made_hand(chance))
    period_ms = chance.choice((1, 1, 1, 2))
    arguments = ["--hand", folder / "hand.yaml", "--inertia", f"{chance.uniform(0.05, 0.15):.3g}", "--mass",
                 f"{chance.uniform(5, 12):.3g}", "--timestep", f"{period_ms}ms", "--duration", f"{DURATION_S}s"]
    done = hunting.run(folder / "cell.yaml", SOURCE / "scenes/free.yaml", arguments, folder / "record")
    if done.returncode not in (0, 1) or not done.stdout:
        return {"refused": done.stderr.strip()[-150:]}
    summary = json.loads(done.stdout)
    cell = tool_motion.Cell(folder / "cell.yaml")
    record = hunting.Record(folder / "record/signals.csv")
    time_s = numpy.array(record.time)
    motors = [numpy.array([cell.angle(i, counts) for counts in record.column(f"{joint}_target_counts")])
              for i, joint in enumerate(cell.joints)]
    sent, steel = figures(turned_tool(cell, motors), time_s), figures(steel_turns(record), time_s)
    faults, hands = {fault["fault"] for fault in summary["faults"]}, set()
    if faults:
        loose = hunting.run(folder / "loose.yaml", SOURCE / "scenes/free.yaml", arguments, folder / "loose")
        hands = {fault["fault"] for fault in json.loads(loose.stdout)["faults"]} & {"force_excessive"}
    wrong = sorted(faults - hands)
    for key, limit in limits.items():
        more = COUNTS_RAD_PER_S / period_ms if "speed" in key else ANGLE_RAD
        if sent[key] > limit + more:
            wrong.append(f"sent {key} {sent[key]:.6g} of {limit:.6g}")
    out = {"cell": name, "cycles": len(time_s), "wrong": wrong, "pulled": bool(faults & hands),
           "guarded": summary["guarded_cycles"],
           "lasts": summary["oscillation"]["lasts"]}
    out |= {f"{what} {key}": figure[key] - limit for key, limit in limits.items()
            for what, figure in (("sent", sent), ("steel", steel))}
    return out


def main():
    results = hunting.sessions(hunting.options(__doc__, cycles=100_000), session)
    ran = [r for _, r in results if "refused" not in r]
    words = (f"; {sum(r['cycles'] for r in ran)} cycles, the last guard acted in {sum(r['guarded'] for r in ran)} of "
             f"{sum(bool(r['guarded']) for r in ran)} sessions; {sum(bool(r['lasts']) for r in ran)} oscillated for long; "
             f"{sum(r['pulled'] for r in ran)} ended by a hand that pulls too hard without these limits, too")
    beyond = sorted({key for r in ran for key in r if key.startswith(("sent", "steel"))})
    return hunting.tell(results, beyond, words)


if __name__ == "__main__":
    sys.exit(main())
