"""What `proxarm plan` promises of a bus, against the in-process bus's own log of a session on it.

The lengths of frames are counted here once more, bit by bit from the standard's layout (ISO 11898-1: 11-bit and 29-bit
data frames, CRC-15, a stuff bit after five equal bits, 13 bits that aren't stuffed).
"""
import collections
import functools
import re
import unittest

from harness import SOURCE, ProgramTest
import sensors_test  # not its classes: they would run here, too

BUS = re.compile(r"^(\S+): 1 Mbit/s, timestep ([\d.]+) ms$")
LOAD = re.compile(r"load where every frame is due: (?P<least>[\d.]+) to (?P<worst>[\d.]+) % .*; over many cycles "
                  r"typically (?P<typical>[\d.]+) %, at most (?P<most>[\d.]+) %")
FRAME = re.compile(r"^  (\S.*?) +([0-9A-F]{3,8}) +([\d.]+) +([\d.]+) +([\d.]+) +([\d.]+)  in time$")
LOGGED = re.compile(r"\((\d+)\.(\d{6})\) (\S+) ([0-9A-F]+)#([0-9A-F]*)$")


@functools.cache
def bits_on_the_wire(identifier, extended, data):
    def number(value, count):
        return [value >> i & 1 for i in reversed(range(count))]

    bits = [0]
    bits += number(identifier >> 18, 11) + [1, 1] + number(identifier & 0x3FFFF, 18) + [0, 0, 0] if extended else \
        number(identifier, 11) + [0, 0, 0]
    bits += number(len(data), 4)
    for byte in data:
        bits += number(byte, 8)
    crc = 0
    for bit in bits:
        crc = (crc << 1 ^ (0x4599 if bit != crc >> 14 else 0)) & 0x7FFF
    bits += number(crc, 15)
    stuffed, run, last = 0, 0, None
    for bit in bits:
        run = run + 1 if bit == last else 1
        last = bit
        if run == 5:
            stuffed, run, last = stuffed + 1, 1, 1 - bit
    return len(bits) + stuffed + 13


class Plan(ProgramTest):
    cell_with = sensors_test.OtherSensors.cell_with

    def planned(self, *arguments):
        """Bus -> its loads and, by identifier, the ends that the plan gives its frames (µs after a cycle's start)."""
        outcome = self.call("plan", *arguments)
        self.assertEqual(outcome.status, 0, outcome.err + outcome.out)
        plans = {}
        for line in outcome.out.splitlines():
            if match := BUS.match(line):
                ends = collections.defaultdict(list)
                plans[match[1]] = plan = {"period_us": 1000 * float(match[2]), "end_us": ends}
            elif match := LOAD.search(line):
                plan["load"] = [float(match[name]) / 100 for name in ("worst", "least", "most", "typical")]
            elif match := FRAME.match(line):
                ends[match[2]].append(float(match[5]))
        return plans

    def logged(self, *arguments):
        """Bus -> the frames of a session while it rendered: end (µs), identifier, bits."""
        outcome = self.call("run", "--json", "--duration", "1s", "--record", "session", *arguments)
        self.assertEqual(outcome.status, 0, outcome.err)
        buses = collections.defaultdict(list)
        for line in (self.folder / "session" / "frames.log").read_text().splitlines():
            seconds, micros, bus, identifier, data = LOGGED.match(line).groups()
            bits = bits_on_the_wire(int(identifier, 16), len(identifier) == 8, bytes.fromhex(data))
            buses[bus].append((1_000_000 * int(seconds) + int(micros), identifier, bits))
        # Rendering is from 0.45 s to 1.45 s.
        return {bus: [f for f in frames if 500_000 <= f[0] < 1_300_000] for bus, frames in buses.items()}

    def assert_agrees(self, arguments, streaming=False):
        plans, sessions = self.planned(*arguments), self.logged(*arguments)
        self.assertEqual(sorted(plans), sorted(sessions))
        # Cycles begin at multiples of the period after the first, at the same time on all buses; a SYNC takes 47 bits
        # and stuff bits, and is received at the end of its EOF, three bits before the next frame may start.
        syncs = [end - (bits - 3) for frames in sessions.values() for end, name, bits in frames if name == "080"]
        for bus, plan in plans.items():
            with self.subTest(bus):
                frames, period = sessions[bus], plan["period_us"]
                phase = min(start % period for start in syncs)
                self.assertLess(max(start % period - phase for start in syncs), 136, "a SYNC waits for one frame")
                cycles = int((frames[-1][0] - frames[0][0]) / period)
                begin = frames[0][0]
                seen = sum(bits for end, _, bits in frames if begin < end <= begin + cycles * period)
                load = seen / (cycles * period)
                worst, least, mean_worst, typical = plan["load"]
                self.assertLessEqual(load, mean_worst)
                self.assertGreaterEqual(load, least * mean_worst / worst - 0.01)
                self.assertLess(abs(load - typical), 0.01, f"{load:.4f} seen, {typical} predicted")
                for end, identifier, _ in frames:
                    self.assertIn(identifier, plan["end_us"], "a frame that isn't in the plan")
                    if bus == "sensor" and streaming:
                        continue  # at any time in the cycle
                    # µs of the log are cut off, the figures of the plan are rounded.
                    self.assertLessEqual((end - phase) % period, max(plan["end_us"][identifier]) + 1.1, identifier)

    def test_agrees_with_the_log_of_every_shipped_cell(self):
        for cell in sorted((SOURCE / "models/cells").glob("*.yaml")):
            with self.subTest(cell.name):
                self.assert_agrees([cell])
        with self.subTest("twice the timestep"):
            self.assert_agrees(["--timestep", "2ms"])

    def test_agrees_with_the_log_of_every_sensor(self):
        for name in sensors_test.MAKES:
            with self.subTest(name):
                self.assert_agrees([self.cell_with(name)], streaming=True)

    # LATE came with a longer timestep and CAN FD alone, where a key of the cell would do.
    def test_a_late_sensor_is_told_which_key_of_the_cell_would_bring_it_in_time_and_does(self):
        bench = "models/cells/bench.yaml"
        for wrong, way in ((("base_id: 0x12", "base_id: 0x7F"), r"sensor\.(base_id: 0x\w\w) \(lower identifiers win\)"),
                           (("receive_window: 0.55", "receive_window: 0.45"), r"(receive_window: 0\.\d+)")):
            with self.subTest(wrong[1]):
                cell = self.changed(bench, wrong)
                late = self.call("plan", cell)
                self.assertEqual(late.status, 1, late.err)
                self.assertIn("LATE", late.out)
                would_fit = late.out.split("would fit: ")[1]
                self.assertRegex(would_fit, way)
                self.assertIn("a timestep of 1.25 ms", would_fit)
                self.assert_refused(self.call("run", cell), "can't carry", re.search(way, would_fit)[0])
                cell.write_text(cell.read_text().replace(wrong[1], re.search(way, would_fit)[1]))
                mended = self.call("plan", cell)
                self.assertEqual(mended.status, 0, mended.out)
                cell.write_text((SOURCE / bench).read_text())

    def test_modbus_lines_are_told_with_their_arithmetic(self):
        rail = (SOURCE / "models/cells/rail.yaml").read_text()
        for path in ("../arms", "../../scenes", "../../sim", "../sensors", "../drives"):
            rail = rail.replace(path + "/", str((SOURCE / "models/cells" / path).resolve()) + "/")
        tcp = self.call("plan", self.written("tcp.yaml", rail))
        self.assertEqual(tcp.status, 0, tcp.err)
        self.assertIn("rail: Modbus TCP, 127.0.0.1, port 15020\n  rail, unit 1: 200 exchanges/s of 200 wanted; a setpoint "
                      "comes 7.5 ms later than on CAN\n", tcp.out)
        # The arithmetic stands in docs/reference/buses.md: 34 characters of 11 bits at 115,200 baud, and twice 1.75 ms.
        line = "device: /dev/ttyUSB0, baud: 115200"
        rtu = self.call("plan", self.written("rtu.yaml", rail.replace("host: 127.0.0.1, port: 15020", line)))
        self.assertIn("rail: Modbus RTU, /dev/ttyUSB0, 115200 baud\n  rail, unit 1: 6.75 ms an exchange, 1 device on the "
                      "line: 148 exchanges/s of 200 wanted; a setpoint comes 10.1 ms later than on CAN\n", rtu.out)
        slow = self.call("plan", self.written("slow.yaml", rail.replace("host: 127.0.0.1, port: 15020",
                                                                          line.replace("115200", "9600"))))
        self.assertIn("warning: the loop through rail can't be stable at", slow.err)


if __name__ == "__main__":
    unittest.main()
