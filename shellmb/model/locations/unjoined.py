"""Shells that touch along edges where nothing connects them: mostly a join that was forgotten."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Mapping
from itertools import combinations
from typing import Any

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Bools, Floats
from shellmb.errors import warn
from shellmb.model.locations.nodes import ON_NODE, local_nodes
from shellmb.model.shells.shell import ShellModel
from shellmb.scene import Contact, Scene
from shellmb.scene.multibody.joints import GROUND, EdgeHinge
from shellmb.scene.values.validate import edge_names

type Sets = dict[Hashable, Hashable]


def doubt_unjoined(scene: Scene, comm: MPI.Comm, meshes: Mapping[str, Any]) -> None:
    """Warn of shells with an edge on another shell that nothing connects there; collective.

    What moves against one another may touch: shells that joints, springs, contacts or glued beams
    connect, directly or by other bodies, are not meant, nor are edges that are both supported.

    Args:
        scene: The scene as it is described.
        comm: Communicator.
        meshes: Shells and beams by name, those that are rigid among them.
    """
    shells = {n: _Shell(m) for n, m in meshes.items() if isinstance(m, ShellModel)}
    if comm.rank != 0 or len(shells) < 2:
        return
    at_edges, joined, linked, pairs = _connections(scene)
    held = {
        (body.name, edge)
        for support in scene.supports
        for body in scene.bodies_of(support)
        for edge in _named(getattr(support, "at", None))
    }
    for a, b in combinations(shells, 2):
        apart = _end(joined, a) != _end(joined, b) and _end(linked, a) == _end(linked, b)
        if frozenset({a, b}) in pairs or apart:
            continue
        for one, other in ((a, b), (b, a)):
            found = next(_touching(one, shells[one], other, shells[other], at_edges, held), None)
            if found is not None:
                mine, theirs = found
                there = f"and '{theirs}'" if theirs else f"of '{one}'"
                how = (
                    f"Join({one!r}, {other!r}, {mine!r}, {theirs!r}), an EdgeHinge"
                    if theirs
                    else f"a Join along edges, for which '{other}' must be split there"
                )
                warn(
                    f"shells '{one}' and '{other}' touch along '{mine}' {there}, and nothing "
                    f"connects them there; connect them, as by {how}, another joint or a Contact, "
                    "or leave a gap"
                )
                break


class _Shell:
    """Nodes of a shell and of its edges, of all ranks; collective.

    Args:
        model: The shell.
    """

    def __init__(self, model: ShellModel) -> None:
        self.close = 2 * ON_NODE * model.surface_mesh.length
        every = model.mixed.nodes("u")
        owned = np.arange(len(every)) < model.mixed.subspaces["u"].dofmap.index_map.size_local
        comm = model.domain.mesh.comm

        def gathered(nodes: Any) -> Floats:
            return np.concatenate(comm.allgather(every[nodes[owned[nodes]]]))

        self.nodes = gathered(np.arange(len(every)))
        edges = {e: gathered(local_nodes(model, e, "edges")) for e in model.surface_mesh.edges}
        # a pole is no edge
        self.edges = {e: x for e, x in edges.items() if len(x) > 2 and np.ptp(x, axis=0).max() > 0}


def _touching(
    one: str, a: _Shell, other: str, b: _Shell, at_edges: Sets, held: set[tuple[str, str]]
) -> Iterator[tuple[str, str | None]]:
    """Edges of a shell on another one where neither joins nor supports hold them together."""
    close = max(a.close, b.close)
    low, high = b.nodes.min(axis=0) - close, b.nodes.max(axis=0) + close
    inside = {e: x for e, x in a.edges.items() if ((x >= low) & (x <= high)).all()}
    along = {e: [f for f, y in b.edges.items() if _on_edge(x, y, close)] for e, x in inside.items()}
    if len(a.edges) > 2 and all(map(along.get, a.edges)):
        # a shell that lies on another one altogether is a copy of it
        return
    for edge, x in inside.items():
        if not along[edge] and not _near(x, b.nodes, close).all():
            continue
        ends = [_end(at_edges, (other, f)) for f in along[edge]]
        supported = (one, edge) in held and any((other, f) in held for f in along[edge])
        if not supported and _end(at_edges, (one, edge)) not in ends:
            yield edge, next(iter(along[edge]), None)


def _near(x: Floats, y: Floats, close: float) -> Bools:
    """Decide which places are nodes of a shell."""
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(y).query(x)[0] <= close)


def _on_edge(x: Floats, y: Floats, close: float) -> bool:
    """Decide whether places lie on an edge with these nodes, one of them at a node."""
    from scipy.spatial import cKDTree

    distance, near = cKDTree(y).query(x, k=3)
    if not (distance[:, 0] <= close).any():
        return False
    a, b, c = (y[near[:, k]] for k in range(3))
    # an edge that is curved leaves its chords by as much as the third node leaves the line
    bulge = np.minimum(_from_line(c, a, b), _from_line(b, a, c))
    away = np.minimum(_from_line(x, a, b), np.linalg.norm(x - a, axis=1))
    longest = np.linalg.norm(b - a, axis=1)
    beside = np.maximum(distance[:, 0], distance[:, 1]) <= longest * (1 + 1e-6)
    return bool(np.all((distance[:, 0] <= close) | ((away <= close + bulge) & beside)))


def _from_line(x: Floats, a: Floats, b: Floats) -> Floats:
    """Distances of places from lines through two others."""
    along = (b - a) / np.linalg.norm(b - a, axis=1, keepdims=True)
    r = x - a
    return np.linalg.norm(r - np.sum(r * along, axis=1, keepdims=True) * along, axis=1)


def _connections(scene: Scene) -> tuple[Sets, Sets, Sets, set[frozenset[str]]]:
    """Find what is connected: edges, bodies by joins, bodies by anything, pairs of bodies directly.

    Args:
        scene: The scene.
    """
    edges: Sets = {}
    joined: Sets = {}
    linked: Sets = {}
    hinges = [j for j in scene.joints if isinstance(j, EdgeHinge)]
    along: list[Any] = [*scene.joins, *hinges]
    for item in along:
        for mine in _named(item.at):
            for theirs in _named(item.second_at):
                _tie(edges, (item.first, mine), (item.second, theirs))
    for join in scene.joins:
        _tie(joined, join.first, join.second)
    ends = [(join.first, join.second) for join in scene.joins]
    direct = [(glue.beam, glue.shell) for glue in scene.glues]
    direct += [(item.first, item.second) for item in scene.joints if item not in hinges]
    elements: tuple[Any, ...] = scene.force_elements
    direct += [(e.first, e.second) for e in elements if hasattr(e, "second")]
    for contact in scene.contacts:
        direct += [(body.name, _touched(contact)) for body in scene.bodies_of(contact)]
    for first, second in (*ends, *direct, *((h.first, h.second) for h in hinges)):
        if GROUND not in (first, second):
            _tie(linked, first, second)
    return edges, joined, linked, {frozenset(pair) for pair in direct}


def _touched(contact: Contact) -> str:
    return getattr(contact.obstacle, "shell", None) or contact.obstacle_body or GROUND


def _named(where: Any) -> Iterable[str]:
    """Edges by their names; none of places that are given otherwise."""
    return [n for n in edge_names(where) if isinstance(n, str)] if where is not None else []


def _tie(sets: Sets, a: Hashable, b: Hashable) -> None:
    sets[_end(sets, a)] = _end(sets, b)


def _end(sets: Sets, a: Hashable) -> Hashable:
    while sets.setdefault(a, a) != a:
        a = sets[a]
    return a
