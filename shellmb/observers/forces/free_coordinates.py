"""Rotations and translations of joints that nothing acts on and no sensor reads.

Those that something acts on are unknowns (`model.joints.coordinates`). All others follow from the
places of their joints, without an unknown and a form.
"""

from __future__ import annotations

import math

from mpi4py import MPI as _MPI  # noqa: F401  (before dolfinx)

import numpy as np

from shellmb.arrays import Floats
from shellmb.model.joints.columns import COLUMN
from shellmb.model.joints.joints import BoundJoint, JointGroup
from shellmb.observers.deferred_observer import DeferredNumbers, SharedTable
from shellmb.observers.forces.locations import Places
from shellmb.restart import Restartable
from shellmb.simulate.simulation import Simulation


class FreeCoordinates(Restartable):
    """Reads them between two steps.

    Attributes:
        values: Rotations [rad], which count whole turns as long as no step is half a turn, and
            translations [m], by column.
    """

    remembered = ("values",)

    def __init__(self) -> None:
        self.values: dict[str, float] = {}
        self._read: list[_Like] = []

    def start(self, simulation: Simulation) -> None:
        """Find the joints and take the values."""
        mechanism = simulation.model.mechanism
        names = {
            (joint.joint.name, kind): f"{joint.joint.name}.{COLUMN[kind]}"
            for joint in mechanism.joints.values()
            for kind in (*joint.joint.freedoms, *joint.joint.observed)
            if (joint.joint.name, kind) not in mechanism.table
        }
        number = {key: k for k, key in enumerate(names)}
        for name in names.values():
            self.values.setdefault(name, simulation.problem.counted.get(name, 0.0))
        # rotations whose turns count
        ending = f".{COLUMN['rotation']}"
        counts = not simulation.scheme.linear
        self._counting = {name for name in names.values() if counts and name.endswith(ending)}
        self._linear = simulation.scheme.linear
        arrays: dict[str, Floats] = {}
        # of each step: values up to whole turns
        self._found = SharedTable(simulation.model.comm, (len(names),))
        self._read = []
        for group in mechanism.groups if names else []:
            mine = group.nodes.mesh.topology.index_map(1).size_local
            for kind in ("rotation", "translation"):
                here = [
                    (number[key], row, group.joints[item])
                    for row, item in enumerate(group.nodes.item[:mine])
                    if (key := (group.joints[item].joint.name, kind)) in number
                ]
                if here:
                    self._read.append(_Like(kind, group, *zip(*here, strict=True)))
                    arrays[group.name] = simulation.problem.state(group.name).x.array
        # and states of the groups
        self._kept = DeferredNumbers(list(arrays.values()))
        self._states = dict(zip(arrays, self._kept.tables, strict=True))
        if self.values:
            self.take(0)
            self.count(slice(0, 1))

    def take(self, row: int) -> None:
        """Take the state; collective.

        Args:
            row: Which of the steps that are counted together.
        """
        if self.values:
            self._kept.take(row)
            self._found.take(row, self._find)

    def _find(self, rows: slice, found: Floats) -> None:
        for like in self._read:
            found[:, like.numbers] = like.values(self._states[like.group][rows], self._linear)

    def count(self, rows: slice) -> list[dict[str, float]]:
        """Values of some steps, one after the other.

        Args:
            rows: The steps.
        """
        found = []
        for row in self._found.of(rows, self._find).tolist():
            for name, value in zip(self.values, row, strict=True):
                if name in self._counting:
                    before = self.values[name]
                    value = before + math.remainder(value - before, 2 * math.pi)
                self.values[name] = value
            found.append(dict(self.values))
        return found


class _Like:
    """Coordinates of one kind of joints of one group.

    Args:
        kind: "rotation" or "translation".
        group: The group.
        numbers: Places of their values.
        cells: Local cells of the joints.
        joints: The joints.
    """

    def __init__(
        self,
        kind: str,
        group: JointGroup,
        numbers: tuple[int, ...],
        cells: tuple[int, ...],
        joints: tuple[BoundJoint, ...],
    ) -> None:
        self.group, self.numbers, self._kind = group.name, list(numbers), kind
        self._places = [Places(group, k, cells, joints) for k in range(2)]
        self._axes = [
            np.array([joint.axes[k] @ joint.ends[k].directors.T for joint in joints])
            for k in range(2)
        ]
        ends = np.array([[end.point for end in joint.ends] for joint in joints])
        axes = np.array([joint.axes[0][2] for joint in joints])
        self._start = np.einsum("ni,ni->n", axes, ends[:, 1] - ends[:, 0])

    def values(self, q: Floats, linear: bool) -> Floats:
        """Angles up to pi, rad, or translations, m, shape (steps, n), at states of the group."""
        first, second = self._places
        e = self._axes[0] @ first.directors(q)
        if self._kind == "translation":
            gap = second.points(q) - first.points(q)
            return np.vecdot(e[..., 2, :], gap) - self._start
        turned = self._axes[1][:, :1] @ second.directors(q)
        cosine, sine = np.moveaxis(np.vecdot(e[..., :2, :], turned), -1, 0)
        return np.asarray(sine if linear else np.arctan2(sine, cosine))
