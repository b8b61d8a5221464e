"""`proxarm prove` on interfaces, where nobody pushes and where somebody does: four minutes of the arm's time."""
import subprocess

import two_processes as two


# When the hand pushes, by its own clock, which begins with the drives: the arm is asked for the first push after 15 s
# and waits for each of them for a minute; between two of them it moves for some 10 s.
PUSHES = ((18, "x"), (36, "y"), (66, "x"))
PUSH_S = 8


def pushing_hand(path):
    """15 N along an axis of W wherever the tool is: it wants to be ten metres away, and is no stronger than that."""
    waypoints, grips, offset = ["{time_s: 0, offset_m: [0, 0, 0]}"], [], "[0, 0, 0]"
    for time_s, axis in PUSHES:
        waypoints.append(f"{{time_s: {time_s - 6}, offset_m: {offset}}}")
        offset = "[10, 0, 0]" if axis == "x" else "[0, 10, 0]"
        waypoints.append(f"{{time_s: {time_s - 5}, offset_m: {offset}}}")
        grips += [f"{{time_s: {time_s}, stiffness_N_per_m: 50, damping_Ns_per_m: 5}}",
                  f"{{time_s: {time_s + PUSH_S}, stiffness_N_per_m: 0, damping_Ns_per_m: 0}}"]
    path.write_text("name: pushes\nmass_kg: 0\nstiffness_N_per_m: 0\ndamping_Ns_per_m: 0\nmax_force_N: 15\n" +
                    "".join(f"{key}:\n" + "".join(f"  - {line}\n" for line in lines)
                            for key, lines in (("waypoints", waypoints), ("grips", grips))))
    return path


class Proof(two.VcanTestCase):
    def test_an_arm_that_is_pushed_as_it_asks_is_proven(self):
        with two.simulated_arm(two.THREE, "--hand", pushing_hand(self.folder / "pushes.yaml")):
            done = subprocess.run([two.PROGRAM, "prove", "--bus", two.THREE, "--out", self.folder / "proof"],
                                  capture_output=True, text=True, timeout=600, stdin=subprocess.DEVNULL)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        asked = [line[len("push the handle along "):].split()[0] for line in done.stderr.splitlines()
                 if line.startswith("push the handle")]
        self.assertEqual(asked, [f"+{axis}" for _, axis in PUSHES])
        self.assertIn("PROVEN: signs, ratios, and the sensor's mounting, sign and scale", done.stdout)
        self.assertIn("arm: simulated\n", (self.folder / "proof").read_text())

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
