"""The reference of the library's headers: made without a warning, and it has what stands in them."""
import html
import re
import shutil
import subprocess
import sys
import unittest

from harness import SOURCE, ProgramTest

if not shutil.which("doxygen"):
    print("doxygen isn't installed")
    sys.exit(77)


class Reference(ProgramTest):
    def test_is_made_without_a_warning_and_has_the_headers_comments(self):
        settings = (SOURCE / "docs/api/Doxyfile").read_text()
        headers = [word for word in settings.split() if word.endswith(".hpp")]
        self.assertGreater(len(headers), 8)
        done = subprocess.run(["doxygen", "-"], input=settings + f"\nOUTPUT_DIRECTORY = {self.folder}\n", cwd=SOURCE,
                              capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        pages = {}
        for page in (self.folder / "api").glob("*.html"):
            pages[page.name] = re.sub(r"\s+", " ", html.unescape(re.sub(r"<[^>]+>", "", page.read_text())))
        session = pages["classproxarm_1_1Session.html"]
        for function in ("set_world", "set_hand", "set_sensor", "set_drive", "run", "stop"):
            self.assertIn(function, session)
        self.assertIn("It must outlive the session.", session)
        # Behind a member, and going on in the line below.
        parts = pages["structproxarm_1_1controller_1_1OwnParts.html"]
        self.assertIn("in W; must outlive the loop", parts)
        # The first sentence of each header.
        whole = " ".join(pages.values())
        for header in headers:
            first = re.match(r"// (.*)", (SOURCE / header).read_text())[1]
            self.assertIn(first[:40], whole, header)


if __name__ == "__main__":
    unittest.main(verbosity=2)
