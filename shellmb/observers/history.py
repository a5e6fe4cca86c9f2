"""The history of a run: one row per accepted step, written as it goes."""

from __future__ import annotations

import csv
import time as clock
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from shellmb.errors import SceneError
from shellmb.observers.batches import Batches
from shellmb.observers.growingfile import GrowingFile
from shellmb.simulate.simulation import Silent, Simulation

# what every history begins and ends with
STEP_COLUMNS = ("step", "t", "dt", "iterations", "rejected", "jump")
WALL = "wall_s"


@runtime_checkable
class Measuring(Protocol):
    """An observer with numbers for the history, known and equal on all ranks."""

    def measure(self) -> dict[str, float]:
        """Numbers at the current time, the same names at all times."""
        ...


class History(Silent):
    """Collects the numbers of measuring observers after every step, and writes them to a CSV file.

    It has to stand behind the observers it asks. Row 0 is the initial state. Rows of short steps
    are written several at a time (`Batches`); all are there when a run ends, however it ends.

    Args:
        measuring: The observers to ask.
        path: File to write, on rank 0; None: kept in memory only.

    Attributes:
        rows: The rows so far; a number that a scheme does not have is NaN.
    """

    def __init__(self, measuring: Sequence[Measuring], path: Path | None = None) -> None:
        self._measuring, self._path = list(measuring), path
        self.rows: list[dict[str, float]] = []
        self._kept: int | None = None
        self._file: GrowingFile | None = None
        self._batches = Batches()

    def start(self, simulation: Simulation) -> None:
        """Open the file; after a restart keep the rows up to it.

        Raises:
            SceneError: If two columns have the same name.
        """
        self._begin = clock.perf_counter()
        writes = self._path is not None and simulation.model.comm.rank == 0
        if self._kept is not None and self._path is not None:
            read = read_history(self._path)[: self._kept] if writes else None
            self.rows = simulation.model.comm.bcast(read)
            self._begin -= self.rows[-1][WALL]
        first = not self.rows
        if first:
            self._check_names()
            self.rows.append(self._row(simulation))
        if writes:
            assert self._path is not None
            # under its name only when complete: rows of an earlier run are not lost on the way
            draft = self._path.with_suffix(".tmp")
            self._file = GrowingFile(draft, ",".join(self.rows[0]) + "\n", "\n", "\n")
            self.write()
            draft.replace(self._path)

    def _check_names(self) -> None:
        seen = {*STEP_COLUMNS, WALL}
        for observer in self._measuring:
            for name in observer.measure():
                if name in seen:
                    raise SceneError(
                        f"history: two columns are named '{name}'; a probe or observer needs a "
                        "name of its own"
                    )
                seen.add(name)

    def _row(self, simulation: Simulation) -> dict[str, float]:
        last = simulation.last
        # a run that is resumed at its end has made no step of its own
        jump = float("nan") if last is None or last.jump is None else last.jump
        row: dict[str, float] = {
            "step": simulation.step,
            "t": simulation.t,
            "dt": last.dt if last else 0.0,
            "iterations": last.iterations if last else 0,
            "rejected": simulation.size.rejected,
            "jump": jump,
        }
        for observer in self._measuring:
            row.update({name: float(value) for name, value in observer.measure().items()})
        row[WALL] = clock.perf_counter() - self._begin
        return row

    def write(self) -> None:
        """Write the rows that are not in the file yet."""
        if self._file is None or self._file.count == len(self.rows):
            return
        # repr keeps all digits; what a scheme does not have is left empty
        rows = self.rows[self._file.count :]
        self._file.add([",".join(map(repr, row.values())).replace("nan", "") for row in rows])
        self._batches.written()

    def accepted(self, simulation: Simulation) -> None:
        """Add a row."""
        row = self._row(simulation)
        self.rows.append(row)
        if self._batches.due():
            self.write()

    def finish(self, simulation: Simulation, error: Exception | None) -> None:
        """Write what is left and close the file."""
        if self._file is not None:
            self.write()
            self._file.close()
            self._file = None

    def state(self) -> dict[str, Any]:
        """Number of rows."""
        return {"rows": len(self.rows)}

    def restore(self, state: dict[str, Any]) -> None:
        """Keep so many rows of the file."""
        self._kept = int(state["rows"])


def read_history(path: Path) -> list[dict[str, float]]:
    """Rows of a history file; empty entries are NaN, whole numbers are int.

    Args:
        path: The file.
    """
    integers = {"step", "iterations", "rejected"}

    def number(name: str, text: str) -> float:
        return int(text) if name in integers else float(text or "nan")

    with path.open(newline="") as file:
        return [{k: number(k, v) for k, v in row.items()} for row in csv.DictReader(file)]
