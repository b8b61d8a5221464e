"""What the hunts share: random values, vectors, and sessions beside each other, each judged by itself.

A session is a function of its seed and of a folder for its files that doesn't exist yet. Its result has `refused` and
why, or `wrong`, a list of words that is empty where nothing was, beside figures.
"""
import argparse
import csv
import functools
import math
import os
import pathlib
import shutil
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor

SOURCE = pathlib.Path(__file__).resolve().parents[2]


def log_uniform(chance, low, high):
    return math.exp(chance.uniform(math.log(low), math.log(high)))


def direction(chance):
    way = [chance.gauss(0, 1) for _ in range(3)]
    return [x / math.hypot(*way) for x in way]


def minus(a, b):
    return [x - y for x, y in zip(a, b)]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def run(cell, scene, arguments, record):
    """`proxarm run` with a record and a summary in JSON. Its command is kept beside the record."""
    command = [os.environ["PROXARM_PROGRAM"], "run", str(cell), "--scene", str(scene), *map(str, arguments), "--no-plot",
               "--json", "--record", str(record), "--signals", "csv"]
    record.with_name(f"{record.name}.command").write_text(" ".join(command) + "\n")
    return subprocess.run(command, cwd=record.parent, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=600)


class Record:
    """The cycles of a record's signals.csv in which the scene was rendered, or all of them."""

    def __init__(self, file, every_phase=False):
        with open(file, newline="") as text:
            rows = csv.reader(text)
            self.at = {name: i for i, name in enumerate(next(rows))}
            self.rows = [row for row in rows if every_phase or row[self.at["phase"]] == "rendering"]

    def column(self, name):
        return [float(row[self.at[name]]) for row in self.rows]

    def vectors(self, name, unit="m", parts="xyz"):
        """Of each cycle, a tuple; quaternions by parts ("qx", "qy", "qz", "qw") and unit ""."""
        end = f"_{unit}" if unit else ""
        return list(zip(*(self.column(f"{name}_W_{part}{end}") for part in parts)))

    time = functools.cached_property(lambda self: self.column("time_s"))
    proxy = functools.cached_property(lambda self: self.vectors("proxy"))
    steel = functools.cached_property(lambda self: self.vectors("true_tool"))
    hand = functools.cached_property(lambda self: self.vectors("hand_force", "N"))
    flags = functools.cached_property(lambda self: [row[self.at["flags"]].split("|") for row in self.rows])


def options(doc, sessions=100, cycles=None, cells=()):
    parser = argparse.ArgumentParser(description=doc.splitlines()[0])
    if cycles is None:
        parser.add_argument("--sessions", type=int, default=sessions)
    else:
        parser.add_argument("--cycles", type=int, default=cycles)
    parser.add_argument("--first", type=int, default=0, help="the first session's number")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--keep", type=pathlib.Path, help="folder for the files of wrong sessions")
    if cells:
        parser.add_argument("--cell", action="append", metavar="FILE", help=f"instead of {', '.join(cells)}")
        parser.add_argument("--strongest-N", type=float, default=150.0, help="of the hands; less for a weak arm's cell")
    given = parser.parse_args()
    if cells:
        given.cell = [pathlib.Path(file).resolve() for file in given.cell or ()] or [
            SOURCE / f"models/cells/{name}.yaml" for name in cells]
    return given


def sessions(given, session, *more):
    """(number, result) of given.sessions, or of as many as have given.cycles between them (but not for ever)."""
    results = []
    with tempfile.TemporaryDirectory() as scratch, ThreadPoolExecutor(given.jobs) as pool:
        def one(n):
            folder = pathlib.Path(scratch) / str(n)
            try:
                figures = session(f"{given.seed}/{n}", folder, *more)
                if figures.get("wrong") and given.keep:
                    shutil.copytree(folder, given.keep / f"{given.seed}-{n}", dirs_exist_ok=True)
                return n, figures
            finally:
                shutil.rmtree(folder, ignore_errors=True)
        if hasattr(given, "sessions"):
            return list(pool.map(one, range(given.first, given.first + given.sessions)))
        while sum(r.get("cycles", 0) for _, r in results) < given.cycles and len(results) < 10 + given.cycles // 500:
            begun = given.first + len(results)
            results += pool.map(one, range(begun, begun + 4 * given.jobs))
    return results


def tell(results, figures, words="", name=lambda r: r["cell"]):
    """Prints counts, each figure's median and most, and what was wrong. Returns the status."""
    ran = [(n, r) for n, r in results if "refused" not in r]
    refused = [(n, r) for n, r in results if "refused" in r]
    print(f"{len(ran)} sessions, {len(refused)} refused{words}")
    for key in figures:
        values = sorted((r[key], n) for n, r in ran if key in r)
        if values:
            print(f"  {key:16s} median {values[len(values) // 2][0]:.4g}, most {values[-1][0]:.4g} in session {values[-1][1]}")
    wrong = [(n, r) for n, r in ran if r["wrong"]]
    print(f"something was wrong in {len(wrong)} sessions")
    for n, r in wrong[:40]:
        print(f"  {n} ({name(r)}): {'; '.join(r['wrong'])}")
    for n, r in refused[:3]:
        print(f"  {n} refused: {r['refused'][:150]}")
    return 1 if wrong or not ran else 0
