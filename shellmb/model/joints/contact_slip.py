"""Slip of contacts by the motion of the bodies alone: for results, and at the start."""

import itertools
from collections.abc import Mapping, Sequence

from mpi4py import MPI

import numpy as np
from dolfinx import fem

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.model.joints.columns import Solution
from shellmb.model.joints.joints import BoundJoint, JointGroup
from shellmb.model.joints.rolling import ContactGroup

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
    return np.zeros(3) if "Q" not in group.own else -size * group.coordinate("Q", row, q)[2::3]


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
        values = np.zeros((len(group.joints), 3))
        mine = group.nodes.mesh.topology.index_map(1).size_local
        slips = sliding(group, q, v)[:, 0]
        for row, item in enumerate(group.nodes.item[:mine]):
            values[item] = *group.coordinate("y", row, q), slips[row]
        group.nodes.mesh.comm.Allreduce(MPI.IN_PLACE, values)
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
