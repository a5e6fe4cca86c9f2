"""Coordinates of a mechanism and the forces that act on them, as columns of the history."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

from mpi4py import MPI

import numpy as np
from dolfinx import fem

from shellmb.arrays import Floats
from shellmb.model.elements.elements import ElementGroup
from shellmb.model.joints.coordinates import Coordinate, CoordinateGroup, Key, gathered
from shellmb.model.joints.linear import HeldCoordinates, TiedCoordinates
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
