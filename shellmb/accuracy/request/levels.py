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
        directory: The directory; None: nothing is kept.
        writes: Whether this rank writes.
        base: What the mesh of the first level is called.
    """

    def __init__(self, directory: Path | None, writes: bool, base: str = "given") -> None:
        self.directory, self._writes, self.base = directory, writes, base

    def place(self, number: int) -> Path | None:
        """Directory of the run of a level.

        Args:
            number: Its number, from 1.
        """
        return None if self.directory is None else self.directory / LEVELS / str(number)

    def is_done(self, number: int, comm: MPI.Comm) -> bool:
        """Decide whether the run of a level is there with its summary; collective.

        Args:
            number: Its number, from 1.
            comm: The ranks.
        """
        place = self.place(number)
        return bool(comm.bcast(place is not None and (place / SUMMARY).is_file()))

    def emptied(self, number: int, comm: MPI.Comm) -> Path | None:
        """Directory of a level, without what a killed run has left; collective.

        Args:
            number: Its number, from 1.
            comm: The ranks.
        """
        place = self.place(number)
        if place is not None and self._writes:
            shutil.rmtree(place, ignore_errors=True)
        comm.Barrier()
        return place

    def summary(self, number: int, comm: MPI.Comm) -> dict[str, Any]:
        """Summary of the run of a level that is done; collective.

        Args:
            number: Its number, from 1.
            comm: The ranks.
        """
        place = self.place(number)
        assert place is not None
        found: dict[str, Any] = comm.bcast(read_json(place / SUMMARY) if comm.rank == 0 else None)
        return found

    def keep(self, family: Family, levels: Sequence[Level]) -> None:
        """Write what is kept of runs, and the levels.

        Args:
            family: The runs.
            levels: The levels so far.
        """
        if self.directory is None or not self._writes:
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
        (self.directory / LEVELS).mkdir(parents=True, exist_ok=True)
        write_text(self.directory / LEVELS / f"{self.base}-{KEPT}", json.dumps(whole) + "\n")

    def read(self) -> tuple[dict[Change, RunRecord | None], dict[Change, str], list[Level]]:
        """Stored runs, why those without a result failed, and levels; empty if there are none."""
        file = None if self.directory is None else self.directory / LEVELS / f"{self.base}-{KEPT}"
        if file is None or not file.is_file():
            return {}, {}, []
        whole: Any = read_json(file)
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
