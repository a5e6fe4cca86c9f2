"""Coordinates of a mechanism, forces that act on them, and slip of contacts, as columns."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

from mpi4py import MPI

import numpy as np
from dolfinx import fem

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.model.elements.elements import ElementGroup
from shellmb.model.joints.coordinates import Coordinate, CoordinateGroup, Key
from shellmb.model.joints.joints import JointGroup
from shellmb.model.joints.rolling import ContactGroup
from shellmb.model.joints.switches import TiedCoordinates
from shellmb.model.massless import gathered
from shellmb.model.sections.branches import MaxwellBranches

# how a distance and the force along or about a coordinate are called in results
COLUMN = {"rotation": "rotation", "translation": "translation", "distance": "length"}
EFFORT = {"rotation": "torque", "translation": "force", "distance": "force"}


class Solution(Protocol):
    """Interface of a problem to readings (`shellmb.simulate.problem.Problem`)."""

    model: Any
    scheme: Any
    system: Any

    @property
    def levels(self) -> Mapping[str, Any]:
        """Functions of each body."""
        ...

    @property
    def last(self) -> str:
        """Stage at the end of a step."""
        ...

    def state(self, body: str) -> fem.Function:
        """Current state of a body."""
        ...

    def number(self, body: str, stage: str) -> int:
        """Number of the field of a body's stage in the system."""
        ...


class Relaxing(Solution, Protocol):
    """A problem whose bodies and springs may relax."""

    @property
    def branches(self) -> Mapping[str, MaxwellBranches]:
        """Maxwell branches by the name of their body."""
        ...


def read_coordinates(
    problem: Solution, groups: Sequence[CoordinateGroup]
) -> tuple[dict[Key, float], dict[Key, float]]:
    """Changes of all coordinates and their rates; collective."""
    values: dict[Key, float] = {}
    rates: dict[Key, float] = {}
    for group in groups:
        dofs = group.mixed.dofs["x"]
        x = gathered(group.nodes, problem.state(group.name).x.array[dofs])
        v = np.zeros_like(x)
        if "v" in problem.scheme.rates:
            v = gathered(group.nodes, problem.levels[group.name].rates["v"].x.array[dofs])
        for item, x_k, v_k in zip(group.coordinates, x, v, strict=True):
            values[item.name, item.kind] = float(x_k)
            rates[item.name, item.kind] = float(v_k)
        for found, each in ((values, x), (rates, v)):
            for key, mean in means(group, each).items():
                found[key] = mean
    return values, rates


def means(group: CoordinateGroup, values: Floats) -> dict[Key, float]:
    """Means over the angles of joints that have several.

    Args:
        group: The group.
        values: Values of its items, shape (items,).
    """
    found: dict[Key, float] = {}
    for item, value in zip(group.coordinates, values.tolist(), strict=True):
        if item.joint:
            key = item.joint, item.kind
            found[key] = found.get(key, 0.0) + item.share * value
    return found


def drive(problem: Solution, coordinate: Coordinate) -> float:
    """Torque or force that a driver exerts on its coordinate; collective.

    It is the mean over the step just solved, the value at its middle to second order; in statics
    that at its end.
    """
    system, found = problem.system, 0.0
    number = problem.number(coordinate.group.name, problem.last)
    held = system.numbering.start + system.fixed
    for unknown in system.numbering.by_field[number][coordinate.local()]:
        found += float(np.sum(system.reactions[held == unknown]))
    return float(system.comm.allreduce(found, op=MPI.SUM))


def element_forces(
    group: ElementGroup,
    values: Mapping[Key, float],
    rates: Mapping[Key, float],
    t: float,
    branches: MaxwellBranches | None,
) -> dict[str, float]:
    """Tension of springs, resistance of dampers, drive of motors at a state; collective."""
    keys = [(item.coordinate.name, item.coordinate.kind) for item in group.items]
    x = np.array([values[key] for key in keys])
    v = np.array([rates[key] for key in keys])
    forces = group.forces(x, v, t)
    if branches is not None:
        forces = forces + gathered(group.nodes, branches.forces())
    return element_columns(group, forces)


def element_columns(group: ElementGroup, forces: Floats) -> dict[str, float]:
    """Forces of the elements of a group, shape (items,), by their columns: sums of equal ones."""
    names = [f"{i.element.name}.{EFFORT[i.coordinate.kind]}" for i in group.items]
    return summed(names, forces)


def summed(names: Sequence[str], values: Floats) -> dict[str, float]:
    """Values by name, those of the same name added up."""
    found: dict[str, float] = {}
    for name, value in zip(names, values.tolist(), strict=True):
        found[name] = found[name] + value if name in found else value
    return found


def tie_forces(
    problem: Solution, group: TiedCoordinates, name: Callable[[str, Coordinate], str]
) -> dict[str, float]:
    """Torques and forces that locks and couplings exert on their coordinates; collective.

    Means over the step just solved, as those of drivers. While locks are open they are 0.

    Args:
        problem: The problem, a step of which is accepted.
        group: The locks or couplings.
        name: Column of a coordinate of one with some label.
    """
    forces = group.forces(problem.state(group.name))
    each = zip(group.labels, group.members, strict=True)
    return summed([name(label, c) for label, members in each for c in members], forces.ravel())


def lock_column(label: str, c: Coordinate) -> str:
    """Column of the force of a lock."""
    return f"{c.joint}.lock_{EFFORT[c.kind]}"


def coupling_column(label: str, c: Coordinate) -> str:
    """Column of the force of a coupling on one of its coordinates."""
    return f"{label}.{c.joint}.{EFFORT[c.kind]}"


Functions = Mapping[str, fem.Function]

# slip at the start of what was to roll, as a part of the speeds that it is the difference of
SLIPPING = 1e-6


def read_contacts(problem: Solution, groups: Sequence[JointGroup]) -> dict[str, float]:
    """Columns of contacts; collective.

    `JOINT.track1`, `JOINT.track2`: the point of contact in the plane, along its axes, from the
    joint's point of the first body [m]; `JOINT.slip`: speed of slip now [m/s], which vanishes to
    the order of the scheme: what vanishes exactly are its moments over a step.
    """
    found: dict[str, float] = {}
    for group in groups:
        if not isinstance(group, ContactGroup):
            continue
        levels = problem.levels[group.name]
        local = group.sliding(levels.q.x.array, levels.rates["v"].x.array)
        for name, line in zip(group.labels, gathered(group.nodes, local).tolist(), strict=True):
            slip, _, *track, _ = line
            for column, value in zip(("track1", "track2", "slip"), (*track, slip), strict=True):
                found[f"{name}.{column}"] = value
    return found


def refuse_slip(groups: Sequence[JointGroup], q: Functions, v: Functions) -> None:
    """See that nothing slips in the velocities given; collective.

    Args:
        groups: Groups of joints.
        q: States by their names.
        v: Velocities.

    Raises:
        SceneError: If a contact slips; names it.
    """
    for group in groups:
        if not isinstance(group, ContactGroup):
            continue
        found = group.sliding(q[group.name].x.array, v[group.name].x.array)[:, :2]
        wrong = [
            (int(item), float(slip))
            for item, (slip, speed) in zip(group.nodes.item, found, strict=True)
            if slip > SLIPPING * speed
        ]
        every = sorted(set(itertools.chain(*group.nodes.mesh.comm.allgather(wrong))))
        if every:
            item, slip = every[0]
            raise SceneError(
                f"{group.joints[item].joint.said}: it slips with {slip:.3g} m/s at the start; give "
                "initial velocities without slip (a wheel's spin is its speed over its radius), or "
                "assemble=True to begin with the nearest ones"
            )
