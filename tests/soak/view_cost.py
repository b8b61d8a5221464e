#!/usr/bin/python3
"""What `--view` costs the cycle: sessions with three viewers, of which one doesn't read, and sessions without, in turn.

    tests/soak/view_cost.py [--pairs 30] [--pace virtual|realtime] [--pin CPU] [PROXARM]

Prints the p99 and the median of the cycle's computing time with and without, and what the view adds: the median over the
pairs, with the interval that holds it at 95 % (order statistics). For a quiet machine; other load makes it wider. --pin gives
the session's own thread a processor under SCHED_FIFO once it has begun, which keeps other load away; not its viewers.
"""
import argparse
import json
import os
import pathlib
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "command_line"))

DURATIONS = {"virtual": "60s", "realtime": "8s"}  # a second and a half of computing; eight of the clock


def read_on(page):
    try:
        while page.socket.recv(1 << 20):
            pass
    except OSError:
        pass


def pin(process, processor):
    if processor is not None:
        os.sched_setaffinity(process, {processor})
        os.sched_setscheduler(process, os.SCHED_FIFO, os.sched_param(10))


def without(session_type, folder, words, processor):
    process = subprocess.Popen([os.environ["PROXARM_PROGRAM"], *words], cwd=folder, stdin=subprocess.DEVNULL,
                               stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    time.sleep(0.1)  # as long as the other way takes to have its address
    pin(process.pid, processor)
    return json.loads(process.communicate()[0])["compute_us"]


def with_viewers(session_type, folder, words, processor):
    with session_type(folder, *words, "--view") as session:
        pin(session.process.pid, processor)
        pages = [session.open_socket() for _ in range(3)]
        pages[2].socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)  # the one that doesn't read
        for page in pages[:2]:
            threading.Thread(target=read_on, args=(page,), daemon=True).start()
        session.until_said("until Ctrl-C")
        figures = json.loads(session.end()[1])["compute_us"]
        for page in pages:
            page.close()
        return figures


def interval(values):
    """Of the median, at 95 %: the binomial's order statistics."""
    ordered, n = sorted(values), len(values)
    reach = 0.98 * n ** 0.5  # 1.96 standard deviations of a fair coin's count
    low, high = max(0, int(n / 2 - reach)), min(n - 1, int(n / 2 + reach))
    return statistics.median(ordered), ordered[low], ordered[high]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program", nargs="?", default=str(ROOT / "build/release/controller/proxarm"))
    parser.add_argument("--pairs", type=int, default=30)
    parser.add_argument("--pace", choices=DURATIONS, default="virtual")
    parser.add_argument("--pin", type=int)
    options = parser.parse_args()
    os.environ["PROXARM_PROGRAM"] = str(pathlib.Path(options.program).resolve())
    from view_client import Session
    words = ("run", "--json", "--no-plot", "--pace", options.pace, "--duration", DURATIONS[options.pace])
    found = {"with": [], "without": []}
    with tempfile.TemporaryDirectory(prefix="proxarm-view-cost-") as folder:
        for pair in range(options.pairs):
            ways = [("without", without), ("with", with_viewers)]
            for name, way in ways if pair % 2 else reversed(ways):
                found[name].append(way(Session, folder, words, options.pin))
    for figure in ("p99", "median"):
        plain = [run[figure] for run in found["without"]]
        added = [a[figure] - b for a, b in zip(found["with"], plain)]
        middle, low, high = interval(added)
        base = statistics.median(plain)
        print(f"{options.pace}, {figure}: {base:.2f} µs without, {statistics.median(r[figure] for r in found['with']):.2f} with; "
              f"the view adds {middle:+.2f} µs ({low:+.2f} to {high:+.2f}), {100 * middle / base:+.1f} %")


main()
