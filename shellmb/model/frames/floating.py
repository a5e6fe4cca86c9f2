"""The floating frame of a body whose strains are small relative to it.

Its directors are unknowns that are the same all over the body: a part "frame" of the body's own
space that is constant on each cell, all cells identified, and so are the multipliers, "hold", of
what ties it to the body (`forms.floating.frame`). It has no mass: its velocity follows from the
body's, and its forces do no work.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
import ufl
from ufl import Form
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.forms.constraints.leap import Leap, leap_row
from shellmb.forms.constraints.pathconstraints import held_row
from shellmb.forms.state import Layout
from shellmb.forms.steps.discrete import variation
from shellmb.forms.steps.mixed import Interval
from shellmb.forms.steps.path import Path
from shellmb.meshes.spaces import MixedSpace
from shellmb.model.body import Leaping, NodeLink

# parts of a state that are the same all over a body, with their sizes; and that which moves
EVERYWHERE = {"frame": 9, "hold": 9}
FRAME = "frame"


class FloatingFrame:
    """A frame and what ties it to its body.

    Args:
        mixed: Space of the body.
        constraints: Densities whose integrals vanish as a function of the state, shape (9,).
        measure: Rule of the integrals.
        force: Size of the body's resultants: a Constant.
    """

    def __init__(
        self,
        mixed: MixedSpace,
        constraints: Callable[[Expr], Expr],
        measure: ufl.Measure,
        force: Expr,
    ) -> None:
        self._layout, self.constraints = Layout(mixed.parts), constraints
        self._measure, self._force = measure, force
        # of some cell: they are the same on all
        self._dofs = mixed.dofs[FRAME][: EVERYWHERE[FRAME]].reshape(-1, 3, 3)

    def _hold(self, q: Expr) -> Expr:
        return self._layout.part(q, "hold")

    def _form(self, *products: tuple[Expr, Expr]) -> Form:
        total = sum(ufl.dot(a, b) for a, b in products)
        return self._force * total * self._measure

    def changes(self, values: Floats) -> Floats:
        """Changes of the directors as rows, or their rates, of a local array, shape (3, 3).

        Zero on ranks that have nothing of the body.
        """
        return np.asarray(values[self._dofs].sum(axis=0))

    def error(self, q: Floats) -> float:
        """Largest deviation from an orthonormal frame in a local array of the state."""
        d = np.eye(3) + self.changes(q)
        return float(np.max(np.abs(d @ d.T - np.eye(3))))

    def work(self, span: Interval, dq: Expr) -> Form:
        """Constraints at the end of a sub-interval, forces along the gradient at its middle."""
        acting = variation(self.constraints, span.mid, dq)
        rows = self.constraints(span.at)
        return self._form((self._hold(span.unknown), acting), (self._hold(dq), rows))

    def row(self, path: Path, k: int, dq: Expr, inertialess: bool) -> Form:
        """The same in a row of a step that is quadratic in time, eqs. (Q4) and (Q6)."""
        row = held_row(self.constraints, path, k, dq, inertialess)
        own, other = map(self._hold, row.multipliers)
        return self._form((own, row.own), (other, row.other), (self._hold(dq), row.value))

    def velocity(self, v: Expr, mid: Expr, dv: Expr) -> Form:
        """Velocities do not violate the constraints; the impulses for that are zero."""
        acting, rates = (variation(self.constraints, mid, q) for q in (dv, v))
        return self._form((self._hold(v), acting), (self._hold(dv), rates))

    def leaping(self, leap: Leap, dq: Expr) -> tuple[Form, Form]:
        """Velocities at the end of a step with a jump, eq. (N2)."""
        row = leap_row(self.constraints, leap, dq)
        hold = self._hold(leap.jump)
        impulses = self._form((hold, row.impulse), (self._hold(dq), row.value))
        return impulses, self._form((hold, row.force))


def leaping(own: Leaping, ties: Iterable[FloatingFrame], leap: Leap, dq: Expr) -> Leaping:
    """Constraints on velocities of a body's nodes together with those of its frame."""
    found = [own, *(tie.leaping(leap, dq) for tie in ties)]
    if not any(found):
        return None
    impulses, forces = zip(*(pair for pair in found if pair is not None), strict=True)
    return sum(impulses[1:], impulses[0]), sum(forces[1:], forces[0])


def identified(mixed: MixedSpace, name: str) -> list[NodeLink]:
    """Links that make the parts which are the same everywhere one unknown each; collective.

    Args:
        mixed: Space of the body.
        name: Its name.
    """
    comm, index_map = mixed.space.mesh.comm, mixed.space.dofmap.index_map
    links = []
    for part, size in EVERYWHERE.items():
        cells = mixed.subspaces[part].dofmap.list[:, 0]
        rows = mixed.dofs[part].reshape(-1, size)[cells]
        mine = index_map.local_to_global(rows[:1].ravel()).tolist()
        # those of the first cell of the first rank that has one
        first = next(found for found in comm.allgather(mine) if found)
        targets = np.tile(np.array(first, dtype=np.int64), len(rows))
        links.append(NodeLink(rows.ravel(), name, targets))
    return links
