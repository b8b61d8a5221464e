"""`proxarm prove` and `proxarm identify` on interfaces, where nobody pushes and where somebody does: minutes of the arm's time."""
import json
import subprocess
from pathlib import Path

import two_processes as two

BENCH = Path(__file__).resolve().parents[2] / "models/cells/bench.yaml"
HELPER = "--for-proof"


class Proof(two.VcanTestCase):
    def prove(self, bus, *options):
        return subprocess.run([two.PROGRAM, "prove", "--bus", bus, "--out", self.folder / "proof", *options],
                              capture_output=True, text=True, timeout=600, stdin=subprocess.DEVNULL)

    def assert_proven(self, done, asked_for):
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        asked = [line[len("push the handle along "):].split()[0] for line in done.stderr.splitlines()
                 if line.startswith("push the handle")]
        self.assertEqual(asked, asked_for)
        self.assertNotIn(HELPER, done.stderr)
        self.assertIn("PROVEN: signs, ratios, and the sensor's mounting, sign and scale", done.stdout)
        self.assertIn("arm: simulated\n", (self.folder / "proof").read_text())

    def test_an_arm_whose_helper_pushes_as_it_asks_is_proven_and_once_more(self):
        with two.simulated_arm(two.THREE, HELPER):
            for _ in range(2):
                self.assert_proven(self.prove(two.THREE), ["+x", "+y", "+x"])

    def test_the_bench_on_one_bus_is_proven_and_its_drives_stop_by_themselves(self):
        with two.simulated_arm(two.ONE, BENCH, HELPER):
            self.assert_proven(self.prove(two.ONE, BENCH), ["+x", "+y"])
            silence = self.prove(two.ONE, BENCH, "--bus-loss")
        self.assertEqual(silence.returncode, 0, silence.stdout + silence.stderr)
        self.assertIn("ALL DRIVES STOP BY THEMSELVES", silence.stdout)

    def test_a_simulated_hand_that_plays_its_own_motion_proves_nothing_and_the_refusal_says_what_would(self):
        with two.simulated_arm(two.ONE, BENCH):
            done = self.prove(two.ONE, BENCH)
        self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
        self.assertIn("NOT PROVEN", done.stdout)
        self.assertIn("`proxarm sim --for-proof`", done.stderr)

    def test_a_proof_on_interfaces_asks_for_pushes_and_is_none_without_them(self):
        hand = self.folder / "nobody.yaml"
        hand.write_text("mass_kg: 0\nstiffness_N_per_m: 0\ndamping_Ns_per_m: 0\n")
        with two.simulated_arm(two.THREE, "--hand", hand):
            done = self.prove(two.THREE)
        self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
        self.assertIn("push the handle along +x of the world W", done.stderr)
        self.assertIn("nobody pushed", done.stdout)
        self.assertFalse((self.folder / "proof").exists())

    def test_what_hangs_behind_the_sensor_is_identified_on_interfaces(self):
        with two.simulated_arm(two.THREE, HELPER):
            done = subprocess.run([two.PROGRAM, "identify", "--bus", two.THREE, "--json"], capture_output=True,
                                  text=True, timeout=600, stdin=subprocess.DEVNULL)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        found = json.loads(done.stdout)
        self.assertFalse(found["real_arm"])
        self.assertAlmostEqual(found["mass_kg"]["value"], 0.25, delta=0.0125)
        for value, truth in zip(found["centre_of_mass_S_m"]["value"], (0, 0, 0.06)):
            self.assertAlmostEqual(value, truth, delta=0.002)


if __name__ == "__main__":
    two.main()
