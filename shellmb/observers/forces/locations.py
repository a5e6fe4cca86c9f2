"""Ends of joints, read from the state of their group, and coordinates that follow from them.

Rotations and translations of joints that something acts on are unknowns
(`model.joints.coordinates`). All others follow from the places of their joints, without an unknown
and a form.
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from shellmb.arrays import Floats
from shellmb.model.joints.coordinates import COLUMN, CoordinateGroup
from shellmb.model.joints.joints import BoundJoint, JointGroup
from shellmb.observers.deferred import SharedTable, copies
from shellmb.restart import Restartable
from shellmb.simulate.simulation import Simulation

type Group = JointGroup | CoordinateGroup


class Places:
    """One end of each of some joints of a group, in states of the group or changes of these.

    Args:
        group: The group.
        which: 0 for the first, 1 for the second end.
        cells: Local cells of the joints.
        joints: The joints.

    Attributes:
        turn: Whether directors matter at this end; if not, it has none here.
    """

    def __init__(
        self, group: Group, which: int, cells: Sequence[int], joints: Sequence[BoundJoint]
    ) -> None:
        place, ends = group.ends[which], [joint.ends[which] for joint in joints]
        self.turn = place.turns
        self._u = _dofs(group, f"u{place.tag}", cells)
        self._nodes = np.array([end.node for end in ends])
        if not self.turn:
            return
        self._w = _dofs(group, f"w{place.tag}", cells).reshape(len(ends), -1, 3)
        self._directors = np.array([end.directors for end in ends])
        self._offsets = np.array([end.offset for end in ends])

    def nodes(self, q: Floats, whole: float = 1.0) -> Floats:
        """Positions of the nodes, shape (..., n, 3), m.

        Args:
            q: A state, or several, shape (..., dofs).
            whole: Zero where these are changes of states.
        """
        return whole * self._nodes + np.take(q, self._u, axis=-1)

    def directors(self, q: Floats, whole: float = 1.0) -> Floats:
        """Directors of the nodes, shape (..., n, m, 3)."""
        return whole * self._directors + np.take(q, self._w, axis=-1)

    def points(self, q: Floats, whole: float = 1.0) -> Floats:
        """Positions of the ends themselves, shape (..., n, 3), m."""
        x = self.nodes(q, whole)
        if not self.turn:
            return x
        return x + (self._offsets[:, None] @ self.directors(q, whole))[..., 0, :]

    def moments(self, q: Floats, work: Floats, about: Floats, whole: float = 1.0) -> Floats:
        """Forces and their moments, shape (..., n, 2, 3).

        Args:
            q: States of the group, shape (..., dofs).
            work: Virtual work for each of its dofs.
            about: Points that moments are about, shape (..., n, 3), m.
            whole: Zero where these are changes of states and points.
        """
        found = np.empty((*about.shape[:-1], 2, 3))
        force = found[..., 0, :] = np.take(work, self._u, axis=-1)
        # arms and what they turn with, one below the other
        arms, forces = (self.nodes(q, whole) - about)[..., None, :], force[..., None, :]
        if self.turn:
            arms = np.concatenate([arms, self.directors(q, whole)], axis=-2)
            forces = np.concatenate([forces, np.take(work, self._w, axis=-1)], axis=-2)
        # sums of products by pairs of axes
        products = arms.swapaxes(-1, -2) @ forces
        for k, (a, b) in enumerate(((1, 2), (2, 0), (0, 1))):
            found[..., 1, k] = products[..., a, b] - products[..., b, a]
        return found


def _dofs(group: Group, part: str, cells: Sequence[int]) -> npt.NDArray[np.intp]:
    dofs = group.mixed.dofs[part].reshape(-1, group.mixed.parts[part][1])
    return np.asarray(dofs[list(cells)], dtype=np.intp)


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
                    self._read.append(_Like(kind, group, here))
                    arrays[group.name] = simulation.problem.state(group.name).x.array
        # and states of the groups, where each begins
        self._states = copies(arrays.values())
        ends = np.cumsum([0, *map(len, arrays.values())]).tolist()
        self._of = {name: slice(*own) for name, own in zip(arrays, pairwise(ends), strict=True)}
        if self.values:
            self.take(0)
            self.count(slice(0, 1))

    def take(self, row: int) -> None:
        """Take the state; collective.

        Args:
            row: Which of the steps that are counted together.
        """
        if self.values:
            self._states.take(row)
            self._found.take(row, self._find)

    def _find(self, rows: slice, found: Floats) -> None:
        for like in self._read:
            states = self._states.of(rows)[:, self._of[like.group]]
            found[:, like.numbers] = like.values(states, self._linear)

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
        here: Of each the place of its value, the local cell of its joint, and the joint.
    """

    def __init__(self, kind: str, group: JointGroup, here: Sequence[Any]) -> None:
        numbers, cells, joints = zip(*here, strict=True)
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
