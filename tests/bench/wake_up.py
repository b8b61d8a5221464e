"""How late the cycle is woken, beside what cyclictest (Debian's rt-tests) finds on the same machine in the same run.

    cmake --build build/release --target proxarm
    /usr/bin/python3 tests/bench/wake_up.py [SECONDS]

cyclictest, the session, cyclictest again, SECONDS (5) each, at the same priority, period and processor. With a vcan0 that
is up the session is one on that interface, and its wake-up ends when SYNC has been handed over, so it has that system
call in it. Without one, controller and simulated arm are one process at the pace of real time (`--pace realtime`). Needs
the right to SCHED_FIFO; status 77 where there is none.
"""
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
os.environ.setdefault("PROXARM", str(ROOT / "build/release/controller/proxarm"))
sys.path.insert(0, str(ROOT / "tests/vcan"))
import two_processes as two  # noqa: E402

PRIORITY, PERIOD_US = 80, 1000  # the session's


def cyclictest(seconds, processor):
    """Its histogram: [µs, how many] of each bin."""
    done = subprocess.run(["cyclictest", "-q", "-m", "-t1", f"-p{PRIORITY}", f"-i{PERIOD_US}", f"-a{processor}",
                           f"-l{round(seconds * 1e6 / PERIOD_US)}", "-h10000"],
                          capture_output=True, text=True, check=True)
    rows = [line.split() for line in done.stdout.splitlines() if line[:1].isdigit()]
    beyond = sum(int(n) for line in done.stdout.splitlines() if line.startswith("# Histogram Overflows:")
                 for n in line.split(":")[1].split())
    return [[int(us), int(n)] for us, n in rows if int(n) > 0] + ([[10000, beyond]] if beyond else [])


def session(seconds, processor):
    """On vcan0, the simulated arm a process of its own, or both in one process. Its summary."""
    if not Path("/sys/class/net/vcan0").exists():
        done = subprocess.run(["taskset", "-c", str(processor), two.PROGRAM, "run", "--pace", "realtime", "--duration",
                               f"{seconds}s", "--json", "--no-plot"], capture_output=True, text=True,
                              preexec_fn=lambda: os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY)))
        if done.returncode != 0:
            sys.exit(f"the session ended with {done.returncode}\n{done.stderr}{done.stdout}")
        return json.loads(done.stdout)
    with tempfile.TemporaryDirectory() as folder, two.simulated_arm("vcan0", "--hand", two.write_hand(folder, "still")):
        with two.controller("vcan0", f"{seconds}s") as run:
            status = run.wait(60 + 10 * seconds)
            if status != 0:
                sys.exit(f"the session ended with {status}\n{run.errors()}{run.output()}")
            summary = json.loads(run.output())
            print(run.errors(), end="", file=sys.stderr)
    return summary


def line(name, histogram):
    count, below, at = sum(n for _, n in histogram), 0, {}
    for us, n in histogram:
        below += n
        for share in (0.5, 0.99, 0.999):
            if below >= share * count:
                at.setdefault(share, us)
    print(f"{name:<22}" + "".join(f"{at[share]:>9}" for share in (0.5, 0.99, 0.999)) + f"{histogram[-1][0]:>9}"
          f"{count:>9}")


def main():
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 5.0
    processor = max(os.sched_getaffinity(0))
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    except PermissionError:
        print("SCHED_FIFO refused: run as root, or grant rtprio", file=sys.stderr)
        sys.exit(77)
    before = cyclictest(seconds, processor)
    summary = session(seconds, processor)
    after = cyclictest(seconds, processor)
    print(f"{'µs late, period 1 ms':<22}" + "".join(f"{name:>9}" for name in ("median", "p99", "p99.9", "max", "of")))
    line("cyclictest", before)
    line("the cycle's wake-up", summary["latency_us"]["wake_up"]["histogram"])
    line("cyclictest", after)
    faults = summary.get("page_faults")
    if faults:
        print(f"page faults of the cycle {faults['minor']} minor, {faults['major']} major")
    print(f"overruns {summary['overruns']}; processor {processor}, priority {PRIORITY}, {os.uname().release}")


if __name__ == "__main__":
    main()
