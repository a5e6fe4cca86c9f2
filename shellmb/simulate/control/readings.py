"""Readings of sensors at the end of a step, accepted or only solved."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from shellmb.errors import SceneError
from shellmb.model.joints.columns import read_coordinates
from shellmb.scene.checks.signals import coordinate_read
from shellmb.scene.control.sensors import Sensor
from shellmb.simulate.stepping import Attempt, StepInfo

if TYPE_CHECKING:
    from shellmb.simulate.simulation import Simulation


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
        self, simulation: Simulation, observers: Sequence[Any], sensors: Sequence[Sensor]
    ) -> None:
        self._simulation, self._sensors = simulation, list(sensors)
        # some are several in one
        single = [part for o in observers for part in getattr(o, "inner", (o,))]
        measuring = [o for o in single if hasattr(o, "measure")]
        self._columns: dict[str, Any] = {}
        rates = {s: coordinate_read(simulation.scene, s.column) for s in sensors if s.derivative}
        # coordinates whose rates are part of the motion
        self._rates = {s.name: key for s, key in rates.items() if key is not None}
        for sensor in sensors:
            if sensor.name in self._rates:
                continue
            owner = next((o for o in measuring if sensor.column in o.measure()), None)
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
            groups = simulation.model.mechanism.coordinate_groups
            rates = read_coordinates(simulation.problem, groups)[1]
            found |= {label: rates[key] for label, key in self._rates.items()}
        for sensor in self._sensors:
            if sensor.derivative and sensor.name not in self._rates:
                change = found[sensor.column] - before.get(sensor.column, found[sensor.column])
                found[sensor.name] = change / dt if dt > 0 else 0.0
        return found

    @contextmanager
    def after(self, attempt: Attempt) -> Iterator[None]:
        """The simulation as it would be behind a step that is solved; then as before it.

        Args:
            attempt: The step.
        """
        simulation = self._simulation
        kept = {name: array.copy() for name, array in simulation.live().items()}
        t, last = simulation.t, simulation.last
        states = [copy.deepcopy(o.state()) for o in self._observers]
        simulation.last = StepInfo(t, attempt.dt, attempt.iterations, None, attempt.error)
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
