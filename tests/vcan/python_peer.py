"""A device written by hand in Python on python3-can: a thread with a bus of its own."""
import contextlib
import threading

import can  # python3-can


class Peer(threading.Thread):
    """run() goes on until `over` is set."""
    extended = False

    def __init__(self, interface):
        super().__init__(daemon=True)
        self.bus = can.Bus(interface="socketcan", channel=interface)
        self.over = threading.Event()

    def send(self, identifier, data):
        self.bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=self.extended))

    @contextlib.contextmanager
    def running(self):
        self.start()
        try:
            yield self
        finally:
            self.over.set()
            self.join()
            self.bus.shutdown()
