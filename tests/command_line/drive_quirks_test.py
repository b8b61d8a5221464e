#!/usr/bin/python3
"""Every quirk of the table in drive_quirks.py, with the simulated far end in the program's own process."""
import unittest

import drive_quirks
from harness import ProgramTest

AT_S = 0.8  # from power on; the session renders by then
RESTS = ("name: at rest\nmass_kg: 1.0\nstiffness_N_per_m: 500\ndamping_Ns_per_m: 20\n"
         "waypoints:\n  - {time_s: 0.5, offset_m: [0, 0, 0]}\n")


class DriveQuirks(ProgramTest):
    def test_every_quirk_runs_or_stops_with_a_message_that_names_it(self):
        rows = drive_quirks.quirks()
        self.assertGreaterEqual(len(rows), 60)
        self.assertEqual(len({row.name for row in rows}), len(rows))
        file = self.copies() / "models/cells/bench.yaml"
        shipped = file.read_text()
        hand = self.written("rests.yaml", RESTS)
        for row in rows:
            with self.subTest(row.name):
                file.write_text(drive_quirks.cell_of(row, shipped))
                outcome = self.call("run", file, "--json", "--no-plot", "--hand", hand, "--duration", "0.8s",
                                    *row.arguments, *drive_quirks.texts(row, AT_S))
                summary = outcome.summary if outcome.out else None
                period_s = 0.002 if row.arguments else 0.001
                after_s = 0.0
                if summary and summary["faults"]:
                    after_s = summary["first_cycle_s"] + summary["faults"][0]["cycle"] * period_s - AT_S
                drive_quirks.check(self, row, outcome.status, outcome.err, summary, after_s, period_s)


if __name__ == "__main__":
    unittest.main()
