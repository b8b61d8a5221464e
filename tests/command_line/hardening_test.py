"""What the compiler and the linker put into the program against hostile files and frames, read off the program itself."""
import os
import re
import subprocess
import unittest

from harness import program


def readelf(*options):
    return subprocess.run(["readelf", "--wide", *options, program()], capture_output=True, text=True, check=True,
                          timeout=60).stdout


@unittest.skipIf(os.environ.get("PROXARM_SLOW_BUILD"), "sanitizers and debug builds are built without")
class Program(unittest.TestCase):
    def test_is_loaded_at_a_random_address(self):
        self.assertRegex(readelf("--file-header"), r"Type:\s+DYN")

    @staticmethod
    def flags(kind):
        """R, W and E of each segment of a kind."""
        return re.findall(rf"^\s*{kind}(?:\s+0x[0-9a-f]+){{5}}\s+([RWE ]{{3}})\s", readelf("--program-headers"), re.MULTILINE)

    def test_has_no_stack_that_could_be_run(self):
        self.assertEqual(self.flags("GNU_STACK"), ["RW "])

    def test_has_no_memory_that_is_both_written_and_run(self):
        flags = self.flags("LOAD")
        self.assertIn("R E", flags)
        self.assertIn("RW ", flags)
        self.assertNotIn("RWE", flags)

    def test_resolves_all_functions_at_the_start_and_writes_their_table_never_again(self):
        self.assertIn("GNU_RELRO", readelf("--program-headers"))
        self.assertRegex(readelf("--dynamic"), r"BIND_NOW|FLAGS_1.*NOW")

    def test_guards_its_stack(self):
        self.assertIn("__stack_chk_fail", readelf("--dyn-syms"))

    def test_checks_the_sizes_of_buffers_that_the_library_writes(self):
        self.assertRegex(readelf("--dyn-syms"), r"__\w+_chk@")

    @unittest.skipUnless(os.uname().machine == "x86_64", "of x86-64 alone")
    def test_says_where_it_may_be_jumped_to(self):
        """endbr64. The mark that has the kernel enforce it (IBT in the notes) needs start files that have it, too; those
        of Debian 12 don't."""
        with open(program(), "rb") as file:
            self.assertGreater(file.read().count(b"\xf3\x0f\x1e\xfa"), 1000)


if __name__ == "__main__":
    unittest.main()
