"""`proxarm prove` on interfaces, where nobody pushes: four minutes of the arm's time."""
import subprocess

import two_processes as two


class Proof(two.VcanTestCase):
    def test_a_proof_on_interfaces_asks_for_pushes_and_is_none_without_them(self):
        hand = self.folder / "nobody.yaml"
        hand.write_text("mass_kg: 0\nstiffness_N_per_m: 0\ndamping_Ns_per_m: 0\n")
        with two.simulated_arm(two.THREE, "--hand", hand):
            done = subprocess.run([two.PROGRAM, "prove", "--bus", two.THREE, "--out", self.folder / "proof"],
                                  capture_output=True, text=True, timeout=600, stdin=subprocess.DEVNULL)
        self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
        self.assertIn("push the handle along +x of the world W", done.stderr)
        self.assertIn("nobody pushed", done.stdout)
        self.assertFalse((self.folder / "proof").exists())


if __name__ == "__main__":
    two.main()
