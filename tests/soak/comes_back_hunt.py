#!/usr/bin/python3
"""Random hands that lead the tool out and back, mostly further than the arm reaches: does it come back, and never go
against the hand?

    PROXARM_PROGRAM=build/release/controller/proxarm tests/soak/comes_back_hunt.py --sessions 10000 --seed 1

Judged by the records alone, with what a person holding the handle would notice:
  comes back         1 s after the hand's way has ended at the start (later where a heavy proxy swings on the hand's
                     spring), the steel is within 1 mm of it, beside what the hand's spring leaves under the force that
                     the hand feels
  never against it   the hand's work and the change of the proxy's kinetic energy, over any time from the start on, never
                     fall below −1 mJ − 0.1 % of the work done, but for what the loop's delay L gives: M L ∫|a|² dt
  nothing else       no fault, and nothing that the last guard held back
Sessions whose mass isn't stable with their hand, at the start or where it leads to, aren't judged. Nor is where the tool
ends, if a joint is at the end of its range then, since the straight way back may lead through the arm's base; or if the
arm oscillated for long, since the damping that ends a swing slows the way back. Both are counted. Status 1, and the
session's files in `--keep DIR`, where it isn't so.
"""
import json
import math
import random
import sys

import hunting
from hunting import SOURCE, direction, dot, log_uniform, minus

CELLS = ("default", "cobot", "seven", "rail", "scara", "gantry", "linear")
NEAR_M = 1e-3
LEAST_J, SHARE = 1e-3, 1e-3


def made_hand(chance, least_N, strongest_N):
    """The text of a hand, when its way has ended, its largest force, and its damping."""
    stiffness, most_N = log_uniform(chance, 100, 3000), log_uniform(chance, min(least_N, strongest_N), strongest_N)
    way = direction(chance)
    reach = min(1.5, 0.3 + log_uniform(chance, 0.05, 1.2))
    # Slower than the tool's limit of 0.5 m/s.
    out_s, stay_s, back_s = (reach / chance.uniform(0.1, 0.4), chance.uniform(0.0, 1.5),
                             reach / chance.uniform(0.1, 0.35))
    points = [(0.5, 0.0), (0.5 + out_s, 1.0), (0.5 + out_s + stay_s, 1.0), (0.5 + out_s + stay_s + back_s, 0.0)]
    lines = ["name: out and back", f"mass_kg: {chance.uniform(0.3, 1.5):.3g}", f"stiffness_N_per_m: {stiffness:.4g}",
             f"damping_Ns_per_m: {2 * math.sqrt(stiffness) * chance.uniform(0.6, 1.2) * 2:.4g}", f"max_force_N: {most_N:.4g}",
             "waypoints:"]
    aside = direction(chance)
    for time_s, share in points:
        bent = 0.05 * math.sin(math.pi * share) if 0 < share < 1 else (0.1 if share == 1.0 else 0.0)
        at = [share * reach * x + bent * y for x, y in zip(way, aside)]
        lines.append(f"  - {{time_s: {time_s:.4g}, offset_m: [{', '.join(f'{x:.5g}' for x in at)}]}}")
    return "\n".join(lines) + "\n", points[-1][0], most_N, float(lines[3].split()[1])


def least_mass_kg(cell):
    """Of shipped cells 4 kg, of others the one that they advise."""
    return 4.0 if SOURCE in cell.parents else number_in(cell.read_text(), "default_mass_kg", 4.0)


def made_arguments(chance, cell, most_N):
    least_kg = least_mass_kg(cell)
    most_kg = max(1.025 * least_kg, min(20.0, most_N / 2))  # led by 2 m/s² at least
    arguments = ["--timestep", f"{chance.choice((1, 1, 2, 4))}ms", "--mass", f"{log_uniform(chance, least_kg, most_kg):.4g}"]
    if SOURCE not in cell.parents or cell.stem in ("default", "cobot", "seven"):
        arguments += ["--orientation", chance.choice(("held", "held", "free"))]
    if chance.random() < 0.4:
        arguments += ["--lookahead", "auto"]
    return arguments


def number_in(text, key, otherwise):
    """Of a cell's text: the number after this key."""
    for line in text.splitlines():
        if line.strip().startswith(f"{key}:"):
            return float(line.split(":")[1].split("#")[0])
    return otherwise


def delay_s(cell, period_s):
    """Of the loop: the setpoints' filter, 2/omega, and four cycles of bus, sensor and drives."""
    return 1.0 / (math.pi * number_in(cell.read_text(), "setpoint_bandwidth_Hz", 25.0)) + 4 * period_s


def against_the_hand(record, mass_kg, delay_s):
    """By how many joules the hand was led beyond what is allowed, at most.

    A loop that is late by L takes M v·a L out of the balance for as long as it accelerates, and M L ∫|a|² dt for good."""
    work = done = given = 0.0
    worst, window = 0.0, []
    for k in range(2, len(record.time)):
        T = record.time[k] - record.time[k - 1]
        moved = minus(record.steel[k], record.steel[k - 1])
        step = dot([0.5 * (x + y) for x, y in zip(record.hand[k], record.hand[k - 1])], moved)
        work += step
        done += abs(step)
        v, v1 = ([x / T for x in minus(record.steel[j], record.steel[j - 1])] for j in (k, k - 1))
        a = [x / T for x in minus(v, v1)]
        given += mass_kg * delay_s * dot(a, a) * T
        window = window[-round(delay_s / T):] + [math.hypot(*v) * math.hypot(*a)]
        late = mass_kg * delay_s * max(window)
        kinetic = 0.5 * mass_kg * dot(v, v)
        worst = max(worst, -(work - kinetic) - LEAST_J - SHARE * done - given - late)
    return worst


def session(seed, folder, cells, strongest_N):
    chance = random.Random(seed)
    folder.mkdir()
    cell = chance.choice(cells)
    least_N = 5.0 if SOURCE in cell.parents else max(5.0, min(100.0, 2.0 * least_mass_kg(cell)))
    hand, ended_s, most_N, damping = made_hand(chance, least_N, strongest_N)
    (folder / "hand.yaml").write_text(hand)
    arguments = made_arguments(chance, cell, most_N)
    # A mass on the hand's spring swings on without any limit: it falls to 1e-4 of a metre in 9 of its time constants.
    settles_s = max(1.2, 9 * 2 * (float(arguments[3]) + 1.5) / damping)
    done = hunting.run(cell, SOURCE / "scenes/free.yaml",
                       ["--hand", folder / "hand.yaml", *arguments, "--duration", f"{ended_s + settles_s:.4g}s"],
                       folder / "record")
    if "isn't stable with this hand" in done.stderr:
        return {"refused": "not stable where it is led"}
    if done.returncode == 2:
        return {"refused": done.stderr.strip().splitlines()[-1][:120] if done.stderr.strip() else "no reason"}
    summary = json.loads(done.stdout)
    record = hunting.Record(folder / "record/signals.csv")
    wrong = [fault["fault"] for fault in summary["faults"]]
    figures = {"cell": cell.stem if SOURCE in cell.parents else cell.parent.name}
    if not wrong:
        stiffness = float(hand.split("stiffness_N_per_m: ")[1].split()[0])
        start = record.steel[0]
        off = math.hypot(*minus(record.steel[-1], start))
        figures["off mm"] = 1e3 * max(0.0, off - math.hypot(*record.hand[-1]) / stiffness)
        figures["against mJ"] = 1e3 * against_the_hand(record, float(arguments[3]), delay_s(cell, float(arguments[1][:-2]) / 1e3))
        figures["far m"] = max(math.hypot(*minus(x, start)) for x in record.steel)
        figures["push J"] = summary["limits_push_J"]
        figures["cornered"] = any("limit_joint" in flags for flags in record.flags[-100:])
        slowed = summary["oscillation"]["lasts"]
        if figures["off mm"] > 1e3 * NEAR_M and not figures["cornered"] and not slowed:
            wrong.append(f"{figures['off mm']:.3g} mm off")
        if figures["against mJ"] > 0.0 and not slowed:
            wrong.append(f"{figures['against mJ']:.3g} mJ against the hand")
        if summary["guarded_cycles"] > 0:
            wrong.append(f"the last guard acted in {summary['guarded_cycles']} cycles")
        if slowed:
            figures["oscillates"] = 1.0
    figures["wrong"] = wrong
    return figures


def main():
    given = hunting.options(__doc__, cells=CELLS)
    results = hunting.sessions(given, session, given.cell, given.strongest_N)
    words = (f"; oscillating for long: {sum('oscillates' in r for _, r in results)}; at the end of a joint's range at last: "
             f"{sum(bool(r.get('cornered')) for _, r in results)}")
    return hunting.tell(results, ("off mm", "against mJ", "push J", "far m"), words)


if __name__ == "__main__":
    sys.exit(main())
