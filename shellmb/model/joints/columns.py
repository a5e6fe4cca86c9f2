"""Coordinates of a mechanism, forces that act on them, and slip of contacts, as columns."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import Any, Protocol

from mpi4py import MPI

import numpy as np
from dolfinx import fem

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.model.elements.elements import ElementGroup
from shellmb.model.joints.coordinates import Coordinate, CoordinateGroup, Key
from shellmb.model.joints.joints import BoundJoint, JointGroup
from shellmb.model.joints.rolling import ContactGroup
from shellmb.model.joints.switches import HeldCoordinates, TiedCoordinates
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

    def time(self, name: str) -> fem.Constant:
        """Time at the middle of the step."""
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


def lock_forces(problem: Solution, group: HeldCoordinates) -> dict[str, float]:
    """Torques and forces by which locks hold their coordinates, 0 while they are open; collective.

    Means over the step just solved, as those of drivers.
    """
    names = [f"{c.joint}.lock_{EFFORT[c.kind]}" for c in group.coordinates]
    return summed(names, group.forces(problem.state(group.name)))


def coupling_forces(problem: Solution, group: TiedCoordinates) -> dict[str, float]:
    """Torques and forces that couplings exert on their coordinates; collective.

    Means over the step just solved, as those of drivers.
    """
    forces = group.forces(problem.state(group.name))
    return {
        f"{name}.{c.joint}.{EFFORT[c.kind]}": float(force)
        for name, members, row in zip(group.labels, group.members, forces, strict=True)
        for c, force in zip(members, row, strict=True)
    }


Functions = Mapping[str, fem.Function]

# slip at the start of what was to roll, as a part of the speeds that it is the difference of
SLIPPING = 1e-6


def sliding(group: ContactGroup, q: Floats, v: Floats) -> Floats:
    """Speed of slip and what it is the difference of, from the bodies' motion alone, m/s.

    Args:
        group: The group.
        q: State of the group.
        v: Velocities.

    Returns:
        For each local cell both, shape (n, 2).
    """
    found = np.zeros((len(group.nodes.item), 2))
    for row, item in enumerate(group.nodes.item):
        contact = group.joints[item]
        (_, e), _ = (_moved(group, contact, k, row, q) for k in range(2))
        (va, de), (vb, dd) = (_moved(group, contact, k, row, v) for k in range(2))
        under = va + group.coordinate("y", row, q) @ de[:2]
        rolled = _arm(group, row, q, contact.length) @ dd
        slip = (contact.axes[0] + e)[:2] @ (vb + rolled - under)
        if group.kind == "knife edge":
            t = group.heading(row, q)
            slip = np.array([t[0] * slip[1] - t[1] * slip[0]]) / np.linalg.norm(t)
        speeds = (np.linalg.norm(part) for part in (vb, rolled, under))
        found[row] = np.linalg.norm(slip), sum(speeds)
    return found


def _moved(
    group: ContactGroup, contact: BoundJoint, k: int, row: int, q: Floats
) -> tuple[Floats, Floats]:
    """Displacement of a place and changes of its vectors as rows, or their rates."""
    end, (u, w) = contact.ends[k], group.ends[k].parts
    there = q[group.mixed.dofs[u].reshape(-1, 3)[row]]
    turned = q[group.mixed.dofs[w].reshape(-1, 9)[row]].reshape(3, 3)
    return there + end.offset @ turned, contact.axes[k] @ end.directors.T @ turned


def _arm(group: ContactGroup, row: int, q: Floats, size: float) -> Floats:
    """From the second place to the point of contact, in the vectors of that place, m."""
    if group.kind == "wheel":
        return size * np.append(group.coordinate("r", row, q), 0.0)
    return (
        np.zeros(3)
        if "Q" not in group.equations.parts
        else -size * group.coordinate("Q", row, q)[2::3]
    )


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
        q, v = levels.q.x.array, levels.rates["v"].x.array
        slips = sliding(group, q, v)[:, 0]
        local = [[*group.coordinate("y", row, q), slip] for row, slip in enumerate(slips)]
        values = gathered(group.nodes, np.array(local).reshape(-1, 3))
        for name, line in zip(group.labels, values, strict=True):
            for column, value in zip(("track1", "track2", "slip"), line, strict=True):
                found[f"{name}.{column}"] = float(value)
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
        found = sliding(group, q[group.name].x.array, v[group.name].x.array)
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
