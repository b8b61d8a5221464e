"""The controller, the simulated arm and can-utils as processes on the interfaces of a real kernel.

For tests that with-vcan runs. All times are those of the kernel's clock there.
"""
import collections
import contextlib
import ctypes
import hashlib
import json
import os
import re
import signal
import struct
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

PROGRAM = os.environ.get("PROXARM", "proxarm")
ONE = "vcan0"
THREE = "axes_1_3=vcan0,axes_4_6=vcan1,sensor=vcan2"
INTERFACES = ("vcan0", "vcan1", "vcan2")
NODES = range(1, 7)

# CiA 301: predefined identifiers. SYNC, EMCY, TPDO1, RPDO1, SDO answer and request, heartbeat; node added.
NMT, SYNC, EMCY, TPDO, RPDO, SDO_ANSWER, SDO_REQUEST, HEARTBEAT = 0x000, 0x080, 0x080, 0x180, 0x200, 0x580, 0x600, 0x700
MASTER_HEARTBEAT = HEARTBEAT + 127
SENSOR_IDS = range(0x680, 0x690)

Frame = collections.namedtuple("Frame", "time_us interface id data")
LOG_LINE = re.compile(r"\((\d+)\.(\d{6})\) (\S+) ([0-9A-F]{3})#([0-9A-F]*)$")


def read_log(path):
    """Frames of a log as candump -L writes it; every line has to be one."""
    frames = []
    for number, line in enumerate(Path(path).read_text().splitlines(), 1):
        match = LOG_LINE.match(line)
        if not match:
            raise ValueError(f"{path}:{number}: not a frame: {line!r}")
        seconds, micros, interface, identifier, data = match.groups()
        frames.append(
            Frame(int(seconds) * 1_000_000 + int(micros), interface, int(identifier, 16), bytes.fromhex(data)))
    return frames


def write_log(path, frames):
    with open(path, "w") as log:
        for f in frames:
            seconds, micros = divmod(f.time_us, 1_000_000)
            log.write(f"({seconds:010d}.{micros:06d}) {f.interface} {f.id:03X}#{f.data.hex().upper()}\n")


def by_identifier(frames):
    """(interface, identifier) -> its frames, in their order."""
    found = collections.defaultdict(list)
    for frame in frames:
        found[frame.interface, frame.id].append(frame)
    return found


def of_node(frames, function, node):
    return [f for f in frames if f.id == function + node]


def setpoints(frames):
    """Targets in counts, one list per node, out of its RPDOs: 6040h (16 bits), 607Ah (32 bits), little-endian."""
    return [[struct.unpack("<Hi", f.data)[1] for f in of_node(frames, RPDO, node)] for node in NODES]


def sha256_of_counts(targets, cycles):
    """Of lists of counts, one per axis: int32 little-endian, axis order, each of so many cycles. What an axis was sent
    after them is the goodbye, in which drives that are off are told where they are."""
    if any(len(counts) < cycles for counts in targets):
        raise ValueError(f"{cycles} cycles, but only {min(map(len, targets))} targets")
    digest = hashlib.sha256()
    for cycle in list(zip(*targets, strict=True))[:cycles]:
        digest.update(struct.pack(f"<{len(targets)}i", *cycle))
    return digest.hexdigest()


def setpoints_sha256(frames, summary):
    """The summary's setpoint_sha256, from nothing but frames and the number of cycles."""
    return sha256_of_counts(setpoints(frames), summary["cycles"])


class Process:
    """A process with its output in files; ended, if by nothing else, at the end of the with block."""

    def __init__(self, *command):
        self.out, self.err = tempfile.TemporaryFile("w+"), tempfile.TemporaryFile("w+")
        self.process = subprocess.Popen([str(word) for word in command], stdout=self.out, stderr=self.err)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        self.out.close()
        self.err.close()

    def send(self, number):
        self.process.send_signal(number)

    def wait(self, timeout_s=60):
        return self.process.wait(timeout_s)

    def stop(self, number=signal.SIGTERM):
        self.send(number)
        return self.wait()

    def output(self):
        return self._read(self.out)

    def printed(self):
        """How many bytes it has printed so far."""
        return os.fstat(self.out.fileno()).st_size

    def errors(self):
        return self._read(self.err)

    @staticmethod
    def _read(file):
        file.seek(0)
        return file.read()


@contextlib.contextmanager
def hung(process):
    """The main thread, which runs the cycle, stands still as under a debugger; all others of the process go on."""
    seize, interrupt, detach = 0x4206, 0x4207, 17  # linux/ptrace.h
    libc = ctypes.CDLL(None, use_errno=True)

    def ptrace(request):
        if libc.ptrace(ctypes.c_long(request), ctypes.c_long(process.process.pid), ctypes.c_void_p(), ctypes.c_void_p()):
            raise OSError(ctypes.get_errno(), "ptrace")

    ptrace(seize)
    ptrace(interrupt)
    os.waitpid(process.process.pid, 0)
    try:
        yield
    finally:
        ptrace(detach)


def thread_states(process):
    """'t': stopped by a debugger; the main thread's first."""
    tasks = Path(f"/proc/{process.process.pid}/task")
    return [(task / "stat").read_text().rpartition(")")[2].split()[0]
            for task in sorted(tasks.iterdir(), key=lambda task: int(task.name))]


def simulated_arm(bus, *options):
    """It listens first, and says when it has begun."""
    process = Process(PROGRAM, "sim", "--bus", bus, *options)
    for _ in range(100):
        if process.process.poll() is not None or "on the wire" in process.errors():
            break
        time.sleep(0.01)
    time.sleep(0.2)
    return process


def controller(bus, duration, record=None, *options):
    return Process(PROGRAM, "run", "--bus", bus, "--duration", duration, "--json", "--no-plot",
                   *(["--record", record, "--signals", "csv"] if record else []), *options)


def candump(*interfaces):
    """Its output is the log. -r: room for all frames of a second, should it be late."""
    process = Process("candump", "-L", "-r", 8_000_000, *interfaces)
    time.sleep(0.05)
    return process


def frames_of(process):
    """What a candump has seen; ends it."""
    time.sleep(0.05)
    process.stop()
    with tempfile.NamedTemporaryFile("w+") as log:
        log.write(process.output())
        log.flush()
        return read_log(log.name)


def source(path):
    """A shipped file."""
    return Path(__file__).resolve().parents[2] / path


def write_hand(folder, name):
    """The file of a hand that stays where the tool starts."""
    path = Path(folder) / f"{name}.yaml"
    path.write_text("name: at rest\nmass_kg: 1.0\nstiffness_N_per_m: 500\ndamping_Ns_per_m: 20\n"
                    "waypoints:\n  - {time_s: 0.5, offset_m: [0, 0, 0]}\n")
    return path


class Session:
    """One run of both processes from begin to end, with candump as the witness."""

    def __init__(self, bus, duration, folder):
        self.folder = Path(folder)
        with simulated_arm(bus) as arm, candump(*INTERFACES) as witness:
            with controller(bus, duration, self.folder) as run:
                self.status = run.wait()
                self.errors = run.errors()
                output = run.output()
            time.sleep(0.2)  # longer than the drives wait for the controller's heartbeat
            self.seen = frames_of(witness)
            self.arm_status = arm.stop()
            self.arm_errors = arm.errors()
        self.summary = json.loads(output) if output else None

    def recorded(self):
        return read_log(self.folder / "frames.log")


class VcanTestCase(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def assert_drives_off(self, seen):
        """By the last word of every drive: 6041h says anything but operation enabled or quick stop active."""
        for node in NODES:
            word = struct.unpack("<Hi", of_node(seen, TPDO, node)[-1].data)[0]
            self.assertNotIn(word & 0x6F, (0x27, 0x07), f"node {node}: {word:04X}")


def main():
    """Status 77, skipped, where there is no vcan or its clock can't promise deadlines."""
    if os.environ.get("VCAN_CLOCK") != "virtual":
        print("needs the virtual clock: VCAN_BACKEND=uml tests/vcan/with-vcan ...", file=sys.stderr)
        sys.exit(77)
    unittest.main(verbosity=2)
