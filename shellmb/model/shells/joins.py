"""Shells joined along an edge: shared displacements, and shared or mutually locked directors."""

import numpy as np

from shellmb.errors import SceneError
from shellmb.model.body import NodeLink
from shellmb.model.locations.nodes import ON_NODE, Nodes, shared_nodes
from shellmb.model.shells.shell import ShellModel
from shellmb.model.supports.nodal import NodalConstraint, kink
from shellmb.scene import Join

# surfaces whose normals differ by less than this along the edge are one smooth surface [degrees]
SMOOTH = 3.0


def join_shells(
    join: Join, first: ShellModel, second: ShellModel
) -> tuple[list[NodeLink], NodalConstraint | None]:
    """Links of the second shell to the first, and the constraint of a kink.

    Args:
        join: Description.
        first: Shell whose nodes are kept.
        second: Shell whose edge nodes become nodes of the first.

    Raises:
        SceneError: If the nodes of the two edges do not coincide, or the normals are opposite.
    """
    who = f"join of '{first.name}' and '{second.name}'"
    a = shared_nodes(first, join.at, who)
    b = shared_nodes(second, join.second_at, who)
    _coincide(a, b, first, who)
    cosine = np.sum(a.director * b.director, axis=1)
    degrees = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    smooth = join.kind == "smooth" or (join.kind == "auto" and float(np.max(degrees)) < SMOOTH)
    if float(np.max(degrees)) > 180 - SMOOTH or (smooth and float(np.min(cosine)) <= 0):
        raise SceneError(
            f"{who}: the normals of the two shells point to opposite sides along the edge; "
            "turn one of the surfaces over"
        )
    if not smooth and float(np.min(degrees)) < SMOOTH:
        raise SceneError(
            f"{who}: the surfaces are smooth at some of the edge's nodes and kinked at others; "
            "split the edge, or give kind='smooth'"
        )
    parts = ("u", "w", "lam") if smooth else ("u",)
    links = [_link(second, first.name, a, b, part) for part in parts]
    if smooth:
        mean = a.director + b.director
        mean /= np.linalg.norm(mean, axis=1, keepdims=True)
        for body, nodes in ((first, a), (second, b)):
            _set_directors(body, nodes, mean)
        return links, None
    scale = float(first.section.force.value) * first.surface_mesh.length
    constraint = kink(
        f"kink between '{first.name}' and '{second.name}'",
        first.surface_mesh.mesh.comm,
        (first.name, a.dofs["w"], a.director),
        (second.name, b.dofs["w"], b.director),
        scale,
        a.x,
    )
    return links, constraint


def _coincide(a: Nodes, b: Nodes, first: ShellModel, who: str) -> None:
    if len(a.x) != len(b.x):
        raise SceneError(
            f"{who}: the edges have {len(a.x)} and {len(b.x)} nodes; they must have the same nodes"
        )
    steps = np.linalg.norm(np.diff(a.x, axis=0), axis=1)
    if float(np.min(steps, initial=np.inf)) < ON_NODE * first.surface_mesh.length:
        raise SceneError(
            f"{who}: edges of '{first.name}' lie on each other; it must be joined along one of them"
        )
    gap = float(np.max(np.linalg.norm(a.x - b.x, axis=1)))
    if gap > 2 * ON_NODE * first.surface_mesh.length:
        raise SceneError(f"{who}: nodes of the two edges are {gap:.3g} apart; they must coincide")


def _link(body: ShellModel, target: str, a: Nodes, b: Nodes, part: str) -> NodeLink:
    """Link a part of `body` at its nodes `b` to the nodes `a` of the target."""
    local = body.mixed.space.dofmap.index_map.global_to_local(b.dofs[part].ravel())
    here = local >= 0
    return NodeLink(np.asarray(local[here], dtype=np.int32), target, a.dofs[part].ravel()[here])


def _set_directors(body: ShellModel, nodes: Nodes, directors: np.ndarray) -> None:
    """Give nodes a new reference director, on every rank that holds them."""
    index_map = body.mixed.space.dofmap.index_map
    local = index_map.global_to_local(nodes.dofs["w"].ravel())
    here = local >= 0
    # place of each mixed dof in the director's space, whose nodes are in the order of the parts'
    place = np.full(index_map.size_local + index_map.num_ghosts, -1)
    place[body.mixed.dofs["w"]] = np.arange(len(body.mixed.dofs["w"]))
    body.director.x.array[place[local[here]]] = directors.ravel()[here]
