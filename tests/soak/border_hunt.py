#!/usr/bin/python3
"""A border that a hand presses against and slides along: does it feel like a plane in the same place?

    PROXARM_PROGRAM=build/release/controller/proxarm tests/soak/border_hunt.py --sessions 200 --seed 1

Each session is run twice with the same hand: with a border of the cell, `workspace_m` or `keep_out_m`, and with a
frictionless plane of the scene where the border is. Judged by the records alone:
  calm       no oscillation that lasts
  beyond     the steel is at most 0.2 mm beyond the border
  pressing   the hand's force along the border's normal, once it has pressed for a second, is the plane's within 10 %
  sliding    so is the way along the border, and the hand's force along it
  no jam     the tool doesn't stand (slower than 1 mm/s for half a second) under more than 1 N along the border, while
             the plane's moves
  no fault
Masses that aren't stable with the hand are refused by the program, and counted. Status 1, and the session's files in
`--keep DIR`, where it isn't so.
"""
import json
import math
import pathlib
import random
import re
import sys
import tempfile

import hunting
from hunting import SOURCE, dot, log_uniform, minus

CELLS = ("default", "cobot", "seven", "rail", "gantry")
BEYOND_M, SHARE, STANDS_M_PER_S, STANDS_S, PULL_N = 2e-4, 0.1, 1e-3, 0.5, 1.0
# Below these, the tenth part is less than what the loop's delay or the sensor's noise makes of a session.
LEAST_N, LEAST_M = 1.0, 2e-3


def start_of(cell, folder):
    """Where the handle stands at the start."""
    hunting.run(SOURCE / f"models/cells/{cell}.yaml", SOURCE / "scenes/free.yaml", ["--duration", "0.1s"], folder / cell)
    return hunting.Record(folder / cell / "signals.csv").proxy[0]


def made_border(chance, start):
    """The normal towards where the tool may be, and the border's place: 0.6 to 40 mm from the start."""
    axis, sign = chance.randrange(3), chance.choice((-1, 1))
    gap = chance.choice((6e-4, chance.uniform(6e-4, 0.04)))
    normal = [sign * (i == axis) for i in range(3)]
    return axis, sign, normal, start[axis] - sign * gap


def made_limits(chance, axis, sign, place, start):
    """Lines of the cell's limits."""
    if chance.random() < 0.6:
        low, high = [x - 0.8 for x in start], [x + 0.8 for x in start]
        (low if sign > 0 else high)[axis] = place
        return f"  workspace_m: {{min: {[round(x, 6) for x in low]}, max: {[round(x, 6) for x in high]}}}\n"
    low, high = [x - 0.7 for x in start], [x + 0.7 for x in start]
    low[axis], high[axis] = (place - 0.3, place) if sign > 0 else (place, place + 0.3)
    return f"  keep_out_m: [{{min: {[round(x, 6) for x in low]}, max: {[round(x, 6) for x in high]}}}]\n"


def made_hand(chance, normal, gap, axis):
    stiffness, press_N = log_uniform(chance, 200, 1500), log_uniform(chance, 2, 60)
    depth = gap + press_N / stiffness
    angle, length = chance.uniform(0, 2 * math.pi), chance.uniform(0.03, 0.12)
    u, v = [i for i in range(3) if i != axis]
    along = [0.0, 0.0, 0.0]
    along[u], along[v] = length * math.cos(angle), length * math.sin(angle)
    slide_s = length / log_uniform(chance, 0.02, 0.2)
    points = [(0.5, 0, 0), (2.0, 1, 0), (3.0, 1, 0), (3.0 + slide_s, 1, 1), (3.0 + 3 * slide_s, 1, -1),
              (3.0 + 4 * slide_s, 1, 0)]
    mass = chance.uniform(0.5, 1.5)
    lines = ["name: along a border", f"mass_kg: {mass:.3g}", f"stiffness_N_per_m: {stiffness:.4g}",
             f"damping_Ns_per_m: {2 * math.sqrt(stiffness * 5) * chance.uniform(0.4, 1.0):.4g}", "waypoints:"]
    for time_s, deep, far in points:
        at = [-deep * depth * n + far * a for n, a in zip(normal, along)]
        lines.append(f"  - {{time_s: {time_s:.4g}, offset_m: [{', '.join(f'{x:.5g}' for x in at)}]}}")
    return "\n".join(lines) + "\n", points[-1][0]


def run(cell, scene, arguments, record):
    done = hunting.run(cell, scene, arguments, record)
    if done.returncode == 2:
        return None, done.stderr.strip()[-120:]
    return json.loads(done.stdout), hunting.Record(record / "signals.csv")


def mean(values):
    return sum(values) / max(1, len(values))


def figures_of(record, normal, place, axis):
    """Means over the time in which the hand slides, and how long the tool stood under a pull along the border."""
    T = record.time[1] - record.time[0]
    late = [k for k, t in enumerate(record.time) if t > 3.0]
    tangential = lambda x: [a * (1 - abs(n)) for a, n in zip(x, normal)]
    beyond = max(-(dot(normal, x) - place * normal[axis]) for x in record.steel)
    press = mean([abs(dot(normal, record.hand[k])) for k in late])
    pull = mean([math.hypot(*tangential(record.hand[k])) for k in late])
    way = sum(math.hypot(*tangential(minus(record.steel[k], record.steel[k - 10]))) for k in late[10::10])
    window, stands = round(STANDS_S / T), []
    for k in range(late[0] + window, len(record.time), 20):
        moved = math.hypot(*minus(record.steel[k], record.steel[k - window]))
        if moved < STANDS_M_PER_S * STANDS_S and min(
                math.hypot(*tangential(record.hand[j])) for j in range(k - window, k, 10)) > PULL_N:
            stands.append(record.time[k])
    return {"beyond mm": 1e3 * beyond, "press N": press, "pull N": pull, "way m": way, "stands": stands}


def session(seed, folder, starts):
    chance = random.Random(seed)
    folder.mkdir()
    name = chance.choice(CELLS)
    start = starts[name]
    axis, sign, normal, place = made_border(chance, start)
    limits = made_limits(chance, axis, sign, place, start)
    hand, ended_s = made_hand(chance, normal, abs(start[axis] - place), axis)
    (folder / "hand.yaml").write_text(hand)
    text = (SOURCE / f"models/cells/{name}.yaml").read_text()
    text = text.replace(": ../", f": {SOURCE}/models/")
    (folder / "plain.yaml").write_text(text)
    text = re.sub(r"^(  max_force_N:.*\n)", lambda m: m.group(1) + limits, text, count=1, flags=re.M)
    (folder / "cell.yaml").write_text(text)
    (folder / "plane.yaml").write_text(
        f"name: plane\nobjects:\n  - plane: {{name: border, point_m: {[round(place if i == axis else x, 6) for i, x in enumerate(start)]}, "
        f"normal: {normal}}}\n")
    arguments = ["--hand", str(folder / "hand.yaml"), "--timestep", f"{chance.choice((1, 1, 2, 4))}ms", "--mass",
                 f"{chance.choice((4, 10, 20))}", "--duration", f"{ended_s:.4g}s"]
    summary, border = run(folder / "cell.yaml", SOURCE / "scenes/free.yaml", arguments, folder / "border")
    if summary is None:
        return {"refused": border}
    other, plane = run(folder / "plain.yaml", folder / "plane.yaml", arguments, folder / "plane")
    if other is None:
        return {"refused": plane}
    if other["oscillation"]["lasts"] or other["faults"]:
        return {"refused": "the plane itself isn't calm"}
    wrong = [fault["fault"] for fault in summary["faults"]]
    figures = {"cell": name, "limits": limits.split(":")[0].strip()}
    if not wrong:
        a, b = (figures_of(record, normal, place, axis) for record in (border, plane))
        figures |= {"beyond mm": a["beyond mm"], "plane mm": b["beyond mm"]}
        for key, least, unit in (("press N", LEAST_N, "N"), ("pull N", LEAST_N, "N"), ("way m", LEAST_M, "m")):
            off = abs(a[key] - b[key]) / max(b[key], least / SHARE)
            figures[key.split()[0]] = off
            if off > SHARE:
                wrong.append(f"{key.split()[0]} {a[key]:.3g} {unit}, a plane's {b[key]:.3g}")
        if a["beyond mm"] > max(1e3 * BEYOND_M, b["beyond mm"]):
            wrong.append(f"{a['beyond mm']:.3g} mm beyond, a plane's {b['beyond mm']:.3g}")
        if a["stands"] and not b["stands"]:
            wrong.append(f"stands from {a['stands'][0] - STANDS_S:.3g} s on")
        if summary["oscillation"]["lasts"]:
            wrong.append("oscillates")
        if summary["guarded_cycles"] > 0:
            wrong.append(f"guard: {summary['guarded_cycles']} cycles")
    figures["wrong"] = wrong
    return figures


def main():
    given = hunting.options(__doc__)
    with tempfile.TemporaryDirectory() as scratch:
        starts = {name: start_of(name, pathlib.Path(scratch)) for name in CELLS}
    results = hunting.sessions(given, session, starts)
    return hunting.tell(results, ("beyond mm", "plane mm", "press", "pull", "way"), "",
                        lambda r: f"{r['cell']}, {r['limits']}")


if __name__ == "__main__":
    sys.exit(main())
