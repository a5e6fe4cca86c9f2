"""A scene beside the run with what observes it and is written of it."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from shellmb.barrier import first_found
from shellmb.errors import SceneError
from shellmb.files.checksums import as_list
from shellmb.files.reading import read_bytes, unpacked
from shellmb.files.writing import drafted
from shellmb.observers.columns import StateColumns, path_columns, points_and_events
from shellmb.observers.fields.reserves import Reserves
from shellmb.observers.files.checkpoint import Saved, Written
from shellmb.observers.files.described import describe
from shellmb.observers.history import History, Measuring
from shellmb.observers.probes import Probes
from shellmb.observers.summary import summarise, write_json
from shellmb.running.directory import written
from shellmb.running.execute import RunResult, take_up
from shellmb.running.results import measured
from shellmb.running.standard import HISTORY, SUMMARY, StandardObservers
from shellmb.scene import Scene
from shellmb.scene.fingerprint import differences, fingerprint
from shellmb.sensitivity.perturbed_run import PerturbedRun
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


# observers that say whether to trust a run, or how to go on with it
OF_THE_RUN = ("watch of ", "checkpoint", "stop")


class PerturbedScene:
    """One of the two scenes beside a run.

    Args:
        scene: The scene.
        folder: Where its history and fields are written.
        columns: "all", or "probes" only.
        fields: Whether its fields are written.
        run: The run; if it has made steps, the side goes on from its saved state.

    Attributes:
        shadow: Its simulation.

    Raises:
        SceneError: If the state of the side is not of that step of the run, or of another scene.
    """

    def __init__(
        self, scene: Scene, folder: Path, columns: str, fields: bool, run: Simulation
    ) -> None:
        self._folder, self._comm = folder, run.model.comm
        comm = self._comm
        if comm.rank == 0:
            folder.mkdir(parents=True, exist_ok=True)
        comm.Barrier()
        simulation = Simulation(scene, comm, run)
        self._standard: StandardObservers | None = None
        if columns == "all":
            self._standard = StandardObservers(folder)
            assert self._standard.frames is not None
            # a time that moves may be on either side of that of a frame
            self._standard.frames.clock = run
            left_out = OF_THE_RUN if fields else (*OF_THE_RUN, "frames")
            named = self._standard.named.items()
            chosen = {name: o for name, o in named if not name.startswith(left_out)}
        else:
            chosen = _only_probes(folder)
        if comm.rank == 0:
            describe(scene).write(folder)
        self.saved = SavedSide(folder, simulation, chosen)
        if run.step:
            self.saved.take_up(run)
        self.shadow = PerturbedRun(simulation, list(chosen.values()), forces=columns == "all")
        self.shadow.since = simulation.t - run.t

    def finish(
        self, summary: Mapping[str, Any], wall: float, results: Callable[..., Any] | None
    ) -> None:
        """Evaluate and write the results; collective.

        Args:
            summary: That of the run.
            wall: Wall time, s.
            results: What the scene measures, if its module says so.
        """
        assert self._standard is not None
        simulation, sources = self.shadow.simulation, self._standard.sources
        own = {**summary, **summarise(simulation, sources, wall, None)}
        own |= points_and_events(simulation)
        energy = sources.energy
        made = RunResult(simulation.scene, simulation, sources.history.rows, own, energy, None)
        measure = results or simulation.scene.results
        if measure is not None:
            own["results"] = measured(measure, made, self._comm)
        if self._comm.rank == 0:
            with written(self._folder, self._comm):
                write_json(self._folder / SUMMARY, own)


def _only_probes(folder: Path) -> dict[str, Observer]:
    """Observers of the probes, and of the load factor of a path, and the history of these."""
    probes: Measuring = Probes()
    reserves, path = Reserves(), StateColumns(path_columns)
    history = History([probes, reserves, path], folder / HISTORY)
    return {"probes": probes, "reserves": reserves, "path": path, "history": history}  # type: ignore[dict-item]
