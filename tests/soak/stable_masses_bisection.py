#!/usr/bin/python3
"""The smallest stable mass that `proxarm run` names, against bisection on the simulated arm.

    PROXARM_PROGRAM=build/release/controller/proxarm tests/soak/stable_masses_bisection.py --check

Three hands hold the tool of three arms where it starts, at 1, 2 and 4 ms, nudge it by 5 mm and hold it for ten seconds;
nothing is damped, and nobody is taken for absent. A mass is borne if the steel swings by less than 0.05 mm at the end,
by the record alone. Prints a row of a table for each; with --check, status 1 if what is named is above what is borne by
more than 15 %, or below it by more than 3 %.

The arms are the default one and two of other proportions, made of its files by the factors below: `short` is an arm of
the 20 kg class, `long` has a longer and lighter forearm on softer gears.
"""
import argparse
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

SOURCE = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(SOURCE / "tests/command_line"))
from steel import Track  # noqa: E402

HANDS = ((500, 20, 1.0), (1500, 40, 0.5), (200, 10, 1.8))  # N/m, Ns/m, kg
# Gears swing at 8 Hz and more, so this holds a swing and more of them; what a slow hand still moves is nearly a line.
STILL_M, AT_THE_END_S = 0.05e-3, 0.15
MOST_ABOVE, MOST_BELOW = 0.15, 0.03
CLOSE_ENOUGH = 1.015
NAMED = re.compile(r"at least ([\d.]+) kg, the smallest that is stable")

# Of lengths, masses and gears (stiffness and damping; rotors, friction and torques go with the inertia), by link: the
# one that a joint moves. Joints that aren't named have a link's "" factors.
ARMS = {
    "default": None,
    "short": {"": (0.6, 0.25, 0.1)},
    "long": {"": (1.0, 1.0, 0.9), "3": (1.2, 0.9, 0.75), "4": (1.35, 0.8, 0.75), "5": (1.35, 0.8, 0.8)},
}


def scaled(text, factor):
    return " ".join(f"{float(x) * factor:.6g}" for x in text.split())


def scaled_urdf(text, factors):
    """Origins of joints and of masses by the length, masses by the mass, inertias by mass times length squared."""
    def of(number):
        return factors.get(number, factors[""])

    def joint(found):
        length = of(found[1])[0]
        return re.sub(r'<origin xyz="([^"]*)"', lambda o: f'<origin xyz="{scaled(o[1], length)}"', found[0])

    def inertial(found):
        length, mass, _ = of(found[1])
        body = re.sub(r'<origin xyz="([^"]*)"', lambda o: f'<origin xyz="{scaled(o[1], length)}"', found[2])
        body = re.sub(r'<mass value="([^"]*)"', lambda m: f'<mass value="{scaled(m[1], mass)}"', body)
        body = re.sub(r'(i[xyz]{2})="([^"]*)"', lambda i: f'{i[1]}="{scaled(i[2], mass * length ** 2)}"', body)
        return f'<link name="link_{found[1]}">{body}'

    text = re.sub(r'<joint name="axis_(\d)".*?</joint>', joint, text, flags=re.S)
    return re.sub(r'<link name="link_(\d)">(.*?</inertial>)', inertial, text, flags=re.S)


def made_cell(folder, name):
    """The default cell with that arm; a hand that holds still is never taken for absent."""
    text = (SOURCE / "models/cells/default.yaml").read_text() + "\nsupervision: {let_go: coast}\n"
    for part in ("arms", "drives", "sensors"):
        text = text.replace(f"../{part}", f"{SOURCE}/models/{part}")
    for part in ("scenes", "sim"):
        text = text.replace(f"../../{part}", f"{SOURCE}/{part}")
    factors = ARMS[name]
    if factors:
        urdf = scaled_urdf((SOURCE / "models/arms/arm150.urdf").read_text(), factors)
        (folder / "arm.urdf").write_text(urdf)
        text = text.replace(f"{SOURCE}/models/arms/arm150.urdf", "arm.urdf")

        def drive(found):
            length, mass, gear = factors.get(found[1], factors[""])
            by_key = {"gear_stiffness_Nm_per_rad": gear, "gear_damping_Nms_per_rad": gear}
            inertia = dict.fromkeys(("rotor_inertia_kg_m2", "coulomb_friction_Nm", "viscous_friction_Nms_per_rad",
                                     "max_torque_Nm"), max(mass * length ** 2, 0.1))
            return re.sub(r"(\w+): ([\d.]+)\n",
                          lambda k: f"{k[1]}: {float(k[2]) * {**by_key, **inertia}.get(k[1], 1.0):.6g}\n"
                          if k[1] in {**by_key, **inertia} else k[0], found[0])
        text = re.sub(r"  - joint: axis_(\d)\n.*?(?=  - joint:|\nsensor:)", drive, text, flags=re.S)
    (folder / "cell.yaml").write_text(text)
    return folder / "cell.yaml"


def hand_text(stiffness, damping, mass):
    return (f"name: nudge\nmass_kg: {mass}\nstiffness_N_per_m: {stiffness}\ndamping_Ns_per_m: {damping}\nwaypoints:\n"
            "  - {time_s: 0.3, offset_m: [0, 0, 0]}\n  - {time_s: 0.45, offset_m: [0.003, 0.003, 0.003]}\n")


def swing_m(times, places):
    """Half of what goes to and fro about the straight line through the places, of the axis that swings most."""
    mean_t = sum(times) / len(times)
    spread = sum((t - mean_t) ** 2 for t in times)
    most = 0.0
    for axis in zip(*places):
        mean = sum(axis) / len(axis)
        slope = sum((t - mean_t) * (x - mean) for t, x in zip(times, axis)) / spread
        rest = [x - mean - slope * (t - mean_t) for t, x in zip(times, axis)]
        most = max(most, 0.5 * (max(rest) - min(rest)))
    return most


class Bisection:
    def __init__(self, program, folder, arm, hand, timestep_ms):
        self.program, self.folder = program, pathlib.Path(folder)
        hand_file = self.folder / "hand.yaml"
        hand_file.write_text(hand_text(*hand))
        self.session = [made_cell(self.folder, arm), "--hand", hand_file, "--scene", SOURCE / "scenes/free.yaml",
                        "--timestep", f"{timestep_ms}ms", "--passivity", "off", "--no-plot"]

    def run(self, mass, *words):
        return subprocess.run([self.program, "run", *map(str, self.session), "--mass", f"{mass:.5g}kg",
                               *map(str, words)], cwd=self.folder, capture_output=True, text=True)

    def named(self):
        """What a mass that is too small is refused with."""
        said = self.run(0.27).stderr
        found = NAMED.search(said)
        if not found:
            raise RuntimeError(f"no mass is named: {said}")
        return float(found[1])

    def bears(self, mass):
        record = self.folder / "record"
        shutil.rmtree(record, ignore_errors=True)
        done = self.run(mass, "--force-unstable", "--duration", "11s", "--record", record)
        if not (record / "signals.csv").exists():
            raise RuntimeError(done.stderr)
        track = Track(record)
        ends = track.leaves_rendering(track.began) or len(track.place)
        if track.time_s[ends - 1] - track.time_s[track.began] < 10.0:
            return False  # a fault ended it
        late = [(t, p) for t, p in zip(track.time_s[:ends], track.place) if t > track.time_s[ends - 1] - AT_THE_END_S]
        return swing_m(*zip(*late)) < STILL_M

    def borne(self, named):
        low, high = 0.7 * named, 1.15 * named
        while self.bears(low):
            high, low = low, 0.7 * low
        while not self.bears(high):
            low, high = high, 1.15 * high
        while high > CLOSE_ENOUGH * low:
            middle = (low * high) ** 0.5
            low, high = (low, middle) if self.bears(middle) else (middle, high)
        return (low * high) ** 0.5


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--arms", nargs="+", default=list(ARMS))
    parser.add_argument("--timesteps", nargs="+", type=int, default=(1, 2, 4))
    parser.add_argument("--check", action="store_true")
    options = parser.parse_args()
    program = os.path.abspath(os.environ.get("PROXARM_PROGRAM", "build/release/controller/proxarm"))
    off = 0
    print("| arm | T | hand | said | borne | |\n|---|---|---|---|---|---|", flush=True)
    for arm in options.arms:
        for timestep in options.timesteps:
            for hand in HANDS:
                with tempfile.TemporaryDirectory(prefix="proxarm-bisection-") as folder:
                    bisection = Bisection(program, folder, arm, hand, timestep)
                    named = bisection.named()
                    borne = bisection.borne(named)
                share = named / borne - 1.0
                off += share > MOST_ABOVE or share < -MOST_BELOW
                print(f"| {arm} | {timestep} ms | {hand[0]} N/m, {hand[1]} Ns/m, {hand[2]:g} kg | {named:.3g} kg | "
                      f"{borne:.3g} kg | {100 * share:+.0f} % |", flush=True)
    print(f"{off} off by more than {100 * MOST_ABOVE:g} % above or {100 * MOST_BELOW:g} % below")
    return 1 if options.check and off else 0


if __name__ == "__main__":
    sys.exit(main())
