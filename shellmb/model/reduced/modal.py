"""Reduced bodies as the schemes see them, their points, and terms that users add.

Points of a body in modes that potentials and contacts act on.

They are where frame and amplitudes have them,

    x = X + u0 + sum_a w_a (X_a + phi_ka eta_k) + phi_k eta_k,      X_a from the centre,

with the displacement `u0` of the frame and the changes `w_a` of its directors, and directors alike:
quadratic in the unknowns, so that measures that are linear in positions keep the energy exact in
every scheme (`model.potentials`), and nothing is unknown that was not.

Terms that users add to the weak form, of a body in modes.

They are taken where the exact body has them, on its own mesh, at the state that frame and
amplitudes tell: displacements, strains and normals, their rates and variations are those of the
modes. The unknowns of a cell are the same for all of them.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.forms.constraints.joints import Place
from shellmb.forms.floating import modal as forms
from shellmb.forms.frame import vectors
from shellmb.forms.state import Layout
from shellmb.forms.steps.discrete import variation
from shellmb.meshes.nodes import NodeMesh, constant_vector
from shellmb.meshes.spaces import constant_space
from shellmb.model.body import Body, Rates, same_everywhere
from shellmb.model.frames.rigid import RigidBodies
from shellmb.model.locations.nodes import values_at
from shellmb.model.massless import Scale, Targets
from shellmb.model.potentials.points import Points, points_on
from shellmb.model.reduced import floating_body
from shellmb.model.reduced.data import Member, ModalBody, amplitudes


@dataclass(frozen=True)
class ModalPoints(Points):
    """Points of a body in modes.

    Args:
        body: The body.
        u: Displacements by the modes, shape (n, 3, K).
        w: Changes of the directors by the modes, shape (n, m, 3, K), 1/m.
    """

    body: floating_body.Modes
    u: Floats
    w: Floats

    linear = False

    def bound(self, turns: bool) -> "ModalPlaces":
        """The points at nodes of a group."""
        return ModalPlaces(self, turns)


class ModalPlaces:
    """Points of a body in modes at nodes of a node mesh; what `EndGroup` is for others.

    Args:
        points: The points.
        turns: Whether directors matter.
    """

    def __init__(self, points: ModalPoints, turns: bool) -> None:
        self._points, self._K = points, points.body.data.count
        X = np.array([end.point for end in points.ends])
        rows = [X, X - points.body.frame.node, points.u.reshape(len(X), -1)]
        self._count = points.w.shape[1] if turns else 0
        if turns:
            D = np.array([end.directors for end in points.ends])
            for k in range(self._count):
                rows += [D[:, k], points.w[:, k].reshape(len(X), -1)]
        self._rows = np.concatenate(rows, axis=1)

    def bind(self, nodes: NodeMesh) -> None:
        """Take the group's node mesh, with one node for each point."""
        self._data = constant_vector(nodes, self._rows, "places")

    @property
    def targets(self) -> Mapping[str, Targets]:
        """Unknowns of frame and modes."""
        return self._points.body.shared(len(self._rows), ("u1", "w1"))

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


class ModalTerms(Body):
    """The user's terms of one shell or beam of a body in modes.

    Args:
        body: The body.
        member: The shell or beam.

    Attributes:
        of: Name of the body.
        center: Where its frame is at rest, shape (3,), m.
    """

    def __init__(self, body: floating_body.Modes, member: Member) -> None:
        self._of, frame = member.body, body.frame
        self.of, self.center = body.data.name, frame.node
        space = self._of.mixed.space
        mixed = constant_space(space.mesh, {"eta": body.data.count, "u1": 3, "w1": 9})
        targets: dict[str, tuple[str, Any]] = {
            "eta": (body.name, body.numbers("eta")[0]),
            "u1": (frame.body, frame.dofs["u"]),
            "w1": (frame.body, frame.dofs["w"]),
        }
        links = tuple(same_everywhere(mixed, part, *of) for part, of in targets.items())
        super().__init__(f"terms of {self._of.name}", mixed, (), links)
        self.layout, self.kinematic = Layout(mixed.parts), frozenset(mixed.parts)
        # the vectors of the state: what each is at rest, from the centre of mass
        directors = self._of.frames
        center = ufl.as_vector(list(map(float, frame.node)))
        rest = {"u": ufl.SpatialCoordinate(space.mesh) - center, "w": directors}
        self._rest = {
            first + k: (rest[part], k) if part in rest else None
            for part, (first, size) in self._of.mixed.parts.items()
            if part in ("u", "w")
            for k in range(0, size, 3)
        }
        self._shapes = []
        for column in member.states.T:
            shape = fem.Function(space)
            shape.x.array[:] = column
            self._shapes.append(shape)

    def _state(self, q: Expr) -> Expr:
        """State of the shell or beam, without resultants."""
        eta, w = amplitudes(self.layout, q), vectors(self.layout.part(q, "w1"))
        none, pairs = 0 * eta[0], list(zip(eta, self._shapes, strict=True))
        found = [none] * self._shapes[0].ufl_shape[0]
        for first, at in self._rest.items():
            moved = [sum((e * s[i] for e, s in pairs), none) for i in range(first, first + 3)]
            A = ufl.as_vector([0 if at is None else at[0][at[1] + i] for i in range(3)])
            change = forms.carried(A, ufl.as_vector(moved), w)
            if first == self._of.mixed.parts["u"][0]:
                change += self.layout.part(q, "u1")
            found[first : first + 3] = [change[i] for i in range(3)]
        return ufl.as_vector(found)

    def users(self, mid: Expr, rates: Rates | None, dq: Expr, time: fem.Constant) -> Form | None:
        """The terms at the mid-point."""

        def moved(v: Expr) -> Expr:
            return variation(self._state, mid, v)

        now = None if rates is None else Rates(moved(rates.now), moved(rates.chord))
        return self._of.users(self._state(mid), now, moved(dq), time)


def modal_bodies(
    scale: Scale, data: Sequence[ModalBody], rigid: RigidBodies, dynamic: bool
) -> list[Body]:
    """The bodies of the system that reduced bodies consist of, besides their frames.

    Args:
        scale: Communicator and sizes.
        data: The reduced bodies.
        rigid: All frames, theirs included.
        dynamic: Whether they have inertia.
    """
    ends = rigid.ends()
    found: list[Body] = []
    for kept in data:
        body = floating_body.Modes(scale.comm, kept, ends[kept.name])
        found.append(body)
        if dynamic:
            found.append(floating_body.InertiaPoints(body, scale))
        if kept.points_loaded:
            found.append(floating_body.LoadPoints(body, scale))
        if kept.follower_loads:
            found.append(floating_body.FrameLoads(body))
        found += [ModalTerms(body, m) for m in kept.members.values() if m.body.described.terms]
        if kept.interfaces:
            others = [ends[item.name] for item in kept.interfaces]
            found.append(floating_body.Interfaces(body, others, scale))
    return found


def modes_of(bodies: Iterable[Body]) -> list[floating_body.Modes]:
    """The modes of all reduced bodies of a system."""
    return [body for body in bodies if isinstance(body, floating_body.Modes)]


def modal_points(bodies: Sequence[Body]) -> dict[str, ModalPoints]:
    """Points of reduced bodies by the names of potentials and contacts there; collective.

    Args:
        bodies: The bodies of the system.

    Raises:
        SceneError: If there is no such place.
    """
    found: dict[str, ModalPoints] = {}
    for body in modes_of(bodies):
        for name, (member, on, who) in body.data.touched.items():
            kept = body.data.members[member]
            points = points_on(kept.body, on, who)
            numbers = np.array([end.dofs["u"][0] for end in points.ends])
            u, w = values_at(kept.body, numbers, kept.u, kept.w)
            ends = [replace(end, owner=body.data.name) for end in points.ends]
            found[name] = ModalPoints(ends, points.weights, body, u, w, segments=points.segments)
    return found
