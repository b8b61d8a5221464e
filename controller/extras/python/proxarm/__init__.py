"""proxarm from Python: worlds, simulated sessions, records, studies, and sessions that run (docs/how_to/python.md).

A simulated session takes a world and a hand that are Python functions. A real one is `proxarm run`, a process of its
own, which `run` starts and `Live` talks to: no interpreter is ever in its cycle.
"""
import collections.abc
import functools
import json
import mmap
import os
import pathlib
import re
import shutil
import socket
import subprocess
import typing
import warnings

import numpy

from ._proxarm import SetupError, World, _Session, _read_table, _unpacked

__all__ = ["Contact", "Live", "Record", "Result", "Session", "SetupError", "SetupWarning", "Signals", "Study", "World",
           "load", "run", "study"]


class Signals(collections.abc.Mapping):
    """Columns by name, as numpy arrays: numbers as float64 (NaN where a field is empty), words as strings."""

    def __init__(self, columns):
        self._columns = {column[0]: column[1:] for column in columns}

    def _column(self, name):
        """Values, and words where it has such: of a table, read when it is first asked for."""
        column = self._columns[name]
        if callable(column[0]):
            column = self._columns[name] = column[0]()
        return column

    def __getitem__(self, name):
        values, *words = self._column(name)
        return numpy.array(words[0])[values] if words else values

    def __iter__(self):
        return iter(self._columns)

    def __len__(self):
        return len(self._columns)

    def vector(self, name):
        """Three columns as one array of n times 3: "proxy_W_m" for proxy_W_x_m, proxy_W_y_m and proxy_W_z_m."""
        columns = [self[column] for column in self if re.sub("_[xyz](?=_)", "", column, count=1) == name]
        if len(columns) != 3:
            raise KeyError(name)
        return numpy.column_stack(columns)

    def save(self, folder):
        """A file for each column, which load() maps into memory: however long it is, that takes some milliseconds."""
        folder = pathlib.Path(folder)
        folder.mkdir(parents=True)
        for column in self._columns:
            self._save_column(folder, column)
        (folder / "saved.json").write_text(json.dumps(list(self._columns)))

    def _save_column(self, folder, name):
        values, *words = self._column(name)
        if words:
            (folder / f"{name}.words.json").write_text(json.dumps(words[0]))
        unfinished = folder / f"{name}.{os.getpid()}.npy"
        numpy.save(unfinished, values)
        unfinished.replace(folder / f"{name}.npy")  # whole, or not there


class Result:
    """What a simulated session gives: `summary`, a dict as `proxarm run --json` prints it, its `signals`, a row for each
    cycle, and its `contacts`, a row for each contact of each cycle (docs/reference/files.md), both as Signals; `objects` are the
    names of those that contacts have by number."""

    def __init__(self, summary, signals, contacts, objects):
        self.summary, self.signals, self.contacts, self.objects = summary, signals, contacts, objects


class Record:
    """A session that was kept by `proxarm run --record`: a Result in files, but for the objects' names."""

    def __init__(self, folder, summary, signals, meanings):
        self.folder, self.summary, self.signals = folder, summary, signals
        self.meanings = meanings  # of each column: unit, frame and meaning

    @functools.cached_property
    def contacts(self):
        """Read when they are first asked for. SetupError: a record of a version that kept none."""
        described = _json(self.folder / "contact_columns.json")
        names = [column["name"] for column in described]
        if (table := self.folder / "contacts.bin").exists():
            return _Table(table).signals(names)
        text = [column["name"] for column in described if "unit" not in column]
        return Signals(_read_table(str(self.folder / "contacts.csv"), names, text))


class Contact(typing.NamedTuple):
    """What touches in a step of a world that is a function: its `normal` out of the object in W, of any length, the name
    of the `object`, the `point` in W where it isn't the proxy's place, and whether the proxy `slips` there."""

    normal: collections.abc.Sequence
    object: str = "world"
    point: typing.Optional[collections.abc.Sequence] = None
    slips: bool = False


class SetupWarning(UserWarning):
    """What is possible but hardly meant, as `proxarm run` warns of it: a value in another unit, say."""


class _Asked:
    """A session that runs, in this process or in another: ask() sends it a line."""

    def ask(self, line):
        raise NotImplementedError

    def status(self):
        """As `proxarm status --json`."""
        return json.loads(self.ask("status"))

    def set(self, changes=None, **more):
        """set(mass=3, damping="5Ns/m") or set({"wall.friction": 0.2}): all of them or none."""
        return self.ask("\t".join(f"{name}={value}" for name, value in {**(changes or {}), **more}.items()))

    def hold(self):
        """Holds the arm, drives enabled."""
        return self.ask("hold")

    def resume(self):
        """Goes on after a hold."""
        return self.ask("resume")

    def release(self):
        """Lets somebody free who is pinned: the arm yields to the hand, slowly."""
        return self.ask("release")

    def back_off(self, distance="20mm"):
        """Moves the arm away from what it presses on."""
        return self.ask(f"back-off {distance}")

    def reset(self):
        """Enables the drives again after a fault, into a hold."""
        return self.ask("reset")


def _option(name, value):
    """An option's value as the library takes it: None, a bool, a number, a text or a list of texts."""
    if isinstance(value, (list, tuple)):
        return [text if isinstance(text, str) else f"{text}" for text in map(functools.partial(_option, name), value)]
    if value is None or isinstance(value, str):
        return value
    if isinstance(value, (bool, numpy.bool_)):
        return bool(value)
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, (int, float, numpy.number)):
        return float(value)
    raise SetupError(f"--{name.replace('_', '-')}: found {value!r}, expected a number, a text, True, or a list of texts")


class Session(_Asked):
    """A session of the simulated arm. Options are those of `proxarm run --help`, with underscores for hyphens: numbers in
    SI units, or text with its unit; True for one that takes nothing, a list for one that may be repeated.

    Session(scene="scenes/wall.yaml", mass="4kg", fault=["axis_2:silent@2s"]).run() -> Result
    """

    def __init__(self, cell=None, scene=None, hand=None, **options):
        given = {"cell": cell or None, "scene": scene or None, "hand": hand or None, **options}
        self._options = {name: _option(name, value) for name, value in given.items()}
        self._running = _Session(self._options)  # what is wrong is said here
        for text in self._running.surprises():
            warnings.warn(text, SetupWarning, stacklevel=2)

    def run(self, world=None, hand=None):
        """world(kappa, p, q) -> where the proxy goes, or that and a list of Contacts, in place of the scene; a world that
        names no contact is free of them. hand(time_s, position, velocity) -> N, in place of the hand's motion and grip.
        All in W, three numbers each. What either raises comes out of here."""
        self._running = _Session(self._options)
        summary, columns, contacts, objects = self._running.run(world, hand)
        return Result(json.loads(summary), Signals(columns), Signals(contacts), objects)

    def ask(self, line):
        """While it runs, from one of its functions or from another thread: what its socket takes, such as "hold"."""
        return self._running.ask(line)

    def stop(self):
        """While it runs: ends it by a controlled stop."""
        self._running.stop()


KEEP_FROM_BYTES = 100_000_000  # of a signals.csv that takes about half a second to read


def load(folder, columns=None, keep=True):
    """A Record, or what Signals.save() wrote. `columns`: names of those that are wanted; reading takes as long as these
    do, and a pass over the rest. What was read of a long record is kept in its folder (`numpy`), as files that the next
    load maps into memory, for as long as its signals.csv stays as it is; not where nothing can be written there."""
    folder = pathlib.Path(folder)
    if (folder / "saved.json").exists():
        return _load_saved(folder, columns or _json(folder / "saved.json"))
    described = _json(folder / "columns.json")
    summary = _json(folder / "summary.json") if (folder / "summary.json").exists() else None
    wanted = list(columns or (column["name"] for column in described))
    text = [column["name"] for column in described if "unit" not in column]
    signals = _load_signals(folder, wanted, text, keep)
    return Record(folder, summary, signals, {column.pop("name"): column for column in described})


class _Table:
    """signals.bin or contacts.bin (docs/reference/files.md), mapped into memory: a column is read when somebody asks for it. Of a
    packed one the wanted columns are unpacked at once."""

    def __init__(self, file):
        def refuse(found):
            raise SetupError(f"{file}: found {found}, expected a table of a record, version 1 or 2")

        with open(file, "rb") as start:
            head = start.read(24)
            if head[:8] != b"PXSIGNAL":
                refuse("another kind of file")
            if len(head) < 24:
                refuse("a head that is cut off")
            version, begin, block_rows, columns = map(int, numpy.frombuffer(head[8:], "<u4"))
            if version not in (1, 2):
                refuse(f"version {version}")
            self._packed = version == 2
            try:
                self.columns = json.loads(start.read(begin - 24))["columns"]
            except ValueError:
                refuse("a head that is cut off")
        self._file, self._begin = file, begin
        if self._packed:
            self._block = columns, block_rows
            return
        shape = ((file.stat().st_size - begin) // (8 * block_rows * columns), columns, block_rows)
        self._blocks = numpy.memmap(file, "<f8", "r", begin, shape) if shape[0] else numpy.empty(shape)
        # Rows of the last block that have no cycle number are none.
        self._rows = self._blocks[:, 0].size - (int(numpy.isnan(self._blocks[-1, 0]).sum()) if shape[0] else 0)

    def signals(self, wanted):
        numbers = {column["name"]: number for number, column in enumerate(self.columns)}
        for name in wanted:
            if name not in numbers:
                raise SetupError(f'columns: found "{name}", expected the name of a column')
        if self._packed:
            values = self._unpack([0, *(numbers[name] for name in wanted)])
            return Signals((name, *self._with_words(numbers[name], column)) for name, column in zip(wanted, values))
        self._fetch({numbers[name] for name in wanted})
        return Signals((name, functools.partial(self._read, numbers[name])) for name in wanted)

    def _unpack(self, wanted):
        """The columns of these numbers, the first of which is that of the cycles: without it, but as long as it says."""
        data, at, blocks = self._file.read_bytes(), self._begin, []
        while at + 4 <= len(data) and at + 4 + (size := int.from_bytes(data[at:at + 4], "little")) <= len(data):
            block = _unpacked(data[at + 4:at + 4 + size], 8 * self._block[0] * self._block[1])
            if block is None:
                raise SetupError(f"{self._file}: found a block that is damaged, expected what a session has written")
            blocks.append(numpy.frombuffer(block, "<f8").reshape(self._block)[wanted])
            at += 4 + size
        columns = numpy.concatenate(blocks, axis=1) if blocks else numpy.empty((len(wanted), 0))
        rows = columns.shape[1] - (int(numpy.isnan(blocks[-1][0]).sum()) if blocks else 0)
        return [column[:rows] for column in columns[1:]]

    def _fetch(self, wanted):
        """Has the pages of some columns brought from the disk, all at once. Its reading ahead would bring all of them."""
        blocks, columns, rows = self._blocks.shape
        if blocks == 0 or 4 * len(wanted) > columns:
            return
        self._blocks._mmap.madvise(mmap.MADV_RANDOM)
        begins = sorted(number for number in wanted if number - 1 not in wanted)  # of columns that lie side by side
        ends = sorted(number + 1 for number in wanted if number + 1 not in wanted)
        with open(self._file, "rb", buffering=0) as file:
            for block in range(blocks):
                for begin, end in zip(begins, ends):
                    at = self._begin + 8 * rows * (block * columns + begin)
                    os.posix_fadvise(file.fileno(), at, 8 * rows * (end - begin), os.POSIX_FADV_WILLNEED)

    def _read(self, number):
        return self._with_words(number, self._blocks[:, number].reshape(-1)[: self._rows])

    def _with_words(self, number, values):
        form, words = self.columns[number]["form"], self.columns[number].get("words", "").split("|")
        if form == "word":
            return values.astype(numpy.int32), words
        if form != "flags":
            return (values,)
        sets, places = numpy.unique(values, return_inverse=True)
        return places, ["|".join(word for bit, word in enumerate(words) if int(bits) >> bit & 1) for bits in sets]


def _load_signals(folder, wanted, text, keep):
    if (folder / "signals.bin").exists():
        return _Table(folder / "signals.bin").signals(wanted)
    file = folder / "signals.csv"
    state = file.stat() if file.exists() else None
    if not keep or state is None or state.st_size < KEEP_FROM_BYTES:
        return Signals(_read_table(str(file), wanted, text))
    kept = folder / "numpy" / f"{state.st_size}-{state.st_mtime_ns}"  # another file's columns are in another folder
    missing = [name for name in wanted if not (kept / f"{name}.npy").exists()]
    if not missing:
        return _load_saved(kept, wanted)
    read = Signals(_read_table(str(file), missing, text))
    try:
        for old in kept.parent.glob("*"):
            if old != kept:
                shutil.rmtree(old)
        kept.mkdir(parents=True, exist_ok=True)
        for name in missing:
            read._save_column(kept, name)
    except OSError:  # a folder of somebody else's, or a full disk
        return read if missing == wanted else Signals(_read_table(str(file), wanted, text))
    return _load_saved(kept, wanted)


def _load_saved(folder, columns):
    found = []
    for name in columns:
        words = folder / f"{name}.words.json"
        values = numpy.load(folder / f"{name}.npy", mmap_mode="r")
        found.append((name, values, _json(words)) if words.exists() else (name, values))
    return Signals(found)


def _json(file):
    try:
        return json.loads(file.read_text())
    except OSError as error:
        raise SetupError(f"{file}: {error.strerror}; is this the folder of a record?") from None


def program():
    """The program proxarm: PROXARM_PROGRAM, else that of this build, else the one on the path."""
    built = pathlib.Path(__file__).resolve().parents[2] / "proxarm"
    found = os.environ.get("PROXARM_PROGRAM") or (str(built) if built.is_file() else shutil.which("proxarm"))
    if not found:
        raise SetupError("no program proxarm on the path, and PROXARM_PROGRAM doesn't name it")
    return found


def _call(*words):
    done = subprocess.run([program(), *map(str, words)], stdin=subprocess.DEVNULL, capture_output=True, text=True)
    if done.returncode == 2:
        raise SetupError(done.stderr.strip().removeprefix("proxarm: "))
    return done


def run(*words):
    """`proxarm run` with these words, as a process of its own, simulated or real; its summary once it has ended."""
    return json.loads(_call("run", "--json", *words).stdout)


class Study:
    """What a study wrote: `headline` (its JSON, with the meaning of each key) and `table`, every run, as Signals."""

    def __init__(self, folder, name):
        self.folder = pathlib.Path(folder)
        self.headline = _json(self.folder / f"{name}.json")
        self.table = Signals(_read_table(str(self.folder / f"{name}.csv"), [], []))


def study(name, out, **options):
    """`proxarm study NAME --out OUT`, with options such as quick=True, runs=100, seed=2, threads=1."""
    words = []
    for option, value in options.items():
        words += [f"--{option}"] if value is True else [f"--{option}", value]
    _call("study", name, "--out", out, *words)
    return Study(out, name)


class Live(_Asked):
    """A session that runs and was started with `--control`, through its socket, as `proxarm set` and `hold` ask it."""

    def __init__(self, path=None):
        runtime = os.environ.get("XDG_RUNTIME_DIR")
        folder = pathlib.Path(runtime) / "proxarm" if runtime else pathlib.Path(f"/tmp/proxarm-{os.geteuid()}")
        self.path = pathlib.Path(path) if path else folder / "control"

    def ask(self, line):
        """What the session answers. SetupError: it refuses, in its own words, or nobody is there."""
        with socket.socket(socket.AF_UNIX) as ear:
            ear.settimeout(5.0)
            try:
                ear.connect(str(self.path))
                ear.sendall(line.encode() + b"\n")
                answer = b""
                while not answer.endswith(b"\n") and (part := ear.recv(65536)):
                    answer += part
            except OSError as error:
                raise SetupError(f"{self.path}: --control: found {error.strerror or error}, expected a session that "
                                 "listens there") from None
        text = answer.decode().rstrip("\n")
        if not text.startswith("ok: "):
            raise SetupError(text)
        return text.removeprefix("ok: ")
