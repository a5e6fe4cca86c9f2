"""Means over a step of the forces that go with velocities which the constraints allow.

Velocities of EP and ED at the ends of steps violate constraints a little. Made consistent by the
impulses `p`, `v = w + M^-1 Dg^T p`, they turn the balance of a step into

    M (w_f - w_i)/h + .. + Dg^T [lambda + (p_f - p_i)/h] = ..

but for terms of second order. What `lambda` alternates with, in EP of first order, is in `p`.
"""

from __future__ import annotations

import numpy as np

from shellmb.model.joints.columns import read_contacts
from shellmb.observers.forces.joints import (
    Span,
    column_names,
    columns,
    group_loops,
    joint_forces,
)
from shellmb.simulate.simulation import Simulation
from shellmb.simulate.start.endforces import Impulses

ENDING = "_mean"


class ConsistentMeans:
    """Corrects the means of joints, drivers and locks; the projection must have been solved.

    Args:
        simulation: The simulation, at its start.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._impulses = Impulses(simulation.problem)
        self._mechanism = simulation.model.mechanism
        self._loops = group_loops(self._impulses, self._mechanism)
        self.names = [f"{name}{ENDING}" for name in self._now(simulation)]
        # a run begins with consistent velocities; how far off they are where it is resumed, is not
        # known
        self._before = 0.0 if simulation.t == 0 else float("nan")
        self._last: dict[str, float] = {}

    def switched(self) -> None:
        """Velocities have been made consistent."""
        self._last, self._before = {}, 0.0

    def __call__(self, simulation: Simulation, means: dict[str, float]) -> dict[str, float]:
        """Columns of the step just accepted; collective.

        Args:
            simulation: The simulation.
            means: What its scheme solved for, by the names of the columns.
        """
        assert simulation.last is not None
        now, dt = self._now(simulation), simulation.last.dt
        gained = {k: (p - self._last.get(k, self._before)) / dt for k, p in now.items()}
        self._last = now
        return {f"{k}{ENDING}": means[k] + force for k, force in gained.items()}

    def _now(self, simulation: Simulation) -> dict[str, float]:
        levels, model = simulation.problem.levels, simulation.model

        def state(body: str) -> Span:
            return Span(*[np.asarray(levels[body].q.x.array)] * 3)

        found = self._mechanism.efforts(self._impulses)
        for track in read_contacts(self._impulses, self._mechanism.groups):
            del found[track]
        joints = joint_forces(model, self._loops, state)
        return columns(column_names(model.mechanism), joints) | found
