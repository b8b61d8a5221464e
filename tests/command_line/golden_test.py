#!/usr/bin/python3
"""The setpoints of these sessions are the same to the bit as when golden_setpoints.json was written.

A line of that file may change only where an arm is meant to move differently: with a change of the method, of a limit, of
what a shipped cell, scene or hand says. Moving code, renaming it or making it faster is no reason. Who changes it says so
in CHANGELOG.md, for whoever's arm moves differently after an upgrade, and writes it anew:

    PROXARM_PROGRAM=build/release/controller/proxarm tests/command_line/golden_test.py --write
"""
import json
import os
import sys
import unittest

import harness

FILE = harness.SOURCE / "tests" / "command_line" / "golden_setpoints.json"
# libm's results differ in the last bit between processors with and without these; without them all are alike.
PORTABLE = dict(os.environ, GLIBC_TUNABLES="glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4")

SHORT = ("--duration", "3s")
SESSIONS = {
    "default": (),
    "order 2": ("--order", "2"),
    "10 kg at 2 ms": ("--mass", "10", "--timestep", "2ms"),
    "damping and spring": ("--damping", "20", "--spring", "50"),
    "free orientation": ("--orientation", "free", *SHORT),
    "late sensor": ("--extra-delay", "4ms", "--mass", "8"),
    "passivity on": ("--passivity", "on"),
    "stiff grip": ("--hand", "@sim/hands/stiff_grip.yaml", *SHORT),
    "sweep in free space": ("--scene", "@scenes/free.yaml", "--hand", "@sim/hands/sweep.yaml"),
    "light cell, torques": ("@models/cells/light.yaml",),
    "rail on Modbus": ("@models/cells/rail.yaml",),
    "bench, two axes on one bus": ("@models/cells/bench.yaml",),
    "bench at 2 ms": ("@models/cells/bench.yaml", "--timestep", "2ms"),
    "one linear axis": ("@models/cells/linear.yaml",),
    "gantry of three": ("@models/cells/gantry.yaml",),
    "scara of four": ("@models/cells/scara.yaml",),
    "collaborative arm of six": ("@models/cells/cobot.yaml",),
    "seven axes": ("@models/cells/seven.yaml",),
    "sensor frozen": ("--fault", "sensor:frozen@4s"),
    "drive silent": ("--fault", "axis_2:silent@4s"),
    "drive faulty": ("--fault", "axis_3:fault=0x4210@4s"),
    "drive jammed": ("--fault", "axis_2:jammed@3s..5s"),
    "samples lost": ("--fault", "sensor:lost=2@2s..4s"),
    "parameters change": ("--set", "mass=8@2s", "--set", "damping=10@3s", "--set", "spring=20@4s"),
    "timestep changes": ("--set", "timestep=2ms@2s", "--set", "timestep=1ms@5s"),
    "hold and resume": ("--do", "hold@3s", "--do", "resume@5s"),
    "release in contact": ("--do", "hold@5s", "--do", "release@6s", "--do", "hold@7s", "--do", "resume@8s"),
    "back off in contact": ("--do", "hold@5s", "--do", "back-off 20mm@6s", "--do", "hold@7s", "--do", "resume@8s"),
    "order 2 on a groove": ("--order", "2", "--scene", "@scenes/groove.yaml"),
    **{f"scene {scene.stem}": ("--scene", f"@scenes/{scene.name}", "--duration", "6s")
       for scene in sorted((harness.SOURCE / "scenes").glob("*.yaml"))},
}


class GoldenSetpoints(harness.ProgramTest):
    def digest(self, arguments):
        """The hash of the setpoints, or what stands in its place where the session is refused."""
        shipped = [str(harness.SOURCE / a[1:]) if a.startswith("@") else a for a in arguments]
        outcome = self.call("run", "--json", "--no-plot", *shipped, env=PORTABLE, timeout=60)
        try:
            return outcome.summary["setpoint_sha256"]
        except ValueError:
            return f"status {outcome.status}"

    def test_every_session_sends_the_setpoints_that_it_always_sent(self):
        golden = json.loads(FILE.read_text())
        self.assertEqual(sorted(golden), sorted(SESSIONS), "sessions and their golden list differ")
        chosen = os.environ.get("PROXARM_GOLDEN")  # where sanitizers slow all down: some of them, "default|seven axes"
        for name in chosen.split("|") if chosen else SESSIONS:
            with self.subTest(name):
                self.assertEqual(self.digest(SESSIONS[name]), golden[name])


def write():
    case = GoldenSetpoints("test_every_session_sends_the_setpoints_that_it_always_sent")
    case.setUp()
    found = {name: case.digest(arguments) for name, arguments in SESSIONS.items()}
    case.doCleanups()
    FILE.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    write() if sys.argv[1:] == ["--write"] else unittest.main()
