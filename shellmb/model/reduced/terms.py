"""Terms that users add to the weak form, of a body in modes.

They are taken where the exact body has them, on its own mesh, at the state that frame and
amplitudes tell: displacements, strains and normals, their rates and variations are those of the
modes. The unknowns of a cell are the same for all of them.
"""

from __future__ import annotations

from typing import Any

from mpi4py import MPI as _MPI  # noqa: F401  (before dolfinx)

import numpy as np
import ufl
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.forms.floating import modal as forms
from shellmb.forms.frame import vectors
from shellmb.forms.state import Layout
from shellmb.forms.steps.discrete import variation
from shellmb.meshes.spaces import constant_space
from shellmb.model.body import NodeLink, Rates
from shellmb.model.frames.beam import BeamModel
from shellmb.model.massless import Massless
from shellmb.model.reduced.data import Member, amplitudes
from shellmb.model.reduced.floating_body import Reduced


def has_terms(member: Member) -> bool:
    """Decide whether the user has added terms to a shell or beam."""
    body = member.body
    return bool((body.beam if isinstance(body, BeamModel) else body.shell).terms)


class ModalTerms(Massless):
    """The user's terms of one shell or beam of a body in modes.

    Args:
        body: The body.
        member: The shell or beam.

    Attributes:
        of: Name of the body.
        center: Where its frame is at rest, shape (3,), m.
    """

    def __init__(self, body: Reduced, member: Member) -> None:
        self._of, frame = member.body, body.frame
        self.of, self.center = body.data.name, frame.node
        space = self._of.mixed.space
        mixed = constant_space(space.mesh, {"eta": body.data.count, "u1": 3, "w1": 9})
        targets: dict[str, tuple[str, Any]] = {
            "eta": (body.modes.name, body.modes.numbers()),
            "u1": (frame.body, frame.dofs["u"]),
            "w1": (frame.body, frame.dofs["w"]),
        }
        links = []
        for part, (name, numbers) in targets.items():
            rows = mixed.dofs[part].reshape(-1, len(numbers))
            links.append(NodeLink(rows.ravel(), name, np.tile(numbers, len(rows))))
        super().__init__(f"terms of {self._of.name}", mixed, (), tuple(links))
        self.layout, self.kinematic = Layout(mixed.parts), frozenset(mixed.parts)
        # the vectors of the state: what each is at rest, from the centre of mass
        directors = self._of.frames if isinstance(self._of, BeamModel) else self._of.director
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
        found = [0 * eta[0]] * self._shapes[0].ufl_shape[0]
        for first, at in self._rest.items():
            moved = [
                sum(
                    (e * s[i] for e, s in zip(eta[1:], self._shapes[1:], strict=True)),
                    eta[0] * self._shapes[0][i],
                )
                for i in range(first, first + 3)
            ]
            A = ufl.as_vector([0 if at is None else at[0][at[1] + i] for i in range(3)])
            change = forms.carried(A, ufl.as_vector(moved), w)
            if first == self._of.mixed.parts["u"][0]:
                change += self.layout.part(q, "u1")
            found[first : first + 3] = [change[i] for i in range(3)]
        return ufl.as_vector(found)

    def applied(self, mid: Expr, rates: Rates | None, dq: Expr, time: fem.Constant) -> Form | None:
        """The terms at the mid-point."""

        def moved(v: Expr) -> Expr:
            return variation(self._state, mid, v)

        now = None if rates is None else Rates(moved(rates.now), moved(rates.chord))
        return self._of.users(self._state(mid), now, moved(dq), time)
