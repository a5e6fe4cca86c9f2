"""Forces at the end of each step beside the means over it, where a scene asks for them."""

from __future__ import annotations

from functools import partial

import numpy as np

from shellmb.observers.forces.joints import (
    Span,
    column_names,
    columns,
    group_loops,
    joint_forces,
    span_of_step,
)
from shellmb.observers.forces.meanforces import ConsistentMeans
from shellmb.observers.forces.supports import SupportForces
from shellmb.simulate.simulation import BaseObserver, Simulation
from shellmb.simulate.start.endforces import EndForces

ENDING = "_end"


class EndForceColumns(BaseObserver):
    """Forces of joints and all that acts on them, and of supports, at the end of a step.

    Those of force elements follow from coordinates and rates there, all others from the equations
    of motion (`simulate.endforces`).

    Nothing without `Output(end_forces=True)`.

    Attributes:
        values: Columns of the history, named as the means with `_end` behind; those of supports
            (`SupportForces`) as means, too. NaN before the first step. Those of joints, drivers and
            locks with `_mean` behind are `ConsistentMeans`.
    """

    def __init__(self) -> None:
        self.values: dict[str, float] = {}
        self._solution: EndForces | None = None
        self._consistent: ConsistentMeans | None = None
        self._solved: dict[str, float] = {}

    def start(self, simulation: Simulation) -> None:
        """Make the equations, and list the columns."""
        self.idle = not (simulation.scene.output.end_forces and simulation.scheme.dynamic)
        if self.idle:
            return
        self._solution = EndForces(simulation.problem)
        self._loops = group_loops(self._solution, simulation.model.mechanism)
        balance = simulation.scheme.balance
        self._acting = group_loops(simulation.problem, simulation.model.mechanism, balance)
        self._means = SupportForces(simulation.problem, simulation.model, balance)
        self._ends = SupportForces(self._solution, simulation.model)
        names = [*self._means.names, *self._measured(simulation, self._solution)]
        if simulation.scheme.rates == ("v",):
            self._consistent = ConsistentMeans(simulation)
            names += self._consistent.names
        self.values = dict.fromkeys(names, float("nan"))

    def solved(self, simulation: Simulation) -> None:
        """Take the means of what supports hold."""
        if self._solution is not None:
            over = partial(span_of_step, simulation)
            self.values.update(self._means(over))
            if self._consistent is not None:
                model = simulation.model
                found = joint_forces(model, self._acting, over)
                joints = columns(column_names(model.mechanism), found)
                self._solved = joints | model.mechanism.efforts(simulation.problem)

    def switched(self, simulation: Simulation) -> None:
        """Velocities have been made consistent."""
        if self._consistent is not None:
            self._consistent.switched()

    def accepted(self, simulation: Simulation) -> None:
        """Solve at the new state."""
        if self._solution is None or simulation.last is None:
            return
        self._solution.solve(simulation.t, simulation.last.dt)
        if self._consistent is not None:
            # the solution has begun with the projection of the velocities
            self.values.update(self._consistent(simulation, self._solved))
        self.values.update(self._measured(simulation, self._solution))

    def _measured(self, simulation: Simulation, solution: EndForces) -> dict[str, float]:
        model, levels = simulation.model, simulation.problem.levels

        def state(body: str) -> Span:
            return Span(*[np.asarray(levels[body].q.x.array)] * 3)

        mechanism, problem = model.mechanism, simulation.problem
        efforts = mechanism.efforts(solution) | mechanism.elements(problem, simulation.t)
        found = {f"{name}{ENDING}": value for name, value in efforts.items()}
        found_there = joint_forces(model, self._loops, state)
        joints = columns(column_names(mechanism, ENDING), found_there)
        return joints | found | self._ends(state, ENDING)

    def measure(self) -> dict[str, float]:
        """Columns of the history."""
        return dict(self.values)
