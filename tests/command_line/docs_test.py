"""Commands and YAML blocks of the README and of docs/ do what they say."""
import re
import subprocess
import unittest

from harness import SOURCE, ProgramTest

PAGES = [SOURCE / "README.md", *sorted((SOURCE / "docs").rglob("*.md"))]
# What can't run here, and why. Of each kind at least one is expected to stand in the docs.
ELSEWHERE = {
    "--view": "stays until Ctrl-C: view_test.py runs it",
    "--bus vcan": "needs a kernel with CAN: tests/vcan runs it",
    "models/cells/mine.yaml": "somebody's own copy: axes_test.py makes one",
    "my_arm": "somebody's own arm: new_cell_test.py makes some",
    "--bus can0": "needs an interface",
    "view DIR": "stays until Ctrl-C: view_test.py makes some records",
    "proxarm set ": "needs a session that runs: change_test.py asks one",
    "proxarm replay DIR": "needs a record: replay_test.py makes some",
    "proxarm study ": "takes minutes: study_test.py runs each with --quick",
}
REFUSED, FAULT = "refused", "a device fails"  # as the docs say behind a command
PARTS = (" …", "…}", "enabling_input: {drive: axis_3")  # YAML that shows one line of a file


def blocks(language):
    """Fences are taken in pairs: the end of a YAML block would begin one without a language, and hide what follows."""
    for page in PAGES:
        for found in re.finditer(r"^```(\w*)\n(.*?)^```$", page.read_text(), re.MULTILINE | re.DOTALL):
            if found[1] == language:
                yield page.name, found[2]


def commands():
    """Page, arguments of proxarm, and what is said behind them."""
    for page, text in blocks(""):
        for line in text.splitlines():
            if found := re.match(r"(?:\./dev (?=run)|proxarm )(.*)", line):
                words, _, said = found[1].partition("   ")
                yield page, words.split("  ")[0], said.strip()


class Docs(ProgramTest):
    def write_files(self):
        """The files that a page asks its reader to write: blocks whose first line is a comment with the name alone."""
        for language in ("yaml", "python"):
            for _, text in blocks(language):
                if named := re.match(r"# (\w+\.(?:yaml|py))\n", text):
                    file = self.written(named[1], text)
                    if language == "python":
                        subprocess.run(["/usr/bin/python3", file], cwd=self.folder, check=True)

    def test_every_command_runs(self):
        met, ran = set(), 0
        self.write_files()
        for page, words, said in commands():
            with self.subTest(page=page, command=words):
                exception = next((key for key in ELSEWHERE if key in f"proxarm {words} "), None)
                if exception:
                    met.add(exception)
                    if words.startswith("study "):
                        self.assertEqual(self.call("study", words.split()[1], "--help").status, 0)
                    continue
                outcome = self.call(*words.split())
                self.assertEqual(outcome.status, 2 if REFUSED in said else 1 if FAULT in said else 0, outcome.err)
                ran += 1
        self.assertEqual(met, set(ELSEWHERE), "an exception that isn't needed any more")
        self.assertGreaterEqual(ran, 8)

    def test_every_scene_and_hand_is_fine(self):
        # The only complete scene of scenes.md was refused.
        checked = 0
        self.write_files()
        for page, text in blocks("yaml"):
            if not re.search(r"^(objects|waypoints):( *#.*)?$", text, re.MULTILINE) or any(part in text for part in PARTS):
                continue
            with self.subTest(page=page, begins=text.splitlines()[0]):
                outcome = self.call("check", self.written("block.yaml", text))
                self.assertEqual((outcome.status, outcome.err), (0, ""))
                checked += 1
        self.assertGreaterEqual(checked, 3)

    def test_every_part_of_a_cell_is_read(self):
        # An input on the sensor's bus doesn't fit into its millisecond, and `check` says so.
        cell = (SOURCE / "models/cells/default.yaml").read_text()
        slower = cell.replace("default_period_s: 0.001", "default_period_s: 0.002")
        self.assertNotEqual(slower, cell)
        parts = [text for _, text in blocks("yaml") if text.startswith(("supervision:", "enabling_input:"))]
        self.assertEqual(len(parts), 2)
        for text in parts:
            lines = text.splitlines() if text.startswith("enabling_input") else [text]
            for part in lines:
                with self.subTest(part.split("#")[0].strip()):
                    self.changed("models/cells/default.yaml", (cell, slower + "\n" + part + "\n"))
                    outcome = self.call("check", self.copies() / "models/cells/default.yaml")
                    self.assertEqual((outcome.status, outcome.err), (0, ""))
                    (self.copies() / "models/cells/default.yaml").write_text(cell)

    def test_every_key_of_the_summary_and_column_of_the_signals_is_described(self):
        text = (SOURCE / "docs/reference/files.md").read_text()
        summary = self.summary("--duration", "0.5s", "--record", self.folder / "record")
        named = set(re.findall(r"`([a-z_A-Z0-9]+)`", text))
        ellipsis = {"tool_penetration_touch_max_m", "tool_penetration_sliding_max_m", "contact_force_error_max_N"}
        self.assertEqual(set(summary) - named - ellipsis, set())
        columns = (self.folder / "record" / "signals.csv").read_text().splitlines()[0].split(",")
        patterns = [pattern.replace("…", "[xyz]").replace("AXIS", r"axis_\d") for pattern in
                    re.findall(r"`([^`]+)`", text[text.index("## What `--record"):text.index("## The summary")])]
        for column in columns:
            self.assertTrue(any(re.fullmatch(pattern, column) for pattern in patterns), column)

    def test_every_key_of_a_cell_that_is_read_stands_in_its_reference(self):
        text = (SOURCE / "docs/reference/keys.md").read_text()
        text = text[text.index("## Keys of a cell"):text.index("## Keys of a hand")]
        named = set(re.findall(r"`([a-z_A-Z0-9]+)`", text))
        getters = ("number|number_or|integer|integer_or|boolean_or|string|string_or|choice|choice_or|vec3|vec3_or|numbers|map|find_map|"
                   "list|has|existing_file|at")
        read = set()
        for source in ("cell.cpp", "drive.cpp", "supervision.cpp"):
            code = (SOURCE / "models/description" / source).read_text()
            read |= set(re.findall(rf"(?:->|\.)(?:{getters})\(\s*\"(\w+)\"", code))
            read |= set(re.findall(r"(?:read_name|pose_or_identity|bandwidth_or|read_object|absolute_path_or_empty|integer_of|integer_of_or|text_like|"
                                   r"text_up_to|require_key|refuse_key)\(\s*\w+, \"(\w+)\"", code))
        read -= {"min", "max"}
        self.assertGreater(len(read), 90)
        self.assertEqual(read - named, set(), "read, but not described")

    def test_the_screen_of_the_readme_is_the_programs(self):
        # All but what depends on the machine; "..." stands for lines that are left out.
        [shown] = [text for page, text in blocks("") if text.startswith("arm150 default cell, scene wall")
                   and page == "README.md"]
        printed = self.call("run").out
        for line in shown.splitlines():
            if not re.match(r"  (\.\.\.|time|compute)", line):
                self.assertIn(line + "\n", printed)

    def test_links_lead_somewhere(self):
        for page in PAGES:
            for link in re.findall(r"\]\(([^)#\s]+)(?:#[^)\s]*)?\)", page.read_text()):
                if not link.startswith("http"):
                    self.assertTrue((page.parent / link).exists(), f"{page.name}: {link}")


if __name__ == "__main__":
    unittest.main(verbosity=2)
