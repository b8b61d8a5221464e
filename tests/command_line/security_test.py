"""Files and folders from strangers: nothing of theirs is run, and nothing is written where it wasn't asked to go."""
import os
import pathlib
import subprocess
import time
import unittest

from harness import ProgramTest, program

PATIENCE_S = 60  # far more than any of these takes; what hangs is found all the same
BOMB = "a: &a [x, x, x, x, x, x, x, x]\n" + "".join(
    f"{chr(98 + i)}: &{chr(98 + i)} [{', '.join(['*' + chr(97 + i)] * 8)}]\n" for i in range(9))


class Files(ProgramTest):
    def test_yaml_that_is_deep_large_or_a_bomb_is_refused_whatever_it_is_meant_to_be(self):
        for name, text, said in (("bomb", BOMB, "anchors"), ("deep", "a: " + "[" * 100_000, "32 levels"),
                                 ("large", "#" * (16 << 20) + "\na: 1\n", "16 MiB")):
            file = self.written(name + ".yaml", text)
            for use in (("run", file), ("run", "--scene", file), ("run", "--hand", file), ("check", file),
                        ("explain", file)):
                with self.subTest(f"{name}: {use[0]} {use[1] if use[1] != file else ''}"):
                    outcome = self.call(*use, timeout=PATIENCE_S)
                    self.assertEqual(outcome.status, 2, outcome.err)
                    self.assertIn(said, outcome.err + outcome.out)

    def test_a_sensor_that_a_cell_names_is_no_other(self):
        sensor = self.changed("models/sensors/ati_net_can_oem.yaml")
        sensor.write_text(BOMB)
        self.assert_refused(self.call("run", self.copies() / "models/cells/default.yaml", timeout=PATIENCE_S), "anchors")

    def test_a_scene_has_no_place_for_what_could_run_or_be_written(self):
        """Any key that isn't one of geometry, friction or motion is refused; a text with a shell's characters is text."""
        for key in ("exec", "include", "output", "record", "plugin"):
            with self.subTest(key):
                scene = self.written("scene.yaml", f"name: s\nobjects: []\n{key}: /tmp/x\n")
                self.assert_refused(self.call("run", "--scene", scene), key)
        scene = self.written("scene.yaml", 'name: "$(touch owned) `touch owned` ; touch owned"\nobjects: []\n')
        outcome = self.call("run", "--scene", scene, "--duration", "1s")
        self.assertEqual(outcome.status, 0, outcome.err)
        self.assertFalse((self.folder / "owned").exists())

    def test_only_what_is_asked_for_is_written(self):
        copies = self.copies()
        before = {path: path.stat().st_mtime_ns for path in copies.rglob("*")}
        self.summary(copies / "models/cells/default.yaml", "--duration", "1s", "--record", "session")
        after = {path: path.stat().st_mtime_ns for path in copies.rglob("*")}
        self.assertEqual(before, after)
        self.assertEqual(sorted(path.name for path in self.folder.iterdir()), ["copies", "session"])


class Links(ProgramTest):
    def test_a_record_doesnt_follow_links_out_of_its_folder(self):
        """A folder that looks like an earlier session, whose files are links to what a user would miss."""
        names = ("signals.csv", "frames.log", "effective.yaml", "summary.json", "timing.json", "plot.svg")
        outside = self.folder / "outside"
        outside.mkdir()
        session = self.folder / "session"
        session.mkdir()
        for name in names:
            (outside / name).write_text("precious")
            (session / name).symlink_to(outside / name)
        self.summary("--duration", "1s", "--record", "session")
        for name in names:
            self.assertEqual((outside / name).read_text(), "precious", name)
            self.assertFalse((session / name).is_symlink(), name)

    def test_a_folder_that_is_a_link_isnt_emptied(self):
        outside = self.folder / "outside"
        outside.mkdir()
        (outside / "cycles.bin").write_text("precious")
        session = self.folder / "session"
        session.mkdir()
        (session / "replay").symlink_to(outside)
        self.assert_refused(self.call("run", "--json", "--duration", "1s", "--record", "session"), "replay")
        self.assertEqual((outside / "cycles.bin").read_text(), "precious")


class Network(ProgramTest):
    def test_with_a_control_socket_there_is_that_one_and_no_other(self):
        """By the kernel's own tables: no socket of the process' is among TCP's, UDP's, raw or packet ones."""
        folder = self.folder / "own"
        folder.mkdir(mode=0o700)
        run = subprocess.Popen([program(), "run", "--no-plot", "--pace", "realtime", "--duration", "30s", "--control",
                                str(folder / "control")], cwd=self.folder, stdout=subprocess.DEVNULL,
                               stderr=subprocess.DEVNULL)
        self.addCleanup(run.wait)
        self.addCleanup(run.terminate)
        deadline = time.monotonic() + PATIENCE_S
        while not (folder / "control").exists() and time.monotonic() < deadline:
            time.sleep(0.1)
        self.assertTrue((folder / "control").exists())
        own = set()
        for link in pathlib.Path(f"/proc/{run.pid}/fd").iterdir():
            try:
                target = os.readlink(link)
            except FileNotFoundError:  # closed in the meantime
                continue
            if target.startswith("socket:["):
                own.add(target[len("socket:["):-1])
        self.assertGreater(len(own), 0)
        tables = pathlib.Path(f"/proc/{run.pid}/net")
        for table in ("tcp", "tcp6", "udp", "udp6", "udplite", "udplite6", "raw", "raw6", "icmp", "packet"):
            file = tables / table
            if file.exists():
                used = {word for line in file.read_text().splitlines()[1:] for word in line.split()}
                self.assertEqual(own & used, set(), table)
        unix = [line for line in (tables / "unix").read_text().splitlines()[1:] if line.split()[6] in own]
        self.assertTrue(any(line.endswith(str(folder / "control")) for line in unix), unix)


if __name__ == "__main__":
    unittest.main()
