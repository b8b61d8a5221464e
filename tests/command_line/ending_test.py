"""What asks a session to end from outside: every one of it leads to a controlled stop, and the summary says what it was.

The sessions run in virtual time, an hour of it, so that the arm is in motion a moment after their start.
"""
import csv
import json
import os
import pty
import shutil
import signal
import subprocess
import time
import unittest

from harness import SOURCE, ProgramTest, program

PATIENCE_S = 60
# All that a process can catch and that would end or suspend it. Those of a crash are left out: see replay_test.py.
ENDING = ["SIGHUP", "SIGINT", "SIGQUIT", "SIGTERM", "SIGUSR1", "SIGUSR2", "SIGALRM", "SIGVTALRM", "SIGPROF", "SIGXCPU",
          "SIGXFSZ", "SIGPOLL", "SIGPWR", "SIGSTKFLT", "SIGTSTP", "SIGRTMIN", "SIGRTMAX"]
NUMBERS = {"SIGSTKFLT": 16}  # that Python has no name for
# As glibc calls them.
NAMES = {"SIGRTMIN": f"signal {int(signal.SIGRTMIN)}", "SIGRTMAX": f"signal {int(signal.SIGRTMAX)}"}


def defaults():
    """Whoever runs the tests may ignore some, and processes inherit that."""
    for name in ENDING:
        signal.signal(NUMBERS.get(name) or getattr(signal, name), signal.SIG_DFL)


class Ending(ProgramTest):
    def start(self, *arguments, preexec_fn=defaults, **streams):
        shutil.rmtree(self.folder / "session", ignore_errors=True)  # of the session before
        streams = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **streams}
        run = subprocess.Popen([program(), "run", "--json", "--no-plot", "--duration", "1h", "--record", "session",
                                "--signals", "csv", *arguments], cwd=self.folder, text=True, preexec_fn=preexec_fn, **streams)
        self.addCleanup(self.end, run)
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline and run.poll() is None:
            try:
                if (self.folder / "session" / "signals.csv").stat().st_size > 1 << 20:  # some seconds of rendering
                    return run
            except FileNotFoundError:
                pass
            time.sleep(0.01)
        self.fail("the session didn't begin")

    @staticmethod
    def end(run):
        run.kill()
        run.communicate()

    def assert_controlled_stop(self, summary):
        self.assertEqual(summary["faults"], [])
        with open(self.folder / "session" / "signals.csv", newline="") as file:
            phases = [row["phase"] for row in csv.DictReader(file)]
        order = [phase for i, phase in enumerate(phases) if i == 0 or phase != phases[i - 1]]
        self.assertEqual(order[:4], ["enabling", "taring", "rendering", "stopping"])
        self.assertIn(order[-1], ("disabling", "done"))

    def assert_cause(self, summary, word, text):
        self.assertEqual(summary["end"]["reason"], word)
        self.assertTrue(summary["end"]["text"].startswith(f"stopped: {text}; "), summary["end"])

    def recorded_summary(self):
        return json.loads((self.folder / "session" / "summary.json").read_text())

    def test_every_signal_that_can_be_caught_makes_a_controlled_stop(self):
        for name in ENDING:
            with self.subTest(name):
                run = self.start()
                run.send_signal(NUMBERS.get(name) or getattr(signal, name))
                out, err = run.communicate(timeout=PATIENCE_S)
                self.assertEqual((run.returncode, err), (0, ""))
                summary = json.loads(out)
                self.assert_cause(summary, "signal", NAMES.get(name, name))
                self.assert_controlled_stop(summary)
                self.assertEqual(self.recorded_summary()["end"], summary["end"])

    def test_before_anything_is_rendered_is_no_failure_of_the_plot(self):
        """A session that waits for its enabling switch, and is called off."""
        bench = self.copies() / "models/cells/bench.yaml"
        bench.write_text(bench.read_text() + "enabling_input: {drive: shoulder, bit: 16}\n")
        for arguments, plot in ((["--plot", "own.svg"], "own.svg"), ([], "proxarm-run.svg")):
            with self.subTest(plot):
                control = self.folder / "control" / plot
                run = subprocess.Popen([program(), "run", bench, "--pace", "realtime", "--enabling", "100s..", "--control",
                                        control, *arguments], cwd=self.folder, text=True, stdin=subprocess.DEVNULL,
                                       stdout=subprocess.PIPE, stderr=subprocess.PIPE, preexec_fn=defaults)
                self.addCleanup(self.end, run)
                deadline = time.monotonic() + PATIENCE_S
                while not control.exists():
                    self.assertLess(time.monotonic(), deadline)
                    self.assertIsNone(run.poll())
                    time.sleep(0.02)
                run.terminate()
                out, err = run.communicate(timeout=PATIENCE_S)
                self.assertEqual((run.returncode, err), (0, ""))
                self.assertIn("stopped: SIGTERM; 0 of 10 s were rendered", out)
                self.assertIn("plot:                     none; nothing was rendered\n", out)
                self.assertFalse((self.folder / plot).exists())

    def test_from_the_first_line_on(self):
        """Who reads it and wants out was killed, with status -2 and no summary."""
        for _ in range(10):
            run = subprocess.Popen([program(), "run", "--no-plot", "--duration", "1h"], cwd=self.folder, text=True,
                                   stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                   preexec_fn=defaults)
            self.addCleanup(self.end, run)
            self.assertIn("kg felt", run.stdout.readline())
            run.send_signal(signal.SIGINT)
            out, err = run.communicate(timeout=PATIENCE_S)
            self.assertEqual((run.returncode, err), (0, ""))
            self.assertIn("stopped: SIGINT; ", out)

    def test_nohup_is_obeyed(self):
        """Who starts a session so has said that the terminal's end isn't the session's."""
        run = self.start(preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN))
        run.send_signal(signal.SIGHUP)
        time.sleep(0.3)
        self.assertIsNone(run.poll())
        run.send_signal(signal.SIGTERM)
        out, _ = run.communicate(timeout=PATIENCE_S)
        self.assert_cause(json.loads(out), "signal", "SIGTERM")

    def test_a_closed_standard_output_makes_a_controlled_stop(self):
        run = self.start()
        run.stdout.close()
        run.wait(timeout=PATIENCE_S)
        err = run.stderr.read()
        self.assertEqual(run.returncode, 2, err)
        self.assertIn("standard output: Broken pipe", err)
        self.assert_cause(self.recorded_summary(), "output_closed", "standard output was closed")
        self.assert_controlled_stop(self.recorded_summary())

    def test_a_closed_standard_error_makes_a_controlled_stop(self):
        """What a person would have to do to get free is said there."""
        run = self.start()
        run.stderr.close()
        out = run.stdout.read()
        self.assertEqual(run.wait(timeout=PATIENCE_S), 0)
        self.assert_cause(json.loads(out), "output_closed", "standard error was closed")
        self.assert_controlled_stop(json.loads(out))

    def test_sigpipe_itself_is_ignored(self):
        run = self.start()
        run.send_signal(signal.SIGPIPE)
        time.sleep(0.3)
        self.assertIsNone(run.poll())

    def test_a_lost_terminal_makes_a_controlled_stop(self):
        """As by a torn ssh connection, where no shell passes SIGHUP on."""
        master, slave = pty.openpty()
        run = self.start(stdin=slave, stdout=slave, stderr=slave, start_new_session=True)
        os.close(slave)
        os.close(master)
        self.assertEqual(run.wait(timeout=PATIENCE_S), 2, "its output is lost")
        self.assert_cause(self.recorded_summary(), "terminal_lost", "the terminal was lost")
        self.assert_controlled_stop(self.recorded_summary())

    def suspended(self, pause_s, status, *arguments):
        """The summary of a session in real time that stood still for so long, after two seconds."""
        run = subprocess.Popen([program(), "run", "--json", "--no-plot", "--pace", "realtime", *arguments],
                               cwd=self.folder, text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE)
        self.addCleanup(self.end, run)
        time.sleep(2.0)
        run.send_signal(signal.SIGSTOP)
        time.sleep(pause_s)
        run.send_signal(signal.SIGCONT)
        out, err = run.communicate(timeout=PATIENCE_S)
        self.assertEqual(run.returncode, status, err)
        return json.loads(out)

    def test_a_process_that_was_suspended_finds_the_gap_and_stops(self):
        """SIGSTOP can't be caught. Drives have stopped by themselves in the meantime; what catches up is no order of
        anybody who is there."""
        summary = self.suspended(0.7, 1, "--duration", "60s", "--record", "session", "--signals", "csv")
        self.assertEqual([fault["fault"] for fault in summary["faults"]], ["overrun"])
        self.assertIn("was the process suspended?", summary["faults"][0]["text"])
        self.assertLess(summary["simulated_time_s"], 30.0)
        with open(self.folder / "session" / "signals.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        cycles = [row["phase"] for row in rows]
        last = max(i for i, phase in enumerate(cycles) if phase == "rendering")
        gap_s = float(rows[last + 1]["time_s"]) - float(rows[last]["time_s"])
        self.assertGreater(gap_s, 0.3, "the first cycle after it is the stop's")
        self.assertIn("stopping", cycles[last + 1:])

    def test_a_process_that_was_kept_waiting_tells_its_overruns(self):
        """As by a busy machine: simulated time waits for it, but on a bus these cycles would have been late."""
        summary = self.suspended(0.08, 0, "--duration", "3s")
        self.assertGreater(summary["latency_us"]["wake_up"]["max"], 70e3)
        self.assertGreater(summary["overruns"], 70)
        self.assertEqual(summary["faults"], [])


class Output(ProgramTest):
    def test_that_cant_be_written_is_a_failure(self):
        for command in (("run", "--json", "--duration", "0.1s"), ("run", "--no-plot", "--duration", "0.1s"), ("plan",),
                        ("explain", SOURCE / "scenes/wall.yaml"), ("--help",)):
            with self.subTest(command[0]), open("/dev/full", "w") as full:
                done = subprocess.run([program(), *command], cwd=self.folder, stdin=subprocess.DEVNULL, stdout=full,
                                      stderr=subprocess.PIPE, text=True, timeout=PATIENCE_S)
                self.assertEqual(done.returncode, 2, done.stderr)
                self.assertIn("standard output: No space left on device", done.stderr)

    def test_that_is_closed_from_the_start_is_no_file_of_the_record(self):
        done = subprocess.run(["/bin/sh", "-c", 'exec "$0" run --duration 0.1s --record session >&- 2>err', program()],
                              cwd=self.folder, timeout=PATIENCE_S)
        self.assertEqual(done.returncode, 2)
        self.assertIn("standard output", (self.folder / "err").read_text())
        for file in (self.folder / "session").rglob("*"):
            if file.is_file():
                self.assertNotIn(b"felt mass", file.read_bytes(), file)


if __name__ == "__main__":
    unittest.main()
