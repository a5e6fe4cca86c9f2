"""The history of a run: one row per accepted step, written as it goes; columns, growing files.

What the summary has of paths, events and step control stands here, too.
"""

import errno
import hashlib
import math
import os
import time as clock
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict
from operator import itemgetter
from pathlib import Path
from typing import Any, BinaryIO
from weakref import proxy

from shellmb.errors import SceneError
from shellmb.files.reading import read_bytes
from shellmb.files.writing import open_new
from shellmb.observers.deferred import DeferredObserver, Row
from shellmb.simulate.simulation import BaseObserver, Simulation
from shellmb.simulate.stepsize import ErrorSize

# what every history begins and ends with
STEP_COLUMNS = ("step", "t", "dt", "iterations", "rejected", "jump")
WALL = "wall_s"
INTEGERS = {"step", "iterations", "rejected"}


class History(BaseObserver):
    """Collects the numbers of measuring observers after every step, and writes them to a CSV file.

    It has to stand behind the observers it asks. Row 0 is the initial state. Columns of observers
    that collect rows of short steps (`DeferredObserver`) come first. Rows are written several at a
    time (`Batches`); all are there when a run ends, however it ends.

    Args:
        observers: Those to ask.
        path: File to write, on rank 0; None: kept in memory only.
    """

    def __init__(self, observers: Sequence[BaseObserver], path: Path | None = None) -> None:
        self._path = path
        self._rows: list[dict[str, float]] = []
        # the beginnings of rows that are not complete yet, and their ends
        self._steps: list[tuple[tuple[float, ...], dict[str, float]]] = []
        self._later = [o for o in observers if isinstance(o, DeferredObserver)]
        self._each_step = [o for o in observers if o not in self._later]
        self._kept: int | None = None
        self._file: GrowingFile | None = None
        self._refused: OSError | None = None
        # checksum of the first lines of the file, how many they are, and those behind them
        self._sum, self._summed, self._lines = hashlib.sha256(), 0, list[str]()
        self._batches = Batches()

    @property
    def rows(self) -> list[dict[str, float]]:
        """The rows so far; a number that a scheme does not have is NaN."""
        count = len(self._steps)
        if count:
            columns = [observer.collect(count) for observer in self._later]
            for (first, last), *found in zip(self._steps, *columns, strict=True):
                self._rows.append(dict(zip(STEP_COLUMNS, first, strict=True)))
                for each in (*found, last):
                    self._rows[-1] |= each
            self._steps = []
        return self._rows

    def start(self, simulation: Simulation) -> None:
        """Open the file; after a restart keep the rows up to it.

        Raises:
            SceneError: If two columns have the same name.
        """
        self._begin = clock.perf_counter()
        every = [*self._later, *self._each_step]
        check_columns(every)
        writes = self._path is not None and simulation.model.comm.rank == 0
        if self._kept is not None and self._path is not None:
            read = read_rows(self._path.read_text(), self._kept) if writes else None
            self._rows = simulation.model.comm.bcast(read)
            self._begin -= self._rows[-1][WALL]
        row = dict(zip(STEP_COLUMNS, _first_columns(simulation), strict=True)) | self._values(every)
        if not self._rows:
            self._rows.append(row)
        elif new := sorted(row.keys() ^ self._rows[0].keys()):
            # what has not started can neither warn nor write
            self._rows = []
            raise SceneError(
                f"resume: columns {new[:5]} are new or gone; keep observers, output, step_control"
            )
        self._each_step = [observer for observer in self._each_step if observer.measure()]
        for observer in self._later:
            # it keeps from now on what is to be collected
            observer.collect(0)
        if self._path is not None and writes:
            # under its name only when complete: rows of an earlier run are not lost on the way
            draft = self._path.with_suffix(".tmp")
            head = ",".join(self.rows[0])
            self._lines.append(head)
            self._file = GrowingFile(draft, head)
            self.write()
            draft.replace(self._path)

    def _values(self, observers: Iterable[BaseObserver]) -> dict[str, float]:
        """Numbers of observers, and the time since the start."""
        found = {k: float(v) for o in observers for k, v in o.measure().items()}
        return found | {WALL: clock.perf_counter() - self._begin}

    def write(self) -> None:
        """Write the rows that are not in the file yet.

        Raises:
            OSError: If they cannot be, or could not be when the file was closed: no state may count
                on them.
        """
        if self._refused is not None:
            raise self._refused
        every = self.rows
        self._batches.written()
        if self._file is None or self._file.count == len(every):
            return
        # repr keeps all digits; what a scheme does not have is left empty; observers of a run that
        # goes on may stand in another order
        numbers = map(itemgetter(*every[0]), every[self._file.count :])
        lines = [",".join(map(repr, each)).replace("nan", "") for each in numbers]
        self._file.add(lines)
        self._lines += lines

    def sealed(self, state: Mapping[str, Any]) -> dict[str, Any]:
        """A saved state with the checksum of so many rows and the head, on rank 0."""
        new = state["rows"] + 1 - self._summed
        self._sum.update("".join(f"{line}\n" for line in self._lines[:new]).encode())
        del self._lines[:new]
        self._summed += new
        return {**state, "sha256": self._sum.hexdigest()}

    def accepted(self, simulation: Simulation) -> None:
        """Add a row."""
        self._steps.append((_first_columns(simulation), self._values(self._each_step)))
        if self._file is not None and self._batches.due():
            self.write()

    def finish(self, simulation: Simulation, error: BaseException | None) -> None:
        """Write what is left and close the file."""
        if self._file is not None:
            file = self._file
            try:
                self.write()
            except OSError as refused:
                self._refused = refused
                raise
            finally:
                self._file = None
                file.close()

    def state(self) -> dict[str, Any]:
        """Number of rows."""
        return {"rows": len(self._rows) + len(self._steps)}

    def restore(self, state: dict[str, Any]) -> None:
        """Keep so many rows of the file."""
        self._kept = int(state["rows"])


def _first_columns(simulation: Simulation) -> tuple[float, ...]:
    """Values of `STEP_COLUMNS`."""
    last = simulation.last
    # a run that is resumed at its end has made no step of its own
    jump = math.nan if last is None or last.jump is None else last.jump
    made = (last.dt, last.iterations) if last else (0.0, 0)
    return simulation.step, simulation.t, *made, simulation.size.rejected, jump


def read_history(path: Path) -> list[dict[str, float]]:
    """Rows of a history file; empty entries are NaN, whole numbers are int.

    Args:
        path: The file.

    Raises:
        SceneError: If it is no history, or damaged.
    """
    try:
        text = read_bytes(path).decode()
        return read_rows(text, len(text.splitlines()) - 1)
    except (OSError, ValueError, SceneError) as error:
        raise SceneError(f"{path} is no history of a run: {error}") from None


def read_rows(text: str, count: int) -> list[dict[str, float]]:
    """The first rows of a history.

    Args:
        text: What is in the file.
        count: How many.

    Raises:
        ValueError: If they are not there, are no numbers, or are not in the order of time; says
            which row.
    """
    head, *lines = text.split("\n")
    names = head.split(",")
    if names[: len(STEP_COLUMNS)] != list(STEP_COLUMNS) or names[-1] != WALL:
        raise ValueError("its head is not that of a history")
    rows: list[dict[str, float]] = []
    for number, line in enumerate(lines[:count]):
        try:
            values = line.split(",")
            row = {k: _number(k, v) for k, v in zip(names, values, strict=True)}
        except ValueError:
            raise ValueError(f"row {number} is not whole") from None
        if rows and not (row["step"] == rows[-1]["step"] + 1 and row["t"] > rows[-1]["t"]):
            raise ValueError(f"row {number} does not follow the one before it in time")
        rows.append(row)
    if len(rows) < count:
        raise ValueError(f"it has {len(rows)} rows and not {count}")
    return rows


def _number(name: str, text: str) -> float:
    return int(text) if name in INTEGERS else float(text or "nan")


def check_columns(observers: Iterable[BaseObserver]) -> None:
    """Refuse columns that have one name, or a name that a table cannot have.

    Args:
        observers: Observers that have started.

    Raises:
        SceneError: At the first.
    """
    seen = {*STEP_COLUMNS, WALL}
    for observer in observers:
        for name in observer.measure():
            if not name.isprintable() or any(sign in name for sign in ',;"'):
                raise SceneError(
                    f"history: a column is named {name!r}; it must be without commas, "
                    "semicolons, quotes and line breaks"
                )
            if name in seen:
                raise SceneError(
                    f"history: two columns are named '{name}'; a probe or observer needs a "
                    "name of its own"
                )
            seen.add(name)


# what follows an event's name
ON = ".on"
UNIT = "1: error by the time a motion as large as the body has turned by 1 rad, over its size"

# wall time whose results a killed process may lose, s
BATCH = 0.2


class KeptColumns(BaseObserver):
    """An observer of steps that keeps columns of the history.

    Attributes:
        values: Numbers at the current time by the names of their columns.
    """

    def __init__(self) -> None:
        self.values: Row = {}

    def measure(self) -> Row:
        """Columns of the history."""
        return dict(self.values)


class StateColumns(BaseObserver):
    """Columns that are a function of the simulation, of the same names at all times.

    Args:
        read: The function.
    """

    def __init__(self, read: Callable[[Simulation], Row]) -> None:
        self._read = read

    def start(self, simulation: Simulation) -> None:
        """Know what is read."""
        # it knows its observers, and is freed as soon as nobody else knows it
        self._simulation = proxy(simulation)

    def measure(self) -> Row:
        """Columns of the history."""
        return self._read(self._simulation)


def control_columns(simulation: Simulation) -> Row:
    """`CONTROLLER.OUTPUT` of the step that ends, the readings it was made from, `EVENT.on`.

    Before the first step outputs are 0, and nothing has been read.
    """
    found: Row = {}
    for sampler in simulation.control.samplers:
        who = sampler.law.name
        found |= {f"{who}.{k}": v for k, v in (sampler.outputs | sampler.readings).items()}
    return found | {f"{w.event.name}{ON}": float(w.on) for w in simulation.control.watches}


def path_columns(simulation: Simulation) -> Row:
    """`load_factor` of a static path, its derivative `load_rate` by the arc length, and `unstable`.

    The last is the number of directions in which the state is unstable: NaN where it is not known.
    Of other runs nothing.
    """
    path = simulation.path
    if path is None:
        return {}
    unstable = math.nan if path.unstable is None else float(path.unstable)
    return {"load_factor": path.factor, "load_rate": path.here.rate, "unstable": unstable}


def error_columns(simulation: Simulation) -> Row:
    """The estimated error of a step, of runs that are controlled by it."""
    if simulation.scene.step_control.step_error is None:
        return {}
    error = None if simulation.last is None else simulation.last.error
    return {"error_estimate": math.nan if error is None else error}


def volume_columns(simulation: Simulation) -> Row:
    """Enclosed volumes [m^3] at the end of a step, and their pressures [Pa] over that outside.

    The pressure of a gas is that at the end of the step; of a given volume it is a mean over the
    step, NaN before the first one.
    """
    found: Row = {}
    for volume in simulation.model.volumes:
        levels, name = simulation.problem.levels[volume.name], volume.item.name
        step = levels.unknown[simulation.problem.last]
        size, pressure = volume.values(levels.q.x.array, step.x.array)
        known = volume.item.gas is not None or simulation.last is not None
        found |= {f"{name}.volume": size, f"{name}.pressure": pressure if known else math.nan}
    return found


def points_and_events(simulation: Simulation) -> dict[str, Any]:
    """Special points of a path, and events with the times [s] at which they went on and off.

    Args:
        simulation: The simulation, at its end.

    Returns:
        `path`, `events` and `ended_by` of `summary.json`, those that apply.
    """
    found: dict[str, Any] = {}
    if simulation.path is not None:
        found["path"] = [asdict(point) for point in simulation.path.points]
    if watches := simulation.control.watches:
        found["events"] = {w.event.name: {"on": w.on, "times": list(w.times)} for w in watches}
        found["ended_by"] = simulation.control.ended
    return found


def step_control(simulation: Simulation) -> dict[str, Any] | None:
    """Record of step control by error for `summary.json`; None without one."""
    size = simulation.size
    if not isinstance(size, ErrorSize):
        return None
    return {
        "unit": UNIT,
        "step_error": size.settings.step_error,
        "accepted": simulation.step,
        "rejected": size.rejected,
        "largest_error": size.worst,
        "accumulated_error": size.total,
        "above_step_error": size.coarse,
        "dt_min": size.shortest,
        "dt_max": size.longest,
    }


class GrowingFile:
    """Lines behind a head; complete after each addition.

    Args:
        path: The file; what it held is lost when the first lines are added.
        head: The first line.
    """

    def __init__(self, path: Path, head: str) -> None:
        self._path, self._head = path, head
        self._file: BinaryIO | None = None
        # lines behind the head, and bytes: noted together
        self._written = (0, 0)

    @property
    def count(self) -> int:
        """Number of lines behind the head."""
        return self._written[0]

    def add(self, lines: Sequence[str]) -> None:
        """Write lines behind those that are there.

        Args:
            lines: At least one.
        """
        if self._file is None:
            self._file = open_new(self._path)
        elif os.fstat(self._file.fileno()).st_nlink == 0:
            # it would take what nobody finds again
            raise FileNotFoundError(errno.ENOENT, "it was removed during the run", str(self._path))
        count, size = self._written
        text = "".join(f"{line}\n" for line in (lines if count else (self._head, *lines))).encode()
        # at its place: Ctrl-C may come between this and the note of it
        self._file.seek(size)
        self._file.write(text)
        self._file.flush()
        self._written = (count + len(lines), size + len(text))

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            self._file.close()


class Batches:
    """Says when to write what has been collected.

    Writing is cheap in a row, and dear between the steps of a simulation, whose numbers take its
    place in the processor's caches. Long steps are written one by one. What is collected has to be
    written before a state that counts on it, and at the end of the run, however it ends.
    """

    def __init__(self) -> None:
        self._written = -BATCH

    def due(self) -> bool:
        """Decide whether it is time to write."""
        return clock.perf_counter() - self._written > BATCH

    def written(self) -> None:
        """All that was collected is written."""
        self._written = clock.perf_counter()
