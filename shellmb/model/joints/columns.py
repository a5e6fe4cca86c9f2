"""Coordinates of a mechanism, forces that act on them, and slip of contacts, as columns."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import Any

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

# how the values of coordinates are called in results
COLUMN = {"rotation": "rotation", "translation": "translation", "distance": "length"}


def read_coordinates(
    problem: Any, groups: Sequence[CoordinateGroup]
) -> tuple[dict[Key, float], dict[Key, float]]:
    """Changes of all coordinates and their rates; collective."""
    values: dict[Key, float] = {}
    rates: dict[Key, float] = {}
    for group in groups:
        x = group.gathered("x", problem.state(group.name).x.array)[:, 0]
        v = np.zeros_like(x)
        if "v" in problem.scheme.rates:
            v = group.gathered("x", problem.levels[group.name].rates["v"].x.array)[:, 0]
        for found, each in ((values, x), (rates, v)):
            items = zip(group.coordinates, each.tolist(), strict=True)
            found |= {(item.name, item.kind): value for item, value in items}
            found |= means(group, each)
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


def drive(problem: Any, coordinate: Coordinate) -> float:
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


def element_columns(group: ElementGroup, forces: Floats) -> dict[str, float]:
    """Forces of the elements of a group, shape (items,), by their columns: sums of equal ones."""
    return summed([f"{i.element.name}.{i.coordinate.effort}" for i in group.items], forces)


def summed(names: Sequence[str], values: Floats) -> dict[str, float]:
    """Values by name, those of the same name added up."""
    found: dict[str, float] = {}
    for name, value in zip(names, values.tolist(), strict=True):
        found[name] = found[name] + value if name in found else value
    return found


def tie_forces(problem: Any, group: TiedCoordinates) -> dict[str, float]:
    """Torques and forces that locks and couplings exert on their coordinates; collective.

    Means over the step just solved, as those of drivers. While locks are open they are 0.

    Args:
        problem: The problem, a step of which is accepted.
        group: The locks or couplings.
    """
    forces = group.forces(problem.state(group.name)).ravel()
    each = zip(group.labels, group.members, strict=True)
    return summed([group.column(label, c) for label, members in each for c in members], forces)


Functions = Mapping[str, fem.Function]

# slip at the start of what was to roll, as a part of the speeds that it is the difference of
SLIPPING = 1e-6


def read_contacts(problem: Any, groups: Sequence[JointGroup]) -> dict[str, float]:
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


def refuse_slip(groups: Sequence[ContactGroup], q: Functions, v: Functions) -> None:
    """See that nothing slips in the velocities given; collective.

    Args:
        groups: Groups of contacts.
        q: States by their names.
        v: Velocities.

    Raises:
        SceneError: If a contact slips; names it.
    """
    for group in groups:
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
