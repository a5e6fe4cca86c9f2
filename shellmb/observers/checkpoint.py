"""The last good state of a run, from which `shellmb resume` goes on."""

from __future__ import annotations

import json
import time as clock
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mpi4py import MPI

import numpy as np
import numpy.typing as npt

from shellmb.errors import ConvergenceError, SceneError
from shellmb.simulate.simulation import Observer, Silent, Simulation

Arrays = dict[str, npt.NDArray[np.float64]]

INTERVAL = 30.0
FORMAT = 2


@dataclass(frozen=True)
class Saved:
    """A state read back.

    Args:
        arrays: This rank's dofs.
        simulation: Counters and step size.
        observers: States of the observers by name.
    """

    arrays: Arrays
    simulation: dict[str, Any]
    observers: dict[str, dict[str, Any]]


class Checkpoint(Silent):
    """Writes the last accepted state now and then, at the end, and when a run fails.

    The arrays of a step are written first, one file per rank; `state.json`, replaced in one go,
    then names them. Whenever a run is stopped, the file it left names a complete state.

    Args:
        folder: Folder of the state.
        observers: Observers whose state is kept, by name; the checkpoint has to stand behind them.
        first: Write what a state counts on, the history say.
        interval: Least time between two states, s.
    """

    def __init__(
        self,
        folder: Path,
        observers: Mapping[str, Observer],
        first: Sequence[Callable[[], None]] = (),
        interval: float = INTERVAL,
    ) -> None:
        self._folder, self._observers, self._interval = folder, observers, interval
        self._first = first

    def start(self, simulation: Simulation) -> None:
        """Take the initial state."""
        self._comm = simulation.model.comm
        if self._comm.rank == 0:
            self._folder.mkdir(parents=True, exist_ok=True)
        self._comm.Barrier()
        self._pending = False
        self._live = simulation.live()
        self._remember(simulation)
        self._write()

    def _remember(self, simulation: Simulation) -> None:
        """A copy, as a failing step spoils the functions, and a failing observer others' states."""
        arrays = {name: array.copy() for name, array in self._live.items()}
        observers = {name: o.state() for name, o in self._observers.items()}
        # in one go, as Ctrl-C may come at any moment
        self._last = arrays | simulation.past(), simulation.state(), observers
        self._pending = True

    def accepted(self, simulation: Simulation) -> None:
        """Remember the state and write it if the last writing is long ago."""
        self._remember(simulation)
        due = clock.perf_counter() - self._written > self._interval
        # the first rank's clock decides for all
        if self._comm.bcast(due) if self._comm.size > 1 else due:
            self._write()

    def finish(self, simulation: Simulation, error: Exception | None) -> None:
        """Write the last state, unless ranks may have failed one by one and would wait for ever."""
        together = error is None or isinstance(error, ConvergenceError) or self._comm.size == 1
        if self._pending and together:
            self._write()

    def _write(self) -> None:
        arrays, simulation, observers = self._last
        state = {
            "format": FORMAT,
            "ranks": self._comm.size,
            "simulation": simulation,
            "observers": observers,
        }
        for write in self._first:
            write()
        stem = f"step-{simulation['step']:08d}"
        file = self._folder / f"{stem}-rank{self._comm.rank}.npz"
        np.savez(file, allow_pickle=False, **arrays)
        self._comm.Barrier()
        if self._comm.rank == 0:
            draft = self._folder / "state.tmp"
            draft.write_text(json.dumps({**state, "arrays": stem}, indent=1))
            draft.replace(self._folder / "state.json")
            for old in self._folder.glob("step-*.npz"):
                if not old.name.startswith(f"{stem}-"):
                    old.unlink()
        self._pending = False
        self._written = clock.perf_counter()


def read_checkpoint(folder: Path, comm: MPI.Comm) -> Saved:
    """Read a state back.

    Args:
        folder: Folder of the state.
        comm: Communicator, of as many ranks as wrote it.

    Raises:
        SceneError: If there is no state, or it was written by another number of ranks.
    """
    file = folder / "state.json"
    if not file.is_file():
        raise SceneError(f"resume: there is no state {file}; give the directory of a run")
    state = json.loads(file.read_text())
    if state["format"] != FORMAT:
        raise SceneError(
            f"resume: the state in {folder} has format {state['format']}; this version of shellmb "
            f"reads format {FORMAT}, so start the run anew"
        )
    if state["ranks"] != comm.size:
        raise SceneError(
            f"resume: the run was made on {state['ranks']} ranks, not {comm.size}; resume it with "
            f"`mpiexec -n {state['ranks']}`"
        )
    with np.load(folder / f"{state['arrays']}-rank{comm.rank}.npz") as archive:
        arrays = {key: archive[key] for key in archive.files}
    return Saved(arrays, state["simulation"], state["observers"])
