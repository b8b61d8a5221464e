#!/usr/bin/python3
"""Random hands of up to 50 N at a device that takes torques: do the borders of its joints and of its tool hold?

    PROXARM_PROGRAM=build/release/controller/proxarm tests/soak/torque_hands_hunt.py --sessions 2000 --seed 1

Judged by the records alone, with kinematics of its own from the arm's URDF. In each cycle of rendering:
  range   no joint is beyond its range by more than 5 mrad
  steel   no joint is on its steel stop, 50 mrad beyond the range
  speed   the tool is slower than 1.2 of its limit, by the steel, over 5 ms
What a hand overpowers isn't judged: while its force has more torque on a joint than the drive has beside the device's
weight, and after that until the device is within these bounds again, for a second at most. Nor is what comes after a
fault, and the speed of a force that is there within 2 ms, faster than people push: it is printed beside. A hand is told apart by how it moves (slow, quick, thrown
as a step) and by how stiff it is; a quarter of them let go. Status 1, and the session's files in `--keep DIR`, where it
isn't so.
"""
import collections
import json
import math
import random
import sys
import xml.etree.ElementTree

import hunting
from hunting import SOURCE, direction, log_uniform

CELL = SOURCE / "models/cells/light.yaml"
JOINTS = ("turn", "shoulder", "elbow")
# Of models/cells/light.yaml; the test asks whether they still are.
RANGE_RAD = ((-1.5, 1.5), (-1.6, 0.6), (0.2, 2.6))
MAX_TORQUE_NM, TOOL_SPEED_M_PER_S = 18.0, 0.5
HANDLE_FROM_FLANGE_M = 0.02 + 0.05  # sensor.pose_link, tool.handle_S, both along the flange's z
BASE_W_M = (0.263679, 0.0, 0.273508)
G_M_PER_S2 = 9.80665
TOOL_KG, TOOL_FROM_FLANGE_M = 0.05, 0.02 + 0.05

BEYOND_RAD, STEEL_RAD, SPEED_SHARE = 5e-3, 0.05, 1.2
AFTER_S = 1.0


def made_hand(chance):
    """The text of a hand, what it is, and how long it takes."""
    stiffness, most_N = log_uniform(chance, 100, 3000), log_uniform(chance, 1, 50)
    kind = chance.choice(("slow", "slow", "quick", "quick", "step"))
    # A force of 50 N within 2 ms is a hand's only if the hand's mass comes with it.
    mass = chance.choice((0.0, log_uniform(chance, 0.1, 1.5))) if kind != "step" else log_uniform(chance, 0.3, 1.5)
    speed = {"slow": log_uniform(chance, 0.03, 0.3), "quick": log_uniform(chance, 0.3, 2.0), "step": 20.0}[kind]
    damping = 2 * math.sqrt(stiffness * max(mass, 0.2)) * chance.uniform(0.3, 1.0)
    lines = [f"name: {kind}", f"mass_kg: {mass:.3g}", f"stiffness_N_per_m: {stiffness:.4g}",
             f"damping_Ns_per_m: {damping:.4g}", f"max_force_N: {most_N:.4g}", "waypoints:",
             "  - {time_s: 0.5, offset_m: [0, 0, 0]}"]
    at, time_s = [0.0] * 3, 0.5
    for _ in range(chance.randint(1, 4)):
        to = [chance.uniform(0.1, 1.0) * x for x in direction(chance)]
        time_s += math.dist(at, to) / speed + 0.002
        lines.append(f"  - {{time_s: {time_s:.5g}, offset_m: [{', '.join(f'{x:.5g}' for x in to)}]}}")
        time_s += chance.uniform(0.0, 1.0)
        lines.append(f"  - {{time_s: {time_s:.5g}, offset_m: [{', '.join(f'{x:.5g}' for x in to)}]}}")
        at = to
    if chance.random() < 0.25:
        lines += ["grips:", f"  - {{time_s: {chance.uniform(0.6, time_s):.4g}, stiffness_N_per_m: 0, damping_Ns_per_m: 0}}"]
    return "\n".join(lines) + "\n", kind, min(time_s + 0.5, 15.0)


def masses():
    """Of link 2, link 3 and flange: mass and distance of its centre from the joint before, along the link."""
    robot = xml.etree.ElementTree.parse(SOURCE / "models/arms/light_device.urdf").getroot()
    return {link.get("name"): float(link.find("inertial/mass").get("value")) for link in robot.iter("link")}


class Device:
    """Place, Jacobian and weight of the arm: a turning column, then two links of 0.4 m in a vertical plane."""

    def __init__(self):
        kg = masses()
        # Each mass: along the upper link, and along the forearm.
        self.bodies = ((kg["link_2"], 0.2, 0.0), (kg["link_3"], 0.4, 0.2), (kg["flange"], 0.4, 0.405),
                       (TOOL_KG, 0.4, 0.4 + TOOL_FROM_FLANGE_M))
        self.forearm_m = 0.4 + HANDLE_FROM_FLANGE_M

    def at(self, angles, upper, fore):
        _, shoulder, elbow = angles
        out = upper * math.cos(shoulder) + fore * math.cos(shoulder + elbow)
        up = -upper * math.sin(shoulder) - fore * math.sin(shoulder + elbow)
        return out, up

    def place(self, angles):
        out, up = self.at(angles, 0.4, self.forearm_m)
        return (BASE_W_M[0] + out * math.cos(angles[0]), BASE_W_M[1] + out * math.sin(angles[0]),
                BASE_W_M[2] + 0.3 + up)

    def torque(self, angles, force):
        """Of a force on the handle, about each joint."""
        out, up = self.at(angles, 0.4, self.forearm_m)
        out_3, up_3 = self.at(angles, 0.0, self.forearm_m)
        c, s = math.cos(angles[0]), math.sin(angles[0])
        outwards, aside = force[0] * c + force[1] * s, -force[0] * s + force[1] * c
        return out * aside, up * outwards - out * force[2], up_3 * outwards - out_3 * force[2]

    def weight(self, angles):
        """That the drives must hold."""
        shoulder = elbow = 0.0
        for kg, upper, fore in self.bodies:
            shoulder -= kg * G_M_PER_S2 * self.at(angles, upper, fore)[0]
            elbow -= kg * G_M_PER_S2 * self.at(angles, 0.0, fore)[0]
        return 0.0, shoulder, elbow


def joints_of(record):
    return list(zip(*(record.column(f"{joint}_actual_rad") for joint in JOINTS)))


def overpowered(device, angles, force):
    """Whether the hand has more torque on a joint than its drive has beside the device's weight."""
    return any(abs(hand) >= MAX_TORQUE_NM - abs(weight)
               for hand, weight in zip(device.torque(angles, force), device.weight(angles)))


def judged(record):
    """The worst of each figure where no joint is overpowered, and the device has recovered from that."""
    device = Device()
    joints = joints_of(record)
    until_s = 0.0
    figures = {"beyond mrad": -math.inf, "speed m/s": 0.0, "overpowered s": 0.0}
    for k in range(5, len(record.time)):
        angles, time_s = joints[k], record.time[k]
        beyond = max(max(low - q, q - high) for q, (low, high) in zip(angles, RANGE_RAD))
        speed = math.dist(record.steel[k], record.steel[k - 5]) / (time_s - record.time[k - 5])
        if overpowered(device, angles, record.hand[k]):
            until_s = time_s + AFTER_S
        elif beyond <= BEYOND_RAD and speed <= SPEED_SHARE * TOOL_SPEED_M_PER_S:
            until_s = 0.0
        if time_s < until_s:
            figures["overpowered s"] += time_s - record.time[k - 1]
            continue
        figures["beyond mrad"] = max(figures["beyond mrad"], 1e3 * beyond)
        figures["speed m/s"] = max(figures["speed m/s"], speed)
    return figures


def faults_of(figures):
    wrong = []
    if figures["beyond mrad"] > 1e3 * BEYOND_RAD:
        wrong.append(f"{figures['beyond mrad']:.3g} mrad beyond a joint's range")
    if figures["beyond mrad"] > 1e3 * STEEL_RAD:
        wrong.append("on its steel stop")
    if figures.get("speed m/s", 0.0) > SPEED_SHARE * TOOL_SPEED_M_PER_S:
        wrong.append(f"{figures['speed m/s']:.3g} m/s")
    return wrong


def session(seed, folder):
    chance = random.Random(seed)
    folder.mkdir()
    hand, kind, lasts_s = made_hand(chance)
    scene = chance.choice(("free", "wall"))
    (folder / "hand.yaml").write_text(hand)
    done = hunting.run(CELL, SOURCE / f"scenes/{scene}.yaml",
                       ["--hand", folder / "hand.yaml", "--duration", f"{lasts_s:.4g}s"], folder / "record")
    if done.returncode == 2:
        return {"kind": kind, "refused": done.stderr.strip()[:120], "wrong": []}
    summary = json.loads(done.stdout)
    figures = {"kind": f"{kind}, {scene}", **judged(hunting.Record(folder / "record/signals.csv"))}
    if kind == "step":
        figures["of steps m/s"] = figures.pop("speed m/s")
    figures["faults"] = [fault["fault"] for fault in summary["faults"]]
    figures["wrong"] = faults_of(figures)
    if summary["oscillation"] and summary["oscillation"]["lasts"]:
        figures["wrong"].append("oscillates")
    return figures


def main():
    results = hunting.sessions(hunting.options(__doc__), session)
    told = collections.Counter(fault for _, r in results for fault in r.get("faults", []))
    words = f"; faults: {', '.join(f'{name} {count}' for name, count in sorted(told.items())) or 'none'}"
    return hunting.tell(results, ("beyond mrad", "speed m/s", "of steps m/s", "overpowered s"), words, lambda r: r["kind"])


if __name__ == "__main__":
    sys.exit(main())
