"""What a session shares with others, or may find missing: folders, pipes, file descriptors, the disk."""
import os
import resource
import signal
import subprocess
import time
import unittest

from harness import ProgramTest, program

PATIENCE_S = 60
LONG = ("run", "--json", "--no-plot", "--duration", "1h", "--record", "session")


class Locks(ProgramTest):
    def start(self, *arguments):
        run = subprocess.Popen([program(), *arguments], cwd=self.folder, stdin=subprocess.DEVNULL,
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(self.end, run)
        return run

    @staticmethod
    def end(run):
        run.kill()
        run.communicate()

    def await_path(self, path):
        deadline = time.monotonic() + PATIENCE_S
        while not path.exists() and time.monotonic() < deadline:
            time.sleep(0.02)
        self.assertTrue(path.exists(), path)

    def test_a_record_belongs_to_one_session(self):
        """Both ended with 0, and the first one's record was gone."""
        first = self.start(*LONG)
        self.await_path(self.folder / "session" / "signals.bin")
        self.assert_refused(self.call("run", "--json", "--no-plot", "--duration", "0.1s", "--record", "session"),
                            "another session")
        first.send_signal(signal.SIGTERM)
        out, err = first.communicate(timeout=PATIENCE_S)
        self.assertEqual(first.returncode, 0, err)
        self.assertTrue((self.folder / "session" / "summary.json").exists())
        self.summary("--no-plot", "--duration", "0.1s", "--record", "session")  # and now it may be replaced

    def test_a_session_that_was_killed_locks_nothing(self):
        first = self.start(*LONG)
        self.await_path(self.folder / "session" / "signals.bin")
        first.kill()
        first.communicate()
        time.sleep(1.0)  # its black box is in there
        deadline = time.monotonic() + PATIENCE_S
        while self.call("run", "--json", "--duration", "0.1s", "--record", "session").status != 0:
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.2)

    def test_a_control_socket_belongs_to_one_session(self):
        (self.folder / "mine").mkdir(mode=0o700)
        path = self.folder / "mine" / "control"
        first = self.start("run", "--json", "--no-plot", "--pace", "realtime", "--duration", "60s", "--control", str(path))
        self.await_path(path)
        self.assert_refused(self.call("run", "--json", "--duration", "0.1s", "--control", path), "another session")
        # One whose socket was taken away from under it still has the place.
        path.unlink()
        self.assert_refused(self.call("run", "--json", "--duration", "0.1s", "--control", path), "another session")
        first.kill()
        first.communicate()
        self.summary("--duration", "0.1s", "--control", str(path))


class Pipes(ProgramTest):
    def test_from_which_nothing_comes_are_refused(self):
        """Each hung."""
        fifo = self.folder / "fifo.yaml"
        os.mkfifo(fifo)
        for use in (("run", fifo), ("run", "--scene", fifo), ("run", "--hand", fifo), ("check", fifo), ("explain", fifo),
                    ("plan", fifo)):
            with self.subTest(use[0]):
                outcome = self.call(*use, timeout=PATIENCE_S)
                self.assertEqual(outcome.status, 2)
                self.assertIn("a pipe from which nothing comes", outcome.err + outcome.out)

    def test_are_no_parts_of_a_scene_or_a_record(self):
        os.mkfifo(self.folder / "mesh.stl")
        scene = self.written("scene.yaml", "name: s\nobjects:\n  - mesh: {name: m, file: mesh.stl}\n")
        self.assertEqual(self.call("check", scene, timeout=PATIENCE_S).status, 2)
        self.summary("--no-plot", "--duration", "0.1s", "--record", "session")
        (self.folder / "session" / "replay" / "cycles.bin").unlink()
        os.mkfifo(self.folder / "session" / "replay" / "cycles.bin")
        self.assert_refused(self.call("replay", "session", timeout=PATIENCE_S), "no regular file")


class Meshes(ProgramTest):
    HEADER = "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n" \
             "element face {}\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"

    def refusal_of(self, vertices, faces):
        self.written("mesh.ply", self.HEADER.format(vertices, faces))
        scene = self.written("scene.yaml", "name: s\nobjects:\n  - mesh: {name: m, file: mesh.ply}\n")
        outcome = self.call("check", scene, timeout=PATIENCE_S)
        self.assertEqual(outcome.status, 2)
        return outcome

    def test_with_more_elements_than_bytes_are_refused_at_once(self):
        for counts in ((3, 50_000_000), (50_000_000, 1), (3, 10**30)):
            with self.subTest(counts):
                outcome = self.refusal_of(*counts)
                self.assertIn("bytes", outcome.err + outcome.out)
                self.assertLess(outcome.user_s, 1.0)

    def test_larger_than_any_that_is_felt_are_refused(self):
        """Sparse: it takes no room, and limits that grow with a file would have been 150 GB and 40 minutes."""
        with open(self.folder / "mesh.stl", "wb") as file:
            file.truncate(2_500_000_084)
        scene = self.written("scene.yaml", "name: s\nobjects:\n  - mesh: {name: m, file: mesh.stl}\n")
        outcome = self.call("check", scene, timeout=PATIENCE_S)
        self.assertEqual(outcome.status, 2)
        self.assertIn("256 MiB", outcome.err + outcome.out)


class Missing(ProgramTest):
    @unittest.skipIf(os.environ.get("PROXARM_SLOW_BUILD"), "a sanitizer needs some of its own")
    def test_file_descriptors_are_named(self):
        """The whole message was std::bad_alloc."""
        for most in range(4, 10):
            done = subprocess.run([program(), "run", "--json", "--no-plot", "--duration", "0.1s", "--record", "session"],
                                  cwd=self.folder, capture_output=True, text=True, timeout=PATIENCE_S,
                                  preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (most, most)))
            with self.subTest(most):
                self.assertIn(done.returncode, (0, 2), done.stderr)
                self.assertNotIn("bad_alloc", done.stderr)
                if done.returncode != 0:
                    self.assertTrue(done.stderr.startswith("proxarm: "), done.stderr)

    def test_a_black_box_that_wasnt_written_isnt_announced(self):
        (self.folder / "box").mkdir()
        run = subprocess.Popen([program(), "run", "--no-plot", "--pace", "realtime", "--duration", "60s", "--fault",
                                "axis_3:silent@3s", "--black-box", "box"], cwd=self.folder, stdin=subprocess.DEVNULL,
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(run.wait)
        self.addCleanup(run.kill)
        time.sleep(1.0)
        self.written("box/precious", "which no session has written")
        out, err = run.communicate(timeout=PATIENCE_S)
        self.assertEqual(run.returncode, 1, err)
        self.assertIn("no black box could be written", err)
        self.assertNotIn("black box", out)

    def test_a_mass_out_of_range_is_told_the_range(self):
        """It was refused with "at least 1.5 kg"."""
        for mass in ("1e308kg", "20000kg"):
            self.assert_refused(self.call("run", "--mass", mass), "at most 10000 kg")
        self.assert_refused(self.call("run", "--set", "mass=1e308@1s"), "at most 10000 kg")


if __name__ == "__main__":
    unittest.main()
