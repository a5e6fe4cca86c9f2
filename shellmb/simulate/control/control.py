"""Controllers and events of a run: sampled before each step, watched behind it."""

import copy
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import astuple
from typing import Any

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.model.signals import Signals, Way
from shellmb.restart import Restartable
from shellmb.scene import Scene
from shellmb.scene.checks.signals import coordinate_read
from shellmb.scene.control.sensors import Sensor
from shellmb.simulate.control.items import Sampler, Watch, comes_soon, first_crossing, turning_point
from shellmb.simulate.stepping import StepInfo
from shellmb.simulate.stepsize import LEAST

# a simulation (`shellmb.simulate.simulation.Simulation`), which has these controls itself
type Running = Any


def measuring(observers: Iterable[Any]) -> list[Any]:
    """Observers that may have columns: those that derive from nothing may leave `measure` out."""
    return [observer for observer in observers if hasattr(observer, "measure")]


class Readings:
    """Reads columns of the run's observers.

    Args:
        simulation: The simulation.
        observers: Its observers, which have begun.
        sensors: What is read.

    Raises:
        SceneError: If no observer has such a column.
    """

    def __init__(
        self, simulation: Running, observers: Sequence[Any], sensors: Sequence[Sensor]
    ) -> None:
        self._simulation, self._sensors = simulation, list(sensors)
        self._columns: dict[str, Any] = {}
        rates = {s: coordinate_read(simulation.scene, s.column) for s in sensors if s.derivative}
        # coordinates whose rates are part of the motion
        self._rates = {s.name: key for s, key in rates.items() if key is not None}
        for sensor in sensors:
            if sensor.name in self._rates:
                continue
            owner = next((o for o in measuring(observers) if sensor.column in o.measure()), None)
            if owner is None:
                raise SceneError(
                    f"sensor '{sensor.column}': no observer of this run measures it; the run must "
                    "have its standard observers"
                )
            self._columns[sensor.column] = owner
        self._observers = list({id(o): o for o in self._columns.values()}.values())

    def now(self, before: Mapping[str, float], dt: float) -> dict[str, float]:
        """All readings by their names, with the columns that rates are taken of; collective.

        Args:
            before: Those at the start of the step; empty before the first step.
            dt: Length of the step, s.
        """
        simulation = self._simulation
        measured = {id(o): o.measure() for o in self._observers}
        found = {c: float(measured[id(o)][c]) for c, o in self._columns.items()}
        if not before:
            # what is known of steps only
            found = {c: 0.0 if math.isnan(v) else v for c, v in found.items()}
        if self._rates:
            _, rates = simulation.model.mechanism.read(simulation.problem)
            found |= {label: rates[key] for label, key in self._rates.items()}
        for sensor in self._sensors:
            if sensor.derivative and sensor.name not in self._rates:
                change = found[sensor.column] - before.get(sensor.column, found[sensor.column])
                found[sensor.name] = change / dt if dt > 0 else 0.0
        return found

    @contextmanager
    def after(self, attempt: StepInfo) -> Iterator[None]:
        """The simulation as it would be behind a step that is solved; then as before it.

        Args:
            attempt: The step.
        """
        simulation = self._simulation
        kept = {name: array.copy() for name, array in simulation.live().items()}
        t, last = simulation.t, simulation.last
        states = [copy.deepcopy(o.state()) for o in self._observers]
        simulation.last = attempt
        try:
            for observer in self._observers:
                observer.solved(simulation)
            simulation.problem.advance(attempt.dt)
            simulation.t = t + attempt.dt
            for observer in self._observers:
                observer.accepted(simulation)
            yield
        finally:
            for name, array in simulation.live().items():
                array[:] = kept[name]
            simulation.t, simulation.last = t, last
            for observer, state in zip(self._observers, states, strict=True):
                observer.restore(state)


class Control(Restartable):
    """Controllers and events of a scene.

    Args:
        scene: The scene.
        signals: What it commands and switches.

    Attributes:
        samplers: Its controllers.
        watches: Its events.
        ended: Name of the event that has ended the run.
        crossed: Events that happen at the end of the step that was located last, by their positions
            among the watches.
    """

    remembered = ("samplers", "watches", "_read", "_before", "_dt", "_begun", "_changed", "ended")

    def __init__(self, scene: Scene, signals: Signals) -> None:
        self._signals = signals
        self.samplers = [Sampler(law) for law in scene.controllers]
        self.watches = [Watch(event, scene.dt) for event in scene.all_events]
        self.ended: str | None = None
        self._sensors, self._active = scene.sensors, bool(self.samplers or self.watches)
        self._readings: Readings | None = None
        # at the accepted state and at the one before, by their names; None: not read yet
        self._read: dict[str, float] | None = None
        self._before: dict[str, float] = {}
        self._begun, self._changed = False, False
        self.crossed: list[int] = []
        self._dt = 0.0

    def go_on(self, controlled: Mapping[str, Mapping[str, Any]]) -> None:
        """Take up controllers of another run that this one starts from.

        Args:
            controlled: States of samplers by their controllers.
        """
        known = [sampler for sampler in self.samplers if sampler.law.name in controlled]
        for sampler in known:
            sampler.restore(controlled[sampler.law.name])
        self._hold_outputs(known)

    def _hold_outputs(self, samplers: Iterable[Sampler]) -> None:
        for sampler in samplers:
            for name, value in sampler.outputs.items():
                self._signals.commands[sampler.law.name, name] = value

    def attach(self, simulation: Running, observers: Sequence[Any]) -> None:
        """Read the columns of some observers from now on; they have begun.

        Args:
            simulation: The simulation.
            observers: Its observers.

        Raises:
            SceneError: If nothing measures what a sensor reads.
        """
        if self._active and self._readings is None:
            self._readings = Readings(simulation, observers, self._sensors)

    def begin(self, simulation: Running, observers: Sequence[Any]) -> None:
        """Switch what events have changed, and ask controllers, before a step; collective.

        Args:
            simulation: The simulation.
            observers: Its observers.

        Raises:
            ControlError: If a law fails.
            SceneError: If nothing measures what a sensor reads, or the run would end at once.
        """
        if not self._active:
            return
        self.attach(simulation, observers)
        t, read = simulation.t, self._now()
        changed = self._changed
        for watch in self.watches:
            if not self._begun and watch.margin(read, t) >= 0:
                watch.change(t)
                changed = True
                if watch.event.ends:
                    raise SceneError(
                        f"event '{watch.event.name}': it is true at the start, where the run "
                        "would end; it must be false there"
                    )
            self._signals.windows[watch.event.name][:] = watch.windows
            watch.armed = watch.armed or watch.margin(read, t) < 0
        self._begun, self._changed = True, False
        jumps = False
        for sampler in self.samplers:
            if sampler.due(t):
                jumps |= sampler.ask(t, read, simulation.model.comm)
                sampler.command(t, self._signals)
        if self.samplers:
            simulation.model.mechanism.command(self._signals)
        if changed or jumps:
            # forces have jumped; a step that an event has cut is too short to guess from
            simulation.stepping.forget(velocities=changed)

    def _now(self) -> dict[str, float]:
        """Readings at the accepted state."""
        if self._read is None:
            assert self._readings is not None
            self._read = self._readings.now(self._before, self._dt)
        return self._read

    @property
    def next(self) -> float:
        """Time of the next sample, s."""
        return min((s.next for s in self.samplers), default=np.inf)

    def locate(self, simulation: Running, attempt: StepInfo, lands: bool) -> StepInfo:
        """Look behind a step that is solved, and repeat it where an event is within; collective.

        Also where one is so near behind it that the next step would be too short: it is halved; and
        where a condition may be true and false again within: it ends where that is to be seen.

        Args:
            simulation: The simulation.
            attempt: The step.
            lands: Whether it ends where a step has to.

        Returns:
            It, or the one that ends with the event.

        Raises:
            ConvergenceError: If a shorter step has no solution.
            ControlError: If a condition is no number.
        """
        self.crossed = []
        if not self.watches:
            return attempt
        read, t, last = self._now(), simulation.t, attempt
        armed = np.array([watch.armed for watch in self.watches])
        start = np.array([watch.margin(read, t) for watch in self.watches])

        def behind(made: StepInfo) -> Floats:
            return np.where(armed, self.margins(t, made), -np.inf)

        def margins(dt: float) -> Floats:
            nonlocal last
            last = simulation.stepping.attempt(t, dt)
            return behind(last)

        end, least = behind(attempt), LEAST * simulation.size.dt
        crossing = end >= 0
        if np.any(crossing):
            tolerance = min(w.tolerance for w, c in zip(self.watches, crossing, strict=True) if c)
            dt, found = first_crossing(margins, start, end, attempt.dt, tolerance, least)
            if lands and attempt.dt - dt < least:
                dt, found = attempt.dt, end
            if last.dt != dt:
                last = simulation.stepping.attempt(t, dt)
            crossing = found >= 0
        elif attempt.dt > 4 * least and comes_soon(start, end, attempt.dt, 2 * least):
            return self.locate(simulation, simulation.stepping.attempt(t, attempt.dt / 2), False)
        else:
            part = self._inner_time(start, end, t, attempt.dt)
            # what is left of a step that has to end where it does is no shorter
            if part is not None and least < part < attempt.dt - least:
                found = margins(part)
                return self.locate(simulation, last, False) if np.any(found >= 0) else last
        self.crossed = np.flatnonzero(crossing).tolist()
        return last

    def margins(self, t: float, made: StepInfo) -> Floats:
        """Margins of the conditions of all events, behind a step that is solved; collective.

        Args:
            t: Time at its start, s.
            made: The step.

        Raises:
            ControlError: If a condition is no number.
        """
        read, readings = self._now(), self._readings
        assert readings is not None
        with readings.after(made):
            now = readings.now(read, made.dt)
        return np.array([watch.margin(now, t + made.dt) for watch in self.watches])

    def _inner_time(self, start: Floats, end: Floats, t: float, dt: float) -> float | None:
        """Find where in a step a condition may be true between ends where it is not, s."""
        if not self._before:
            return None
        before = np.array([w.margin(self._before, t - self._dt) for w in self.watches])
        return turning_point(before, start, end, (self._dt, dt))

    def accept(self, dt: float, t: float) -> None:
        """A step is accepted.

        Args:
            dt: Its length, s.
            t: Time at its end, s.

        Raises:
            ControlError: If an event goes on and off again and again.
        """
        if not self._active:
            return
        self._before, self._read, self._dt = self._read or {}, None, dt
        for k in self.crossed:
            watch = self.watches[k]
            watch.change(t)
            self._changed = True
            if watch.on and watch.event.ends:
                self.ended = watch.event.name

    def state(self) -> dict[str, Any] | None:
        """State for a restart; None if nothing is controlled or watched."""
        if not self._active:
            return None
        if self._readings is not None:
            self._now()
        return super().state() | {
            "accelerated": [list(key) for key in self._signals.ways],
            "ways": [list(astuple(way)) for way in self._signals.ways.values()],
        }

    def restore(self, state: Mapping[str, Any] | None) -> None:
        """Take up a saved state.

        Args:
            state: As from `state`.
        """
        if state is None:
            return
        super().restore(state)
        self._hold_outputs(self.samplers)
        for key, way in zip(self._signals.ways, state["ways"], strict=True):
            self._signals.ways[key] = Way(*way)
        self.crossed = []
