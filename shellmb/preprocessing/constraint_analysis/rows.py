"""The constraints of a model as rows of a matrix, by the unknowns they tie, at a state."""

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
# constraints whose combinations of unit size are larger than that are clearly independent
CLEAR = 0.01


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
        numbers, dofs = unknowns.numbers[body.name], body.mixed.dofs
        w = numbers[dofs["w"]].reshape(reference.shape)
        lam = numbers[dofs["lam"]].reshape(-1, body.mixed.parts["lam"][1])
        tied = np.isin(w, touched).any(axis=1) | given.has(w).any(axis=1)
        # nodes are looked at by the rank and the body that have their multipliers
        owned = body.mixed.space.dofmap.index_map.size_local
        mine = (dofs["lam"] < owned) & ~unknowns.linked[body.name][dofs["lam"]]
        wanted = tied[:, None] & mine.reshape(lam.shape) & ~given.has(lam)
        states = _states(w, given)
        now = reference
        if at is not None:
            now = reference + at[body.name][dofs["w"]].reshape(reference.shape)
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


def looped(rows: Sequence[Row], known: Ints, sizes: Floats) -> list[Row]:
    """Rows without those that no others can imply: what is left are loops of what they tie.

    Few constraints tie a body at the end of a chain. Where they are independent by its unknowns
    alone, no combination of constraints has any of them, and without them the body before it is at
    the end. A tree of any number of bodies has none left.

    Args:
        rows: The constraints.
        known: Numbers of all unknowns that they tie, ascending.
        sizes: How far these move in motions of one size.
    """
    places = [np.searchsorted(known, row.columns) for row in rows]
    entries = [row.entries * sizes[place] for row, place in zip(rows, places, strict=True)]
    node = _components([p for row, p in zip(rows, places, strict=True) if row.inner], len(known))
    nodes = [set(node[place].tolist()) for place in places]
    ties: dict[int, set[int]] = {n: set() for n in range(len(known))}
    for number, some in enumerate(nodes):
        for n in some:
            ties[n].add(number)
    ends = np.cumsum(np.bincount(node, minlength=len(known)))[:-1]
    columns = np.split(np.argsort(node, kind="stable"), ends)
    queue, left = list(ties), set(range(len(rows)))
    while queue:
        n = queue.pop()
        own = columns[n]
        if not 0 < len(ties[n]) <= len(own):
            continue
        block = np.zeros((len(ties[n]), len(own)))
        for part, number in zip(block, ties[n], strict=True):
            here = node[places[number]] == n
            part[np.searchsorted(own, places[number][here])] = entries[number][here]
            part /= np.linalg.norm(entries[number])
        if np.linalg.svd(block, compute_uv=False)[-1] > CLEAR:
            for number in list(ties[n]):
                left.discard(number)
                for other in nodes[number]:
                    ties[other].discard(number)
                    queue.append(other)
    return [rows[number] for number in sorted(left)]


def connected(rows: Sequence[Row], known: Ints) -> Iterator[list[Row]]:
    """Rows by what they tie together; the order is kept within each part.

    Args:
        rows: The constraints.
        known: Numbers of all unknowns that they tie, ascending.
    """
    places = [np.searchsorted(known, row.columns) for row in rows]
    part = _components(places, len(known))
    parts: dict[int, list[Row]] = {}
    for number, (row, place) in enumerate(zip(rows, places, strict=True)):
        # one that ties nothing is a part by itself
        parts.setdefault(part[place[0]] if len(place) else -1 - number, []).append(row)
    yield from parts.values()


def _components(places: Sequence[Ints], size: int) -> Ints:
    """Of each unknown one of those that it is tied to, the same for all of them."""
    above = list(range(size))

    def end_of(k: int) -> int:
        while above[k] != k:
            above[k] = k = above[above[k]]
        return k

    for first, *others in (place.tolist() for place in places if len(place)):
        for other in others:
            above[end_of(other)] = end_of(first)
    return np.array([end_of(k) for k in range(size)], dtype=int)
