"""Records with signals.bin: read here from the layout that docs/reference/files.md promises, and held against signals.csv."""
import array
import csv
import itertools
import json
import math
import os
import signal
import struct
import subprocess
import time
import unittest

import mcap_reader
from harness import SOURCE, ProgramTest, program
from view_client import Session

ROWS = 512  # of a block
FORMS = {"csv": {"signals.csv", "contacts.csv", "frames.log"}, "binary": {"signals.bin", "contacts.bin", "frames.log"},
         "packed": {"signals.bin", "contacts.bin", "frames.log.zst"}}


def read_table(data):
    """Columns by name, as text, from docs/reference/files.md alone."""
    assert data[:8] == b"PXSIGNAL"
    version, begin, rows, count = struct.unpack("<4I", data[8:24])
    assert version in (1, 2) and (begin % 4096, rows) == (0, ROWS)
    columns = json.loads(data[24:begin])["columns"]
    assert len(columns) == count
    numbers = [array.array("d") for _ in columns]
    if version == 2:
        data, packed = data[:begin], data[begin:]
        while packed:
            size, = struct.unpack_from("<I", packed)
            data += mcap_reader.unpacked("zstd", packed[4:4 + size], 8 * rows * count)
            packed = packed[4 + size:]
    for block in range((len(data) - begin) // (8 * rows * count)):
        for i, column in enumerate(numbers):
            at = begin + 8 * rows * (block * count + i)
            column.frombytes(data[at:at + 8 * rows])
    empty = bytes.fromhex("7ff800454d505459")
    there = sum(struct.pack(">d", value) != empty for value in numbers[0])
    assert all(struct.pack(">d", value) != empty for value in numbers[0][:there])
    texts = {}
    for column, values in zip(columns, numbers):
        words = column.get("words", "").split("|")

        def text(value):
            if struct.pack(">d", value) == empty:
                return ""
            if column["form"] == "word":
                return words[int(value)]
            if column["form"] == "flags":
                return "|".join(word for bit, word in enumerate(words) if int(value) >> bit & 1)
            return value
        texts[column["name"]] = [text(value) for value in values[:there]]
    return texts


class BinaryRecords(ProgramTest):
    def both(self, *arguments, form="binary"):
        """The same session twice, as text and as numbers."""
        for name, form in (("text", "csv"), ("numbers", form)):
            outcome = self.call("run", "--no-plot", "--json", "--record", name, "--signals", form, *arguments)
            self.assertIn(outcome.status, (0, 1), outcome.err)
        self.assertFalse((self.folder / "numbers/signals.csv").exists())
        return self.folder / "text", self.folder / "numbers"

    def test_has_what_the_text_has_to_the_bit(self):
        sessions = (("--duration", "2s"), ("--duration", "5s", "--fault", "axis_3:silent@4s"),
                    (SOURCE / "models/cells/light.yaml", "--duration", "2s"),
                    ("--scene", SOURCE / "scenes/soft_corner.yaml", "--hand", SOURCE / "sim/hands/explore.yaml",
                     "--duration", "4s"))
        for words, form in itertools.product(sessions, ("binary", "packed")):
            with self.subTest(words=words, form=form):
                text, numbers = self.both(*words, form=form)
                with open(text / "signals.csv", newline="") as file:
                    rows = list(csv.DictReader(file))
                table = read_table((numbers / "signals.bin").read_bytes())
                self.assertEqual(list(table), list(rows[0]))
                for name, values in table.items():
                    for row, value in zip(rows, values, strict=True):
                        # float() reads the nearest double, and the file's numbers are the shortest that name one.
                        self.assertEqual(row[name], value if isinstance(value, str) else row[name] and
                                         (row[name] if float(row[name]) == value else value), name)
                self.assertEqual(self.call("signals", numbers).out, (text / "signals.csv").read_text())
                self.assertEqual(self.call("signals", text).out, (text / "signals.csv").read_text())
                contacts = (text / "contacts.csv").read_text()
                for folder in (text, numbers):
                    self.assertEqual(self.call("signals", folder, "--contacts").out, contacts)
                    self.assertEqual((folder / "contact_columns.json").read_text(), (text / "contact_columns.json").read_text())
                self.assertEqual([column["name"] for column in json.loads((text / "contact_columns.json").read_text())],
                                 contacts.split("\n")[0].split(","))
                self.assertEqual(self.call("signals", numbers, "--frames").out, (text / "frames.log").read_text())
                self.assertEqual(set(os.listdir(numbers)) - set(os.listdir(text)), FORMS[form] - {"frames.log"})
                self.assertEqual(self.call("replay", numbers).status, 0)

    def test_a_cut_file_has_the_rows_of_its_whole_blocks(self):
        text, numbers = self.both("--duration", "2s")
        lines = (text / "signals.csv").read_text().splitlines(keepends=True)
        file = numbers / "signals.bin"
        whole = file.read_bytes()
        begin, _, columns = struct.unpack("<3I", whole[12:24])
        block = 8 * ROWS * columns
        for blocks, beyond in ((0, 0), (0, block - 1), (1, 0), (2, 1), (3, block // 2)):
            file.write_bytes(whole[:begin + blocks * block + beyond])
            self.assertEqual(self.call("signals", numbers).out, "".join(lines[:1 + blocks * ROWS]))
        for data, *found in ((whole[:begin - 1], "a head that is cut off"), (whole[:20], "a file of 20 bytes"), (b"", "a file of 0"),
                             (b"time,x\n" * 10, "another kind of file"),
                             (whole[:8] + struct.pack("<I", 3) + whole[12:], "version 3", "version 1 or 2"),
                             (whole[:16] + struct.pack("<I", 0) + whole[20:], "cut off or damaged"),
                             (whole[:20] + struct.pack("<I", 7) + whole[24:], "names %d columns" % columns)):
            file.write_bytes(data)
            self.assert_refused(self.call("signals", numbers), "signals.bin", *found)
            self.assert_refused(self.call("view", numbers), "signals.bin", *found)
        self.assert_refused(self.call("signals", "."), "neither signals.bin nor signals.csv")
        self.assert_refused(self.call("run", "--signals", "binary"), "--signals", "--record")
        self.assert_refused(self.call("run", "--record", "a", "--signals", "npy"), "--signals", '"npy"', "binary, csv or packed")

    def test_without_a_word_it_is_packed_and_a_quarter_of_the_text(self):
        subprocess.run([program(), "run", "--no-plot", "--record", "packed"], cwd=self.folder, stdout=subprocess.DEVNULL, check=True)
        self.call("run", "--no-plot", "--record", "text")
        self.assertLess(FORMS["packed"], set(os.listdir(self.folder / "packed")))
        self.assertFalse(FORMS["csv"] & set(os.listdir(self.folder / "packed")))
        size = {name: sum(file.stat().st_size for file in (self.folder / name).rglob("*") if file.is_file())
                for name in ("packed", "text")}
        # Ten minutes of that, which moves and touches all the time, have to stay within 600 MB.
        self.assertLess(60 * size["packed"], 600e6)
        # Before session.mcap and the replay were packed the text took 41 MB.
        self.assertLess(4 * size["packed"], 41e6)
        self.assertEqual(self.call("replay", "packed").status, 0)

    def test_damage_of_a_packed_table_is_told(self):
        _, numbers = self.both("--duration", "2s", form="packed")
        file, frames = numbers / "signals.bin", numbers / "frames.log.zst"
        whole = file.read_bytes()
        begin, = struct.unpack_from("<I", whole, 12)
        size, = struct.unpack_from("<I", whole, begin)
        lines = self.call("signals", numbers).out.splitlines(keepends=True)
        for data in (whole[:begin + 4 + 40] + b"damage" + whole[begin + 4 + 46:],):
            file.write_bytes(data)
            self.assert_refused(self.call("signals", numbers), "signals.bin", "a block that is damaged")
            self.assert_refused(self.call("view", numbers), "signals.bin", "a block that is damaged")
        # Cut off, as by a crash: what is whole counts. And a length that no file has is the end.
        for data in (whole[:begin + 4 + size + 3], whole[:begin + 4 + size + 100],
                     whole[:begin + 4 + size] + b"\xff\xff\xff\xff" + whole[begin + 8 + size:]):
            file.write_bytes(data)
            self.assertEqual(self.call("signals", numbers).out, "".join(lines[:1 + ROWS]))
        whole = frames.read_bytes()
        frames.write_bytes(whole[:40] + b"damage" + whole[46:])
        self.assert_refused(self.call("signals", numbers, "--frames"), "frames.log.zst", "damaged")
        self.assert_refused(self.call("signals", numbers, "--frames", "--contacts"), "--contacts excludes --frames")

    def test_a_session_that_is_killed_leaves_whole_rows(self):
        record = self.folder / "killed"
        with subprocess.Popen([program(), "run", "--no-plot", "--pace", "realtime", "--duration", "60s", "--record", record,
                               "--signals", "binary"], cwd=self.folder, stdout=subprocess.DEVNULL,
                              stderr=subprocess.DEVNULL) as session:
            deadline = time.monotonic() + 60
            columns = 100
            while not (record / "signals.bin").exists() or (record / "signals.bin").stat().st_size < 3 * 8 * ROWS * columns:
                self.assertLess(time.monotonic(), deadline)
                time.sleep(0.05)
            session.send_signal(signal.SIGKILL)
        rows = list(csv.DictReader(self.call("signals", record).out.splitlines()))
        self.assertGreater(len(rows), 2 * ROWS)
        self.assertEqual(len(rows) % 64, 0, "rows are written 64 at a time")
        for k, row in enumerate(rows):
            self.assertEqual(int(row["cycle"]), k)
            empty = {name for name, value in row.items() if value == ""}
            self.assertLessEqual(empty, {"flags", "fault", "held_for", *(f"axis_{i}_target_Nm" for i in range(1, 7))})

    def test_the_view_shows_the_same(self):
        shown = []
        for folder in (*self.both("--duration", "4s"), self.both("--duration", "4s", form="packed")[1]):
            session = Session(self.folder, "view", folder)
            self.addCleanup(session.end)
            page = session.open_socket()
            self.addCleanup(page.close)
            stage = page.receive_json("stage")
            moments = [page.receive_moment(stage["fields"])]
            for index in (0, 777, 4000):
                page.send({"at": index})
                moments.append(page.receive_moment(stage["fields"]))
            shown.append((stage["record"]["cycles"], stage["record"]["events"], stage["record"]["open_at"],
                          [[None if isinstance(v, float) and math.isnan(v) else v for v in m.values()] for m in moments]))
        self.assertEqual(shown[0], shown[1])
        self.assertEqual(shown[0], shown[2])

    def test_an_earlier_record_is_replaced(self):
        for form, other in (("binary", "csv"), ("csv", "bin"), ("packed", "csv"), ("binary", "csv")):
            self.summary("--duration", "1s", "--record", "session", "--signals", form)
            names = os.listdir(self.folder / "session")
            self.assertIn("signals." + {"binary": "bin", "csv": "csv", "packed": "bin"}[form], names)
            self.assertNotIn("signals." + other, names)


if __name__ == "__main__":
    unittest.main(verbosity=2)
