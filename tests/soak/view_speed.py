#!/usr/bin/python3
"""How fast the view is there, in a browser that draws by software.

    tests/soak/view_speed.py [--runs 7] [--busy N] [PROXARM]

From the start of `proxarm run --view` to the first picture, with a browser that stands open; the same with a mesh of
328 048 triangles, its cache new and old; pictures a second, and what the page weighs. --busy N: N processes that compute all
the while. Targets: 2 s, 3 s, 30 a second, 1 MB.
"""
import argparse
import gzip
import multiprocessing
import os
import pathlib
import statistics
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "command_line"))

SHOWN = 'window.proxarm && performance.getEntriesByName("first-moment").length > 0'
SOLID = "proxarm.world.objects.parts[0].getObjectByName('solid')"


def compute():
    while True:
        sum(range(10_000))


def told(what, seconds, most):
    print(f"{what}: median {statistics.median(seconds):.2f} s, longest {max(seconds):.2f} s of {len(seconds)} (at most {most} s)")


def time_to(browser, session_type, folder, condition, *words):
    """From the start of the program; the browser's own word for when, since asking takes time."""
    browser.open("about:blank")
    begun = time.time()
    with session_type(folder, "run", "--view", "--no-plot", "--duration", "60s", *words) as session:
        browser.driver.execute_script("location.href = arguments[0]", session.url)
        browser.until(f"({condition})", condition)
        return time.time() - begun


def pictures_a_second(browser, session_type, folder):
    with session_type(folder, "run", "--view", "--no-plot", "--duration", "60s") as session:
        browser.open(session.url)
        browser.until(SHOWN, "the first moment")
        time.sleep(3.0)  # it finds how fine it may draw
        before, begun = browser.run("return [proxarm.world.frames, performance.now()]")
        time.sleep(4.0)
        after, ended = browser.run("return [proxarm.world.frames, performance.now()]")
        return 1e3 * (after - before) / (ended - begun)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program", nargs="?", default=str(ROOT / "build/release/controller/proxarm"))
    parser.add_argument("--runs", type=int, default=7)
    parser.add_argument("--busy", type=int, default=0)
    options = parser.parse_args()
    os.environ["PROXARM_PROGRAM"] = str(pathlib.Path(options.program).resolve())
    import view_browser
    from timing_test import bumpy_ball
    from view_client import Session
    if reason := view_browser.why_not():
        sys.exit(reason)
    busy = [multiprocessing.Process(target=compute, daemon=True) for _ in range(options.busy)]
    for process in busy:
        process.start()
    with tempfile.TemporaryDirectory(prefix="proxarm-view-speed-") as name, view_browser.Browser() as browser:
        folder = pathlib.Path(name)
        told("first picture", [time_to(browser, Session, folder, SHOWN) for _ in range(options.runs)], 2)
        new = []
        for i in range(options.runs):
            bumpy_ball(folder / f"ball{i}.stl")
            (folder / "ball.yaml").write_text(f"name: ball\nobjects:\n  - mesh: {{name: ball, file: ball{i}.stl}}\n")
            shown = f"{SHOWN} && {SOLID} && ({SOLID}.drawnAt ??= proxarm.world.frames) < proxarm.world.frames"
            new.append(time_to(browser, Session, folder, shown, "--scene", folder / "ball.yaml"))
        old = [time_to(browser, Session, folder, shown, "--scene", folder / "ball.yaml") for _ in range(options.runs)]
        told("328 048 triangles, for the first time", new, 3)
        told("328 048 triangles, again", old, 3)
        print(f"pictures a second: {pictures_a_second(browser, Session, folder):.0f} (at least 30)")
    three = pathlib.Path("/usr/share/javascript/three")
    files = [*(ROOT / "controller/extras/view/page").iterdir(), three / "build/three.module.js",
             three / "examples/jsm/controls/OrbitControls.js"]
    print(f"page: {sum(len(gzip.compress(file.read_bytes())) for file in files) / 1e6:.2f} MB (at most 1 MB)")
    for process in busy:
        process.terminate()


main()
