"""Redundant and contradictory constraints, found before anything is built and named.

Supports, drivers, joins, glued nodes and joints are one set of constraints. Those on velocities,
`Dg v = 0`, are the rows of a matrix, of which unknowns that supports and drivers give are no
columns. Going through the rows in the order of the scene, one that is a combination of those before
it is redundant; if the same combination of the right-hand sides is not zero, it contradicts them.
"""

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from dolfinx import fem

from shellmb.arrays import Floats, Ints
from shellmb.errors import SceneError
from shellmb.model.body import FixedDofs
from shellmb.model.joints.constraints import ConstraintGroup
from shellmb.model.model import Model
from shellmb.model.unknowns import Unknowns
from shellmb.preprocessing.constraint_analysis import rows as tied
from shellmb.scene.lookup import listed

# a row whose part outside the rows before it is below this fraction of it counts as dependent:
# far above round-off, far below the angle between independent constraints of a sound mechanism
DEPENDENT = 1e-8
CONTRADICTION = 1e-6
# below this it is nearly so: of a parallelogram of rods, within a thousandth of a radian of its
# change point, from where steps may fail
SINGULAR = 1e-3
# share of a row in a combination above which it counts as a part of it
INVOLVED = 1e-6
# step of the difference that gives rates at the start, in steps of the scene
RATE_STEP = 1e-3
# prescribed motions are compared at that many times
TIMES = 17


@dataclass(frozen=True)
class Redundant:
    """A constraint that the ones before it imply.

    Args:
        row: The constraint.
        with_: Whose constraints imply it, besides what supports and drivers prescribe.
        contradicts: Whether it demands another motion than they do.
        apart: Its part that is no combination of theirs.
    """

    row: tied.Row
    with_: tuple[str, ...]
    contradicts: bool
    apart: float


def look_through(model: Model) -> list[Redundant]:
    """Leave out what other constraints of the model imply; collective.

    What joints have too many is left out if the scene says so; what joins and glued nodes have is
    left out always, because no results depend on which of them carries the force.

    Args:
        model: The bodies; dropped constraints get multipliers of zero.

    Returns:
        What was left out.

    Raises:
        SceneError: If constraints contradict one another, or joints have redundant ones and the
            scene does not drop them; names them.
    """
    scene = model.scene
    unknowns = Unknowns(model.bodies, model.comm)
    times = np.linspace(0.0, scene.given_until, TIMES)
    redundant = _all_dependent(model, unknowns, times.tolist())
    refuse(model, redundant)
    _drop(model, unknowns, redundant)
    return redundant


def singular(model: Model, at: Mapping[str, Floats]) -> str:
    """Say which constraints nearly depend on one another at a state; collective.

    Args:
        model: The bodies, looked through.
        at: Local arrays of their states, by name.

    Returns:
        Which constraint, on which others, and how nearly, in words; empty where none does.
    """
    found = _all_dependent(model, Unknowns(model.bodies, model.comm), [0.0], at, SINGULAR)
    joints = {body.name for body in model.mechanism.bodies}
    found = [item for item in found if item.row.body in joints and item.with_]
    if not found:
        return ""
    worst = min(found, key=lambda item: item.apart)
    return (
        f"a constraint of '{worst.row.owner}' nearly depends on those of {listed(worst.with_)} "
        f"(its part that does not is {worst.apart:.1e})"
    )


def _all_dependent(
    model: Model,
    unknowns: Unknowns,
    times: list[float],
    at: Mapping[str, Floats] | None = None,
    bound: float = DEPENDENT,
) -> list[Redundant]:
    """Constraints that those before them imply; collective.

    Args:
        model: The bodies.
        unknowns: Their unknowns.
        times: When prescribed motions are compared, s.
        at: Local arrays of their states, by name; None: the reference.
        bound: Part of a constraint outside of those before it that counts as none.
    """
    given = unknowns.given(times, RATE_STEP * model.scene.dt)
    rows = tied.local_rows(model, unknowns, given, at)
    everywhere = model.comm.allgather(np.unique(_columns(rows)))
    inner = tied.inner_rows(model, unknowns, given, np.unique(np.concatenate(everywhere)), at)
    everywhere = model.comm.allgather(np.unique(_columns([*inner, *rows])))
    columns = np.unique(np.concatenate(everywhere))
    sizes = unknowns.sizes(columns)
    gathered = model.comm.gather((inner, rows))
    found = None
    if gathered is not None:
        every = [row for part in gathered for row in part[0]]
        every += sorted((row for part in gathered for row in part[1]), key=_order(model))
        parts = tied.connected(tied.looped(every, columns, sizes), columns)
        found = [item for part in parts for item in _dependent(part, columns, sizes, bound)]
    return model.comm.bcast(found) or []


def _columns(rows: list[tied.Row]) -> Ints:
    return np.concatenate([np.zeros(0, dtype=np.int64), *(row.columns for row in rows)])


def _order(model: Model) -> Callable[[tied.Row], tuple[int, int, str, int, int]]:
    """Key that sorts constraints: inside bodies, of joints, of their coordinates, as in a scene."""
    joints = {name: k for k, name in enumerate(model.mechanism.joints)}
    mechanism = {body.name for body in model.mechanism.bodies}

    def key(row: tied.Row) -> tuple[int, int, str, int, int]:
        kind = 0 if row.body not in mechanism else 1 if row.owner in joints else 2
        # what drives, locks or pitches a joint has its name before the last dot
        joint = row.owner if kind < 2 else row.owner.rpartition(".")[0]
        return kind, joints.get(joint, len(joints)), row.owner, row.item, row.component

    return key


def _dependent(
    rows: list[tied.Row], known: Ints, sizes: Floats, bound: float = DEPENDENT
) -> list[Redundant]:
    """Find which rows are combinations of those before; `sizes` of all `known` columns.

    By motions relative to the size of bodies: what depends on what is no question of units.
    """
    columns = np.unique(_columns(rows))
    # orthonormal combinations of the rows kept: vectors, right-hand sides, what each is made of
    size = min(len(rows), len(columns))
    basis, sides = np.zeros((size, len(columns))), np.zeros(size)
    made_of = np.zeros((size, len(rows)))
    kept: list[int] = []
    found = []
    for number, row in enumerate(rows):
        entries = row.entries * sizes[np.searchsorted(known, row.columns)]
        n, length = len(kept), float(np.linalg.norm(entries))
        if not length:
            # all that it ties is given
            found.append(Redundant(row, (), row.gap > CONTRADICTION, 0.0))
            continue
        vector, side, combination = np.zeros(len(columns)), row.rate / length, np.zeros(len(rows))
        vector[np.searchsorted(columns, row.columns)] = entries / length
        combination[number] = 1.0
        for _ in range(2):
            # twice is enough: the second pass removes the round-off of the first
            shares = basis[:n] @ vector
            vector -= shares @ basis[:n]
            side -= float(shares @ sides[:n])
            combination -= shares @ made_of[:n]
        rest = float(np.linalg.norm(vector))
        if rest >= bound:
            basis[n], sides[n], made_of[n] = vector / rest, side / rest, combination / rest
            kept.append(number)
            continue
        others = [rows[k] for k in kept if abs(combination[k]) > INVOLVED]
        names = {other.owner for other in others if not other.inner} - {row.owner}
        scale = max(np.max(np.abs(sides[:n]), initial=0.0), abs(row.rate) / length, 1e-300)
        contradicts = bool(abs(side) > CONTRADICTION * scale)
        found.append(Redundant(row, tuple(sorted(names)), contradicts, rest))
    return found


def refuse(model: Model, redundant: list[Redundant]) -> None:
    """Refuse constraints that contradict others, and redundant ones unless they are dropped.

    Args:
        model: The bodies.
        redundant: What was found.

    Raises:
        SceneError: Names the joints.
    """
    scene, joints = model.scene, {body.name for body in model.mechanism.bodies}
    # what implies constraints that no other constraint does
    givers = ["the supports"] * bool(scene.supports) + ["the drivers"] * bool(scene.drivers)
    given = " and ".join(givers) or "the rigidity of its bodies"
    for item in redundant:
        row = item.row
        if row.inner and np.isinf(row.gap):
            raise SceneError(
                f"{row.owner} is fixed along its own direction by a support, and by its unit "
                "length too; fix all three components, or the two normal to it"
            )
        if item.contradicts:
            who = f"joint '{row.owner}'" if row.body in joints else row.owner
            others = " and ".join(f"'{name}'" for name in item.with_) or given
            raise SceneError(
                f"{who}: its motion contradicts {others}: no velocities satisfy them all; remove "
                "one of the drivers, supports or joints"
            )
    # hinges of edges leave out by themselves what supports and, at corners, one another imply
    hinges = {j.name: j for j in scene.joints if j.along_edges}
    left = [item for item in redundant if item.row.owner not in hinges]
    for hinge in hinges.values():
        mine = [item for item in redundant if item.row.owner == hinge.name]
        if _beyond_a_corner([item.row for item in mine if item.row.void]):
            raise SceneError(
                f"{hinge.said} cannot turn: the edges of '{hinge.first}' and '{hinge.second}' are "
                "joined there; remove the join or the hinge"
            )
        held = [item for item in mine if item.with_]
        if _beyond_a_corner([item.row for item in held]):
            left += held
    ours = [item for item in left if item.row.body in joints]
    if ours and scene.redundant != "drop":
        counts = Counter(item.row.owner for item in ours)
        words = ", ".join(f"{n} of joint '{name}'" for name, n in counts.items())
        names = {repr(name) for item in ours for name in item.with_ if name not in counts}
        implied = sorted(names) + [given] * any(not item.with_ for item in ours)
        raise SceneError(
            f"{len(ours)} of the constraints are redundant: {words}"
            + (f" (implied by {', '.join(implied)})" if implied else "")
            + "; use joints with fewer constraints, or redundant='drop'"
        )


def _beyond_a_corner(rows: list[tied.Row]) -> bool:
    """Decide whether rows of a hinge hold neighbouring nodes, and not single ones at its ends."""
    counts = Counter(row.item for row in rows)
    whole = [item for item, count in counts.items() if count == 3]
    return any(item + 1 in whole for item in whole)


def _drop(model: Model, unknowns: Unknowns, redundant: list[Redundant]) -> None:
    """Hold the multipliers of redundant constraints at zero."""
    multipliers = [item.row.multiplier for item in redundant if item.row.inner]
    groups = {group.name: group for group in model.constraint_groups}
    for item in redundant:
        if item.row.body in groups:
            groups[item.row.body].drop(item.row.item, item.row.component)
    for body in model.bodies:
        if "lam" in body.mixed.parts:
            lam = body.mixed.dofs["lam"]
            idle = lam[np.isin(unknowns.numbers[body.name][lam], multipliers)]
            if len(idle):
                body.fixed.append(FixedDofs(idle))


def largest_gap(model: Model, q: Mapping[str, fem.Function]) -> tuple[float, str, str]:
    """The constraint with the largest violation; collective.

    Args:
        model: The bodies.
        q: Their states by name.

    Returns:
        The violation, relative to the scene's length, or of directions; whose it is; the violation
        in words.
    """
    found = [worst_of(group, group.apart(q[group.name])) for group in model.constraint_groups]
    return max(model.comm.allgather(max(found, default=(0.0, "", ""))))


def worst_of(group: ConstraintGroup, values: Floats) -> tuple[float, str, str]:
    """The largest violation among some of a group; as of `largest_gap`, on this rank.

    Args:
        group: The group.
        values: The violations, shape (nodes, constraints).
    """
    if not values.any():
        return 0.0, "", ""
    row, component = np.unravel_index(np.argmax(values), values.shape)
    apart = float(values[row, component])
    return apart, group.labels[int(group.nodes.item[row])], group.said(int(component), apart)
