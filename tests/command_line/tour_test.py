#!/usr/bin/python3
"""docs/tour.md and the README's links lead somewhere: every linked file is there, and every name of the tour's first two
tables stands in its file."""
import re
import unittest

import harness

LINK = re.compile(r"\]\(((?!https?:|#)[^)#]+)(?:#[^)]*)?\)")
DOCUMENTS = [harness.SOURCE / "README.md", harness.SOURCE / "CHANGELOG.md", *sorted((harness.SOURCE / "docs").rglob("*.md"))]


class Tour(unittest.TestCase):
    def test_every_link_of_the_documents_leads_to_a_file_or_folder(self):
        for document in DOCUMENTS:
            prose = re.sub(r"^```.*?^```", "", document.read_text(), flags=re.MULTILINE | re.DOTALL)
            for target in LINK.findall(prose):
                with self.subTest(document=document.name, target=target):
                    self.assertTrue((document.parent / target).exists())

    def test_every_link_to_a_heading_leads_to_one(self):
        for document in DOCUMENTS:
            for target, anchor in re.findall(r"\]\(((?!https?:)[^)#]*)#([^)]+)\)", document.read_text()):
                page = document.parent / target if target else document
                headings = {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
                            for heading in re.findall(r"^#+ (.*)$", page.read_text(), re.MULTILINE)}
                with self.subTest(document=document.name, target=target, anchor=anchor):
                    self.assertIn(anchor, headings)

    def test_every_hunt_is_there_and_on_its_page(self):
        """`torque_weights` stood in the nightly script for days without its file."""
        script = (harness.SOURCE / ".ci" / "nightly").read_text()
        hunts = re.search(r'^readonly all="(.*)"$', script, re.MULTILINE)[1].split()
        page = (harness.SOURCE / "docs" / "development.md").read_text()
        self.assertEqual(set(hunts), set(re.findall(r"^hunt_(\w+)\(\)", script, re.MULTILINE)))
        for name in hunts:
            with self.subTest(hunt=name):
                self.assertTrue(f"\n| `{name}` |" in page, "has no row in docs/development.md")
        files = set(re.findall(r"tests/soak/\w+\.py", script))
        self.assertGreater(len(files), 10)
        for file in files:
            self.assertTrue((harness.SOURCE / file).exists(), file)

    def test_every_name_on_the_tour_stands_in_its_file(self):
        tour = harness.SOURCE / "docs" / "tour.md"
        rows = re.findall(r"^\| (?:&nbsp;)*\[[^\]]+\]\(([^)]+)\) \| (`[^|]+`) \|", tour.read_text(), re.MULTILINE)
        self.assertGreater(len(rows), 15)
        for target, names in rows:
            source = (tour.parent / target).read_text()
            for name in re.findall(r"`([^`]+)`", names):
                with self.subTest(file=target, name=name):
                    self.assertRegex(source, rf"(?<!\w){re.escape(name)}(?!\w)")


if __name__ == "__main__":
    unittest.main()
