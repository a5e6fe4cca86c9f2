"""The state of a scene beside a run, written with that of the run: both go on from there."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from shellmb.barrier import first_found
from shellmb.errors import SceneError
from shellmb.files.checksums import as_list
from shellmb.files.reading import read_bytes, unpacked
from shellmb.files.writing import drafted
from shellmb.observers.files.checkpoint import Saved, Written
from shellmb.running.execute import take_up
from shellmb.scene.fingerprint import differences, fingerprint
from shellmb.simulate.simulation import Observer, Simulation

# entry of the file that holds numbers and observers; behind it come arrays of the simulation
TABLE = "state"


class SavedSide:
    """The state of one of the two scenes beside a run.

    Args:
        folder: Folder of the scene.
        simulation: Its simulation.
        named: Its observers by name.
    """

    def __init__(self, folder: Path, simulation: Simulation, named: Mapping[str, Observer]) -> None:
        self._simulation, self._named = simulation, dict(named)
        self._file = folder / f"state-rank{simulation.model.comm.rank}.npz"

    def remember(self) -> None:
        """Take down the present state, that of an accepted step."""
        observers = {name: o.state() for name, o in self._named.items()}
        self._last = *self._simulation.saved(), observers

    def write(self) -> None:
        """Write the state that was taken down last, and before it the files that it counts on."""
        arrays, simulation, observers = self._last
        first = self._simulation.model.comm.rank == 0
        for name, observer in self._named.items():
            if isinstance(observer, Written):
                observer.write()
                if first:
                    observers[name] = observer.sealed(observers[name])
        scene = fingerprint(self._simulation.scene)
        table = {"simulation": simulation, "observers": observers, "scene": scene}
        with drafted(self._file) as part:
            text = np.array(json.dumps(table, default=as_list))
            np.savez(part, allow_pickle=False, **arrays, **{TABLE: text})

    def take_up(self, run: Simulation) -> None:
        """Go on from the state in the file; collective.

        Args:
            run: The run, which goes on, too.

        Raises:
            SceneError: If the state is damaged, of another scene, or of another step.
        """
        comm = run.model.comm
        arrays, table, wrong = {}, {}, None
        try:
            arrays = unpacked(self._file, read_bytes(self._file))
            table = json.loads(str(arrays.pop(TABLE)))
        except SceneError as error:
            wrong = str(error)
        except (ValueError, KeyError) as error:
            wrong = f"{self._file} cannot be read ({error})"
        # observers of the first rank know the files
        table = comm.bcast(table)
        wrong = first_found(comm, wrong)
        if wrong is None and table["simulation"]["step"] != run.step:
            wrong = (
                f"{self._file} is of step {table['simulation']['step']}, and the run goes on from "
                f"step {run.step}"
            )
        if wrong is None:
            others = differences(table["scene"], fingerprint(self._simulation.scene))
            if others:
                path, was, now = others[0]
                wrong = f"{self._file} is of another scene: {path} was {was}, is {now}"
        if wrong is not None:
            raise SceneError(f"sensitivities: {wrong}; start again in another directory")
        saved = Saved(arrays, table["simulation"], table["observers"])
        take_up(self._simulation, self._named, saved)
