"""The loop over the steps. It knows steps and observers, no physics."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack
from typing import Any

from mpi4py import MPI

from shellmb.arrays import Ints
from shellmb.clock import now
from shellmb.errors import ConvergenceError, petsc_in_words
from shellmb.forms.steps.discrete import taken_once
from shellmb.meshes.lifetime import uncollected
from shellmb.meshes.shared import Meshes
from shellmb.model.model import Model
from shellmb.model.rank_consistency import same_on_all
from shellmb.native.assembler import assembled_as
from shellmb.preprocessing.bodyfields import relative_size
from shellmb.preprocessing.checked_model import checked_model
from shellmb.preprocessing.constraint_analysis.redundancy import singular
from shellmb.restart import Restartable, arrays_of, below, with_arrays, without_arrays
from shellmb.scene import Scene
from shellmb.scene.checks.ignored_settings import check_begin
from shellmb.schemes.base import Scheme, StateArrays, levels_arrays, live_arrays
from shellmb.schemes.registry import make_scheme
from shellmb.simulate.control.control import Control
from shellmb.simulate.paths.arclength import ArcSize, PathSteps
from shellmb.simulate.problem import Problem
from shellmb.simulate.scene_copy import SceneCopy
from shellmb.simulate.start.start import Start
from shellmb.simulate.start.stored import numbering, spread
from shellmb.simulate.stepping import Arrays, DroppedConstraints, StepInfo, TimeSteps
from shellmb.simulate.stepsize import Count, ErrorSize, Landing, LoadSize, StepSize, near
from shellmb.stopping import failing_together

# what names of saved arrays of steps before the last one begin with
PAST = "past/"


class BaseObserver(Restartable):
    """Reads the state of a simulation and changes nothing: the base class of observers.

    It does nothing. `solved` is called when a step is solved but not yet accepted, so that both
    ends of the step are available; `accepted` is called afterwards. `state` and `restore` save and
    restore an observer when a run is stopped and resumed: the attributes that it names in
    `remembered`, as JSON, which later steps must not change.

    Attributes:
        idle: Whether it has nothing to do in this run and need not be called in its steps; read
            once, after `start`.
    """

    idle = False

    def start(self, simulation: Simulation) -> None:
        """Before the first step (of the run, or of its continuation)."""

    def switched(self, simulation: Simulation) -> None:
        """Before a step at whose start a joint or lock began to act and velocities jumped."""

    def solved(self, simulation: Simulation) -> None:
        """A step is solved: `levels.q` is its start, `levels.unknown` its end."""

    def accepted(self, simulation: Simulation) -> None:
        """A step is accepted: `levels.q` and `levels.rates` are the new state."""

    def finish(self, simulation: Simulation, error: BaseException | None) -> None:
        """After the last step, or after the failure `error`."""

    def measure(self) -> dict[str, float]:
        """Columns of the history now, known and equal on all ranks; the same names at all times."""
        return {}


Observer = BaseObserver


def busy[T: Observer](observers: Iterable[T]) -> list[T]:
    """Observers that have something to do in the steps of a run, for which they have started."""
    return [observer for observer in observers if not getattr(observer, "idle", False)]


def _acting(observers: Sequence[Observer], method: str) -> list[Observer]:
    """Observers with a method of their own: between two solutions each call takes its time."""
    nothing = getattr(BaseObserver, method)
    every = [(o, getattr(o, method)) for o in busy(observers)]
    return [o for o, own in every if getattr(own, "__func__", own) is not nothing]


class Simulation(Restartable):
    """A scene in motion.

    Args:
        scene: The scene.
        comm: Communicator.
        like: Simulation of a scene nearby whose units of multipliers and coordinates this one
            takes, its bases of modes, and its meshes where cells are equal.

    Raises:
        SceneError: If it cannot be built, or cannot begin as it is described.

    Attributes:
        meshes: Meshes of the bodies.
        model: Bodies.
        redundant: Constraints that are left out because others imply them.
        scheme: Time scheme.
        problem: Functions and the system of one step.
        stepping: How it gets from state to state.
        path: The same where it follows a static path, else None.
        control: Controllers and events.
        t: Current time, s.
        step: Number of accepted steps.
        iterations: Newton iterations of accepted steps.
        last: The step just solved.
        doubts: Warnings given while it was made.
        setup_seconds: Time to build everything but the forms, s.
        step_seconds: Time spent in steps so far, observers included, s.
    """

    remembered = ("t", "_count", "step", "iterations", "step_seconds", "size")

    @uncollected()
    @taken_once()
    @petsc_in_words()
    @assembled_as(lambda self, scene, *_, **__: scene.solver)
    def __init__(
        self, scene: Scene, comm: MPI.Comm = MPI.COMM_WORLD, like: Simulation | None = None
    ) -> None:
        begin = now()
        same_on_all(scene, comm)
        check_begin(scene)
        self._own = SceneCopy(scene)
        self.scene = scene = self._own.scene
        self.scheme: Scheme = make_scheme(scene.scheme, scene.dissipation)
        self.t, self.t_end = 0.0, float(scene.t_end)
        self._count, self.step, self.iterations = Count(), 0, 0
        self.size = self._size()
        self.last: StepInfo | None = None
        self.doubts: tuple[str, ...] = ()
        self.model: Model
        near = () if like is None else (like.model.force, like.model.length, like.model.modal)
        self.meshes = Meshes()
        with self.meshes.used(None if like is None else like.meshes):
            self.model, self.redundant = checked_model(scene, comm, *near)
        self.problem = Problem(self.model, self.scheme)
        self._start = start = Start(self.problem, self.size.dt, scene)
        start.positions()
        start.velocities()
        start.accelerations()
        self.problem.begin()
        self.problem.prepare(0.0, self.size.dt)
        self.problem.warm_up(self.size.dt)
        self.problem.arrive(0.0)
        self.path: PathSteps | None = None
        if scene.path is not None:
            assert isinstance(self.size, ArcSize)
            self.path = PathSteps(self.problem, scene.path, self.size)
        self.stepping: TimeSteps | PathSteps = self.path or TimeSteps(self.problem)
        self.dropped = DroppedConstraints(self.problem)
        self.landing = Landing(scene, self.model.mechanism.switches.events)
        self.control = Control(scene, self.model.signals)
        self.control.go_on(self.problem.controlled)
        self._find_acting(())
        self.setup_seconds = now() - begin - self.problem.system.jit_seconds
        self.step_seconds = 0.0

    @property
    def solved(self) -> StepInfo:
        """The last step that was solved; there has been one."""
        assert self.last is not None
        return self.last

    def _size(self) -> StepSize:
        """Make what chooses the step."""
        control, dt = self.scene.step_control, self.scene.dt
        if self.scene.path is not None:
            return ArcSize(control, dt)
        if control.step_error is None:
            return StepSize(control, dt) if self.scheme.dynamic else LoadSize(control, dt)
        law = self.scheme.local_error
        noise = law.per_radian(self.scene.solver.tolerance ** (1 / law.degree))
        return ErrorSize(control, dt, self.t_end, law.order, noise, law.factor)

    @petsc_in_words()
    @assembled_as(lambda self, *_, **__: self.scene.solver)
    def run(self, observers: Sequence[Observer] = ()) -> None:
        """Step to the end.

        Args:
            observers: Called in their order.

        Raises:
            ConvergenceError: If a step fails at the smallest step size; names time, step, field.
        """
        error: BaseException | None = None
        with uncollected(), taken_once():
            for observer in observers:
                observer.start(self)
        self._find_acting(observers)
        begin = now()
        before = self.step_seconds
        try:
            # before observers finish, which have to be the same on all ranks
            with failing_together(self.model.comm):
                while not self.over and not self.finished:
                    self.advance(observers)
                    self.step_seconds = before + now() - begin
        except BaseException as failure:
            error = failure
            raise
        finally:
            # each of them, though one may fail: others have something to write
            with ExitStack() as last:
                last.callback(self._own.finish)
                for observer in reversed(observers):
                    last.callback(observer.finish, self, error)

    @property
    def over(self) -> bool:
        """Decide whether the last time is reached."""
        return self.t_end - self.t <= near(self.t_end, self.size.dt)

    @property
    def finished(self) -> bool:
        """Decide whether the end is reached before the last time."""
        return self.stepping.finished or self.control.ended is not None

    @assembled_as(lambda self, *_, **__: self.scene.solver)
    def advance(self, observers: Sequence[Observer] = ()) -> None:
        """One accepted step, after as many rejected ones as it takes.

        Raises:
            ConvergenceError: If the step fails at the smallest step size.
            ControlError: If a controller or an event fails.
        """
        self.begin_step(observers)
        if self.landing.corner(self.t):
            self.stepping.forget(velocities=False)
        while True:
            dt, end = self.landing.step(self.t, self.t_end, self.control.next, self.size)
            try:
                attempt = self.stepping.attempt(self.t, dt)._replace(jump=self._jump())
                wrong = self.size.too_large(attempt.measured, attempt.dt)
                if wrong and self.size.reject(attempt.dt, attempt.measured):
                    continue
                located = self.control.locate(self, attempt, end is not None and attempt.dt == dt)
                if located is not attempt:
                    attempt = located._replace(jump=self._jump())
            except ConvergenceError as error:
                if self.size.reject(dt) or (self.scheme.dynamic and self.size.lengthen()):
                    continue
                where = f"t = {self.t:g}, step {self.step + 1}, {self.size.failed(dt)}"
                raise error.reworded(f"{where}: {self._why(error)}") from error
            if attempt.dt != dt:
                dt, end = attempt.dt, None
            break
        self.dropped.check(self.t)
        self.last = attempt
        if self._given[0] is not observers or self._given[1] != len(observers):
            self._find_acting(observers)
        for observer in self._solved:
            observer.solved(self)
        self.stepping.accept(dt)
        self.t = self._count.after(self.t, dt) if end is None else end
        self.problem.arrive(self.t)
        self.control.accept(dt, self.t)
        if self.finished:
            self.t_end = self.t
        self.step += 1
        self.iterations += attempt.iterations
        self.size.accept(attempt.measured, dt)
        for observer in self._accepted:
            observer.accepted(self)

    def _find_acting(self, observers: Sequence[Observer]) -> None:
        """Find the observers that have something to do in steps, of those that have started."""
        self._given = observers, len(observers)
        self._solved, self._accepted = (_acting(observers, k) for k in ("solved", "accepted"))

    def begin_step(self, observers: Sequence[Observer] = ()) -> None:
        """Ask controllers, and switch what begins or ends to act at the current time.

        Args:
            observers: Those that controllers may read.

        Raises:
            ControlError: If a controller or an event fails.
        """
        self.control.begin(self, observers)
        if self.model.mechanism.switches.update(self.t, self.problem.state) and self.scheme.dynamic:
            self.problem.projection.project()
            # as long as the impulses are there, of which accelerations leave nothing
            for observer in observers:
                observer.switched(self)
            self._start.accelerations(self.t)
            # velocities have jumped: what went before tells nothing
            self.stepping.forget(velocities=True)
        self.model.mechanism.refresh(self.problem.levels)

    def _why(self, error: ConvergenceError) -> str:
        """Say why no step succeeds from the current state; collective."""
        states = {name: levels.q.x.array for name, levels in self.problem.levels.items()}
        found = "" if self.scheme.linear else singular(self.model, states)
        if not found:
            return str(error)
        # shorter steps, which it would advise, lead nowhere from there
        failed = str(error).partition("; try ")[0]
        return (
            f"{found}: the mechanism is at a singular position (like a four-bar with all bars in "
            "line), where its motion is not unique; choose dt or the start so that no step ends "
            f"there ({failed})"
        )

    def _jump(self) -> float | None:
        """Largest jump of a kinematic part between the start of the step and the jump stage."""
        stage = self.scheme.dissipation()[1]
        if stage is None:
            return None
        largest = 0.0
        for body in self.model.bodies:
            levels = self.problem.levels[body.name]
            jump = levels.unknown[stage].x.array - levels.q.x.array
            largest = max(largest, relative_size(body, jump))
        return float(self.model.comm.allreduce(largest, op=MPI.MAX))

    def arrays(self) -> Arrays:
        """State of all bodies on this rank, by name: what a restart needs."""
        return self.saved()[0]

    def saved(self) -> tuple[Arrays, dict[str, Any]]:
        """Both `arrays` and `state`, for which the whole state is taken once."""
        past, counters = separated(self.whole_state())
        return {name: array.copy() for name, array in self.live().items()} | past, counters

    def _kept(self) -> Iterator[StateArrays]:
        """Arrays of each space that a state consists of, with the space and a name."""
        yield from levels_arrays(self.problem.levels)
        for branches in self.problem.branches.values():
            yield from (own.kept() for own in branches)

    def live(self) -> Arrays:
        """The first part of it, the bodies' own arrays, which the next step changes."""
        return live_arrays(self._kept())

    def numbering(self) -> dict[str, Ints]:
        """Numbering of the values of `live` in the meshes, on any number of ranks."""
        return {
            f"{name}/{key}": array
            for name, _, space in self._kept()
            for key, array in numbering(space).items()
        }

    def spread(self, ranks: Sequence[tuple[Arrays, dict[str, Ints]]]) -> Arrays:
        """State of all bodies on this rank, from what another number of ranks has saved.

        Args:
            ranks: Of each of them what `live` and `numbering` gave.
        """
        found = {}
        for name, mine, space in self._kept():
            own = f"{name}/"
            for key in (own + key for key in mine):
                if any(key not in arrays for arrays, _ in ranks):
                    continue
                parts = [(below(there, own), a[key]) for a, there in ranks]
                values = spread(parts, space)
                if values is not None:
                    found[key] = values
        return found

    def restore(self, arrays: Arrays, state: dict[str, Any]) -> None:  # type: ignore[override]
        """Take up a saved state.

        Args:
            arrays: As from `arrays`, on the same number of ranks.
            state: As from `state`; what it does not know of earlier steps is found again.
        """
        super().restore(state)
        for name, array in self.live().items():
            array[:] = arrays[name]
        self.problem.arrive(self.t)
        self.model.mechanism.switches.restore(state["switches"])
        past = with_arrays(state["past"], below(arrays, PAST))
        self.stepping.restore(past.get("steps"))
        for k, saved in past.get("couplings", {}).items():
            self.problem.couplings[int(k)].restore(saved)
        self.control.restore(state["control"])
        if self.control.ended is not None:
            self.t_end = self.t

    @property
    def repeatable(self) -> bool:
        """Decide whether steps can be taken again: no law of the scene remembers the first time."""
        return not self._own.remembers

    def state(self) -> dict[str, Any]:
        """Counters and step size, for a restart."""
        return separated(self.whole_state())[1]

    def whole_state(self) -> dict[str, Any]:
        """Both `state` and the arrays of earlier steps, which nothing changes."""
        couplings = {str(k): each.state() for k, each in enumerate(self.problem.couplings)}
        return super().state() | {
            "switches": self.model.mechanism.switches.state(),
            "past": {"steps": self.stepping.state(), "couplings": couplings},
            "control": self.control.state(),
        }


def separated(state: dict[str, Any]) -> tuple[Arrays, dict[str, Any]]:
    """Arrays of earlier steps by name, and what JSON knows.

    Args:
        state: As from `Simulation.whole_state`.
    """
    past = state["past"]
    return arrays_of(past, PAST), state | {"past": without_arrays(past)}
