"""Points of potentials and contacts: nodes of bodies with their shares of an area or length."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import combinations
from typing import Any

import numpy as np
import ufl

from shellmb.arrays import Floats, Ints
from shellmb.model.frames.beam import BeamModel
from shellmb.model.locations.ends import End, EndGroup
from shellmb.model.locations.nodes import FindEnd, shared_nodes, values_at
from shellmb.model.massless import Places
from shellmb.model.shells.shell import ShellModel
from shellmb.native.kernels import assembled
from shellmb.scene import Scene
from shellmb.scene.lookup import said
from shellmb.scene.values.validate import as_names

MeshedBody = ShellModel | BeamModel

# part of the distance of two nodes: a third one that is so near to their middle is between them
BETWEEN = 0.26


def _alone() -> Ints:
    """No neighbours."""
    return np.zeros((0, 2), dtype=np.int64)


@dataclass(frozen=True)
class Points:
    """Places on one body, the same on all ranks.

    Args:
        ends: The places, with the same number of directors.
        weights: Area or length that each stands for, or one, shape (n,).
        segments: Gives pairs of points that are neighbours on the body, shape (m, 2), the same on
            all ranks; collective.
    """

    ends: list[End]
    weights: Floats
    segments: Callable[[], Ints] = field(default=_alone, kw_only=True)

    # whether positions are linear in the state
    linear = True

    def bound(self, turns: bool) -> Places:
        """The points at nodes of a group; `turns`: whether directors matter."""
        ends = self.ends
        axes = np.array([end.directors if end.framed else np.eye(3) for end in ends])
        arms = any(np.any(end.offset != 0) for end in ends)
        return EndGroup(ends, axes, "1", turns or arms)


@dataclass(frozen=True)
class ActingPoints:
    """Finds the points of bodies where potentials and contacts act; collective.

    Args:
        scene: The scene as it was given, with its rigid shells and beams.
        find: Places on bodies.
        meshed: Shells and beams.
        rigid_meshes: Meshes of those that are rigid.
        reduced: Points on bodies in modes, by the names of what acts there.
    """

    scene: Scene
    find: FindEnd
    meshed: Mapping[str, MeshedBody]
    rigid_meshes: Mapping[str, MeshedBody]
    reduced: Mapping[str, Points]

    def __call__(self, item: Any) -> Points:
        """Points of the body of a potential or contact.

        Args:
            item: It.

        Raises:
            SceneError: If there is no such place.
        """
        (body,), who = self.scene.bodies_of(item), said(item)
        if item.name in self.reduced:
            return self.reduced[item.name]
        if body.name in self.meshed:
            return points_on(self.meshed[body.name], item.at, who)
        center = self.find(body.name, None, who)
        if body.name in self.rigid_meshes:
            found = points_on(self.rigid_meshes[body.name], item.at, who)
            return replace(found, ends=[replace(center, point=end.point) for end in found.ends])
        named = isinstance(item.at, tuple) and isinstance(item.at[0], str)
        ends = [self.find(body.name, at, who) for at in (item.at if named else (item.at,))]
        return Points(ends, np.ones(len(ends)))


def points_on(body: MeshedBody, on: Any, who: str) -> Points:
    """Nodes of a shell or beam; those of points weigh one; collective.

    Args:
        body: The shell or beam.
        on: Where on it, as of a contact.
        who: Who asks, for the error.

    Raises:
        SceneError: If there is no such place.
    """
    nodes = shared_nodes(body, on, who)
    ends = [nodes.end(k, body.name) for k in range(len(nodes.x))]
    measures = _measures(body, on, who)
    if measures is None:
        return Points(ends, np.ones(len(ends)))
    numbers = nodes.dofs["u"][:, 0]
    return Points(ends, _shares(body, measures, numbers), segments=partial(_pairs, body, numbers))


def _pairs(body: MeshedBody, numbers: Ints) -> Ints:
    """Neighbours in an element, along and across its sides, with no node between; collective.

    Args:
        body: The shell or beam.
        numbers: First global dofs of the nodes that count.
    """
    space, order = body.mixed.subspaces["u"], np.argsort(numbers)
    X, domain = body.mixed.nodes("u"), body.domain.mesh
    first = body.mixed.nodal("u")[: len(X), 0]
    own = body.mixed.numbers(first)
    place = np.minimum(np.searchsorted(numbers[order], own), len(order) - 1)
    item = np.where(numbers[order][place] == own, order[place], -1)
    cells = space.dofmap.list[: domain.topology.index_map(domain.topology.dim).size_local]
    found = [np.zeros((0, 2), dtype=np.int64)]
    for i, j in combinations(range(cells.shape[1]), 2):
        a, b = X[cells[:, i]], X[cells[:, j]]
        gaps = np.linalg.norm(X[cells] - (a + b)[:, None] / 2, axis=2).min(axis=1)
        pairs = item[cells[gaps > BETWEEN * np.linalg.norm(b - a, axis=1)][:, [i, j]]]
        found.append(pairs[(pairs >= 0).all(axis=1)])
    return np.unique(np.sort(np.concatenate(domain.comm.allgather(np.concatenate(found)))), axis=0)


def _measures(body: Any, on: Any, who: str) -> list[ufl.Measure] | None:
    """Measures of the area or length; None at points."""
    if on is None:
        return [body.rules.nodes]
    names = as_names(on)
    if not isinstance(names[0], str):
        return None
    mesh = body.domain
    if set(names) <= set(mesh.points):
        return None
    edges = tuple(name for name in names if name not in mesh.areas)
    found = [body.ds(edges, who)] if edges else []
    for name in names:
        if name in mesh.areas:
            cells = mesh.areas[name]
            owned = cells[cells < mesh.mesh.topology.index_map(2).size_local]
            data = [(1, owned.astype(np.int32))]
            found.append(body.rules.nodes.reconstruct(subdomain_id=1, subdomain_data=data))
    return found


def _shares(body: MeshedBody, measures: list[ufl.Measure], wanted: Ints) -> Floats:
    """Integrals of the functions of some nodes, which their first dofs name; collective."""
    space = body.mixed.subspaces["u"]
    total = sum(assembled(ufl.TestFunction(space)[0] * measure) for measure in measures)
    return values_at(body, wanted, np.reshape(total, (-1, 3))[:, 0])[0]
