"""Violation of constraints: those of the directors, and those between bodies, by joint."""

from collections.abc import Mapping

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Bools, Floats
from shellmb.model.body import constraint_errors
from shellmb.model.joints.joints import JointGroup
from shellmb.observers.deferred import STEPS, Booked, DeferredObserver, Row, SharedTable, copies
from shellmb.observers.fields.nodal import nodal_bodies
from shellmb.simulate.simulation import Simulation

# dofs of a body up to which calls of NumPy take longer than its numbers: states are kept, and their
# errors are found for many steps at a time
SMALL = 2000


class Constraints(DeferredObserver):
    """Largest constraint errors; nothing in linear statics, where constraints are linearised.

    Attributes:
        director_max: Largest deviation so far of a shell's director from unit length, or of a
            frame from orthonormality. None if not measured.
        constraint_max: Largest violation of any constraint so far, `director_max` included.
        joints: Largest violation so far of each joint. Of positions it is relative to the scene's
            length, of directions in rad; what was left out as redundant counts.
    """

    remembered = ("_director_max", "_constraint_max", "_joints")
    director_max, constraint_max = Booked[float | None](), Booked[float | None]()
    joints = Booked[Row]()

    def __init__(self) -> None:
        super().__init__()
        self._director_max: float | None = None
        self._constraint_max: float | None = None
        self._joints: dict[str, float] = {}

    def start(self, simulation: Simulation) -> None:
        """Take the errors at the start."""
        model, levels = simulation.model, simulation.problem.levels
        joints = {id(group) for group in model.mechanism.groups}
        nodal = nodal_bodies(model).keys() - model.own.keys()
        bodies = [body for body in model.bodies if id(body) not in joints]
        arrays = {body.name: levels[body.name].q.x.array for body in model.bodies}
        small = {n for n in nodal if len(arrays[n]) <= SMALL}
        self._small = [body for body in bodies if body.name in small]
        # large ones, and those some of whose constraints may be switched off, with the first of the
        # columns of `_add` that they count in
        others = [body for body in bodies if body.name not in small]
        self._others = [(b, arrays[b.name][None], 0 if b.name in nodal else 1) for b in others]
        self._found = np.zeros((STEPS, len(others)))
        number = {name: k for k, name in enumerate(model.mechanism.joints)}
        self._names = list(number)
        self._groups = [_Violations(group, number) for group in model.mechanism.groups]
        self._switched_groups = [group for group in self._groups if group.switched]
        kept = [*self._small, *model.mechanism.groups]
        states = [arrays[each.name] for each in kept]
        self._states, self._ends = copies(states), np.cumsum([*map(len, states)])
        # of each step: of directors, of all constraints, and of each joint
        self._worst = SharedTable(model.comm, (2 + len(number),), MPI.MAX)
        self._measured = not simulation.scheme.linear
        if self._measured:
            self.take_accepted(simulation, 0)
            self.begin(*self.book_rows(slice(0, 1)))

    def take_accepted(self, simulation: Simulation, row: int) -> None:
        """Take the errors."""
        if not self._measured:
            return
        self._states.take(row)
        self._found[row] = [constraint_errors(body, q)[0] for body, q, _ in self._others]
        for group in self._switched_groups:
            group.take(row)
        self._worst.take(row, self._add)

    def _add(self, rows: slice, worst: Floats) -> None:
        """Largest violations of directors and of each joint on this rank."""
        states = np.split(self._states.of(rows), self._ends, axis=1)[:-1]
        found = [(constraint_errors(*own), 0) for own in zip(self._small, states, strict=False)]
        found += [(self._found[rows, k], first) for k, (_, _, first) in enumerate(self._others)]
        for errors, first in found:
            np.maximum(worst[:, first:2], errors[:, None], out=worst[:, first:2])
        for group, own in zip(self._groups, states[len(self._small) :], strict=True):
            group.add(own, rows, worst[:, 2:])
        np.maximum(worst[:, 1], worst[:, 2:].max(axis=1, initial=0.0), out=worst[:, 1])

    def book_rows(self, rows: slice) -> list[Row]:
        """See which are the largest."""
        if not self._measured:
            return [{} for _ in range(*rows.indices(STEPS))]
        worst = self._worst.of(rows, self._add)
        director, every, *joints = worst.max(axis=0).tolist()
        self._director_max = max(self._director_max or 0.0, director)
        self._constraint_max = max(self._constraint_max or 0.0, every)
        for name, value in zip(self._names, joints, strict=True):
            self._joints[name] = max(self._joints.get(name, 0.0), value)
        names = ("director_error", "constraint_error")
        return [dict(zip(names, row, strict=True)) for row in worst[:, :2].tolist()]


class _Violations:
    """Violations of a group of joints in some steps.

    Args:
        group: The group.
        number: Place of each joint, by its name.

    Attributes:
        switched: Whether some joints may be switched off.
    """

    def __init__(self, group: JointGroup, number: Mapping[str, int]) -> None:
        self._group, self.switched = group, group.on is not None
        joints = [group.joints[item].joint.name for item in group.nodes.item]
        self._joints = np.array([number[name] for name in joints], dtype=np.intp)
        self._on: list[Bools] = [group.switched_on] * STEPS

    def take(self, row: int) -> None:
        """Take which constraints act."""
        self._on[row] = self._group.switched_on

    def add(self, states: Floats, rows: slice, worst: Floats) -> None:
        """Take the largest of each joint for some steps, shape (steps, joints)."""
        on = np.array(self._on[rows]) if self.switched else self._on[0]
        apart = self._group.relative(self._group.violations_at(states), on)
        largest = np.maximum.reduce(apart, axis=2, initial=0.0)
        # most have one item each; a weld along a region has many
        np.maximum.at(worst.T, self._joints, largest.T)
