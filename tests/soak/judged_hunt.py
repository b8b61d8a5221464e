#!/usr/bin/python3
"""What `proxarm run` accepts on elastic layers, at walls and in free space: does it come to rest?

    PROXARM_PROGRAM=build/release/controller/proxarm tests/soak/judged_hunt.py --sessions 100 --jobs 1

A random hand jerks a shipped cell's tool and holds it: in free space, or in a plane that it presses on, rigid or with a
layer of 1 to 100 kN/m. The mass is 1.0 to 1.1 times the smallest that `run` names. Wrong: half of what the steel moves
from peak to peak in the last half second, five seconds after the jerk, is more than 20 µm. With --refused the mass is
0.8 times that, by --force-unstable, and a session is wrong that comes to rest. What still dies away by then, to 0.7 of
what it was two seconds before, comes to rest: near the bound that takes long.
"""
import argparse
import json
import math
import random
import re
import sys
from types import SimpleNamespace

import hunting
from decaying_hunt import CALM_M, jerk
from hunting import SOURCE, log_uniform

sys.path.insert(0, str(SOURCE / "tests/command_line"))
from steel import Track  # noqa: E402

CELLS = ("default", "linear", "rail", "cobot", "seven", "gantry", "bench", "scara")
LEAST = re.compile(r"at least ([\d.e+]+) kg, the smallest that is stable")


def plane(chance, towards, start_m, layer):
    """One that the hand ends 5 mm deep in."""
    depth_m = 0.005
    length = math.hypot(*towards)
    normal = [-x / length for x in towards]
    point = [s + x + depth_m * n for s, x, n in zip(start_m, towards, normal)]
    return ("name: plane\nobjects:\n  - plane:\n      name: plane\n"
            f"      point_m: [{', '.join(map(str, point))}]\n      normal: [{', '.join(map(str, normal))}]\n"
            f"      friction: {chance.choice((0.0, 0.4))}\n"
            + (f"      layer: {{thickness_m: 0.02, stiffness_N_per_m: {layer:.5g}}}\n" if layer else ""))


def amplitude_m(track, from_end_s):
    """The largest along an axis in the half second that begins then, half of peak to peak."""
    cycles = round(0.5 / (track.time_s[1] - track.time_s[0]))
    places = [place for place, phase in zip(track.place, track.phase) if phase == "rendering"]
    begin = len(places) - round(2 * from_end_s * cycles)
    seen = places[begin:begin + cycles]
    return max((max(x) - min(x)) / 2 for x in zip(*seen))


def comes_to_rest(track):
    last_m = amplitude_m(track, 0.5)
    return last_m < CALM_M or last_m < 0.7 * amplitude_m(track, 2.5)


def start_of(cell, folder):
    """Where the tool begins, by a session without a hand's motion."""
    hand = folder / "still.yaml"
    hand.write_text("name: still\nmass_kg: 1\nstiffness_N_per_m: 300\ndamping_Ns_per_m: 30\nwaypoints:\n"
                    "  - {time_s: 0, offset_m: [0, 0, 0]}\n")
    hunting.run(SOURCE / f"models/cells/{cell}.yaml", SOURCE / "scenes/free.yaml",
                ["--hand", hand, "--duration", "0.1s", "--force-unstable", "--mass", "30"], folder / "start")
    track = Track(folder / "start")
    return track.place[track.began]


def session(seed, folder, given):
    chance = random.Random(seed)
    folder.mkdir()
    cell, kind = chance.choice(given.cells), chance.choice(given.kinds)
    result = {"cell": f"{cell} {kind}", "wrong": []}
    hand, scene = folder / "hand.yaml", SOURCE / "scenes/free.yaml"
    text = jerk(chance, cell)
    hand.write_text(text)
    if kind != "free":
        towards = [float(x) for x in re.findall(r"offset_m: \[([^\]]*)\]", text)[-1].split(",")]
        scene = folder / "scene.yaml"
        layer = log_uniform(chance, 1e3, 1e5) if kind == "layer" else None
        scene.write_text(plane(chance, towards, start_of(cell, folder), layer))
    words = ["--hand", hand, "--timestep", chance.choice(("1ms", "1ms", "2ms", "4ms")), "--duration", "6.5s",
             "--passivity", "observe"]
    if chance.random() < 0.15:
        words += ["--order", 2]
    file = SOURCE / f"models/cells/{cell}.yaml"
    least = LEAST.search(hunting.run(file, scene, [*words, "--mass", 0.26], folder / "least").stderr)
    if not least:
        return {"refused": f"{cell} {kind}: no smallest mass"}
    share = 0.8 if given.refused else chance.uniform(1.0, 1.1)
    mass = max(0.26, math.ceil(1000 * share * float(least[1])) / 1000)
    done = hunting.run(file, scene, [*words, "--mass", mass, *(["--force-unstable"] if given.refused else [])],
                       folder / "record")
    try:
        ended = json.loads(done.stdout)["end"]["reason"]
    except ValueError:
        return {"refused": done.stderr.strip()[-150:]}
    if ended != "duration":
        return {"refused": f"ended by {ended}"}
    rests = comes_to_rest(Track(folder / "record"))
    result["share"] = share
    if rests == given.refused:
        result["wrong"].append(f"{share:.3f} of {least[1]} kg: {'rests' if rests else 'swings'}; {words[3]} {words[-1]}")
    return result


def main():
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument("--refused", action="store_true")
    parser.add_argument("--kinds", nargs="+", default=["free", "wall", "layer"])
    parser.add_argument("--cells", nargs="+", default=CELLS)
    own, rest = parser.parse_known_args()
    sys.argv[1:] = rest
    given = hunting.options(__doc__)
    results = hunting.sessions(given, session, SimpleNamespace(**vars(own)))
    return hunting.tell(results, ["share"])


if __name__ == "__main__":
    sys.exit(main())
