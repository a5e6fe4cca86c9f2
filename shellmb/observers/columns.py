"""Columns of the history that are functions of the simulation, and files that grow by lines.

What the summary has of paths, events and step control stands here, too.
"""

import errno
import math
import os
import time as clock
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, BinaryIO
from weakref import proxy

from shellmb.files.writing import open_new
from shellmb.observers.deferred import Row
from shellmb.simulate.simulation import BaseObserver, Simulation
from shellmb.simulate.stepsize import ErrorSize

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
