"""The last good state of a run, from which `shellmb resume` goes on."""

import json
import time as clock
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.errors import ControlError, ConvergenceError, Stopped
from shellmb.files.writing import add_checksum, checksum, drafted, make_folder, write_text
from shellmb.observers.deferred import DeferredObserver
from shellmb.restart import Restartable, arrays_of, without_arrays
from shellmb.scene.fingerprint import Fingerprint, fingerprint
from shellmb.simulate.simulation import BaseObserver, Observer, Simulation, busy, separated

Arrays = dict[str, Floats]

INTERVAL = 30.0
FORMAT = 8
# what names of saved arrays of observers begin with
OBSERVED = "observers/"
# name in the folder
STATE_FILE = "state.json"


@dataclass(frozen=True)
class Saved:
    """A state read back.

    Args:
        arrays: This rank's dofs; none if the state is of another number of ranks.
        simulation: Counters and step size.
        observers: States of the observers by name.
        scene: Fingerprint of the scene.
        ranks: Dofs and their numbering (`Simulation.numbering`) on each of that many ranks.
    """

    arrays: Arrays
    simulation: dict[str, Any]
    observers: dict[str, dict[str, Any]]
    scene: Fingerprint = field(default_factory=dict)
    ranks: tuple[tuple[Arrays, dict[str, Ints]], ...] = ()


class Checkpoint(BaseObserver):
    """Writes the last accepted state now and then, at the end, and when a run fails.

    The arrays of a step are written first, one file per rank; `state.json`, replaced in one go,
    then names them. Whenever a run is stopped, the file it left names a complete state. With it go
    the scene's fingerprint and checksums of all that a run goes on with.

    Args:
        folder: Folder of the state.
        observers: Observers whose state is kept, by name; the checkpoint has to stand behind them.
        interval: Least time between two states, s.
    """

    def __init__(
        self, folder: Path, observers: Mapping[str, Observer], interval: float = INTERVAL
    ) -> None:
        self._folder, self._interval, self._names = folder, interval, list(observers)
        # a state counts on their files: they write what is not there yet, and have checksums
        self._files: dict[str, Any] = {n: o for n, o in observers.items() if hasattr(o, "sealed")}
        # these need not be asked in each step
        self._later = {n: o for n, o in observers.items() if isinstance(o, DeferredObserver)}
        self._observers = {n: o for n, o in observers.items() if n not in self._later}

    def start(self, simulation: Simulation) -> None:
        """Take the initial state."""
        self._comm = simulation.model.comm
        if self._comm.rank == 0:
            make_folder(self._folder)
        self._comm.Barrier()
        self._pending = False
        self._scene = fingerprint(simulation.scene)
        self._live = simulation.live()
        changed = {id(o) for o in busy(self._observers.values()) if _is_changed(o)}
        self._acting = {n: o for n, o in self._observers.items() if id(o) in changed}
        still = {n: o for n, o in self._observers.items() if n not in self._acting}
        self._still = {name: observer.state() for name, observer in still.items()}
        # where those of each rank belong, for a run that goes on with more or fewer of them
        numbers = self._folder / f"cells-of-{self._comm.size}-rank{self._comm.rank}.npz"
        with drafted(numbers) as part:
            np.savez(part, allow_pickle=False, **simulation.numbering())
        self._cells = self._comm.gather(checksum(numbers.read_bytes()))
        self.remember(simulation)
        self.write()

    def remember(self, simulation: Simulation) -> None:
        """A copy, as a failing step spoils the functions, and a failing observer others' states."""
        arrays = {name: array.copy() for name, array in self._live.items()}
        observers = self._still | {name: o.state() for name, o in self._acting.items()}
        counts = {name: o.count for name, o in self._later.items()}
        # in one go, as Ctrl-C may come at any moment
        self._last = arrays, simulation.whole_state(), observers, counts
        self._pending = True

    def accepted(self, simulation: Simulation) -> None:
        """Remember the state and write it if the last writing is long ago."""
        self.remember(simulation)
        due = clock.perf_counter() - self._written > self._interval
        # the first rank's clock decides for all
        if self._comm.bcast(due) if self._comm.size > 1 else due:
            self.write()

    def finish(self, simulation: Simulation, error: BaseException | None) -> None:
        """Write the last state, unless ranks may have failed one by one and would wait for ever."""
        known = error is None or isinstance(error, ConvergenceError | ControlError | Stopped)
        together = known or self._comm.size == 1
        if self._pending and together:
            self.write()

    def write(self) -> None:
        """Write the state that was remembered last."""
        arrays, whole, observers, counts = self._last
        past, simulation = separated(whole)
        past |= arrays_of(observers, OBSERVED)
        observers = observers | {n: self._later[n].state_at(c) for n, c in counts.items()}
        observers = {name: without_arrays(observers[name]) for name in self._names}
        for written in self._files.values():
            written.write()
        stem = f"step-{simulation['step']:08d}"
        file = self._folder / f"{stem}-rank{self._comm.rank}.npz"
        with drafted(file) as part:
            np.savez(part, allow_pickle=False, **arrays, **past)
        checksums = self._comm.gather(checksum(file.read_bytes()))
        if self._comm.rank == 0:
            counted = {name: w.sealed(observers[name]) for name, w in self._files.items()}
            state = {
                "format": FORMAT,
                "ranks": self._comm.size,
                "scene": self._scene,
                "arrays": stem,
                "arrays_sha256": checksums,
                "cells_sha256": self._cells,
                "simulation": simulation,
                "observers": observers | counted,
            }
            write_text(self._folder / STATE_FILE, json.dumps(add_checksum(state), indent=1))
            kept = (f"{stem}-", f"cells-of-{self._comm.size}-")
            for old in self._folder.glob("*-rank*.npz"):
                if not old.name.startswith(kept):
                    old.unlink()
        self._pending = False
        self._written = clock.perf_counter()


def _is_changed(observer: Observer) -> bool:
    """Decide whether steps change what an observer remembers."""
    taken: Any = type(observer).state
    return taken is not Restartable.state or bool(getattr(observer, "remembered", True))
