#!/usr/bin/python3
"""Devices that take torques and weigh something else than their cell says, or are let go of under load: do they stay?

    PROXARM_PROGRAM=build/release/controller/proxarm tests/soak/torque_weights_hunt.py --sessions 300 --seed 1

The simulated device has links of 0.8 to 1.2 of the masses that its controller knows, and a tool of up to 0.5 kg more or
less. Nobody holds it, or a hand leads it to somewhere and lets go, also from a wall and with a soft virtual coupling.
Judged by the simulated steel alone:
  nobody   refused before rendering, or within 10 mm of the start for eight seconds; nothing moves before that either
  let go   by at most 50 mm from where the hand lets go of it and below 0.3 m/s, beside what the coupling gives back:
           it was pressed in by F/K, and comes out by that much
Status 1, and the session's files in `--keep DIR`, where it isn't so.
"""
import collections
import json
import math
import random
import sys
import xml.etree.ElementTree

import hunting
from hunting import SOURCE, direction, log_uniform

NOBODY_M, LET_GO_M, LET_GO_M_PER_S = 10e-3, 50e-3, 0.3
NOBODY = "name: nobody\nmass_kg: 0\nstiffness_N_per_m: 0\ndamping_Ns_per_m: 0\nwaypoints:\n" \
         "  - {time_s: 0.3, offset_m: [0, 0, 0]}\n"
REFUSED = ("weight_unknown", "force_at_start")


def written(folder, name, tool_kg, shares):
    """A cell like light.yaml, with this tool and links of these shares of their masses."""
    robot = xml.etree.ElementTree.parse(SOURCE / "models/arms/light_device.urdf")
    for link in robot.getroot().iter("link"):
        inertial = link.find("inertial")
        if inertial is None or link.get("name") not in shares:
            continue
        share = shares[link.get("name")]
        inertial.find("mass").set("value", repr(share * float(inertial.find("mass").get("value"))))
        inertia = inertial.find("inertia")
        for key, value in inertia.items():
            inertia.set(key, repr(share * float(value)))
    robot.write(folder / f"{name}.urdf")
    text = (SOURCE / "models/cells/light.yaml").read_text()
    text = text.replace("../arms/light_device.urdf", str(folder / f"{name}.urdf")).replace("../../", f"{SOURCE}/")
    text = text.replace("../", f"{SOURCE}/models/").replace("mass_kg: 0.05", f"mass_kg: {tool_kg:.6g}", 1)
    file = folder / f"{name}.yaml"
    file.write_text(text)
    return file


def led(chance, scene):
    """A hand that leads to somewhere, rests there and lets go; when it does."""
    way = [1.0, 0.0, 0.0] if scene == "wall" else direction(chance)
    reach = chance.uniform(0.2, 0.3) if scene == "wall" else log_uniform(chance, 0.005, 0.15)
    stiffness, arrives_s = log_uniform(chance, 100, 1500), 0.5 + reach / log_uniform(chance, 0.05, 0.25)
    released_s = arrives_s + chance.uniform(0.3, 2.0)
    offset = ", ".join(f"{reach * x:.6g}" for x in way)
    return "\n".join(["name: lets go", "mass_kg: 0.5", f"stiffness_N_per_m: {stiffness:.5g}", "damping_Ns_per_m: 10",
                      "max_force_N: 25", "waypoints:", "  - {time_s: 0.5, offset_m: [0, 0, 0]}",
                      f"  - {{time_s: {arrives_s:.5g}, offset_m: [{offset}]}}", "grips:",
                      f"  - {{time_s: {released_s:.5g}, stiffness_N_per_m: 0, damping_Ns_per_m: 0}}"]) + "\n", released_s


def let_go(record, released_s, coupling_N_per_m):
    """How far the steel goes from where it is let go, beside what the coupling gives back, and its speed over 5 ms."""
    first = next((k for k, time in enumerate(record.time) if time >= released_s), None)
    if first is None:
        return 0.0, 0.0
    given_back = math.hypot(*record.hand[first - 5]) / coupling_N_per_m
    far = max(math.dist(place, record.steel[first]) for place in record.steel[first:])
    speed = max((math.dist(record.steel[k], record.steel[k - 5]) / (record.time[k] - record.time[k - 5])
                 for k in range(first + 5, len(record.time))), default=0.0)
    return max(0.0, far - given_back), speed


def session(seed, folder):
    chance = random.Random(seed)
    folder.mkdir()
    kind = chance.choice(("nobody", "lets go"))
    off = chance.random() < (0.8 if kind == "nobody" else 0.5)
    shares = {f"link_{i}": chance.uniform(0.8, 1.2) if off else 1.0 for i in (1, 2, 3)}
    heavier_kg = chance.choice((0.0, chance.uniform(-0.5, 0.5))) if kind == "nobody" else 0.0
    known_kg = 0.05 + max(0.0, -heavier_kg)  # a tool that is lighter than the cell says
    cell = written(folder, "cell", known_kg, {})
    arm = written(folder, "arm", known_kg + heavier_kg, shares)
    scene = chance.choice(("free", "wall")) if kind == "lets go" else "free"
    coupling_N_per_m = log_uniform(chance, 200, 750)
    hand, released_s = (NOBODY, math.inf) if kind == "nobody" else led(chance, scene)
    (folder / "hand.yaml").write_text(hand)
    lasts_s = 8.0 if kind == "nobody" else released_s + 3.0
    done = hunting.run(cell, SOURCE / f"scenes/{scene}.yaml",
                       ["--arm", arm, "--hand", folder / "hand.yaml", "--stiffness", f"{coupling_N_per_m:.4g}",
                        "--duration", f"{lasts_s:.4g}s"], folder / "record")
    if done.returncode == 2 or not done.stdout:
        return {"kind": kind, "refused": done.stderr.strip()[:160], "wrong": []}
    faults = [fault["fault"] for fault in json.loads(done.stdout)["faults"]]
    record = hunting.Record(folder / "record/signals.csv", every_phase=kind == "nobody")
    out = {"kind": f"{kind}, {scene}", "faults": faults, "wrong": []}
    if kind == "nobody":
        out["nobody mm"] = 1e3 * max(math.dist(place, record.steel[0]) for place in record.steel)
        if out["nobody mm"] > 1e3 * NOBODY_M:
            out["wrong"].append(f"{out['nobody mm']:.3g} mm with nobody there")
    else:
        far, speed = let_go(record, released_s, coupling_N_per_m)
        out["let go mm"], out["let go m/s"] = 1e3 * far, speed
        if far > LET_GO_M or speed > LET_GO_M_PER_S:
            out["wrong"].append(f"{1e3 * far:.3g} mm, {speed:.3g} m/s after letting go")
    out["wrong"] += [fault for fault in faults if fault not in REFUSED]
    return out


def main():
    results = hunting.sessions(hunting.options(__doc__, sessions=300), session)
    told = collections.Counter(fault for _, r in results for fault in r.get("faults", []))
    words = f"; faults: {', '.join(f'{name} {count}' for name, count in sorted(told.items())) or 'none'}"
    return hunting.tell(results, ("nobody mm", "let go mm", "let go m/s"), words, lambda r: r["kind"])


if __name__ == "__main__":
    sys.exit(main())
