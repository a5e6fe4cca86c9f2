"""Redundant and contradictory constraints, found before the first step and named joint by joint.

The constraints on velocities, `Dg v = 0`, are the rows of a matrix. Going through them in the order
of the scene, one that is a combination of those before it is redundant; if the same combination of
the right-hand sides is not zero, it contradicts them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from dolfinx import fem

from shellmb.errors import SceneError
from shellmb.model.constraints import ConstraintGroup
from shellmb.model.model import Model
from shellmb.simulate.consistent import VelocityProjection

Floats = npt.NDArray[np.float64]

# a row whose part outside the rows before it is below this fraction of it counts as dependent:
# far above round-off, far below the angle between independent constraints of a sound mechanism
DEPENDENT = 1e-8
CONTRADICTION = 1e-6
# share of a row in a combination above which it counts as a part of it
INVOLVED = 1e-6


@dataclass(frozen=True)
class Redundant:
    """A constraint that the ones before it imply.

    Args:
        joint: What it belongs to.
        component: Which of the joint's constraints.
        with_: The joints that imply it.
        contradicts: Whether it demands another velocity than they do.
    """

    joint: str
    component: int
    with_: tuple[str, ...]
    contradicts: bool


@dataclass(frozen=True)
class _Row:
    """A constraint: whose it is, and its entries by column."""

    owner: str
    component: int
    joint: bool
    columns: npt.NDArray[np.int64]
    entries: Floats
    rhs: float


def find_redundant(model: Model, projection: VelocityProjection) -> list[Redundant]:
    """Dependent constraints between bodies; collective, the same on all ranks.

    Args:
        model: The bodies.
        projection: The system of their velocities, at the state to look at.
    """
    mine = _rows(model, projection)
    gathered = model.comm.gather(mine)
    found = None
    if gathered is not None:
        found = _dependent([row for part in gathered for row in part], _order(model))
    return model.comm.bcast(found) or []


def _order(model: Model) -> dict[str, int]:
    return {name: k for k, name in enumerate(model.mechanism.joints)}


def _rows(model: Model, projection: VelocityProjection) -> list[_Row]:
    """Rows of the multipliers that this rank owns."""
    system = projection.system
    n = system.numbering
    projection.take_given()
    system.gather()
    system.update_fixed_values()
    system.scatter(system.x)
    system.jacobian(system.x, system.A)
    held = np.zeros(n.owned, dtype=bool)
    held[system.fixed] = True
    # velocities that are given: what they contribute is the right-hand side
    everywhere = model.comm.allgather((n.start + system.fixed, system._values[system.fixed]))
    given = {int(k): float(v) for ks, vs in everywhere for k, v in zip(ks, vs, strict=True)}
    multipliers = _multipliers(model, projection)
    rows = []
    for number, (owner, component, joint) in multipliers.items():
        if held[number - n.start]:
            continue
        columns, entries = system.A.getRow(number)
        keep = entries != 0
        columns, entries = columns[keep].astype(np.int64), entries[keep]
        free = np.array([int(c) not in given and int(c) != number for c in columns], dtype=bool)
        rhs = -sum(
            e * given[int(c)] for c, e in zip(columns, entries, strict=True) if int(c) in given
        )
        if np.any(free):
            rows.append(_Row(owner, component, joint, columns[free], entries[free], float(rhs)))
    return rows


def _multipliers(model: Model, projection: VelocityProjection) -> dict[int, tuple[str, int, bool]]:
    """Owner, component and whether it is a joint's, of each multiplier on this rank."""
    n, found = projection.system.numbering, {}
    for k, body in enumerate(model.bodies):
        part = next((p for p in ("mu", "lam") if p in body.mixed.parts), None)
        if part is None:
            continue
        size = body.mixed.parts[part][1]
        numbers = n.by_field[k][body.mixed.dofs[part]].reshape(-1, size)
        names = _names(body, len(numbers))
        joint = isinstance(body, ConstraintGroup)
        for name, row in zip(names, numbers, strict=True):
            for component, number in enumerate(row):
                if n.start <= number < n.start + n.owned:
                    found[int(number)] = (name, component, joint)
    return found


def _names(body: object, count: int) -> list[str]:
    """Name of the owner of each node's multipliers."""
    if isinstance(body, ConstraintGroup):
        labels = body.labels
        return [labels[int(item)] for item in body.nodes.item]
    return [str(getattr(body, "name", ""))] * count


def _dependent(rows: list[_Row], order: dict[str, int]) -> list[Redundant]:
    joints = [row for row in rows if row.joint]
    touched = np.unique(np.concatenate([row.columns for row in joints] or [np.zeros(0, int)]))
    # of the constraints inside bodies only those at nodes of joints matter
    inside = [r for r in rows if not r.joint and np.isin(r.columns, touched).any()]
    joints.sort(key=lambda row: (order.get(row.owner, len(order)), row.owner, row.component))
    rows = inside + joints
    columns = np.unique(np.concatenate([row.columns for row in rows] or [np.zeros(0, int)]))
    # orthonormal combinations of the rows kept: vectors, right-hand sides, what each is made of
    size = min(len(rows), len(columns))
    basis, sides = np.zeros((size, len(columns))), np.zeros(size)
    made_of = np.zeros((size, len(rows)))
    kept: list[int] = []
    found = []
    for number, row in enumerate(rows):
        n, length = len(kept), float(np.linalg.norm(row.entries))
        vector, side, combination = np.zeros(len(columns)), row.rhs / length, np.zeros(len(rows))
        vector[np.searchsorted(columns, row.columns)] = row.entries / length
        combination[number] = 1.0
        for _ in range(2):
            # twice is enough: the second pass removes the round-off of the first
            shares = basis[:n] @ vector
            vector -= shares @ basis[:n]
            side -= float(shares @ sides[:n])
            combination -= shares @ made_of[:n]
        rest = float(np.linalg.norm(vector))
        if rest >= DEPENDENT:
            basis[n], sides[n], made_of[n] = vector / rest, side / rest, combination / rest
            kept.append(number)
            continue
        names = {rows[k].owner for k in kept if abs(combination[k]) > INVOLVED}
        with_ = tuple(sorted(name for name in names - {row.owner} if name in order))
        scale = max(np.max(np.abs(sides[:n]), initial=0.0), abs(row.rhs) / length, 1e-300)
        contradicts = bool(abs(side) > CONTRADICTION * scale)
        found.append(Redundant(row.owner, row.component, with_, contradicts))
    return found


def refuse(redundant: list[Redundant], drop: bool) -> None:
    """Refuse constraints that contradict others, and redundant ones unless they are dropped.

    Args:
        redundant: What was found.
        drop: Whether redundant but consistent constraints are dropped.

    Raises:
        SceneError: Names the joints.
    """
    for item in redundant:
        others = " and ".join(f"'{name}'" for name in item.with_) or "the other constraints"
        if item.contradicts:
            raise SceneError(
                f"joint '{item.joint}': its motion contradicts {others}: no velocities satisfy "
                "them all; take one of the drivers or joints away"
            )
    if redundant and not drop:
        counts: dict[str, int] = {}
        for item in redundant:
            counts[item.joint] = counts.get(item.joint, 0) + 1
        said = ", ".join(f"{n} of joint '{name}'" for name, n in counts.items())
        implied = sorted({name for item in redundant for name in item.with_} - counts.keys())
        raise SceneError(
            f"{len(redundant)} of the constraints are redundant: {said}"
            + (f" (implied by {', '.join(repr(n) for n in implied)})" if implied else "")
            + "; use joints with fewer constraints, or redundant='drop'"
        )


def largest_gap(model: Model, q: Mapping[str, fem.Function]) -> tuple[str, float]:
    """The constraint with the largest violation, relative to the scene's length; collective."""
    worst = ("", 0.0)
    for body in model.bodies:
        if not isinstance(body, ConstraintGroup):
            continue
        values = np.abs(body.violations(q[body.name]))
        for item, value in zip(body.nodes.item, values.max(axis=1, initial=0.0), strict=True):
            if value / model.length > worst[1]:
                worst = (body.labels[int(item)], float(value) / model.length)
    gathered = model.comm.allgather(worst)
    return max(gathered, key=lambda pair: pair[1])
