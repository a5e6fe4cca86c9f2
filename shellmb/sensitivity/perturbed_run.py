"""A shadow: a scene beside the one that runs, taken through the same steps by first derivatives.

With it goes what observes it. This is the only module of the folder that touches the steps of a
simulation.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import SceneError, of_first, unsaid
from shellmb.observers.files.checkpoint import Checkpoint, Saved
from shellmb.observers.files.described import describe
from shellmb.observers.history import points_and_events
from shellmb.observers.summary import summarise
from shellmb.running.execute import RunResult, take_up
from shellmb.running.results import measured, write_summary
from shellmb.running.saved import read_saved
from shellmb.running.standard import STATE, StandardObservers
from shellmb.scene import Scene
from shellmb.scene.fingerprint import differences, fingerprint
from shellmb.simulate.simulation import Observer, Simulation, busy
from shellmb.simulate.stepping import StepInfo
from shellmb.system.nullspace.directors import any_pseudo_inverse, constraint, pseudo_inverse

# observers that say how to go on with a run
OF_THE_RUN = ("checkpoint", "stop")


class PerturbedRun:
    """A simulation of a scene with another value of one parameter, which solves nothing.

    Its states are those of the run moved along their derivative. So are its unknowns, which the
    caller finds from its residuals.

    Args:
        simulation: The simulation, at its start.
        observers: What looks at it.
        forces: Whether they look at forces, too.

    Attributes:
        saved: What writes its state with that of the run; None: nothing does.
        since: By how much later than that of the run its present step begins, s: events move.
        until: By how much later it ends, s.
    """

    saved: Checkpoint | None = None

    def __init__(
        self, simulation: Simulation, observers: Sequence[Observer], forces: bool = True
    ) -> None:
        self.simulation, self.observers, self.forces = simulation, list(observers), forces
        self.problem, self.system = simulation.problem, simulation.problem.system
        self.iteration = self.problem.iteration
        self.since = self.until = 0.0
        self._length = 0.0
        sets = self.iteration.nodes.sets
        self._others = {k: s for k, s in sets.items() if s.partial or s.declared.linear}
        self._any_others = bool(self.system.comm.allreduce(len(self._others)))
        # views: those that PETSc's vectors give are made anew at each call
        self._x, self._b = self.system.x.array, self.system.b.array

    def start(self) -> None:
        """Start the observers."""
        for observer in self.observers:
            observer.start(self.simulation)
        # as in a run, those that have nothing to do are not called in steps
        self.observers = busy(self.observers)
        if self.saved is not None:
            self.saved.start(self.simulation)

    def begin(self, t: float, dt: float) -> None:
        """Set all that acts in a step; unknowns come later; collective.

        Args:
            t: Time at its start, s.
            dt: Its length, s.
        """
        self.simulation.begin_step(self.observers)
        self.prepare(t, dt)

    def prepare(self, t: float, dt: float, until: float = 0.0) -> None:
        """Set the time of a step that has begun, or another end of it; collective.

        Args:
            t: Time at the start of the step of the run, s.
            dt: Its length, s.
            until: By how much later than that of the run the step of this scene ends, s.
        """
        self.until, self._length = until, dt + until - self.since
        self.problem.prepare(t + self.since, self._length)
        if self.simulation.path is not None:
            # along paths sides are looked at there
            self.problem.start_from_state()
            self.iteration.begin(None, True)
            return
        self.iteration.nodes.begin()
        self.system.update_fixed_values()
        self.system.residuals.refresh()

    def take_pairs(self, run: Simulation) -> None:
        """Points touch where those of the run may, which has found all of them in its step."""
        for mine, other in zip(self.problem.couplings, run.problem.couplings, strict=True):
            mine.candidates = other.candidates

    def project(self, unknowns: Floats) -> Floats:
        """Unknowns near given ones with fixed values, and directors that keep their constraints.

        Args:
            unknowns: One number for each unknown that this rank owns.

        Returns:
            The same array at each call.
        """
        system, x = self.system, self.system.x
        self._x[:] = unknowns
        self.iteration.nodes.normalise(x)
        self._x[system.fixed] = system.fixed_values()
        if self._any_others:
            self._project_others(x)
        return self._x

    def _project_others(self, x: PETSc.Vec) -> None:
        """Nodes of which some components are fixed, and those that change little."""
        nodes, seen = self.iteration.nodes, self.iteration.nodes.full
        self.system.scatter(x)
        ids, changes = [np.zeros(0, np.int64)], [np.zeros(0)]
        for k, s in self._others.items():
            s.settled = False
            found = s.correction(self.system.fields)
            change = np.zeros(s.dofs.shape) if found is None else found * ~s.regular[:, None]
            if s.declared.linear and s.state is None:
                C, w = constraint(s.at(self.system.fields)), s.values[s.dofs]
                change[s.regular] = -np.einsum("nic,ncj,nj->ni", pseudo_inverse(C), C, w)[s.regular]
                for node, free, _ in s.partial:
                    change[node, free] = -any_pseudo_inverse(C[node][:, free]) @ (C[node] @ w[node])
            ids.append(nodes.rows[k].ravel())
            changes.append(change.ravel())
        x.array[:] += seen.set(np.concatenate(ids), np.concatenate(changes))

    def residual(self, unknowns: Floats) -> Floats:
        """Residual of the step at given unknowns, the same array at each call; collective."""
        self._x[:] = unknowns
        self.system.evaluate(self.system.x, self.system.b)
        return self._b

    def hold(self, unknowns: Floats) -> None:
        """Give the fields their unknowns."""
        self._x[:] = unknowns
        self.system.scatter(self.system.x)

    def ahead(self) -> Floats:
        """State at the end of the step whose solution the fields hold, which is not taken."""
        start = self._state()
        self.problem.advance(self._length)
        found = self._state()
        self._take(start)
        return found

    def _state(self) -> Floats:
        """State of all bodies, one array behind the other."""
        return np.concatenate(list(self.simulation.live().values()))

    def _take(self, state: Floats) -> None:
        """Be at a state."""
        arrays = list(self.simulation.live().values())
        ends = np.cumsum([len(array) for array in arrays])[:-1]
        for array, values in zip(arrays, np.split(state, ends), strict=True):
            array[:] = values

    def solved(self, step: StepInfo, end: Floats | None = None) -> None:
        """The unknowns that the fields hold are the solution of a step of the run.

        Args:
            step: The step.
            end: State at its end; None: that which follows from its solution.
        """
        moved = self.since != 0.0 or self.until != 0.0
        self.simulation.last = (
            step._replace(t=step.t + self.since, dt=self._length) if moved else step
        )
        for observer in self.observers:
            observer.solved(self.simulation)
        if end is None:
            self.problem.advance(self._length)
        else:
            self._take(end)

    def margins(self) -> Floats:
        """Margins of all events at the end of the step that the fields hold; collective."""
        own = self.simulation
        return own.control.margins(own.t, StepInfo(own.t, self._length, 0))

    def accepted(self, run: Simulation) -> None:
        """Go with the run, whose step is accepted."""
        own = self.simulation
        own.step, own.iterations = run.step, run.iterations
        # an event may have ended the run
        own.t, own.t_end = run.t + self.until, run.t_end + self.until
        self.since = self.until
        own.problem.arrive(own.t)
        own.control.crossed = list(run.control.crossed)
        own.control.accept(self._length, own.t)
        for observer in self.observers:
            observer.accepted(own)

    def finish(self, run: Simulation, error: BaseException | None) -> None:
        """End as the run ends."""
        own = self.simulation
        own.step_seconds = run.step_seconds
        for observer in reversed(self.observers):
            observer.finish(own, error)


def check_alike(run: Simulation, shadow: Simulation, who: str) -> None:
    """Refuse a scene whose unknowns do not correspond to those of the run; collective.

    Args:
        run: The run.
        shadow: The other scene.
        who: What the parameter is called.

    Raises:
        SceneError: If meshes, supports, joints or constraints that are left out are others.
    """
    ours, its = run.problem.system, shadow.problem.system
    a, b = ours.numbering, its.numbering
    cells = [
        [np.asarray(f.function.function_space.dofmap.list) for f in system.fields]
        for system in (ours, its)
    ]
    alike = (
        np.array_equal(a.local_to_global, b.local_to_global)
        and np.array_equal(a.offsets, b.offsets)
        and all(np.array_equal(p, q) for p, q in zip(*cells, strict=True))
    )
    # which ones, not their coefficients: these move with lengths
    left = [{item.row.multiplier for item in sim.redundant} for sim in (run, shadow)]
    times = [sorted(sim.landing.times) for sim in (run, shadow)]
    same = {
        "changes the mesh: its nodes or cells differ next to the value; only positions of nodes "
        "may depend on the parameter": alike,
        "changes which nodes are fixed; supports must stay at the same nodes": (
            np.array_equal(ours.fixed, its.fixed)
        ),
        "changes which constraints are redundant; begin at a position at which it does not": (
            left[0] == left[1]
        ),
        "moves a time at which a step ends, of a load, a lock or a window; such times must not "
        "depend on it": times[0] == times[1],
    }
    for said, holds in same.items():
        if not run.model.comm.allreduce(holds, op=MPI.LAND):
            raise SceneError(f"sensitivities: parameter '{who}' {said}")


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
        of_first(comm, lambda: folder.mkdir(parents=True, exist_ok=True))
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
