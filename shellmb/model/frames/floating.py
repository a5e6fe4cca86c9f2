"""The floating frame of a body whose strains are small relative to it.

Its directors are unknowns that are the same all over the body: a part "frame" of the body's own
space that is constant on each cell, all cells identified, and so are the multipliers, "hold", of
what ties it to the body (`forms.floating.frame`). It has no mass: its velocity follows from the
body's, and its forces do no work.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import ufl
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.forms.constraints.held import Held
from shellmb.forms.state import Layout
from shellmb.meshes.spaces import MixedSpace
from shellmb.model.body import NodeLink, largest
from shellmb.model.joints.held import Constraints

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

    def changes(self, values: Floats) -> Floats:
        """Changes of the directors as rows, or their rates, of a local array, shape (3, 3).

        Zero on ranks that have nothing of the body.
        """
        return np.asarray(values[self._dofs].sum(axis=0))

    def errors(self, states: Floats) -> Floats:
        """Largest deviations from an orthonormal frame in local arrays of states, shape (k,)."""
        d = np.eye(3) + states[:, self._dofs].sum(axis=1)
        return largest(d @ d.swapaxes(1, 2) - np.eye(3))

    def held(self, inertialess: bool) -> Constraints:
        """The frame tied to its body, as what the body holds.

        Args:
            inertialess: Whether the body has no inertia.
        """
        return Constraints(
            Held(self.constraints),
            lambda q: self._layout.part(q, "hold"),
            self._force,
            self._measure,
            self.errors,
            inertialess,
        )


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
