"""An axis on Modbus TCP under five on CAN: the controller and the simulated arm as two processes, on real interfaces of
both kinds."""
import contextlib
import json
import os
import re
import socket
import subprocess
import threading
from pathlib import Path

import two_processes as two

CELL = Path(__file__).resolve().parents[2] / "models/cells/rail.yaml"
BUSES = "axes_2_3=vcan0,axes_4_6=vcan1,sensor=vcan2"


class ModbusAxis(two.VcanTestCase):
    @classmethod
    def setUpClass(cls):
        subprocess.run(["ip", "link", "set", "lo", "up"], check=True)

    def run_both(self, *faults, far_end=CELL, cell=CELL, options=()):
        with two.simulated_arm(BUSES, far_end, *faults) as arm:
            with two.Process(two.PROGRAM, "run", cell, "--bus", BUSES, "--duration", "2s", "--json",
                             "--no-plot", *options) as run:
                status, output, errors = run.wait(), run.output(), run.errors()
            self.assertEqual(arm.stop(), 0, arm.errors())
        self.assertTrue(output, errors)
        return status, json.loads(output), errors


class OnThisMachine(ModbusAxis):
    def test_ends_well(self):
        status, summary, errors = self.run_both()
        self.assertEqual(status, 0, errors)
        self.assertEqual(summary["faults"], [])
        self.assertRegex(errors, r"rail on Modbus line rail, unit 1: \d+(\.\d+)? exchanges/s of 200 wanted")

    def test_a_connection_that_is_closed_stops_the_arm(self):
        status, summary, errors = self.run_both("--fault", "rail:closed@1.5s")
        self.assertEqual(status, 1, errors)
        self.assertEqual([fault["fault"] for fault in summary["faults"]], ["modbus_silent"])
        self.assertIn("Modbus connection was closed", summary["faults"][0]["text"])


    def test_a_first_position_that_does_not_show_the_order_of_its_words_is_refused(self):
        """The rail starts at 0, which is 0 in either order; on a line only somebody who has tried it knows."""
        text = re.sub(r"(:\s*)(\.\./[\w./]+)", lambda m: m[1] + str((CELL.parent / m[2]).resolve()), CELL.read_text())
        untried = self.folder / "untried.yaml"
        untried.write_text(re.sub(r" +word_order_tried: .*\n", "", text))
        with two.simulated_arm(BUSES, CELL) as arm:
            done = subprocess.run([two.PROGRAM, "run", untried, "--bus", BUSES, "--duration", "1s"], capture_output=True,
                                  text=True, timeout=60)
            self.assertEqual(arm.stop(), 0, arm.errors())
        self.assertEqual(done.returncode, 2, done.stdout + done.stderr)
        self.assertIn("word_order_tried", done.stderr)
        self.assertIn("rail", done.stderr)


NETWORK_ADDRESS = "10.77.0.1"
PORT = 15020  # of the cell's file


@contextlib.contextmanager
def drive_in_the_network():
    """The simulated axis behind an address of the network: what arrives there goes to the loopback address and back."""
    subprocess.run(["ip", "address", "add", NETWORK_ADDRESS + "/32", "dev", "lo"], check=True)
    listener = socket.create_server((NETWORK_ADDRESS, PORT))

    def forward(source, sink):
        with contextlib.suppress(OSError):
            while data := source.recv(4096):
                sink.sendall(data)
            sink.shutdown(socket.SHUT_WR)

    def serve():
        with contextlib.suppress(OSError):
            while True:
                near = listener.accept()[0]
                far = socket.create_connection(("127.0.0.1", PORT))
                for end in (near, far):
                    end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                threading.Thread(target=forward, args=(near, far), daemon=True).start()
                threading.Thread(target=forward, args=(far, near), daemon=True).start()

    threading.Thread(target=serve, daemon=True).start()
    try:
        yield
    finally:
        listener.close()
        subprocess.run(["ip", "address", "del", NETWORK_ADDRESS + "/32", "dev", "lo"], check=True)


class RealPeer(ModbusAxis):
    """A Modbus drive elsewhere needs what a real CAN interface needs: --hardware, the checklist, an enabling input."""

    def cell(self, name, text):
        text = re.sub(r"(:\s*)(\.\./[\w./]+)", lambda m: m[1] + str((CELL.parent / m[2]).resolve()), text)
        (self.folder / name).write_text(text)
        return self.folder / name

    def refused(self, cell, *options, **environment):
        done = subprocess.run([two.PROGRAM, "run", cell, "--bus", BUSES, *options], capture_output=True, text=True,
                              timeout=60, env={**os.environ, **environment}, stdin=subprocess.DEVNULL)
        self.assertEqual(done.returncode, 2, done.stdout + done.stderr)
        return done.stderr

    def setUp(self):
        super().setUp()
        text = CELL.read_text()
        switch = "enabling_input: {drive: axis_2, bit: 16}\n"
        self.without_switch = self.cell("without.yaml", text.replace("127.0.0.1", NETWORK_ADDRESS))
        self.real = self.cell("real.yaml", text.replace("127.0.0.1", NETWORK_ADDRESS) + switch)
        self.near = self.cell("near.yaml", text + switch)

    def test_is_refused_without_the_option_the_switch_or_somebody_who_confirms(self):
        errors = self.refused(self.real)
        self.assertIn("bus rail: this Modbus peer isn't a process of this machine: a real axis would move", errors)
        self.assertIn("found 10.77.0.1, port 15020, expected a loopback address", errors)
        self.assertIn("for a real arm --hardware", errors)
        self.assertIn("enabling_input: found none, expected one",
                      self.refused(self.without_switch, "--hardware=checked"))
        self.assertIn("real.yaml.proof: found no proof", self.refused(self.real, "--hardware"))
        errors = self.refused(self.real, "--hardware", "--without-proof")
        self.assertIn("drives of a real arm on 10.77.0.1, port 15020", errors)
        self.assertIn("8. each Modbus drive stops by its own communication timeout", errors)
        self.assertIn("no terminal to confirm on", errors)
        self.assertIn("found 127.0.0.1, port 15020", self.refused(self.near, PROXARM_TREAT_AS_REAL="127.0.0.1"))

    def test_runs_with_all_of_them(self):
        with drive_in_the_network():
            # No `proxarm zero` has been at this sensor, whose zero is that of a simulated one.
            status, summary, errors = self.run_both(far_end=self.near, cell=self.real,
                                                    options=["--hardware=checked", "--without-proof",
                                                             "--accept-force", "100N"])
        self.assertEqual(status, 0, errors)
        self.assertEqual(summary["faults"], [])
        self.assertIn("This will enable the drives of a real arm on 10.77.0.1, port 15020", errors)
        self.assertRegex(errors, r"rail on Modbus line rail, unit 1: \d+(\.\d+)? exchanges/s of 200 wanted")

    def test_nobody_there_is_said_with_the_place(self):
        with two.simulated_arm(BUSES, self.near):
            errors = self.refused(self.real, "--hardware=checked", "--without-proof")
        self.assertIn("the Modbus line can't be opened: found 10.77.0.1, port 15020:", errors)


if __name__ == "__main__":
    two.main()
