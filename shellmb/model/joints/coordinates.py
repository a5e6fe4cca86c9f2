"""Relative coordinates of joints and pairs of points as unknowns, with the equations they obey."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.forms.constraints import coordinates as forms
from shellmb.forms.constraints.held import Law
from shellmb.forms.constraints.joints import Place
from shellmb.model.body import Dofs, NodeLink
from shellmb.model.joints.constraints import ConstraintGroup
from shellmb.model.joints.joints import BoundJoint, apart
from shellmb.model.locations.ends import End, end_pair
from shellmb.model.massless import Scale, Targets

# name of a joint or a force element, and "rotation", "translation" or "distance"
Key = tuple[str, str]

# vectors that the two places need
_VECTORS = {"rotation": (3, 3), "translation": (3, 0), "distance": (0, 0)}
# how the values of coordinates are called in results
COLUMN = {"rotation": "rotation", "translation": "translation", "distance": "length"}


@dataclass(frozen=True)
class BoundCoordinate:
    """A coordinate with its places.

    Args:
        name: Name of the joint or force element.
        kind: "rotation", "translation" or "distance".
        ends: Places on the first and the second body.
        axes: Vectors `e1, e2, e3` of both places as rows, shape (2, 3, 3).
        start: Distance or translation of the places in the reference configuration, m; the unknown
            is what it changes by. 0 for rotations.
        joint: Name of the joint that it is one of several coordinates of; empty: the only one.
        share: Its share in the mean of these. Coordinates of the same name are one unknown.
    """

    name: str
    kind: str
    ends: tuple[End, End]
    axes: Floats
    start: float
    joint: str = ""
    share: float = 1.0

    @property
    def group(self) -> tuple[str, int, int]:
        """Key that coordinates with common kernels share."""
        first, second = (e.needed(n) for e, n in zip(self.ends, _VECTORS[self.kind], strict=True))
        return self.kind, first, second


def joint_coordinate(joint: BoundJoint, kind: str) -> BoundCoordinate:
    """The rotation or translation of a joint; it begins as zero."""
    start = 0.0
    if kind == "translation":
        start = float(joint.axes[0][2] @ (joint.ends[1].point - joint.ends[0].point))
    return BoundCoordinate(joint.joint.name, kind, joint.ends, joint.axes, start)


def distance_coordinate(
    name: str, ends: tuple[End, End], length: float, who: str
) -> BoundCoordinate:
    """The distance of two points.

    Args:
        name: Name of the force element.
        ends: The points.
        length: Size of the scene, m.
        who: Who asks, for the error.
    """
    axes = np.array([np.eye(3)] * 2)
    return BoundCoordinate(name, "distance", ends, axes, apart(ends, length, who))


class CoordinateGroup(ConstraintGroup):
    """Coordinates of one kind between like places, with a multiplier for each.

    The part "x" holds what each has changed by since the reference configuration.

    Args:
        scale: Communicator and sizes.
        items: The coordinates.
    """

    # an angle enters by its sine and cosine
    quadratic = False

    def __init__(self, scale: Scale, items: Sequence[BoundCoordinate]) -> None:
        self.coordinates = list(items)
        self.kind, *framed = items[0].group
        name = f"{self.kind} coordinates ({framed[0]}/{framed[1]})"
        self.ends = end_pair([i.ends for i in items], [i.axes for i in items], framed)
        turns = self.kind == "rotation"
        size = 1.0 if turns else scale.length
        # the work of a multiplier of size one is the same for all kinds
        sizes = scale.couple if turns else scale.force, size
        super().__init__(
            name, scale.comm, len(items), 1, self.gap, *sizes, own={"x": 1}, places=self.ends
        )
        self.links += tuple(self._same())
        self._start = self.per_item([i.start for i in items], "start")
        # of each at the start of a step, where forms are those of a single state
        self.before = self.per_item([0.0] * len(items), "before")
        # the places have velocities, too: `refresh` takes that of the coordinate from them
        self.move_along({"x": (f"{self.kind} of joints", size)}, "a smaller step")
        self.labels = [f"{item.name}.{item.kind}" for item in items]
        self.targets = self.numbers("x")[:, 0]

    def _same(self) -> list[NodeLink]:
        """Links of coordinates of the same name to the first of them."""
        first: dict[str, int] = {}
        for k, item in enumerate(self.coordinates):
            first.setdefault(item.name, k)
        of = np.array([first[item.name] for item in self.coordinates])
        if len(first) == len(of):
            return []
        local = self.nodes.item
        again = of[local] != local
        targets = self.numbers("x")[of[local[again]], 0]
        return [NodeLink(self.mixed.dofs["x"][again], self.name, targets)]

    def coordinate(self, k: int) -> Coordinate:
        """One of them."""
        item, size, target = self.coordinates[k], float(self.sizes[0]), int(self.targets[k])
        start = item.start if self.kind == "distance" else 0.0
        named = item.name, item.joint or item.name, self.kind
        return Coordinate(self, k, *named, start, size, target)

    def _places(self, q: Expr) -> tuple[Place, Place]:
        first, second = (end.place(q, self.layout) for end in self.ends)
        return first, second

    def gap(self, q: Expr, before: Expr | None = None) -> Expr:
        """Difference of the coordinate and that of the places, as a scalar in a list.

        Args:
            q: State.
            before: That at the start of the step, from which a rotation is counted; without it the
                difference is known up to whole turns.
        """
        first, second = self._places(q)
        x = self._x(q)
        if self.kind == "rotation":
            gap = forms.rotation_gap(first, second, x, x if before is None else before)
        elif self.kind == "translation":
            gap = forms.translation_gap(first, second, self._start + x)
        else:
            gap = forms.distance_gap(first, second, self._start + x, self._start)
        return as_row(gap)

    def angle(self, q: Expr) -> Expr:
        """Cosine and sine of the angles of a state, shape (2,)."""
        return forms.cosine_sine(*self._places(q))

    def drop(self, item: int, component: int) -> None:
        """Leave out the driver of a coordinate that others drive likewise."""
        here = self.mixed.dofs["x"][self.nodes.item == item]
        self.fixed = [f for f in self.fixed if not np.isin(f.dofs, here).any()]

    @property
    def law(self) -> Law:
        """The equations of the coordinates."""
        if self.kind != "rotation":
            return super().law
        return forms.Angle(self.angle, self._x, self.gap, self.before)

    def rate_gap(self, q: Expr, v: Expr) -> Expr:
        """Derivative of the equation at the state `q` along the velocity `v`."""
        return self.law.velocity(v, q, v).value

    def _x(self, q: Expr) -> Expr:
        return self.layout.part(q, "x")

    def excess(self, q: Expr, v: Expr) -> Expr:
        """Difference of a coordinate's rate from that of its places."""
        gap = self.rate_gap(q, v)[0]
        if self.kind == "distance":
            # the equation is that of the squares
            gap = gap * self._start / (self._start + self._x(q))
        return gap

    @cached_property
    def _excess(self) -> Callable[[Floats, Floats], Floats]:
        return self.reader(lambda q, v: as_row(self.excess(q, v)))

    def by_name(self, state: Floats) -> dict[Key, float]:
        """Values in a local array of a state, and means of joints that have several; collective."""
        values = self.gathered("x", state)[:, 0].tolist()
        found: dict[Key, float] = {}
        means: dict[Key, float] = {}
        for item, value in zip(self.coordinates, values, strict=True):
            found[item.name, item.kind] = value
            if item.joint:
                key = item.joint, item.kind
                means[key] = means.get(key, 0.0) + item.share * value
        return found | means

    def begin(self, q: fem.Function) -> None:
        """Count rotations from where they are, before a step.

        Args:
            q: State.
        """
        rows = self.before.function_space.dofmap.list[:, 0]
        self.before.x.array[rows] = q.x.array[self.mixed.dofs["x"]]

    def refresh(self, q: fem.Function, v: fem.Function) -> None:
        """Give the coordinates the rates that their places have.

        Velocities at the end of a step violate constraints a little, and so differ from the rate
        that the coordinate has by itself. A driver that starts a step from the latter never
        corrects the former, and its torque oscillates from step to step.

        Args:
            q: State.
            v: Velocities there; those of the coordinates are replaced.
        """
        v.x.array[self.mixed.dofs["x"]] -= self._excess(q.x.array, v.x.array)[:, 0]


def as_row(value: Expr) -> Expr:
    """A scalar as a vector of one entry, the shape of constraints."""
    return ufl.as_vector([value])


@dataclass(frozen=True)
class Coordinate:
    """One coordinate of a group.

    Args:
        group: Its group.
        item: Its number there.
        name: Name of its joint or force element.
        joint: Name of its joint or force element, also where the joint has several of them.
        kind: Kind of the coordinate.
        start: Value in the reference configuration that results count from, m: of distances only.
        size: Typical size: 1 rad, or the size of the scene, m.
        target: Global dof of the unknown "x".
    """

    group: CoordinateGroup
    item: int
    name: str
    joint: str
    kind: str
    start: float
    size: float
    target: int

    @property
    def effort(self) -> str:
        """Name of the force along or about it in results."""
        return "torque" if self.kind == "rotation" else "force"

    def local(self) -> Dofs:
        """Local dof of the unknown "x", shape (0,) on ranks that do not have it."""
        here = self.group.nodes.item == self.item
        return self.group.mixed.dofs["x"][here]

    def drive(self, problem: Any) -> float:
        """Torque or force that a driver exerts on it; collective.

        It is the mean over the step just solved, the value at its middle to second order; in
        statics that at its end.
        """
        system, found = problem.system, 0.0
        number = problem.number(self.group.name, problem.last)
        held = system.numbering.start + system.fixed
        for unknown in system.numbering.by_field[number][self.local()]:
            found += float(np.sum(system.reactions[held == unknown]))
        return float(system.comm.allreduce(found, op=MPI.SUM))


def summed(names: Sequence[str], values: Floats) -> dict[str, float]:
    """Values by name, those of the same name added up."""
    found: dict[str, float] = {}
    for name, value in zip(names, values.tolist(), strict=True):
        found[name] = found[name] + value if name in found else value
    return found


def coordinate_groups(
    scale: Scale, items: Sequence[BoundCoordinate]
) -> tuple[list[CoordinateGroup], dict[Key, Coordinate]]:
    """Groups of like coordinates, and where each coordinate is.

    Args:
        scale: Communicator and sizes.
        items: All coordinates.
    """
    groups, table = [], dict[Key, Coordinate]()
    for key in dict.fromkeys(item.group for item in items):
        members = [item for item in items if item.group == key]
        group = CoordinateGroup(scale, members)
        groups.append(group)
        for k in range(len(members)):
            one = group.coordinate(k)
            table.setdefault((one.name, one.kind), one)
            # of several the first stands for the joint where its name is requested
            table.setdefault((one.joint, one.kind), one)
    return groups, table


def scalar_targets(coordinates: Sequence[Coordinate]) -> Targets:
    """Unknowns of coordinates that a scalar part of a group is, one for each of its items."""
    return [c.group.name for c in coordinates], np.array([[c.target] for c in coordinates])
