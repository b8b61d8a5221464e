"""Where the simulated steel goes, which the controller never sees, by a session's record; and a hand that isn't there."""
import cmath
import csv
import math

# From power on to the first cycle, to a cycle or two.
BEFORE_FIRST_CYCLE_S, SLACK_S = 0.2, 0.003

NOBODY = """name: nobody
mass_kg: 0
stiffness_N_per_m: 0
damping_Ns_per_m: 0
waypoints:
  - {time_s: 0, offset_m: [0, 0, 0]}
"""


def coefficient(values, frequency_Hz, period_s=1e-3):
    """Of a sine in values that are read once a period, without a factor that two of them share."""
    mean = sum(values) / len(values)
    return sum((value - mean) * cmath.exp(-2j * math.pi * frequency_Hz * period_s * k)
               for k, value in enumerate(values))


def vectors(column, rows, name, unit):
    columns = [column[f"{name}_{axis}_{unit}"] for axis in "xyz"]
    return [tuple(float(row[i]) for i in columns) for row in rows]


class Track:
    """A session's phases and places of the steel."""

    def __init__(self, folder):
        with open(folder / "signals.csv", newline="") as file:
            header, *rows = csv.reader(file)
        self.take({name: i for i, name in enumerate(header)}, rows)

    def take(self, column, rows):
        self.time_s = [float(row[column["time_s"]]) for row in rows]
        self.phase = [row[column["phase"]] for row in rows]
        self.place = vectors(column, rows, "true_tool_W", "m")
        self.began = self.phase.index("rendering")

    def at(self, time_s):
        return next(k for k, t in enumerate(self.time_s) if t >= time_s)

    def leaves_rendering(self, start):
        """The first cycle from `start` on that doesn't render; None: there is none before the session's end."""
        return next((k for k in range(start, len(self.phase)) if self.phase[k] != "rendering"), None)
