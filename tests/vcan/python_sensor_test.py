"""Each CAN sensor as a peer written by hand in Python on python3-can: bytes in its maker's format, sent and obeyed by
nothing that the controller or its simulation shares. The program reads them; the arm's axes are the simulated ones.

Every sensor stands still under the same load but for one count of noise; values are as near to it as its counts are.
"""
import contextlib
import csv
import re
import struct
import subprocess
import time
from pathlib import Path

import python_peer
import two_processes as two

MODELS = Path(__file__).resolve().parents[2] / "models"
PERIOD_S = 0.001
LOADED = ("--accept-force", "60")  # they stand under 13.3 N from the beginning on; the ATI has another zero, too, 46 N off


class Sensor(python_peer.Peer):
    """Sends its frames every millisecond while it streams; what it is told is in `commands`."""
    def __init__(self, interface, streaming=False):
        super().__init__(interface)
        self.streaming, self.commands, self.samples = streaming, [], 0

    def send_sample(self):
        for identifier, data in self.frames(self.samples):
            self.send(identifier, data)
        self.samples += 1

    def run(self):
        due = time.monotonic()
        while not self.over.is_set():
            message = self.bus.recv(max(0.0, due - time.monotonic()) if self.streaming else 0.01)
            if message is not None and message.is_extended_id == self.extended:
                self.commands.append((message.arbitration_id, bytes(message.data).hex()))
                self.obey(message.arbitration_id, bytes(message.data))
            if self.streaming and time.monotonic() >= due:
                self.send_sample()
                due += PERIOD_S
            elif not self.streaming:
                due = time.monotonic()


class Aidin(Sensor):
    """AFT200-D80: F = n / 100 - 300 N, T = n / 500 - 50 Nm, unsigned, big-endian, then two bytes of nothing."""
    file, base_id, heard = "aidin_aft200", "", ("001", "002")
    wrench = (12.34, -5.00, 0.0, 0.4, -0.6, 0.25)
    told = [(0x102, "0103010000000000")]

    def frames(self, number):
        return ((0x001, bytes.fromhex("7A02 733C 7530 0000" if number % 2 else "7A02 733C 7531 0000")),
                (0x002, bytes.fromhex("6270 607C 6225 0000")))

    def obey(self, identifier, data):
        if (identifier, data) == (0x102, bytes.fromhex("0103010000000000")):
            self.streaming = True


class Robotous(Sensor):
    """RFT: 0x0B, six signed numbers, Tx split between the frames; N / 50, Nm / 2000; overload byte."""
    file, heard = "robotous_rft", ("1F1", "1F2")
    base_id = "settings: {command_id: 0x1F0, first_id: 0x1F1, second_id: 0x1F2}"
    wrench = (12.34, -5.00, 0.0, 0.4, -0.6, 0.25)
    told = [(0x1F0, "0c00000000000000"), (0x1F0, "0f08000000000000"), (0x1F0, "0b00000000000000")]

    def frames(self, number):
        return ((0x1F1, bytes.fromhex("0B 0269 FF06 0000 03" if number % 2 else "0B 0269 FF06 0001 03")),
                (0x1F2, bytes.fromhex("20 FB50 01F4 00 0000")))

    def obey(self, identifier, data):
        if identifier == 0x1F0 and data[0] in (0x0B, 0x0C):
            self.streaming = data[0] == 0x0B


class OnRobot(Sensor):
    """HEX-E: AA 07 08 16, counter, status, six signed numbers, sum of all bytes; a packet of 22 bytes in three frames."""
    file, base_id, heard = "onrobot_hex", "", ("100",)
    wrench = (12.3, -5.0, 0.0, 0.4, -0.6, 0.25)
    told = [(0x101, "aa00320300010000"), (0x101, "e0"), (0x101, "aa00320301010000"), (0x101, "e1")]  # stop, 1000 Hz
    received = b""

    def frames(self, number):
        fz = number % 2
        packet = struct.pack(">4B8h", 0xAA, 0x07, 0x08, 0x10, number % 0x8000, 0, 123, -50, fz, 400, -600, 250)
        packet += struct.pack(">H", sum(packet) & 0xFFFF)
        return tuple((0x100, packet[at:at + 8]) for at in (0, 8, 16))

    def obey(self, identifier, data):
        """Nine bytes in two frames: AA 00 32 03, rate, filter, zero, sum."""
        if identifier != 0x101:
            return
        self.received = data if data[:4] == bytes.fromhex("AA003203") else self.received + data
        if len(self.received) == 9 and sum(self.received[:7]) == int.from_bytes(self.received[7:], "big"):
            self.streaming = self.received[4] != 0


class DynPick(Sensor):
    """29-bit identifiers command << 24 | id; n = 8192 + 32.765 / N, 8192 + 436.867 / Nm."""
    extended = True
    file, base_id, heard = "wacoh_dynpick", "base_id: 7", ("01000007", "02000007")
    wrench = (404 / 32.765, -164 / 32.765, 0.0, 175 / 436.867, -262 / 436.867, 109 / 436.867)
    told = [(0x04000007, ""), (0x03000007, "")]

    def frames(self, number):
        return ((0x01000007, bytes.fromhex("2194 1F5C 2000" if number % 2 else "2194 1F5C 2001")),
                (0x02000007, bytes.fromhex("20AF 1EFA 206D")))

    def obey(self, identifier, data):
        if identifier in (0x03000007, 0x04000007):
            self.streaming = identifier == 0x03000007


class Ati(Sensor):
    """Net CAN OEM at base id 0x68: polled. The matrix is 1000 on its diagonal, 1000 counts/N and 4000 counts/Nm, so that
    a gauge is a newton, or a quarter of a newton metre. 447A0000 is the float 1000."""
    file, base_id, heard = "ati_net_can_oem", "base_id: 0x68", ()
    wrench = (12.0, -6.0, 0.0, 0.5, -0.5, 0.25)
    told = [(0x68F, ""), (0x685, "")] + [(0x682, f"0{row}") for row in range(6)] + [(0x687, ""), (0x688, ""), (0x680, "")]

    def frames(self, number):
        """Status, SG0, SG2, SG4; SG1, SG3, SG5."""
        return ((0x680, bytes.fromhex("0000 000C 0000 FFFE" if number % 2 else "0000 000C 0001 FFFE")),
                (0x681, bytes.fromhex("FFFA 0002 0001")))

    def obey(self, identifier, data):
        if identifier == 0x680:
            self.send_sample()
        elif identifier == 0x682:
            row = [bytes(4)] * 6
            row[data[0]] = bytes.fromhex("447A0000")
            for i in range(3):
                self.send(0x682 + i, row[2 * i] + row[2 * i + 1])
        elif identifier >> 4 == 0x68:
            answers = {0x68F: "0301002A", 0x685: "4654313233343500", 0x687: "000003E800000FA0", 0x688: "0203"}
            self.send(identifier, bytes.fromhex(answers[identifier]))


class PythonSensors(two.VcanTestCase):
    def cell_with(self, kind):
        text = (MODELS / "cells/default.yaml").read_text()
        for path in ("../arms", "../sensors", "../../scenes", "../../sim"):
            text = text.replace(path + "/", str((MODELS / "cells" / path).resolve()) + "/")
        text = text.replace("/ati_net_can_oem.yaml", f"/{kind.file}.yaml")
        file = self.folder / f"{kind.file}.yaml"
        file.write_text(re.sub(r"  base_id: 0x68\n", f"  {kind.base_id}\n" if kind.base_id else "", text))
        return file

    def assert_read(self, kind):
        """The simulated sensor answers on another interface, where nobody listens."""
        record = self.folder / kind.file
        with two.simulated_arm("axes_1_3=vcan0,axes_4_6=vcan1,sensor=vcan3"), kind("vcan2").running() as sensor, \
                two.controller(two.THREE, "0.2s", record, self.cell_with(kind), *LOADED) as run:
            self.assertEqual(run.wait(), 0, run.errors() + run.output())
        commands = iter(sensor.commands)
        for identifier, data in kind.told:
            self.assertIn((identifier, data), commands, "in this order, whatever else it is told")
        self.assert_recorded(record, kind.wrench)

    def assert_recorded(self, record, wrench):
        with open(record / "signals.csv") as signals:
            rows = list(csv.DictReader(signals))
        self.assertGreater(len(rows), 400)
        names = [f"{what}_S_{axis}" for what, unit in (("force", "N"), ("torque", "Nm")) for axis in
                 (f"x_{unit}", f"y_{unit}", f"z_{unit}")]
        for row in rows:
            for name, value in zip(names, wrench):
                noise = 1.0 if name == "force_S_z_N" else 0.0  # the count that comes and goes, a newton of the coarsest
                self.assertLessEqual(abs(float(row[name]) - value), noise + 1e-9, (row["cycle"], name))
        self.assertEqual(len({row["force_S_z_N"] for row in rows}), 2, "new samples")

    def test_aidin(self):
        self.assert_read(Aidin)

    def test_robotous(self):
        self.assert_read(Robotous)

    def test_onrobot(self):
        self.assert_read(OnRobot)

    def test_dynpick(self):
        self.assert_read(DynPick)

    def test_ati(self):
        self.assert_read(Ati)

    def test_ft300_on_modbus(self):
        """12.34 N, -5.00 N, 0, 0.4 Nm, -0.6 Nm, 0.25 Nm."""
        text = self.cell_with(Aidin).read_text().replace("/aidin_aft200.yaml", "/robotiq_ft300.yaml")
        record, cell = self.folder / "ft300", self.folder / "ft300.yaml"
        peer_program = Path(__file__).resolve().parents[1] / "fieldbus/modbus/modbus_peer.py"
        with subprocess.Popen(["/usr/bin/python3", peer_program, "ft300"], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                              text=True) as peer:
            terminal = peer.stdout.readline().strip()
            text = text.replace("\ndrives:", "\nmodbus_lines:\n"
                                f"  - {{name: ft, device: {terminal}, baud: 19200, parity: none}}\ndrives:")
            cell.write_text(text.replace("  bus: sensor\n", "  bus: ft\n  base_id: 9\n"))
            with two.simulated_arm("axes_1_3=vcan0,axes_4_6=vcan1,sensor=vcan3"), \
                    two.controller(two.THREE, "0.2s", record, cell, *LOADED) as run:
                self.assertEqual(run.wait(), 0, run.errors() + run.output())
            peer.stdin.close()
        self.assert_recorded(record, (12.34, -5.0, 0.0, 0.4, -0.6, 0.25))

    def test_scan_hears_those_that_stream_and_polls_the_one_it_is_told_to(self):
        scan = [two.PROGRAM, "scan", "--bus", "vcan2"]
        with contextlib.ExitStack() as running:
            for kind in (Aidin, Robotous, OnRobot, DynPick):
                running.enter_context(kind("vcan2", streaming=True).running())
            ati = running.enter_context(Ati("vcan2").running())
            silent = subprocess.run(scan, capture_output=True, text=True)
            self.assertEqual([c for c in ati.commands if c[0] >> 4 == 0x68], [], "nothing but SDO uploads is sent unasked")
            polled = subprocess.run([*scan, "--poll-sensor", "0x68"], capture_output=True, text=True)
        for kind in (Aidin, Robotous, OnRobot, DynPick):
            for identifier in kind.heard:
                self.assertIn(identifier, silent.stdout)
        self.assertEqual((silent.returncode, polled.returncode), (1, 0), silent.stdout + polled.stdout)
        self.assertIn("12", polled.stdout)


if __name__ == "__main__":
    two.main()
