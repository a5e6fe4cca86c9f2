"""A scene in motion that a partner steps: trials, inputs and outputs by name."""

import math
from collections import UserDict
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from numbers import Real
from typing import Any

from mpi4py import MPI

import numpy as np

from shellmb.errors import SceneError
from shellmb.observers.account.energy import present, work_forms
from shellmb.observers.deferred import DeferredObserver
from shellmb.observers.fields.nodal import NodalValues, nodal_bodies, nodal_values
from shellmb.observers.history import check_columns
from shellmb.running.standard import StandardObservers
from shellmb.scene import Scene
from shellmb.scene.control.signals import Input, inputs_of, named_inputs
from shellmb.scene.values.validate import listed, show
from shellmb.simulate.simulation import BaseObserver, Observer, Simulation
from shellmb.simulate.stepping import Arrays, StepInfo
from shellmb.simulate.stepsize import Count, near
from shellmb.system.assembly.functionals import functionals
from shellmb.system.direct.solver import Factors

# arrays, and what JSON knows
type State = tuple[Arrays, dict[str, Any]]

# observers whose memory grows, or that say what a run is like as a whole
OF_RUNS = ("history", "stop")


class Inputs(UserDict[str, float]):
    """Values that the inputs of a scene have at the end of the next step, by name.

    Args:
        known: The inputs by name.
    """

    def __init__(self, known: Mapping[str, list[Input]]) -> None:
        self.data = {name: some[0].line[3] for name, some in known.items()}

    def __missing__(self, name: str) -> float:
        raise SceneError(f"there is no input '{name}'; the scene has {listed(self.data) or 'none'}")

    def __setitem__(self, name: str, value: float) -> None:
        self[name]
        number = isinstance(value, int | float | np.floating | np.integer)
        if isinstance(value, bool) or not number or not math.isfinite(value):
            raise SceneError(f"input '{name}': it is {show(value)}; it must be a finite number")
        self.data[name] = float(value)


@contextmanager
def _begun(scene: Scene, start: Mapping[str, float]) -> Iterator[None]:
    """Let the inputs of a scene have values at all times, while a simulation copies it.

    Raises:
        SceneError: If a value is none, or moves what stands in the scene.
    """
    known = named_inputs(scene)
    values = Inputs(known)
    values.update(start)
    for one in inputs_of((scene.supports, scene.drivers)):
        if values[one.name] != one.default:
            raise SceneError(
                f"input '{one.name}': it starts with {show(values[one.name])}, and moves a support "
                f"or driver, which would jump; it must start with {show(one.default)}"
            )
    every = [(one, one.line) for some in known.values() for one in some]
    try:
        for one, _ in every:
            one.take(0.0, 0.0, values[one.name], values[one.name])
        yield
    finally:
        for one, line in every:
            one.take(*line)


class Outputs(dict[str, float]):
    """Numbers of a motion at its present state, by name."""

    def __missing__(self, name: str) -> float:
        raise SceneError(f"there is no output '{name}'; the motion has {listed(self)}")


class SceneMotion:
    """A scene that a partner steps, and may take back.

    Example::

        motion = sm.SceneMotion(scene)
        motion.inputs["push"] = 3.0
        motion.trial(0.01)
        motion.outputs["tip"]
        motion.accept()                       # or motion.reject(), and another trial

    A trial that is longer than the scene's `dt` takes several steps. Scenes follow inputs in motion
    only, so that the scheme must be dynamic.

    Args:
        scene: The scene; a partner may set each `sm.Input` in it.
        comm: Communicator; None: all ranks, which call everything together.
        start: Values that inputs have from the start on, by name, in place of their defaults.

    Attributes:
        inputs: Values of the inputs at the end of the next trial; they stay until they are set.
        simulation: The simulation.

    Raises:
        SceneError: If the scene is impossible, static, or has laws that cannot be taken back.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        comm: MPI.Comm | None = None,
        start: Mapping[str, float] | None = None,
    ) -> None:
        if not isinstance(scene, Scene):
            raise SceneError(f"SceneMotion: scene is {show(scene)}; it must be a Scene")
        if scene.static:
            raise SceneError(
                f"scene '{scene.name}': scheme is {show(scene.scheme_name)}, which has no time; a "
                "motion needs a dynamic one, as 'ep4'"
            )
        with _begun(scene, start or {}):
            self.simulation = Simulation(scene, MPI.COMM_WORLD if comm is None else comm)
        if not self.simulation.repeatable:
            raise SceneError(
                f"scene '{scene.name}': one of its functions may keep a memory of its own (an "
                "object, a default argument), which no rejected step could take back; a controller "
                "must keep it in its state, and a function of time must have none"
            )
        own = self.simulation.scene
        known = named_inputs(own)
        self.inputs = Inputs(known)
        self._of = [own.name, own.scheme_name]
        self._last = dict(self.inputs)
        self.t_end = own.t_end
        self._places = [one for some in known.values() for one in some]
        # equal steps are counted, so that round-off does not add up
        self._count = Count()
        self._saved: Any = None
        self._tried = False
        # columns of a state that was taken up again: some observers know those of the last step
        self._columns: Outputs | None = None
        named = StandardObservers(None, watched=False).named
        self._begin([*(o for k, o in named.items() if k not in OF_RUNS), PartnerWork(self._places)])

    def _begin(self, observers: Sequence[Observer]) -> None:
        """Start what is measured from the present state on."""
        self._observers = observers
        for observer in observers:
            observer.start(self.simulation)
        check_columns(self._observers)
        # what controllers read at the start is saved with the first state
        self.simulation.control.attach(self.simulation, self._observers)

    @property
    def time(self) -> float:
        """The time, s."""
        return self.simulation.t

    @property
    def ended(self) -> str | None:
        """Name of the event that has ended the motion; None: it goes on."""
        return self.simulation.control.ended

    @property
    def outputs(self) -> Outputs:
        """Columns of the history now, with `t`, and the `work_inputs` since the start, J."""
        if self._columns is not None:
            return Outputs(self._columns)
        found = Outputs(t=self.time)
        for observer in self._observers:
            found |= {name: float(value) for name, value in observer.measure().items()}
        return found

    def nodes(self, body: str) -> NodalValues:
        """Positions, displacements, directors and velocities at the nodes of a body on this rank.

        Args:
            body: Name of a shell or a beam.

        Raises:
            SceneError: If there is none.
        """
        known = list(nodal_bodies(self.simulation.model))
        if body not in known:
            raise SceneError(
                f"nodes: there is no body '{body}' with nodes; there are {listed(known)}"
            )
        return nodal_values(self.simulation, body)

    def trial(self, dt: float) -> None:
        """Compute a step, which is not accepted yet; a further trial replaces it.

        Args:
            dt: Its length, s.

        Raises:
            ConvergenceError: If it has no solution; the motion is where it was before.
            SceneError: If the length is impossible.
        """
        if isinstance(dt, bool) or not isinstance(dt, Real) or not 0 < dt < 1e300:
            raise SceneError(f"trial: dt is {show(dt)}; it must be finite and greater than 0")
        if self._saved is None:
            self._saved = self.state()
        self._tried = False
        self._restore(self._saved)
        try:
            self._advance(float(dt))
        except BaseException:
            self._restore(self._saved)
            raise
        self._tried = True

    def accept(self) -> None:
        """Make the end of the trial the state from which the motion continues.

        Raises:
            SceneError: If there is no trial.
        """
        self._need_trial("accept")
        self._saved, self._tried = None, False

    def reject(self) -> None:
        """Go back to the start of the trial, bit for bit.

        Raises:
            SceneError: If there is no trial.
        """
        self._need_trial("reject")
        self._restore(self._saved)
        self._tried = False

    def _need_trial(self, what: str) -> None:
        if not self._tried:
            raise SceneError(f"{what}: there is no trial; call trial(dt) first, which must succeed")

    def state(self) -> State:
        """Copy of all that steps change now, for `take_up`."""
        simulation, observers = self.simulation, self._observers
        factors = simulation.problem.iteration.factors
        arrays, counters = simulation.saved()
        return arrays, {
            "of": self._of,
            "outputs": self.outputs,
            "simulation": counters,
            "count": self._count.state(),
            "observers": [o.state() for o in observers],
            "marks": [o.mark if isinstance(o, DeferredObserver) else None for o in observers],
            "last": None if simulation.last is None else simulation.last._asdict(),
            "inputs": dict(self._last),
            "lines": [one.line for one in self._places],
            "factors": None if factors is None else factors.value,
        }

    def take_up(self, state: State) -> None:
        """Be at a state again, as often as wanted, bit for bit.

        Args:
            state: As from `state` of this motion, or of another one of the same scene.

        Raises:
            SceneError: If it is none of such a motion.
        """
        known = isinstance(state, tuple | list) and len(state) == 2 and isinstance(state[1], dict)
        if not known or state[1].get("of") != self._of:
            raise SceneError(f"take_up: state is none of {self._of}; it must come from its state()")
        self._restore(state)
        self._saved, self._tried = None, False

    def _restore(self, saved: State) -> None:
        arrays, rest = saved
        simulation, last, factors = self.simulation, rest["last"], rest["factors"]
        simulation.restore(arrays, rest["simulation"])
        every = zip(self._observers, rest["observers"], rest["marks"], strict=True)
        for observer, state, mark in every:
            if isinstance(observer, DeferredObserver):
                observer.mark = mark
            observer.restore(state)
        simulation.last = None if last is None else StepInfo(**last)
        self._count.restore(rest["count"])
        self._columns, self._last = Outputs(rest["outputs"]), dict(rest["inputs"])
        for one, line in zip(self._places, rest["lines"], strict=True):
            one.take(*line)
        simulation.model.mechanism.command(simulation.model.signals)
        simulation.problem.iteration.forget(None if factors is None else Factors(factors))

    def _advance(self, dt: float) -> None:
        simulation = self.simulation
        t, end = simulation.t, self._count.after(simulation.t, dt)
        if self.ended is not None:
            raise SceneError(f"trial: event '{self.ended}' has ended the motion at t = {t:g}")
        if end > self.t_end + near(self.t_end, simulation.scene.dt):
            raise SceneError(
                f"trial: a step of {dt:g} s from t = {t:g} ends after t_end of the scene, which is "
                f"{self.t_end:g}; it must be at most {max(self.t_end - t, 0):g}, or t_end be later"
            )
        if any(not one.linear and one.line[3] != self.inputs[one.name] for one in self._places):
            # forces jump: errors of steps are not to be foreseen from those before
            simulation.stepping.forget(velocities=False)
        for one in self._places:
            last = self.inputs[one.name]
            one.take(t, dt, self._last[one.name] if one.linear else last, last)
        self._last = dict(self.inputs)
        simulation.model.mechanism.command(simulation.model.signals)
        simulation.t_end = end
        self._columns = None
        while not simulation.over and not simulation.finished:
            simulation.advance(self._observers)


# what inputs are set to for a moment, at both ends of a step
NOTHING, SOMETHING = (0.0, 0.0), (1.0, 2.0)


class PartnerWork(BaseObserver):
    """Sums the work that inputs do through loads, motors, supports and drivers.

    It is that of the same step without them taken from the work that is done: loads and motors are
    linear in their inputs. Supports and drivers that have inputs work by their reactions.

    Args:
        inputs: All inputs of the scene.

    Attributes:
        work: It, J; part of the work of loads, terms and supports in the energy balance.
    """

    remembered = ("work",)

    def __init__(self, inputs: Sequence[Input]) -> None:
        self._inputs, self.work = list(inputs), 0.0

    def start(self, simulation: Simulation) -> None:
        """Find what inputs act on."""
        problem, scene = simulation.problem, simulation.scene
        stores = simulation.model.stores
        bodies = [body for body in simulation.model.bodies if body not in stores]
        parts = {"loads": scene.loads, "terms": scene.force_elements}
        kinds = [kind for kind, items in parts.items() if any(True for _ in inputs_of(items))]
        forms = [form for kind in kinds for form in present(work_forms(simulation, kind, bodies))]
        comm = simulation.model.comm
        self._forces = functionals([forms], comm) if forms else None
        given, lines = [], [one.line for one in self._inputs]
        for values in (NOTHING, SOMETHING):
            self._take(simulation, [(0.0, simulation.size.dt, *values)] * len(lines))
            problem.prepare(0.0, simulation.size.dt)
            problem.system.update_fixed_values()
            given.append(problem.system.fixed_values().copy())
        self._moved = given[0] != given[1]
        self._drives = comm.allreduce(bool(np.any(self._moved)), op=MPI.LOR)
        self._take(simulation, lines)

    def _take(
        self, simulation: Simulation, lines: Sequence[tuple[float, float, float, float]]
    ) -> None:
        for one, line in zip(self._inputs, lines, strict=True):
            one.take(*line)
        simulation.model.mechanism.command(simulation.model.signals)

    def _sample(self, simulation: Simulation, t: float, dt: float) -> None:
        problem = simulation.problem
        for stages in problem.forms.values():
            for forms in stages.values():
                for sample in forms.samples:
                    sample.update(t, dt, problem.start_factor)

    def _work(self, simulation: Simulation, t: float, dt: float) -> float:
        self._sample(simulation, t, dt)
        assert self._forces is not None
        return float(self._forces()[0])

    def solved(self, simulation: Simulation) -> None:
        """Add the work of a step."""
        last = simulation.solved
        if self._drives:
            self.work += simulation.problem.support_work(self._moved)
        if self._forces is None:
            return
        every = self._work(simulation, last.t, last.dt)
        lines = [one.line for one in self._inputs]
        self._take(simulation, [(last.t, last.dt, *NOTHING)] * len(lines))
        others = self._work(simulation, last.t, last.dt)
        self._take(simulation, lines)
        self._sample(simulation, last.t, last.dt)
        self.work += every - others

    def measure(self) -> dict[str, float]:
        """Columns of the outputs."""
        return {"work_inputs": self.work}
