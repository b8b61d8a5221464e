#!/usr/bin/python3
"""What drives on Modbus do otherwise than a master would wish, and what is then to happen: a table, simulated.

Expected is what the Modbus specification and docs/reference/buses.md ("Drives on Modbus") say. Answers that are late, echoed or
another's on real lines: tests/sim/devices/modbus_server_test.cpp.
"""
import unittest

from harness import SOURCE, ProgramTest

AT_S, PERIOD_S = 0.8, 0.002
STALE_S = 0.06  # models/drives/generic_absolute.yaml: stale_after_s
EXCHANGE_S = 0.005  # 200 a second
# Wording of the specification, V1.1b3, section 7.
EXCEPTIONS = {1: "illegal function", 2: "illegal data address", 3: "illegal data value", 4: "server device failure",
              5: "acknowledge", 8: "memory parity error", 10: "gateway path unavailable",
              11: "gateway target device failed to respond"}


def rows():
    """Name, fault of the drive, expected: nothing (it runs), words of a refusal, or (fault, words, seconds)."""
    for code, text in EXCEPTIONS.items():
        yield f"exception {code} in motion", f"exception={code}@AT", (
            "drive_fault", (f"exception {code} ({text})",), 2 * EXCHANGE_S)
        yield f"exception {code} at the start", f"exception={code}", (f"exception {code}, {text}", "register 32")
    yield "busy for good, in motion", "exception=6@AT", ("modbus_silent", (), STALE_S + 2 * EXCHANGE_S)
    yield "busy for 40 ms, in motion", "exception=6@0.8s..0.84s", None
    yield "busy for good, at the start", "exception=6", ("exception 6, server device busy", "register 32")
    yield "silent in motion", "silent@AT", ("modbus_silent", (), STALE_S + 2 * EXCHANGE_S)
    yield "silent for 40 ms", "silent@0.8s..0.84s", None
    yield "silent at the start", "silent", ("register 32", "no complete Modbus answer in time")
    yield "one answer in five lost", "lost=5@AT", None
    yield "every second answer lost", "lost=2@AT", None
    yield "connection closed in motion", "closed@AT", ("modbus_silent", (), 2 * EXCHANGE_S)
    yield "connection closed at the start", "closed", ("register 32",)
    yield "another unit's answers in motion", "wrong_unit@AT", ("drive_fault", ("another unit",), 2 * EXCHANGE_S)
    yield "another function's answers in motion", "wrong_function@AT", ("drive_fault", (), STALE_S + 2 * EXCHANGE_S)
    yield "another function's answers for 40 ms", "wrong_function@0.8s..0.84s", None
    yield "answers with a wrong count", "wrong_count@AT", ("drive_fault", (), STALE_S + 2 * EXCHANGE_S)
    yield "another function's answers at the start", "wrong_function", ("register 32",)
    yield "half answers in motion", "half_answer@AT", ("modbus_silent", (), STALE_S + 2 * EXCHANGE_S)
    yield "words in the other order", ("low_first", "offset=0.2rad"), ("word_order", "200000", "Nothing was sent to move")
    # At 0, where nothing shows, and the cell says that somebody has tried it: the first count gives it away.
    yield "words in the other order, at 0", "low_first", ("position_implausible", (), None)
    yield "settings that aren't kept", "forgets", ("communication timeout, register 32, read back", "found 0")
    yield "function 23 unknown", "no_function_23", ("drive_fault", ("exception 1 (illegal function)",), None)
    yield "never ready", "not_ready", ("drive_not_enabled", ("rail",), None)
    yield "never driven", "not_driven", ("drive_not_enabled", ("rail",), None)
    yield "a fault in its status", "tripped@AT", ("drive_fault", (), 2 * EXCHANGE_S)
    yield "power lost in motion", "power@AT", ("modbus_silent", (), STALE_S + 2 * EXCHANGE_S)


class ModbusQuirks(ProgramTest):
    def check(self, outcome, expected):
        if expected is None:
            self.assertEqual(outcome.status, 0, outcome.err)
            self.assertEqual(outcome.summary["faults"], [])
            return
        if all(isinstance(word, str) for word in expected):
            self.assertEqual(outcome.status, 2, outcome.err)
            for word in ("rail", *expected):
                self.assertIn(word, outcome.err)
            return
        name, words, within_s = expected
        self.assertEqual(outcome.status, 1, outcome.err)
        faults = outcome.summary["faults"]
        self.assertEqual([fault["fault"] for fault in faults], [name], faults)
        for word in (*words, "rail"):
            self.assertIn(word, faults[0]["text"])
        if within_s is None:
            return
        after_s = outcome.summary["first_cycle_s"] + faults[0]["cycle"] * PERIOD_S - AT_S
        self.assertGreaterEqual(after_s, 0.0)
        self.assertLessEqual(after_s, within_s + PERIOD_S)

    def test_every_quirk_runs_or_stops_with_a_message_that_names_it(self):
        table = list(rows())
        self.assertGreaterEqual(len(table), 26)
        for name, fault, expected in table:
            with self.subTest(name):
                faults = [fault] if isinstance(fault, str) else fault
                options = [word for text in faults for word in ("--fault", "rail:" + text.replace("AT", f"{AT_S}s"))]
                self.check(self.call("run", SOURCE / "models/cells/rail.yaml", "--json", "--no-plot", "--duration",
                                     "0.8s", "--timestep", "2ms", *options), expected)


if __name__ == "__main__":
    unittest.main()
