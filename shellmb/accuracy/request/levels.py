"""Levels of a request: its targets, and what was run, kept so that a request goes on."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from mpi4py import MPI

import pandas as pd

from shellmb.accuracy.family import Change, Family
from shellmb.accuracy.run_record import RunRecord
from shellmb.accuracy.studies.quantity import NORMS, Quantity, default_quantity, parse_quantity
from shellmb.errors import SceneError, of_first
from shellmb.files.reading import read_json
from shellmb.files.writing import write_text
from shellmb.options.run import AccuracyOptions
from shellmb.running.standard import SUMMARY
from shellmb.scene import Scene
from shellmb.scene.lookup import listed

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
        place = self.place(number)
        of_first(self._comm, lambda: shutil.rmtree(place, ignore_errors=True))
        return place

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


@dataclass(frozen=True, kw_only=True)
class Target(AccuracyOptions):
    """An accuracy that is requested.

    Args:
        accuracy: The relative error.
    """

    accuracy: float

    def quantity(self, scene: Scene, measures: bool = False) -> Quantity:
        """The quantity: a result, or a probe in the norm of its history that fits the scene.

        Args:
            scene: The scene.
            measures: Whether it has results, though the scene itself does not say so.

        Raises:
            SceneError: If there is none of that name, as far as is known.
        """
        names = [b.name for b in scene.meshed]
        if self.body is not None and self.body not in names:
            raise SceneError(
                f"body is '{self.body}'; it must be one of the scene's shells and beams, "
                f"{listed(names) or 'none'}"
            )
        if self.modes:
            return Quantity(self.of or "f1")
        if self.of is None:
            return default_quantity(scene, "", "of")
        name, colon, norm = self.of.rpartition(":")
        if colon and norm in NORMS and name:
            return parse_quantity(self.of)
        if self.of in [probe.name for probe in scene.probes]:
            return Quantity(self.of, "end" if scene.static else "l2")
        measures = measures or scene.results is not None or bool(colon)
        if not measures or (colon and norm not in NORMS):
            raise UnknownQuantity(self._unknown(scene, ()))
        # which results there are a run tells (`check`)
        return Quantity(self.of)

    def check(self, scene: Scene, quantity: Quantity, known: RunRecord) -> None:
        """Check that a run has the quantity.

        Args:
            scene: The scene.
            quantity: The quantity.
            known: The run.

        Raises:
            SceneError: If it has none of that name.
        """
        names = known.results if quantity.norm is None else known.history.columns
        if quantity.name not in names:
            raise UnknownQuantity(self._unknown(scene, tuple(known.results)))

    def _unknown(self, scene: Scene, results: tuple[str, ...]) -> str:
        names = [*(p.name for p in scene.probes), *results]
        known = listed(names) or "none"
        return (
            f"of is '{self.of}'; it must be one of the scene's probes and results, {known}, or "
            f"COLUMN:NORM of its history, as 'tip:max' (norms: {', '.join(NORMS)})"
        )


class UnknownQuantity(SceneError):
    """A quantity that a run of the scene does not have."""


def frequency_number(name: str | None) -> int | None:
    """Number of a natural frequency from its name, "f1"; None: the name is none of a frequency.

    Args:
        name: The name.
    """
    found = re.fullmatch(r"f([1-9][0-9]*)", name or "")
    return None if found is None else int(found[1])
