"""One axis is a CiA 402 drive written by hand in Python on python3-can; the other five and the sensor are simulated.

Nothing of it is shared with the controller or its simulation: the drive is a table of objects and the standard's state
machine, written down once more.
"""
import json
import struct
import time

import python_peer
import two_processes as two

NODE = 6
PRE_OPERATIONAL, OPERATIONAL = 0x7F, 0x05

# Statuswords (6041h) of the states, with voltage (bit 4) and remote (bit 9).
SWITCH_ON_DISABLED, READY, SWITCHED_ON, ENABLED, QUICK_STOP = 0x0250, 0x0231, 0x0233, 0x1237, 0x0217


class PythonDrive(python_peer.Peer):
    """Cyclic synchronous position: at SYNC it is where the last target was."""

    def __init__(self, interface):
        super().__init__(interface)
        self.nmt, self.state = PRE_OPERATIONAL, SWITCH_ON_DISABLED
        self.controlword, self.target, self.position = 0, 0, 0
        self.next_heartbeat = 0.0
        self.controlwords, self.positions, self.written, self.heartbeats = [], [], {}, []
        # Object, size in bytes, value.
        self.objects = {(0x1000, 0): (4, 0x00020192), (0x1018, 1): (4, 0x000000AB), (0x6502, 0): (4, 1 << 7)}
        for index, size in ((0x1017, 2), (0x6007, 2), (0x6060, 1), (0x6061, 1), (0x605A, 2), (0x6065, 4), (0x6066, 2)):
            self.objects[index, 0] = (size, 0)
        for index in ((0x1016, 1), (0x1400, 1), (0x1800, 1)):
            self.objects[index] = (4, 0)
        for pdo in (0x1400, 0x1800):
            self.objects[pdo, 1] = (4, 0x80000000)
            self.objects[pdo, 2] = (1, 0)
            self.objects[pdo, 5] = (2, 0)
        for mapping in (0x1600, 0x1A00):
            self.objects[mapping, 0] = (1, 0)
            for entry in range(1, 9):
                self.objects[mapping, entry] = (4, 0)
        self.objects[0x60C2, 1] = (1, 1)
        self.objects[0x60C2, 2] = (1, 0xFD)

    def run(self):
        self.send(two.HEARTBEAT + NODE, [0])  # boot-up
        while not self.over.is_set():
            message = self.bus.recv(0.005)
            if message is not None and not message.is_extended_id:
                self.receive(message.arbitration_id, bytes(message.data))
            period_s = self.objects[0x1017, 0][1] * 1e-3
            if period_s and time.monotonic() >= self.next_heartbeat:
                self.next_heartbeat = time.monotonic() + period_s
                self.send(two.HEARTBEAT + NODE, [self.nmt])

    def receive(self, identifier, data):
        if identifier == two.NMT and data[1] in (0, NODE):
            self.nmt = {0x01: OPERATIONAL, 0x80: PRE_OPERATIONAL, 0x02: 0x04}.get(data[0], self.nmt)
            self.next_heartbeat = 0.0
        elif identifier == two.SDO_REQUEST + NODE:
            self.send(two.SDO_ANSWER + NODE, self.sdo(data))
        elif self.nmt != OPERATIONAL:
            pass
        elif identifier == two.SYNC:
            if self.state == ENABLED:
                self.position = self.target
            self.send(two.TPDO + NODE, struct.pack("<Hi", self.state, self.position))
        elif identifier == two.RPDO + NODE:
            word, self.target = struct.unpack("<Hi", data)
            self.obey(word)

    def obey(self, word):
        if word != self.controlword:
            self.controlwords.append(word)
        self.controlword = word
        command = word & 0x8F
        if command & 0x02 == 0:
            self.state = SWITCH_ON_DISABLED
        elif command & 0x04 == 0:
            self.state = SWITCH_ON_DISABLED
        elif command == 0x06 and self.state in (SWITCH_ON_DISABLED, SWITCHED_ON, ENABLED):
            self.state = READY
        elif command == 0x07 and self.state in (READY, ENABLED):
            self.state = SWITCHED_ON
        elif command == 0x0F and self.state in (READY, SWITCHED_ON):
            self.state = ENABLED
        if self.state == ENABLED:
            self.positions.append(self.target)

    def sdo(self, request):
        """Expedited transfers of CiA 301; anything else is aborted: command specifier not valid."""
        command, index, sub = struct.unpack_from("<BHB", request)
        known = self.objects.get((index, sub))
        if command >> 5 not in (1, 2):
            return struct.pack("<BHBI", 0x80, index, sub, 0x05040001)
        if known is None:
            return struct.pack("<BHBI", 0x80, index, sub, 0x06020000)  # object doesn't exist
        size, value = known
        if command >> 5 == 2:
            return struct.pack("<BHBI", 0x43 | (4 - size) << 2, index, sub, value)
        value = int.from_bytes(request[4:4 + size], "little")
        self.objects[index, sub] = (size, value)
        self.written[index, sub] = value
        if (index, sub) == (0x1016, 1):
            self.heartbeats.append(value)
        if (index, sub) == (0x6060, 0):
            self.objects[0x6061, 0] = (1, value)
        return struct.pack("<BHBI", 0x60, index, sub, 0)


class PythonCiA402Drive(two.VcanTestCase):
    def test_is_set_up_enabled_followed_and_switched_off(self):
        """The simulated axis_6 is cut off from its bus; this drive answers in its place."""
        drive = PythonDrive("vcan1")
        with two.simulated_arm(two.THREE, "--fault", "axis_6:silent"), drive.running(), \
                two.controller(two.THREE, "0.5s") as run:
            self.assertEqual(run.wait(), 0, run.errors() + run.output())
            summary = json.loads(run.output())
        self.assertEqual(summary["faults"], [])
        self.assertEqual(drive.controlwords[:3], [0x06, 0x07, 0x0F])
        self.assertEqual(drive.controlwords[-2:], [0x06, 0x00])
        self.assertEqual(drive.state, SWITCH_ON_DISABLED)
        self.assertGreater(len(drive.positions), 500, "a target in every cycle")
        self.assertLess(max(abs(b - a) for a, b in zip(drive.positions, drive.positions[1:])), 1000)
        # 60C2h: 1 · 10⁻³ s. 1016h: node 127, 60 ms; none before it is set, and none in the end. 6060h: mode 8.
        # PDO1: 6040h and 607Ah; 6041h and 6064h.
        self.assertEqual((drive.written[0x60C2, 1], drive.written[0x60C2, 2]), (1, 0xFD))
        self.assertEqual(drive.heartbeats, [0, 0x007F003C, 0])
        self.assertEqual(drive.written[0x6060, 0], 8)
        self.assertEqual([drive.written[0x1600, n] for n in (1, 2)], [0x60400010, 0x607A0020])
        self.assertEqual([drive.written[0x1A00, n] for n in (1, 2)], [0x60410010, 0x60640020])
        self.assertEqual(drive.written[0x1400, 1], 0x206)
        self.assertEqual(drive.written[0x1800, 1] & 0xBFFFFFFF, 0x186)


if __name__ == "__main__":
    two.main()
