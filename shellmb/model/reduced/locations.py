"""Points of a body in modes that potentials and contacts act on.

They are where frame and amplitudes have them,

    x = X + u0 + sum_a w_a (X_a + phi_ka eta_k) + phi_k eta_k,      X_a from the centre,

with the displacement `u0` of the frame and the changes `w_a` of its directors, and directors alike:
quadratic in the unknowns, so that measures that are linear in positions keep the energy exact in
every scheme (`model.potentials`), and nothing is unknown that was not.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import ufl
from ufl.core.expr import Expr

from shellmb.arrays import Floats, Ints
from shellmb.forms.constraints.joints import Place
from shellmb.forms.floating import modal as forms
from shellmb.forms.frame import vectors
from shellmb.forms.state import Layout
from shellmb.meshes.nodes import NodeMesh, constant_vector
from shellmb.meshes.spaces import MixedSpace
from shellmb.model.body import NodeLink
from shellmb.model.locations.nodes import part_dofs
from shellmb.model.potentials.points import Points, points_on
from shellmb.model.reduced.data import Member, amplitudes
from shellmb.model.reduced.floating_body import Reduced, frame_links


def _gathered(member: Member, wanted: Ints) -> tuple[Floats, Floats]:
    """Shapes at nodes that their first dofs name, on all ranks; collective."""
    body: Any = member.body
    owned = body.mixed.subspaces["u"].dofmap.index_map.size_local
    first = part_dofs(body, np.arange(owned, dtype=np.int32), "u")[:, 0]
    numbers = body.mixed.space.dofmap.index_map.local_to_global(first)
    parts = body.domain.mesh.comm.allgather((numbers, member.u[:owned], member.w[:owned]))
    every, u, w = (np.concatenate([part[k] for part in parts]) for k in range(3))
    order = np.argsort(every)
    here = order[np.searchsorted(every[order], wanted)]
    return u[here], w[here]


@dataclass(frozen=True)
class ModalPoints(Points):
    """Points of a body in modes.

    Args:
        body: The body.
        u: Displacements by the modes, shape (n, 3, K).
        w: Changes of the directors by the modes, shape (n, m, 3, K), 1/m.
    """

    body: Reduced
    u: Floats
    w: Floats

    linear = False

    def bound(self, nodes: NodeMesh, turns: bool) -> ModalPlaces:
        """The points at nodes of a node mesh."""
        return ModalPlaces(self, nodes, turns)


def reduced_points(body: Reduced, member: str, on: Any, who: str) -> ModalPoints:
    """Points of one of the shells and beams of a reduced body; collective.

    Args:
        body: The body.
        member: Name of the shell or beam.
        on: Where on it, as of a contact.
        who: Who asks, for the error.

    Raises:
        SceneError: If there is no such place.
    """
    kept = body.data.members[member]
    found = points_on(kept.body, on, who)
    u, w = _gathered(kept, np.array([end.dofs["u"][0] for end in found.ends]))
    ends = [replace(end, owner=body.data.name) for end in found.ends]
    return ModalPoints(ends, found.weights, body, u, w, segments=found.segments)


class ModalPlaces:
    """Points of a body in modes at nodes of a node mesh; what `EndGroup` is for others.

    Args:
        points: The points.
        nodes: Node mesh with one cell for each.
        turns: Whether directors matter.
    """

    def __init__(self, points: ModalPoints, nodes: NodeMesh, turns: bool) -> None:
        self._points, self._nodes = points, nodes
        self._K = points.body.data.count
        self.parts = {"u1": 3, "w1": 9, "eta": self._K}
        X = np.array([end.point for end in points.ends])
        self._arms = X - points.body.frame.node
        rows = [X, self._arms, points.u.reshape(len(X), -1)]
        self._count = points.w.shape[1] if turns else 0
        if turns:
            D = np.array([end.directors for end in points.ends])
            for k in range(self._count):
                rows += [D[:, k], points.w[:, k].reshape(len(X), -1)]
        self._data = constant_vector(nodes, np.concatenate(rows, axis=1), "places")

    def links(self, mixed: MixedSpace) -> list[NodeLink]:
        """Links to the unknowns of frame and modes."""
        return list(frame_links(self._nodes, mixed, self._points.body))

    def place(self, q: Expr, layout: Layout) -> Place:
        """The points and their directors at a state."""
        data, K = self._data, self._K
        w = vectors(layout.part(q, "w1"))
        eta = amplitudes(layout, q)

        def vector(first: int) -> Expr:
            return ufl.as_vector([data[first + i] for i in range(3)])

        def turned(first: int, shape: int) -> Expr:
            moved = ufl.as_vector(forms.components(data, shape, eta))
            return forms.carried(vector(first), moved, w)

        x = vector(0) + layout.part(q, "u1") + turned(3, 6)
        size = 3 + 3 * K
        starts = [6 + 3 * K + k * size for k in range(self._count)]
        return Place(x, tuple(vector(s) + turned(s, s + 3) for s in starts))

    def positions(self, q: Floats, mixed: MixedSpace) -> Floats:
        """Positions of the local points (owned and ghost) at a state's array, shape (n, 3), m."""
        here, dofs = self._nodes.item, mixed.dofs
        X = np.array([end.point for end in self._points.ends])[here].reshape(-1, 3)
        eta = q[dofs["eta"]].reshape(-1, self._K)
        moved = np.einsum("nik,nk->ni", self._points.u[here], eta)
        w = q[dofs["w1"]].reshape(-1, 3, 3)
        turned = np.einsum("na,nai->ni", self._arms[here] + moved, w)
        return np.asarray(X + q[dofs["u1"]].reshape(-1, 3) + moved + turned)
