"""Cones over the shells that enclose a volume, and the sides of the shells on which it is."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import ufl
from dolfinx import fem, la
from ufl.core.expr import Expr

from shellmb.arrays import Floats, Ints
from shellmb.errors import SceneError
from shellmb.forms.constraints.volume import Patch, cone, patch, slope
from shellmb.model.locations.nodes import part_dofs, said_point
from shellmb.model.shells.shell import ShellModel
from shellmb.model.supports.prescribed import Prescribed
from shellmb.native.kernels import compiled
from shellmb.scene.loads.potentials import EnclosedVolume
from shellmb.scene.lookup import said

# part of the scene's size within which nodes of several shells are one
TOGETHER = 1e-7
# areas at a free node relative to that of the whole: far above round-off, far below an element's
OPEN = 1e-9
# sine of the angle of directions that count as one
ALIKE = 1e-6
# shells of one volume: all combinations of their sides are tried
MOST = 16


class ReferenceCones:
    """Cones over a shell in the reference configuration.

    Args:
        item: Description of the volume.
        shell: The shell.

    Attributes:
        rule: A rule that is exact for them, so that what is inside a closed surface vanishes.
    """

    def __init__(self, item: EnclosedVolume, shell: ShellModel) -> None:
        self._shell, domain = shell, shell.mixed.space.mesh
        # a product of places and both of their slopes; up to degree 2 the rule of loads is exact
        degree, self.rule = shell.shell.degree, shell.rules.full
        if degree > 2:
            metadata = {"quadrature_degree": 3 * degree - 1}
            self.rule = ufl.Measure("dx", domain, metadata=metadata)
        origin = fem.Constant(domain, np.array(item.origin, dtype=float))
        self.from_origin: Expr = ufl.SpatialCoordinate(domain) - origin

    @property
    def _patch(self) -> Patch:
        surf = self._shell.surface
        return Patch(self.from_origin, surf.e1, surf.e2)

    def volume(self) -> float:
        """Volume of the cones, positive where the director points away from the origin, m^3."""
        form = compiled(cone(self._patch) * self.rule)
        return float(self._shell.mixed.space.mesh.comm.allreduce(fem.assemble_scalar(form)))

    def lids(self) -> tuple[Floats, Floats]:
        """Change of the volume with displacements of owned nodes, less what a pressure does.

        Inside the surface there is nothing of it; at its edges, that of the lids.

        Returns:
            Places (n, 3), m, and derivatives (n, 3), m^2.
        """
        space = self._shell.mixed.subspaces["u"]
        test, surf = ufl.TestFunction(space), self._shell.surface
        work = ufl.dot(ufl.cross(surf.e1, surf.e2), test)
        form = (slope(self._patch, patch(test, surf)) - work) * self.rule
        vector = fem.assemble_vector(compiled(form))
        vector.scatter_reverse(la.InsertMode.add)
        count = space.dofmap.index_map.size_local
        X = space.tabulate_dof_coordinates()[:count]
        return X, np.asarray(vector.array.reshape(-1, 3)[:count])


def sides_of(
    item: EnclosedVolume,
    shells: Sequence[ShellModel],
    lids: Sequence[tuple[Floats, Floats]],
    prescribed: Prescribed,
    length: float,
) -> tuple[Floats, Floats]:
    """Sides of the shells on which the volume is, one or minus one; collective.

    With them what is left of the lids at edges that may move is zero.

    Args:
        item: Description of the volume.
        shells: The shells.
        lids: Of each as from `ReferenceCones.lids`.
        prescribed: What supports hold.
        length: Size of the scene, m.

    Returns:
        The sides, and normals of lids (n, 3).

    Raises:
        SceneError: If there are none such; names the place.
    """
    # loaded where there are volumes only
    from scipy.spatial import cKDTree

    comm, names = shells[0].mixed.space.mesh.comm, said(item)
    if len(shells) > MOST:
        raise SceneError(f"{names}: {len(shells)} shells; they must be {MOST} at most")
    least = OPEN * length**2
    rows = [_free(s, *lid, prescribed, least) for s, lid in zip(shells, lids, strict=True)]
    every = [np.concatenate(comm.allgather(row)) for row in rows]
    of = np.repeat(np.arange(len(every)), [len(row) for row in every])
    X, free, whole, pinned = np.hsplit(np.concatenate(every), (3, 6, 9))
    if not len(X):
        return np.ones(len(shells)), X
    # nodes that several shells share are one
    groups: Ints = np.arange(len(X))
    for a, b in sorted(cKDTree(X).query_pairs(TOGETHER * length)):
        groups[b] = groups[a] = min(groups[a], groups[b])
    open_at, lids_at = np.zeros((2, len(X), len(shells), 3))
    np.add.at(open_at, (groups, of), free)
    np.add.at(lids_at, (groups, of), whole)
    # where shells meet, what one has the other takes, also where nothing moves
    meet = (np.linalg.norm(lids_at, axis=2) > 0).sum(axis=1) > 1
    seen = np.where(meet[:, None, None], lids_at, open_at)
    gram = np.einsum("nik,njk->ij", seen, seen)
    signs = np.array(
        min(
            ((1.0, *more) for more in itertools.product((1.0, -1.0), repeat=len(shells) - 1)),
            key=lambda s: float(np.array(s) @ gram @ np.array(s)),
        )
    )
    left = np.linalg.norm(np.einsum("nik,i->nk", open_at, signs), axis=1)
    worst = int(np.argmax(left))
    if left[worst] > least:
        raise SceneError(
            f"{names}: it is open at {said_point(X[worst], length)}; every edge must be joined "
            f"to another shell of the volume, or be fixed in a plane through origin {item.origin} "
            "as SymmetryPlane and Clamped do"
        )
    full = np.einsum("nik,i->nk", lids_at, signs)
    sizes = np.linalg.norm(full, axis=1)
    closed = sizes > least
    still = (pinned[groups, 0] > 0) & closed
    # along the normal of a plane through the origin where there is one
    if differ(full[still] / sizes[still, None]):
        raise SceneError(
            f"{names}: edges that do not move are in no common plane through origin {item.origin}, "
            f"as at {said_point(X[still][0], length)}, and the volume under their lids is not "
            "known; give such an origin, close the shell by a shell, or use a plane of symmetry"
        )
    return signs, full[closed] / sizes[closed, None]


def differ(directions: Floats) -> bool:
    """Say whether directions (n, 3) are of more than one line."""
    return bool(np.any(np.abs(np.cross(directions, directions[:1])) > ALIKE))


def _free(
    shell: ShellModel, X: Floats, lids: Floats, prescribed: Prescribed, least: float
) -> Floats:
    """Shares of lids at owned nodes: along directions that nothing holds, and in all.

    Args:
        shell: The shell.
        X: Places of its owned nodes, m.
        lids: What is at them, m^2.
        prescribed: What supports hold.
        least: What counts as none, m^2.

    Returns:
        Of each node with some of it the place (3), the former (3), the latter (3), and one where
        nothing moves, shape (n, 10).
    """
    some = np.flatnonzero(np.linalg.norm(lids, axis=1) > least).astype(np.int32)
    index_map = shell.mixed.space.dofmap.index_map
    left, pinned = lids[some], np.zeros(len(some), dtype=bool)
    for k, dofs in enumerate(part_dofs(shell, some, "u")):
        held, _ = prescribed.held(shell.name, index_map.local_to_global(dofs))
        left[k] -= held.T @ (held @ left[k])
        pinned[k] = len(held) == len(dofs)
    return np.hstack([X[some], left, lids[some], pinned[:, None]])
