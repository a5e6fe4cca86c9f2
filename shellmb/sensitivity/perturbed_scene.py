"""A scene beside the run with what observes it and is written of it."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from shellmb.errors import SceneError, unsaid
from shellmb.observers.columns import points_and_events
from shellmb.observers.files.checkpoint import Checkpoint, Saved
from shellmb.observers.files.described import describe
from shellmb.observers.summary import summarise
from shellmb.running.execute import RunResult, take_up
from shellmb.running.results import measured, write_summary
from shellmb.running.resuming.saved import read_saved
from shellmb.running.standard import STATE, StandardObservers
from shellmb.scene import Scene
from shellmb.scene.fingerprint import differences, fingerprint
from shellmb.sensitivity.perturbed_run import PerturbedRun
from shellmb.simulate.simulation import Simulation

# observers that say how to go on with a run
OF_THE_RUN = ("checkpoint", "stop")


class PerturbedScene(PerturbedRun):
    """One of the two scenes beside a run.

    Args:
        scene: The scene.
        folder: Where its history and fields are written.
        columns: "all", or "probes" only.
        fields: Whether its fields are written.
        run: The run; if it has made steps, the side goes on from its saved state.

    Raises:
        SceneError: If the state of the side is not of that step of the run, or of another scene.
    """

    @unsaid()
    def __init__(
        self, scene: Scene, folder: Path, columns: str, fields: bool, run: Simulation
    ) -> None:
        self._folder, comm = folder, run.model.comm
        if comm.rank == 0:
            folder.mkdir(parents=True, exist_ok=True)
        comm.Barrier()
        simulation = Simulation(scene, comm, run)
        self._standard = StandardObservers(folder, watched=False, accounts=columns == "all")
        assert self._standard.frames is not None
        # a time that moves may be on either side of that of a frame
        self._standard.frames.clock = run
        left_out = OF_THE_RUN if fields else (*OF_THE_RUN, "frames")
        chosen = {name: o for name, o in self._standard.named.items() if name not in left_out}
        if comm.rank == 0:
            describe(scene).write(folder)
        self.saved = Checkpoint(folder / STATE, chosen)
        if run.step:
            take_up(simulation, chosen, _saved(folder, simulation, run))
        super().__init__(simulation, list(chosen.values()), columns == "all")
        self.since = simulation.t - run.t

    def evaluate(
        self, summary: Mapping[str, Any], wall: float, results: Callable[..., Any] | None
    ) -> None:
        """Evaluate and write the results; collective.

        Args:
            summary: That of the run.
            wall: Wall time, s.
            results: What the scene measures, if its module says so.
        """
        simulation, sources = self.simulation, self._standard.sources
        own = {**summary, **summarise(simulation, sources, wall, None)}
        own |= points_and_events(simulation)
        energy = sources.energy
        made = RunResult(simulation.scene, simulation, sources.history.rows, own, energy, None)
        measure = results or simulation.scene.results
        if measure is not None:
            own["results"] = measured(measure, made, simulation.model.comm)
        write_summary(own, self._folder, simulation.model.comm)


def _saved(folder: Path, simulation: Simulation, run: Simulation) -> Saved:
    """The state of a side, of the step of the run that goes on; collective."""
    try:
        saved = read_saved(folder, run.model.comm)
        step = saved.simulation["step"]
        others = differences(saved.scene, fingerprint(simulation.scene))
        if step != run.step:
            raise SceneError(f"it is of step {step}, and the run goes on from step {run.step}")
        if others:
            path, was, now = others[0]
            raise SceneError(f"it is of another scene: {path} was {was}, is {now}")
    except SceneError as error:
        raise SceneError(
            f"sensitivities: the state in {folder} cannot be read ({error}); start again in "
            "another directory"
        ) from None
    return saved
