"""The quirks of tests/command_line/drive_quirks.py between two processes on a real kernel's CAN.

A few by day; all of them with PROXARM_ALL_QUIRKS=1.
"""
import json
import os
import sys
import time
from pathlib import Path

import two_processes as two

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "command_line"))
import drive_quirks  # noqa: E402

CELLS = Path(__file__).resolve().parents[2] / "models/cells"
AT_S = 3  # from the far end's power on; the controller begins 0.2 s after it and renders within a second
BY_DAY = ("no heartbeat consumer", "RPDO read-only and event-driven", "mode before mapping, as the cell says",
          "bit 4 wanted, as the cell says", "stray SDO answers, each twice and without a size",
          "SDO answers 700 ms late", "heartbeat whose bit 7 toggles", "boot-up in motion",
          "TPDO shorter than its mapping", "two of one node", "STO opened in motion", "EMCY 0x8120 that stops nothing")


class DriveQuirks(two.VcanTestCase):
    def play(self, row, shipped, hand):
        """Status, messages, and the summary or None."""
        cell = self.folder / "bench.yaml"
        cell.write_text(drive_quirks.cell_of(row, shipped))
        with two.simulated_arm("vcan0", cell, "--hand", hand, *row.arguments, *drive_quirks.texts(row, AT_S)) as arm:
            with two.controller("vcan0", "5s", None, cell, "--hand", hand, *row.arguments) as run:
                status = run.wait()
                errors, output = run.errors(), run.output()
            self.assertEqual(arm.stop(), 0, arm.errors())
        return status, errors, json.loads(output) if output else None

    def test_every_quirk_runs_or_stops_with_a_message_that_names_it(self):
        shipped = (CELLS / "bench.yaml").read_text()
        for path in ("../arms", "../sensors", "../../scenes", "../../sim"):
            shipped = shipped.replace(f" {path}/", f" {(CELLS / path).resolve()}/")
        hand = two.write_hand(self.folder, "at_rest")
        rows = [row for row in drive_quirks.quirks() if not row.own_process_only]
        if "PROXARM_ALL_QUIRKS" not in os.environ:
            rows = [row for row in rows if row.name in BY_DAY]
            self.assertEqual(len(rows), len(BY_DAY))
        begun = time.monotonic()
        for row in rows:
            with self.subTest(row.name):
                status, errors, summary = self.play(row, shipped, hand)
                # When the far end's power came on isn't the controller's to know: that it stops in time is what the
                # same table shows in one process.
                drive_quirks.check(self, row, status, errors, summary, 0.0, 0.001)
        print(f"  {len(rows)} quirks, {time.monotonic() - begun:.0f} s")


if __name__ == "__main__":
    two.main()
