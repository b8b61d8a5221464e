"""Manual pages and completion say what --help says: held against the help of each command, the pages as groff sets them
and the completion as bash asks it."""
import gzip
import os
import re
import subprocess
import unittest

from harness import SOURCE, ProgramTest, program

MANUAL = SOURCE / "packaging/manual"
TEXT_COLUMN = 30  # of what --help says to a name


def entries(text):
    """Of a help text, by its columns: [[name, text]]."""
    found = []
    for line in text.splitlines():
        if re.match(r"  \S", line):
            name = line if line[TEXT_COLUMN - 1:TEXT_COLUMN] != " " else line[:TEXT_COLUMN]
            found.append([name.strip(), line[len(name):].strip()])
        elif line.startswith(" " * TEXT_COLUMN):
            found[-1][1] += " " + line.strip()
    return [[name, told.strip()] for name, told in found]


class Manual(ProgramTest):
    def setUp(self):
        super().setUp()
        self.made = self.folder / "share"
        done = self.make(program(), self.made)
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "", ""))
        self.commands = [name for name, _ in entries(self.call("--help").out.partition("Subcommands:")[2])]
        self.assertGreater(len(self.commands), 15)
        # Some are programs of their own, which not every build has; those have no page, and only their name is completed.
        helps = {command: self.call(command, "--help") for command in self.commands}
        self.helps = {command: told.out for command, told in helps.items() if "no program" not in told.err}

    def make(self, of, folder):
        return subprocess.run(["/usr/bin/python3", MANUAL, of, folder], capture_output=True, text=True, check=False)

    def page(self, name):
        """As it is read on a terminal, in one line of words; no warning of groff's."""
        with gzip.open(self.made / "man/man1" / f"{name}.1.gz") as packed:
            set_ = subprocess.run(["groff", "-K", "utf8", "-T", "utf8", "-man", "-ww", "-rLL=2000n", "-P-cbou"],
                                  input=packed.read(), capture_output=True, check=True)
        self.assertEqual(set_.stderr, b"")
        plain = set_.stdout.decode().replace("\N{HYPHEN}", "-").replace("\N{MINUS SIGN}", "-")
        return " ".join(plain.split())

    def complete(self, *words, path=None):
        """What bash offers for the last of these words."""
        script = (f'source {self.made}/bash-completion/completions/proxarm; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); '
                  '_proxarm; printf "%s\\n" "${COMPREPLY[@]}"')
        done = subprocess.run(["bash", "-c", script, "bash", "proxarm", *words], cwd=self.folder, capture_output=True,
                              text=True, check=True, env={**os.environ, **({"PATH": path} if path else {})})
        self.assertEqual(done.stderr, "")
        return sorted(done.stdout.split())

    def test_each_page_says_all_that_help_says(self):
        for name, text in {"proxarm": self.call("--help").out,
                           **{f"proxarm-{command}": text for command, text in self.helps.items()}}.items():
            with self.subTest(page=name):
                page, told = self.page(name), entries(text)
                self.assertGreater(len(told), 0)
                for entry, said in told:
                    self.assertIn(" ".join(f"{entry.replace(',--', ', --')} {said}".split()), page)

    def test_pages_are_the_same_bytes_each_time(self):
        self.assertEqual(self.make(program(), self.folder / "again").returncode, 0)
        files = [path for path in self.made.rglob("*") if path.is_file()]
        self.assertEqual(len(files), len(self.helps) + 2, "a page each, that of the program, and the completion")
        for path in files:
            self.assertEqual(path.read_bytes(), (self.folder / "again" / path.relative_to(self.made)).read_bytes())

    def test_bash_completes_commands_and_their_options(self):
        self.assertEqual(self.complete(""), sorted([*self.commands, "--help", "--version"]))
        self.assertEqual(self.complete("re"), ["release", "replay", "reset", "resume"])
        for command, text in self.helps.items():
            options = re.findall(r"(?:^  |,)(--[a-z-]+)", text, re.MULTILINE)
            self.assertEqual(self.complete(command, "--"), sorted(options))

    def test_bash_completes_what_options_take(self):
        self.assertEqual(self.complete("run", "--orientation", ""), ["free", "held"])
        self.assertEqual(self.complete("run", "--orientation", "=", "f"), ["free"])
        self.assertEqual(self.complete("run", "--lookahead", "="), ["auto", "off"])
        self.assertEqual(self.complete("run", "--mass", ""), [], "nobody knows")
        self.written("wall.yaml", "")
        for words in (("run", "wa"), ("run", "--scene", "wa"), ("check", "--scene", "=", "wa")):
            self.assertEqual(self.complete(*words), ["wall.yaml"])

    def test_bash_completes_the_files_that_come_with_it(self):
        for folder in ("bin", "share/proxarm/scenes"):
            (self.folder / "usr" / folder).mkdir(parents=True)
        self.written("usr/share/proxarm/scenes/wall.yaml", "")
        self.written("usr/bin/proxarm", "").chmod(0o755)
        path = f"{self.folder}/usr/bin:{os.environ['PATH']}"
        self.assertEqual(self.complete("run", "--scene", "sc", path=path), ["scenes/"])
        self.assertEqual(self.complete("run", "--scene", "scenes/w", path=path), ["scenes/wall.yaml"])

    def test_a_program_that_is_not_there_is_named(self):
        done = self.make(self.folder / "nowhere", self.folder / "none")
        self.assertEqual((done.returncode, done.stdout), (1, ""))
        self.assertIn(f"{self.folder}/nowhere: No such file", done.stderr)


if __name__ == "__main__":
    unittest.main()
