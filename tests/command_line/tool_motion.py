"""How fast and where the tool and the elbow are by a record's joint positions: an independent judge of the tool guard.

Angles are numbers, or NumPy's arrays of a whole record with NumPy's `cos` and `sin` (`trig`).

Shares nothing with the controller but the cell's and the arm's files: links and masses come from the URDF, drives and
limits from the text of the cell file, positions from the counts in signals.csv. The model is a chain of joints whose
gears are twisted by gravity alone, theta = q + tau_g(q)/k; its tool point is T, its elbow points are the places of the
joints from the third to the last one, as the URDF has them.
"""
import csv
import math
import pathlib
import re
import xml.etree.ElementTree

TWO_PI = 2.0 * math.pi


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def turned(R, v):
    return tuple(row[0] * v[0] + row[1] * v[1] + row[2] * v[2] for row in R)


def plus(a, b):
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def product(A, B):
    return tuple(tuple(sum(A[i][k] * B[k][j] for k in range(3)) for j in range(3)) for i in range(3))


def about(axis, angle, trig=math):
    x, y, z = axis
    c, s = trig.cos(angle), trig.sin(angle)
    d = 1.0 - c
    return ((c + d * x * x, d * x * y - s * z, d * x * z + s * y),
            (d * x * y + s * z, c + d * y * y, d * y * z - s * x),
            (d * x * z - s * y, d * y * z + s * x, c + d * z * z))


def rpy(angles):
    roll, pitch, yaw = angles
    return product(product(about((0, 0, 1), yaw), about((0, 1, 0), pitch)), about((1, 0, 0), roll))


def vector(text):
    return tuple(float(word) for word in text.split())


class Cell:
    """What is needed of a cell file; of YAML only what the shipped cells use."""

    def __init__(self, file):
        self.file = pathlib.Path(file)
        text = re.sub(r"#.*", "", self.file.read_text())
        head, drives = text.split("\ndrives:", 1)
        drives = drives.split("\nsensor:", 1)[0]
        self.urdf = self.file.parent / re.search(r"^urdf: *(\S+)", head, re.M).group(1)
        shared = self.keys(re.search(r"^drive_defaults:(.*?)(?=^\w)", head + "\n_", re.M | re.S))
        self.drives = [shared | self.keys(re.search(r".*", drive, re.S))
                       for drive in re.split(r"^  - ", drives, flags=re.M)[1:]]
        gears = [d.get("gear_stiffness_Nm_per_rad") for d in self.drives]
        self.compliance = [1.0 / float(k) if k and float(k) > 0.0 else 0.0 for k in gears]
        self.joints = [d["joint"] for d in self.drives]
        limits = text.split("\nlimits:", 1)[1]
        self.speed = self.number(limits, "max_tool_speed_m_per_s", 0.5)
        self.elbow_speed = self.number(limits, "max_elbow_speed_m_per_s", self.speed)
        box = re.search(r"workspace_m: *\{min: *\[(.*?)\], *max: *\[(.*?)\]\}", limits)
        self.workspace = tuple(tuple(float(x) for x in box.group(i).split(",")) for i in (1, 2)) if box else None
        self.keep_out = [tuple(tuple(float(x) for x in side.split(",")) for side in zone)
                         for zone in re.findall(r"\{min: *\[([^\]]*)\], *max: *\[([^\]]*)\]\}",
                                                limits.partition("keep_out_m:")[2])]
        handle = re.search(r"handle_S: *\{position_m: *\[(.*?)\]", text).group(1)
        mount = re.search(r"pose_link: *\{position_m: *\[(.*?)\]", text).group(1)
        self.tool = plus(tuple(float(x) for x in mount.split(",")), tuple(float(x) for x in handle.split(",")))
        tool_centre = re.search(r"centre_of_mass_S_m: *\[(.*?)\]", text).group(1)
        self.load = (float(re.search(r"^ +mass_kg: *(\S+)", text, re.M).group(1)),
                     plus(tuple(float(x) for x in mount.split(",")), tuple(float(x) for x in tool_centre.split(","))))

    @staticmethod
    def keys(found):
        """Of a drive, or of what all have; of a key that its `simulation` has, too, that one's value."""
        return dict(re.findall(r"(\w+): *(\[.*?\]|[^\s,{}]+)", found.group())) if found else {}

    @staticmethod
    def number(text, key, default):
        found = re.search(key + r": *(\S+)", text)
        return float(found.group(1)) if found else default

    def angle(self, axis, counts):
        drive = self.drives[axis]
        per_rad = float(drive["counts_per_motor_revolution"]) * float(drive["gear_ratio"]) / TWO_PI
        return (counts - float(drive.get("offset_counts", 0))) / (per_rad * float(drive.get("direction", 1)))


class Chain:
    """The URDF's joints from the root to the flange."""

    def __init__(self, cell, trig=math):
        self.cell = cell
        self.trig = trig
        root = xml.etree.ElementTree.parse(cell.urdf).getroot()
        masses = {link.get("name"): (float(link.find("inertial/mass").get("value")),
                                     vector(link.find("inertial/origin").get("xyz")))
                  for link in root.findall("link") if link.find("inertial") is not None}
        self.joints = []
        for joint in root.findall("joint"):
            origin = joint.find("origin")
            axis = joint.find("axis")
            moved = joint.get("type") != "fixed"
            name = joint.get("name")
            self.joints.append({
                "at": vector(origin.get("xyz", "0 0 0")), "R": rpy(vector(origin.get("rpy", "0 0 0"))),
                "axis": vector(axis.get("xyz")) if moved else None, "slides": joint.get("type") == "prismatic",
                "drive": cell.joints.index(name) if moved else None,
                "mass": masses.get(joint.find("child").get("link"), (0.0, (0.0, 0.0, 0.0)))})

    def points(self, q, torque=None):
        """The places of T and of the driven joints, outwards; fills in gravity's torques where asked for."""
        R, p = ((1, 0, 0), (0, 1, 0), (0, 0, 1)), (0.0, 0.0, 0.0)
        places, axes, loads = [], [], []
        for joint in self.joints:
            p = plus(p, turned(R, joint["at"]))
            R = product(R, joint["R"])
            if joint["axis"] is not None:
                axis = turned(R, joint["axis"])
                if joint["slides"]:
                    p = plus(p, tuple(q[joint["drive"]] * x for x in axis))
                else:
                    R = product(R, about(joint["axis"], q[joint["drive"]], self.trig))
                places.append(p)
                axes.append((axis, joint["drive"], joint["slides"]))
            mass, centre = joint["mass"]
            loads.append((mass, plus(p, turned(R, centre)), len(places)))
        loads.append((self.cell.load[0], plus(p, turned(R, self.cell.load[1])), len(places)))
        if torque is not None:
            for i, (axis, drive, slides) in enumerate(axes):
                total = 0.0
                for mass, centre, after in loads:
                    if after <= i:
                        continue
                    weight = (0.0, 0.0, -9.80665 * mass)
                    lever = plus(centre, tuple(-x for x in places[i]))
                    total -= dot(axis, weight if slides else cross(lever, weight))
                torque[drive] = total
        return [plus(p, turned(R, self.cell.tool))] + places

    def at_motors(self, theta):
        """The same for the motors' angles; three rounds leave less than 1e-8 rad of the gears' twist."""
        q = list(theta)
        torque = [0.0] * len(theta)
        for _ in range(3):
            self.points(q, torque)
            q = [t - c * tau for t, c, tau in zip(theta, self.cell.compliance, torque)]
        return self.points(q)


def depth_outside(p, box):
    """How far p is out of the box; 0: inside."""
    return max(0.0, *(low - x for x, low in zip(p, box[0])), *(x - high for x, high in zip(p, box[1])))


def depth_inside(p, box):
    return max(0.0, min(*(x - low for x, low in zip(p, box[0])), *(high - x for x, high in zip(p, box[1]))))


class Worst:
    """The largest figures of a session, as shares of the limits and in metres."""

    def __init__(self):
        self.tool = self.elbow = self.outside = self.inside = self.tool_acceleration = 0.0
        self.at = {}

    def note(self, what, value, time):
        if value > getattr(self, what):
            setattr(self, what, value)
            self.at[what] = time

    def __str__(self):
        return " ".join(f"{what} {getattr(self, what):.5g}@{self.at.get(what, 0)}"
                        for what in ("tool", "elbow", "tool_acceleration", "outside", "inside"))


MOVING = ("rendering", "holding", "freeing", "stopping")


def judge(cell_file, signals, column):
    """Worst figures of a column, "target" or "actual", while the arm moves."""
    cell = Cell(cell_file)
    chain = Chain(cell)
    worst = Worst()
    before = []
    with open(signals, newline="") as file:
        rows = csv.reader(file)
        header = {name: i for i, name in enumerate(next(rows))}
        columns = [header[f"{joint}_{column}_counts"] for joint in cell.joints]
        time, phase = header["time_s"], header["phase"]
        for row in rows:
            if row[phase] not in MOVING:
                before = []
                continue
            theta = [cell.angle(i, float(row[k])) for i, k in enumerate(columns)]
            t = float(row[time])
            points = chain.at_motors(theta)
            if before:
                T = t - before[-1][0]
                speeds = [math.dist(a, b) / T for a, b in zip(points, before[-1][1])]
                worst.note("tool", speeds[0] / cell.speed, t)
                worst.note("elbow", max(speeds[3:]) / cell.elbow_speed, t)
                if len(before) == 2:
                    second = [a - 2 * b + c for a, b, c in zip(points[0], before[1][1][0], before[0][1][0])]
                    worst.note("tool_acceleration", math.hypot(*second) / T / T, t)
            if cell.workspace:
                worst.note("outside", depth_outside(points[0], cell.workspace), t)
            for zone in cell.keep_out:
                worst.note("inside", depth_inside(points[0], zone), t)
            before = (before + [(t, points)])[-2:]
    return worst
