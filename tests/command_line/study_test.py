"""The studies and the advice of `tune`, as the program prints and writes them."""
import json
import re
import unittest

from harness import SOURCE, ProgramTest


class Study(ProgramTest):
    def figures(self, name, folder):
        return json.loads((self.folder / folder / f"{name}.json").read_text())

    def test_parts_that_are_merged_are_the_whole(self):
        runs = ("study", "stress", "--runs", "12", "--seed", "3")
        whole = self.call(*runs, "--out", "whole")
        self.assertIn(whole.status, (0, 1), whole.err)
        for part in (1, 2, 3):
            self.assertEqual(self.call(*runs, "--shard", f"{part}/3", "--out", f"part{part}").status, 0)
        merged = self.call("study", "merge", "part1", "part2", "part3", "--out", "merged")
        self.assertEqual(merged.status, whole.status, merged.err)
        self.assertEqual((self.folder / "whole/stress.csv").read_bytes(), (self.folder / "merged/stress.csv").read_bytes())
        one, other = self.figures("stress", "whole"), self.figures("stress", "merged")
        for key in ("runs", "steps", "violations", "seed", "by_kind"):
            self.assertEqual(one[key], other[key])
        self.assertTrue((self.folder / "merged/stress.svg").exists())
        missing = self.call("study", "merge", "part1", "part3", "--out", "merged")
        self.assertEqual(missing.status, 2)
        self.assertIn("12 jobs: all parts", missing.err)

    def test_figure5_writes_its_files(self):
        self.assertEqual(self.call("study", "figure5", "--out", "out").status, 0)
        figures = self.figures("figure5", "out")
        self.assertEqual(figures["pull_force_N"]["23"], 0)
        self.assertLessEqual(figures["kick_N"]["23"], 1e-12)
        for key in ("pull_force_N", "kick_N", "oscillation_N"):
            self.assertIn(key, figures["keys"])
        self.assertIn("<svg", (self.folder / "out/figure5.svg").read_text()[:1000])

    def test_what_the_hand_feels_of_ten_kilograms_that_are_looked_ahead_of(self):
        self.assertEqual(self.call("study", "fidelity", "--quick", "--out", "out").status, 0)
        figures = self.figures("fidelity", "out")
        self.assertEqual(figures["ended_by_fault"], 0)
        by_setup, ahead = figures["apparent_mass_error_by_setup"], "10 kg, T = 1 ms, lookahead"
        along = figures["apparent_mass_error_by_direction"][ahead]
        self.assertEqual(set(along), {"x", "y", "z"})
        # What the project has promised: along x all of it, in the worst direction up to 5 Hz. There, at 10 Hz it is the
        # gears' give, 26 % in docs/results/studies.md.
        for frequency, along_x, at_worst in (("2", 0.02, 0.02), ("5", 0.07, 0.07), ("10", 0.2, 0.27)):
            self.assertLessEqual(along["x"][frequency], along_x)
            self.assertLessEqual(by_setup[ahead][frequency], at_worst)
            self.assertEqual(by_setup[ahead][frequency], max(error[frequency] for error in along.values()))
        # Without it: the loop's 16.6 ms alone would be 2 sin(pi f L) = 0.21 at 2 Hz.
        self.assertGreater(by_setup["10 kg, T = 1 ms"]["2"], 0.1)
        self.assertLess(by_setup["10 kg, T = 1 ms"]["2"], 0.21)

    def test_what_the_hand_feels_of_a_tool_that_it_turns(self):
        outcome = self.call("study", "fidelity", "--quick", "--out", "out")
        self.assertEqual(outcome.status, 0)
        figures = self.figures("fidelity", "out")
        setup = "0.1 kg m², T = 1 ms"
        # What is in phase is the inertia, within 5 % below 2 Hz; what isn't comes by the loop's delay, as with a mass.
        for frequency in ("0.1", "0.2", "0.3", "0.5", "1"):
            self.assertAlmostEqual(figures["apparent_inertia_over_wanted"][setup][frequency], 1.0, delta=0.05)
        self.assertGreater(figures["apparent_inertia_error_by_setup"][setup]["2"], 0.1)
        self.assertLess(figures["apparent_inertia_error_by_setup"][setup]["2"], 0.21)
        self.assertIn(f"error of the inertia felt, {setup}: at most 5 % up to 0.", outcome.out)
        self.assertIn("<svg", (self.folder / "out/fidelity_turning.svg").read_text()[:1000])

    def test_mistakes_are_named(self):
        for arguments, words in ((("figur5", "--out", "x"), ("'figur5'", "figure5")),
                                 (("figure5",), ("--out",)),
                                 (("figure5", "--out", "x", "--shard", "3/2"), ("--shard", "3/2")),
                                 (("figure5", "--out", "x", "--seed", "-1"), ("--seed",)),
                                 (("stress", "--out", "x", "--runs", "0"), ("--runs", "1 or more")),
                                 (("error", "--out", "x", "--replay", "4"), ("--replay",))):
            outcome = self.call("study", *arguments)
            self.assertEqual(outcome.status, 2, arguments)
            self.assertEqual(outcome.err.count("\n"), 1, outcome.err)
            for word in words:
                self.assertIn(word.strip("'"), outcome.err)


class Explain(ProgramTest):
    def test_a_cycle_leaves_out_what_it_can_and_counts_it(self):
        told = self.call("explain", SOURCE / "scenes/wall.yaml").out
        steps = int(re.search(r"(\d+) steps\)", told)[1])
        for what, share in (("limits of the joints", 0.95), ("the nearest point of all limits", 1.0),
                            ("the last guard's exact test", 1.0)):
            self.assertGreaterEqual(int(re.search(rf"{what}: in (\d+) of", told)[1]), share * steps, told)

    def test_a_scene_that_no_cycle_was_counted_with_is_explained_all_the_same(self):
        (self.folder / "ball.yaml").write_text("name: ball\nobjects:\n  - {sphere: {"
                                               "centre_m: [0.7, 0, 0.6], radius_m: 0.1}}\n")
        outcome = self.call("explain", "ball.yaml")
        self.assertEqual(outcome.status, 0, outcome.err)
        self.assertIn("a step goes through", outcome.out)
        self.assertIn("wasn't counted", outcome.out)


class Tune(ProgramTest):
    def test_advice_says_what_limits(self):
        outcome = self.call("tune")
        self.assertEqual(outcome.status, 0, outcome.err)
        for word in ("smallest stable mass", "advice: --mass", "tried on the simulated arm: ", "is steady for 10 s",
                     "what limits it", "timestep of at most", "handle"):
            self.assertIn(word, outcome.out)

    def test_a_tool_that_is_turned_gets_an_inertia_advised(self):
        lean = ("tune", "--scene", SOURCE / "scenes/rod_over_edge.yaml", "--hand", SOURCE / "sim/hands/lean.yaml",
                "--mass", "4", "--inertia", "0.05")
        told = self.call(*lean).out
        at_start = float(told.split("included; ")[2].split(" kg m²")[0])
        everywhere = float(told.split("smallest stable inertia with 4 kg: ")[1].split(" kg m²")[0])
        self.assertGreater(everywhere, at_start)
        # This hand is stiffer than damped once it is half as stiff again: K L > D.
        self.assertIn("--turning-damping", told)
        advised = float(told.split("--inertia ")[1].split(" kg m²")[0])
        self.assertGreater(advised, everywhere)
        self.assertIn(f"{advised:g} kg m² is steady for 10 s, with the stiffer and heavier hand, too", told)
        self.assertIn("this hand doesn't turn the tool", self.call("tune", "--inertia", "0.05").out)
        self.assertNotIn("inertia", self.call("tune").out)

    def test_what_run_refuses_of_a_tool_that_turns_tune_refuses(self):
        lean = ("--hand", SOURCE / "sim/hands/lean.yaml")
        for arguments, said in (((*lean, "--inertia", "0.0005"), "more than the handle's own"),
                                ((*lean, "--inertia", "1e7"), "at most 1000 kg m²"),
                                ((SOURCE / "models/cells/scara.yaml", *lean, "--inertia", "0.05"), "fewer than six axes")):
            self.assert_refused(self.call("tune", *arguments), said)
            self.assert_refused(self.call("run", *arguments), said)

    def test_where_sines_lead_counts(self):
        hand = self.written("sines.yaml", "name: sines\nmass_kg: 1\nstiffness_N_per_m: 500\ndamping_Ns_per_m: 20\n"
                            "inertia_kg_m2: 0.003\nturning_stiffness_Nm_per_rad: 20\nturning_damping_Nms_per_rad: 0.5\n"
                            "multisine:\n  - {frequency_Hz: 0.1, amplitude_m: 0.2, amplitude_rad: 0.4, direction: [0, 1, 0]}\n")
        told = self.call("tune", "--scene", SOURCE / "scenes/free.yaml", "--hand", hand, "--mass", "4", "--inertia",
                         "0.05").out
        everywhere = float(told.split("smallest stable inertia with 4 kg: ")[1].split(" kg m²")[0])
        self.assertGreater(everywhere, 1.2 * float(told.split("included; ")[2].split(" kg m²")[0]))

    def test_a_timestep_that_a_mass_needs_and_no_bus_carries_is_told_as_such(self):
        self.assertIn("a timestep of at most 0.5 ms, which the cell's buses can't carry", self.call("tune").out)
        self.assertNotIn("can't carry", self.call("tune", "--mass", "6").out)

    def test_a_hopeless_loop_is_told_so(self):
        outcome = self.call("tune", "--timestep", "50ms")
        self.assertIn("damping", outcome.out)

    # It said "advice: --mass none up to 1000 kg, which is stable", and that not even 500 Ns/m would do where 600 did.
    def test_advice_does_not_contradict_itself(self):
        hopeless = self.call("tune", "--timestep", "50ms").out
        self.assertNotIn("--mass none", hopeless)
        self.assertIn("no mass up to 1000 kg is stable", hopeless)
        damped = self.call("tune", "--damping", "600").out
        self.assertNotIn("not even", damped)


if __name__ == "__main__":
    unittest.main()
