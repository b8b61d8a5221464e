#!/usr/bin/python3
"""Random hands that lean, rest, tremble, hit a wall with the tool, hang a bag on it and let go: is any of them stopped
for something that it isn't? And does a constant force move the mass that it should?

    PROXARM_PROGRAM=build/release/controller/proxarm tests/soak/handle_hunt.py --sessions 1000 --seed 1

Judged by the records alone:
  no fault    whatever the hand does: the sensor is fine, and somebody is there
  let go      the tool goes on by at most 0.1 m where the hand lets go of it
  a push      a constant force F from rest, of 0.1 to 2 s and at most 0.25 m and 0.35 m/s, accelerates the proxy by F/M
              within 2 %, along F: fitted to its way from a tenth of that time on, beside how it coasted before, with the
              delay as a second unknown, until a limit acts
  nobody      the tool stays within 2 mm for a minute
Masses that aren't stable with a hand are refused by the program, and counted. Oscillations are told: they aren't judged
here. Status 1, and the session's files in `--keep DIR`, where it isn't so.
"""
import json
import math
import random
import sys

import hunting
from hunting import SOURCE, direction, log_uniform

CELLS = ("default", "cobot", "seven", "scara", "gantry", "rail", "linear")
ALONG = {"linear": (1.0, 0.0, 0.0)}  # where the tool moves on a line alone
# What these hands let go stops within 0.1 m: they lead at up to 0.3 m/s. A gantry's and a rail's own swing after a
# jerk is more than the force below which nobody is there: they coast on until it is gone, which is told.
CALM = ("default", "cobot", "seven", "scara")
LET_GO_M, PUSH_SHARE, NOBODY_M = 0.1, 0.02, 2e-3
PUSH_MOST_M, PUSH_MOST_M_PER_S = 0.25, 0.35
LEFT_KG = 0.05  # a simulated hand that lets go leaves its mass at the handle, and a real one doesn't


def hand_text(name, mass, stiffness, damping, points, released_s=None):
    lines = [f"name: {name}", f"mass_kg: {mass:.3g}", f"stiffness_N_per_m: {stiffness:.4g}",
             f"damping_Ns_per_m: {damping:.4g}", "waypoints:"]
    lines += [f"  - {{time_s: {t:.5g}, offset_m: [{', '.join(f'{x:.7g}' for x in p)}]}}" for t, p in points]
    if released_s is not None:
        lines += ["grips:", f"  - {{time_s: {released_s:.4g}, stiffness_N_per_m: 0, damping_Ns_per_m: 0}}"]
    return "\n".join(lines) + "\n"


def force_text(folder, forces):
    rows = ["time_s,x_N,y_N,z_N"] + [f"{t:.6g},{','.join(f'{x:.6g}' for x in f)}" for t, f in forces]
    (folder / "force.csv").write_text("\n".join(rows) + "\n")
    return "name: a force\nmass_kg: 0\nforce: force.csv\n"


def way_of(chance, cell):
    return list(ALONG[cell]) if cell in ALONG else direction(chance)


def arm_of_a_person(chance):
    """Mass, stiffness and damping."""
    mass, stiffness = chance.uniform(0.3, 1.5), log_uniform(chance, 150, 1000)
    return mass, stiffness, 2 * math.sqrt(stiffness * mass) * chance.uniform(0.4, 1.0)


def led(chance, cell, kind):
    """Waypoints of a hand that is led, rests, or trembles; what it is let go at, and how long it takes."""
    way, time_s, points = way_of(chance, cell), 0.5, [(0.5, (0.0, 0.0, 0.0))]
    reach, speed = chance.uniform(0.02, 0.15), log_uniform(chance, 0.02, 0.3)
    if kind == "rests":
        reach = 0.0
    if kind in ("leans", "hits"):  # the wall of scenes/wall.yaml, some 0.2 m in x from the start
        way, reach = [1.0, 0.0, 0.0], chance.uniform(0.21, 0.27)
        speed = log_uniform(chance, 0.03, 0.15) if kind == "leans" else chance.uniform(0.25, 0.45)
    arrives_s = time_s + reach / speed
    ends_s = arrives_s + chance.uniform(0.5, 4.0)
    if kind == "trembles":
        amplitude, rate = log_uniform(chance, 1e-4, 1e-3), chance.uniform(5.0, 12.0)
        across = way_of(chance, cell)
        steps = int((ends_s - time_s) * 200)
        for k in range(1, steps):
            t = time_s + k / 200
            share = min(1.0, (t - time_s) / (arrives_s - time_s))
            shake = amplitude * math.sin(2 * math.pi * rate * (t - time_s))
            points.append((t, [share * reach * a + shake * b for a, b in zip(way, across)]))
    elif reach > 0.0:
        points.append((arrives_s, [reach * x for x in way]))
        if kind == "hits":  # and away, and once more
            for share in (0.5, 1.0, 0.0):
                arrives_s += 0.6 * reach / speed + 0.05
                points.append((arrives_s, [share * reach * x for x in way]))
            ends_s = arrives_s + 0.5
    released_s = ends_s if chance.random() < 0.5 else None
    mass, stiffness, damping = arm_of_a_person(chance)
    if released_s is not None:
        mass = min(mass, LEFT_KG)
    return hand_text(kind, mass, stiffness, damping, points, released_s), released_s, ends_s + 1.5


def pushed(chance, cell, folder):
    """A constant force from rest."""
    mass, lasts_s = log_uniform(chance, 2, 20), log_uniform(chance, 0.1, 2.0)
    most = mass * min(2 * PUSH_MOST_M / lasts_s**2, PUSH_MOST_M_PER_S / lasts_s)
    force, way, from_s = min(50.0, log_uniform(chance, 0.5, max(0.51, most)), most), way_of(chance, cell), chance.uniform(0.8, 1.5)
    F = [force * x for x in way]
    text = force_text(folder, [(0, [0] * 3), (from_s - 1e-4, [0] * 3), (from_s, F), (from_s + lasts_s, F),
                               (from_s + lasts_s + 1e-4, [0] * 3), (from_s + lasts_s + 1.0, [0] * 3)])
    return text, mass, F, from_s, lasts_s


def hung(chance, folder):
    """A bag of 0.3 to 2 kg, hung on within a second and taken off again."""
    weight, from_s, on_s = 9.81 * log_uniform(chance, 0.3, 2.0), 0.8, chance.uniform(0.1, 1.0)
    held_s = chance.uniform(0.3, 0.8)
    F, none = [0.0, 0.0, -weight], [0.0] * 3
    return force_text(folder, [(0, none), (from_s, none), (from_s + on_s, F), (from_s + on_s + held_s, F),
                               (from_s + 2 * on_s + held_s, none), (from_s + 2 * on_s + held_s + 2, none)]), \
        from_s + 2 * on_s + held_s + 1.5


def limited_s(record):
    """When a limit acts first."""
    return next((t for t, flags in zip(record.time, record.flags) if any("limit" in flag for flag in flags)), math.inf)


def gone_on(record, released_s):
    """How far the steel goes on from where it is let go."""
    after = [p for t, p in zip(record.time, record.steel) if t >= released_s]
    return max(math.dist(p, after[0]) for p in after)


def acceleration(record, F, from_s, lasts_s):
    """Of the fit ½ a (t − t0)² to the way along F, while it acts: √way is a straight line."""
    size = math.hypot(*F)
    until_s = min(from_s + lasts_s, limited_s(record))
    # What the tare doesn't know of the sensor's zero has led it before, by less than what `nobody` bounds.
    (t0, early), (t1, start) = (next((t, p) for t, p in zip(record.time, record.proxy) if t >= from_s - before_s)
                                for before_s in (0.06, 0.01))
    coasts = [(b - a) / (t1 - t0) for a, b in zip(early, start)]
    points = [(t, sum((a - b - v * (t - t1)) * f for a, b, v, f in zip(p, start, coasts, F)) / size)
              for t, p in zip(record.time, record.proxy)
              if from_s + max(0.1 * lasts_s, 0.03) < t < until_s]
    rows = [(t, math.sqrt(2 * x), x) for t, x in points if x > 0.0]
    if len(rows) < 5:
        return None if until_s < from_s + lasts_s else 0.0
    # Weighted by the way itself: what is read of it is as exact everywhere.
    w = [x for _, _, x in rows]
    mean_t = sum(a * t for a, (t, _, _) in zip(w, rows)) / sum(w)
    mean_r = sum(a * r for a, (_, r, _) in zip(w, rows)) / sum(w)
    slope = sum(a * (t - mean_t) * (r - mean_r) for a, (t, r, _) in zip(w, rows)) / \
        sum(a * (t - mean_t) ** 2 for a, (t, _, _) in zip(w, rows))
    return slope**2


def session(seed, folder):
    chance = random.Random(seed)
    folder.mkdir()
    cell = chance.choice(CELLS)
    kind = chance.choice(("leans", "rests", "trembles", "hits", "hangs a bag", "is led", "pushes", "pushes", "is nobody"))
    scene = {"linear": "line"}.get(cell, "wall") if kind in ("leans", "hits") else "free"
    arguments, released_s = [], None
    if kind == "pushes":
        text, mass, F, from_s, lasts_s = pushed(chance, cell, folder)
        ended_s = from_s + lasts_s + 0.5
        arguments += ["--mass", f"{mass:.4g}", "--damping", "0"]
    elif kind == "hangs a bag":
        text, ended_s = hung(chance, folder)
    elif kind == "is nobody":
        text, ended_s = hand_text(kind, 0, 0, 0, [(0.3, (0, 0, 0))]), 60.0
    else:
        text, released_s, ended_s = led(chance, cell, kind)
    (folder / "hand.yaml").write_text(text)
    done = hunting.run(SOURCE / f"models/cells/{cell}.yaml", SOURCE / f"scenes/{scene}.yaml",
                       [*arguments, "--hand", folder / "hand.yaml", "--duration", f"{ended_s:.4g}s"], folder / "record")
    if done.returncode == 2 or not done.stdout:
        return {"refused": f"{cell}, {kind}: {done.stderr.strip()[:120]}"}
    summary, record = json.loads(done.stdout), hunting.Record(folder / "record/signals.csv")
    out = {"cell": f"{cell}, {kind}", "wrong": [fault["fault"] for fault in summary["faults"]]}
    oscillation = summary["oscillation"]
    out["oscillates"] = bool(oscillation and oscillation["lasts"])
    if released_s is not None and not out["wrong"]:
        figure = "let go mm" if cell in CALM else "of others mm"
        out[figure] = 1e3 * gone_on(record, released_s)
        if out.get("let go mm", 0.0) > 1e3 * LET_GO_M:
            out["wrong"].append(f"{out['let go mm']:.3g} mm after letting go")
    if kind == "pushes" and not out["wrong"]:
        found, wanted = acceleration(record, F, from_s, lasts_s), math.hypot(*F) / mass
        if found is None:
            return {"refused": f"{cell}, {kind}: a limit acts at once"}
        out["push off %"] = 100 * abs(found / wanted - 1)
        if out["push off %"] > 100 * PUSH_SHARE:
            out["wrong"].append(f"{out['push off %']:.3g} % off F/M ({math.hypot(*F):.3g} N, {lasts_s:.2g} s, {mass:.3g} kg)")
    if kind == "is nobody":
        out["nobody mm"] = 1e3 * max(math.dist(p, record.steel[0]) for p in record.steel)
        if out["nobody mm"] > 1e3 * NOBODY_M:
            out["wrong"].append(f"{out['nobody mm']:.3g} mm with nobody there")
    return out


def main():
    results = hunting.sessions(hunting.options(__doc__), session)
    words = f"; {sum(bool(r.get('oscillates')) for _, r in results)} oscillate for long"
    return hunting.tell(results, ("let go mm", "of others mm", "push off %", "nobody mm"), words)


if __name__ == "__main__":
    sys.exit(main())
