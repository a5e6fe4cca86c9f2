"""The last state of another run, as it is saved in the run's directory."""

from __future__ import annotations

import csv
import math
from collections import deque
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mpi4py import MPI

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.files.checksums import checksum, is_intact
from shellmb.files.reading import Damaged, read_bytes, read_json, unpacked
from shellmb.model.rank_consistency import alike
from shellmb.prefixes import below
from shellmb.scene.schemes import is_static

Arrays = dict[str, Floats]

# where a run saves its state
STATE, STATE_FILE = "state", "state.json"
# its numbers over time, and how columns of joints' coordinates end there
HISTORY, COUNTED = "history.csv", (".rotation", ".translation")


@dataclass(frozen=True)
class Stored:
    """The last state of a run.

    Args:
        arrays: This rank's values, by body and function, as of `Simulation.arrays`.
        scene: Fingerprint of the run's scene.
        dynamic: Whether the run has velocities.
        t: Time of the state, s.
        control: Its controllers and events, as of `Control.state`; None: there are none, or the
            state is not read.
    """

    arrays: Arrays
    scene: dict[str, Any]
    dynamic: bool
    t: float = 0.0
    control: dict[str, Any] | None = None

    def names(self, kind: str) -> list[str]:
        """Names of the scene's items of a kind, in their order.

        Args:
            kind: Field of the scene.
        """
        # of what an item has by name, as points of a body, entries begin like its own
        return list(dict.fromkeys(key.split("'")[0] for key in below(self.scene, f"{kind}['")))


def read_stored(directory: Path, comm: MPI.Comm, whole: bool = True) -> Stored:
    """Read the last state of a run; collective.

    Args:
        directory: The run directory.
        comm: Communicator, of as many ranks as the run's if the whole state is read.
        whole: Whether the arrays are read, too.

    Raises:
        SceneError: If there is no such state, or it is damaged, or of another number of ranks.
    """
    with alike(comm):
        found = _read(directory, comm, whole)
    return found


def counted(directory: Path, comm: MPI.Comm, at: float | None) -> dict[str, float] | None:
    """Coordinates of joints as a run has counted them, by column of its history; collective.

    Args:
        directory: The run directory.
        comm: Communicator.
        at: Time of the row [s]; None: the last one.

    Returns:
        None if there is no such history.
    """
    found: dict[str, float] | None = None
    if comm.rank == 0:
        wrong = OSError, ValueError, TypeError, KeyError, IndexError, AttributeError, csv.Error
        with suppress(*wrong), (directory / HISTORY).open(newline="") as file:
            rows = csv.DictReader(file)
            row = (
                deque(rows, 1)[0]
                if at is None
                else min(rows, key=lambda row: abs(float(row["t"]) - at))
            )
            values = {key: float(row[key]) for key in row if key.endswith(COUNTED)}
            found = values if all(map(math.isfinite, values.values())) else None
    return comm.bcast(found)


def _read(directory: Path, comm: MPI.Comm, whole: bool) -> Stored:
    file = directory / STATE / STATE_FILE
    if not file.is_file():
        raise SceneError(
            f"start from a run: there is no state {file}; give the directory of a run that has "
            "made a step"
        )
    values = read_json(file)
    try:
        name, sums = str(values["arrays"]), values["arrays_sha256"]
        ranks, scene = values["ranks"], dict(values["scene"])
        t, control = float(values["simulation"]["t"]), values["simulation"].get("control")
        sealed = is_intact(values) and math.isfinite(t)
    except (KeyError, TypeError, ValueError):
        sealed = False
    if not sealed:
        raise SceneError(f"start from a run: {file} is damaged or was edited; run it again")
    if control is not None and "samplers" not in control:
        raise SceneError(
            f"start from a run: the controllers in {directory} were saved by an older version of "
            "shellmb; run it again"
        )
    dynamic = not is_static(scene.get("scheme"))
    if not whole:
        return Stored({}, scene, dynamic)
    if ranks != comm.size:
        raise SceneError(
            f"start from a run: the run in {directory} was made on {ranks} ranks, not {comm.size}; "
            f"start from it with `mpiexec -n {ranks}`"
        )
    try:
        arrays = read_arrays(file.parent / f"{name}-rank{comm.rank}.npz", sums[comm.rank])
    except SceneError as error:
        raise SceneError(f"start from a run: {error}; run it again") from None
    return Stored(arrays, scene, dynamic, t, control)


def read_arrays(file: Path, expected: str) -> Arrays:
    """The arrays that a rank has saved.

    Args:
        file: Their file.
        expected: Its checksum.

    Raises:
        Damaged: If it is not as it was written.
    """
    content = read_bytes(file)
    if checksum(content) != expected:
        raise Damaged(f"{file} is damaged (its checksum differs)")
    return unpacked(file, content)
