"""The constraints of a model as rows of a matrix, by the unknowns they tie, at a state."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.forms.frame import PAIRS
from shellmb.model.body import Body
from shellmb.model.locations.nodes import said_point
from shellmb.model.model import Model
from shellmb.model.unknowns import Given, Unknowns

# an entry below this part of a constraint's largest one is round-off of the difference
ZERO = 1e-9


@dataclass(frozen=True)
class Row:
    """A constraint on velocities.

    Args:
        body: Name of the body of the system that has its multiplier.
        item: Which node or item of it.
        component: Which constraint of that.
        owner: Whose it is, for messages.
        inner: Whether it keeps directors of unit length or frames orthonormal.
        multiplier: Number of its multiplier.
        columns: Numbers of the unknowns it ties that are not given.
        entries: Its derivatives along them.
        rate: What they have to add up to, because of rates that are given.
        gap: By how much given values violate it, where nothing else is tied; infinite where what
            is free changes it to second order only.
        void: Whether it ties a place to itself: nothing, whatever is given.
    """

    body: str
    item: int
    component: int
    owner: str
    inner: bool
    multiplier: int
    columns: Ints
    entries: Floats
    rate: float
    gap: float
    void: bool


def local_rows(
    model: Model, unknowns: Unknowns, given: Given, at: Mapping[str, Floats] | None = None
) -> list[Row]:
    """Constraints of this rank's items that act: of joints, kinks, planes and glued nodes.

    Args:
        model: The bodies.
        unknowns: Their unknowns.
        given: Which of them are given.
        at: Local arrays of their states, by name; None: the reference.
    """
    rows = []
    for body in model.constraint_groups:
        numbers, local = unknowns.numbers[body.name], body.nodes.mesh.topology.index_map(1)
        gradients, dofs, sizes = body.gradients(model.length, None if at is None else at[body.name])
        gaps = body.gaps(_states(numbers, given))
        mu = numbers[body.mixed.dofs["mu"]].reshape(-1, body.count)
        for cell, component in np.argwhere(body.acting[: local.size_local]):
            item = int(body.nodes.item[cell])
            label = body.labels[item]
            whose = (body.name, item, int(component), label, False, int(mu[cell, component]))
            entries, gap = gradients[cell, component], float(gaps[cell, component])
            gap /= body.sizes[component]
            rows.append(_row(whose, numbers[dofs[cell]], entries, sizes, given, gap))
    return rows


def inner_rows(
    model: Model,
    unknowns: Unknowns,
    given: Given,
    touched: Ints,
    at: Mapping[str, Floats] | None = None,
) -> list[Row]:
    """Directors of unit length and orthonormal frames at this rank's nodes that others tie.

    Args:
        model: The bodies.
        unknowns: Their unknowns.
        given: Which of them are given.
        touched: Unknowns that other constraints tie.
        at: Local arrays of their states, by name; None: the reference.
    """
    rows = []
    for body in model.bodies:
        reference = body.manifold.directors
        if reference is None:
            continue
        numbers = unknowns.numbers[body.name]
        w = numbers[body.mixed.dofs["w"]].reshape(reference.shape)
        lam = numbers[body.mixed.dofs["lam"]].reshape(-1, body.mixed.parts["lam"][1])
        tied = np.isin(w, touched).any(axis=1) | given.has(w).any(axis=1)
        # nodes are looked at by the rank and the body that have their multipliers
        owned = body.mixed.space.dofmap.index_map.size_local
        mine = (body.mixed.dofs["lam"] < owned) & ~unknowns.linked[body.name][
            body.mixed.dofs["lam"]
        ]
        wanted = tied[:, None] & mine.reshape(lam.shape) & ~given.has(lam)
        states = _states(w, given)
        now = reference
        if at is not None:
            now = reference + at[body.name][body.mixed.dofs["w"]].reshape(reference.shape)
        for node, component in np.argwhere(wanted):
            D = reference[node].reshape(-1, 3)
            k, m = PAIRS[component] if len(D) == 3 else (0, 0)
            entries, here = np.zeros_like(D), now[node].reshape(-1, 3)
            entries[k] += here[m]
            entries[m] += here[k]
            d = D + states[:, node].reshape(-1, *D.shape)
            gap = np.max(np.abs(np.sum(d[:, k] * d[:, m], axis=1) - float(D[k] @ D[m])))
            free = ~given.has(w[node]).reshape(D.shape)[[k, m]]
            if free.any() and not np.any(entries[[k, m]][free]):
                # held along itself and free across: of second order only
                gap = np.inf
            who = (body.name, int(node), int(component), _node(model, body, int(node)), True)
            number = int(lam[node, component])
            flat = entries.ravel()
            rows.append(_row((*who, number), w[node], flat, np.ones_like(flat), given, float(gap)))
    return rows


def _node(model: Model, body: Body, node: int) -> str:
    """Name of the directors of a node in messages."""
    if model.rigid is not None and body is model.rigid:
        return f"the frame of '{model.rigid.bodies[int(model.rigid.node_mesh.item[node])].name}'"
    x = body.mixed.nodes("u")[node]
    return f"the director of '{body.name}' at {said_point(x, model.length)}"


def _states(numbers: Ints, given: Given) -> Floats:
    """Given values at all times in the place of some unknowns, zero for others."""
    flat = numbers.ravel()
    states = np.zeros((given.values.shape[1], len(flat)))
    here = given.has(flat)
    states[:, here] = given.values[given.place(flat[here])].T
    return states.reshape(len(states), *numbers.shape)


def _row(
    whose: tuple[str, int, int, str, bool, int],
    numbers: Ints,
    entries: Floats,
    sizes: Floats,
    given: Given,
    gap: float,
) -> Row:
    keep = np.abs(entries * sizes) > ZERO * np.max(np.abs(entries * sizes), initial=0.0)
    numbers, entries, sizes = numbers[keep], entries[keep], sizes[keep]
    held = given.has(numbers)
    rate = -float(entries[held] @ given.rates[given.place(numbers[held])])
    # both ends of a joint may be at one node
    columns, place = np.unique(numbers, return_inverse=True)
    sums, weights = np.zeros(len(columns)), np.zeros(len(columns))
    np.add.at(sums, place, entries)
    np.maximum.at(weights, place, sizes)
    ties = np.abs(sums * weights) > ZERO * np.max(np.abs(entries * sizes), initial=0.0)
    keep = ties & ~given.has(columns)
    return Row(*whose, columns[keep], sums[keep], rate, gap, not ties.any())


def connected(rows: Sequence[Row]) -> Iterator[list[Row]]:
    """Rows by what they tie together; the order is kept within each part."""
    above: dict[int, int] = {}

    def end_of(column: int) -> int:
        while above.setdefault(column, column) != column:
            above[column] = column = above[above[column]]
        return column

    for row in rows:
        for column in row.columns[1:]:
            above[end_of(int(column))] = end_of(int(row.columns[0]))
    parts: dict[int, list[Row]] = {}
    for row in rows:
        # one that ties nothing is a part by itself
        key = end_of(int(row.columns[0])) if len(row.columns) else -1 - row.multiplier
        parts.setdefault(key, []).append(row)
    yield from parts.values()
