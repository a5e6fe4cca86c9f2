"""Impulses at which locks and joints begin to act."""

from __future__ import annotations

import numpy as np

from shellmb.model.joints.columns import read_contacts
from shellmb.observers.forces.joints import Span, column_names, columns, group_loops, joint_forces
from shellmb.simulate.simulation import BaseObserver, Simulation
from shellmb.simulate.start.endforces import Impulses

ENDING = "_impulse"


class BlowColumns(BaseObserver):
    """Impulses [N s, N m s] of joints, locks and drivers where something begins to act.

    Velocities jump then, before a step, by an impact without restitution, which goes through the
    whole mechanism. The row of that step has the impulses, all others have zeros. Directions and
    points are those of the state in which it happens.

    Nothing in statics, and in scenes whose locks and joints act always.

    Attributes:
        values: Columns of the history, named as the forces with `_impulse` behind.
    """

    def __init__(self) -> None:
        self.values: dict[str, float] = {}
        self._new = False

    def start(self, simulation: Simulation) -> None:
        """List the columns."""
        model = simulation.model
        self.idle = not (simulation.scheme.dynamic and model.mechanism.switches.items)
        if self.idle:
            return
        self._impulses = Impulses(simulation.problem)
        self._loops = group_loops(self._impulses, model.mechanism)
        self.values = dict.fromkeys(self._read(simulation), 0.0)

    def switched(self, simulation: Simulation) -> None:
        """Read the impulses by which velocities were made consistent; collective."""
        self.values, self._new = self._read(simulation), True

    def solved(self, simulation: Simulation) -> None:
        """Forget them after the row of their step."""
        if not self._new:
            self.values = dict.fromkeys(self.values, 0.0)
        self._new = False

    def _read(self, simulation: Simulation) -> dict[str, float]:
        levels, model = simulation.problem.levels, simulation.model

        def at(name: str) -> Span:
            return Span(*[np.asarray(levels[name].q.x.array)] * 3)

        joints = joint_forces(model, self._loops, at)
        found = columns(column_names(model.mechanism, ENDING), joints)
        efforts = model.mechanism.efforts(self._impulses)
        for track in read_contacts(self._impulses, model.mechanism.groups):
            del efforts[track]
        return found | {f"{name}{ENDING}": value for name, value in efforts.items()}

    def measure(self) -> dict[str, float]:
        """Columns of the history."""
        return dict(self.values)
