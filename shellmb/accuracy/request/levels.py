"""Levels of a request: what was run, its errors and times, kept so that a request goes on."""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from mpi4py import MPI

import pandas as pd

from shellmb.accuracy.companions import Change
from shellmb.accuracy.family import Family
from shellmb.accuracy.run_record import RunRecord
from shellmb.errors import of_first
from shellmb.files.reading import read_json
from shellmb.files.writing import write_text
from shellmb.running.standard import SUMMARY

# folder of a request in its directory, and file of what is kept of levels and companions
LEVELS, KEPT = "levels", "companions.json"


@dataclass(frozen=True)
class Level:
    """A run of a request.

    Args:
        change: What is different in it from the scene.
        label: Mesh, step and scheme in words.
        value: The quantity.
        error: Its error, the sum of all parts; infinite where one is not known.
        mesh: The part of the mesh.
        step: The part of the step.
        others: All other parts.
        order: Order by which the part of the step is predicted.
        seconds: Processor time of its run [s].
        stepping: The part of it in steps [s].
        total: Processor time so far, with all comparison runs [s].
        dimension: Elements go with this power of those along a side.
        refinable: Whether its mesh can be refined.
        converges: Whether differences of its comparison runs fall; else only sizes of its parts do.
    """

    change: Change
    label: str
    value: float
    error: float
    mesh: float
    step: float
    others: float
    order: float
    seconds: float
    stepping: float
    total: float
    dimension: int
    refinable: bool = True
    converges: bool = True

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Level:
        """The level from its plain values."""
        return cls(**{**values, "change": Change(**values["change"])})


class Store:
    """Runs of a request in its directory.

    Args:
        directory: The directory.
        comm: The ranks, of which the first one writes.
        base: What the mesh of the first level is called.
    """

    def __init__(self, directory: Path, comm: MPI.Comm, base: str = "given") -> None:
        self._levels, self._comm = directory / LEVELS, comm
        self._file = self._levels / f"{base}-{KEPT}"

    def place(self, number: int) -> Path:
        """Directory of the run of a level.

        Args:
            number: Its number, from 1.
        """
        return self._levels / str(number)

    def is_done(self, number: int) -> bool:
        """Decide whether the run of a level is there with its summary; collective.

        Args:
            number: Its number, from 1.
        """
        return bool(self._comm.bcast((self.place(number) / SUMMARY).is_file()))

    def emptied(self, number: int) -> Path:
        """Directory of a level, without what a killed run has left; collective.

        Args:
            number: Its number, from 1.
        """
        if self._comm.rank == 0:
            shutil.rmtree(self.place(number), ignore_errors=True)
        self._comm.Barrier()
        return self.place(number)

    def summary(self, number: int) -> dict[str, Any]:
        """Summary of the run of a level that is done; collective.

        Args:
            number: Its number, from 1.
        """
        return of_first(self._comm, lambda: read_json(self.place(number) / SUMMARY))

    def keep(self, family: Family, levels: Sequence[Level]) -> None:
        """Write what is kept of runs, and the levels.

        Args:
            family: The runs.
            levels: The levels so far.
        """
        if self._comm.rank != 0:
            return
        rows = [
            {
                "change": asdict(change),
                "kept": None if kept is None else _plain(kept),
                "why": family.failures.get(change),
            }
            for change, kept in family.found.items()
        ]
        whole = {"runs": rows, "levels": [asdict(level) for level in levels]}
        self._levels.mkdir(parents=True, exist_ok=True)
        write_text(self._file, json.dumps(whole) + "\n")

    def read(self) -> tuple[dict[Change, RunRecord | None], dict[Change, str], list[Level]]:
        """Stored runs, why those without a result failed, and levels; empty if there are none."""
        if not self._file.is_file():
            return {}, {}, []
        whole: Any = read_json(self._file)
        found = {
            Change(**row["change"]): None if row["kept"] is None else _kept(row["kept"])
            for row in whole["runs"]
        }
        # former versions have no reasons
        why = {Change(**row["change"]): row["why"] for row in whole["runs"] if row.get("why")}
        return found, why, [Level.from_dict(level) for level in whole["levels"]]


def _plain(kept: RunRecord) -> dict[str, Any]:
    history = {str(name): kept.history[name].tolist() for name in kept.history}
    return vars(kept) | {"history": history, "means": sorted(kept.means)}


def _kept(values: dict[str, Any]) -> RunRecord:
    history, means = pd.DataFrame(values.pop("history")), frozenset(values.pop("means"))
    return RunRecord(history=history, means=means, **values)
