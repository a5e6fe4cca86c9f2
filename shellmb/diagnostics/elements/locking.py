"""Locking of distorted elements where a thin curved body bends, and measures of meshes for it.

Bending a curved surface without stretching it asks for displacements along it that stand in ratio
to those across. Distorted elements cannot follow: over an element whose normal turns by `kappa h` a
curvature `chi` leaves membrane strains of the size `d kappa h * h chi` beside bending strains of `t
chi`, `d` being the part of its area that it differs by from those around it. Whether a body can
lock is thus a matter of its mesh, `p = d kappa h * h / t`. By how much it does the run shows:
resultants jump between elements, while true ones are smooth on any mesh that is fine enough. The
energy of what they differ by from their means at the nodes (O. C. Zienkiewicz and J. Z. Zhu, Int.
J. Numer. Meth. Engng 24 (1987) 337-357), as a share `s` of the strain energy, is what the body is
too stiff by, `s / (1 - 3 s / 2)`: the body wrinkles to lessen it. Measured (`docs/limits.md`):
beyond a fifth the body may be far stiffer, as means are those of a body that is constrained.

A body that is inextensible is the end of this: its forces have no energy, and what they
would have with the stiffness of the section is a multiple of what is in bending.
"""

from typing import Any

from mpi4py import MPI

import basix
import numpy as np
import ufl
from dolfinx import fem, mesh
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.forms.shell import named
from shellmb.forms.steps.mixed import LinearMixed, LinearOwn, split
from shellmb.meshes.shared import space_on, sums_at_nodes
from shellmb.meshes.spaces import reading_element
from shellmb.model.shells.shell import ShellModel
from shellmb.native.expressions import values_in_cells

# `p`, root of the mean square, below which nothing was too stiff by two per cent
PRONE = 0.6
# of a body that does not stretch the part of jumps in all energy, below which membrane forces
# carry loads
JUMPS = 0.1
# entries of tensors that components 11, 22, 12, 13, 23 are
PLACES = ((0, 0), (1, 1), (0, 1), (0, 2), (1, 2))
# cosine of an angle of 20 degrees: fields are not continued across folds
FOLD = 0.94

# `d` below which meshes are regular
REGULAR = {"quadrilateral": 0.06, "triangle": 0.08}
# `kappa h^2/t`, the normal of an element turning by `kappa h`, below which a body counts as flat
CURVED = 0.3


def excess(body: ShellModel, q: Floats, share: float) -> float:
    """Excess of the stiffness of a shell whose elements can lock, as a part of it; collective.

    Args:
        body: The shell.
        q: Local array of its state or mode.
        share: Of jumps of resultants in its strain energy, `s`.
    """
    measures, d = Mesh(body), body.node_directors()[:, 0] + q[body.mixed.dofs["w"]].reshape(-1, 3)
    if not measures.distorted or measures.proneness(d) < PRONE:
        return 0.0
    return share / max(1 - 1.5 * share, 0.2)


class Roughness:
    """Energy of what resultants of a shell differ by from their means at the nodes.

    Args:
        body: The shell.
    """

    def __init__(self, body: ShellModel) -> None:
        mixed, inner = body.mixed, reading_element(body.mixed.subspaces["u"])
        domain, self._comm = mixed.space.mesh, mixed.space.mesh.comm
        nodes = basix.ufl.element("P", domain.basix_cell(), max(body.shell.degree - 1, 1))
        # forces and moments, their strains, the normal, and one
        self._space = space_on(domain, basix.ufl.blocked_element(nodes, shape=(28,)))
        self._cells = self._space.dofmap.list[: domain.topology.index_map(2).size_local]
        points = np.asarray(inner.points, dtype=np.float64)
        self._up = _table(inner, nodes.basix_element.points)
        self._down = _table(nodes.basix_element, points)
        parts = [ufl.JacobianDeterminant(domain), *body.surface.e1, *body.surface.e2]
        found = values_in_cells(ufl.as_vector(parts), points, domain)()
        rule, weights = basix.make_quadrature(domain.basix_cell(), 2 * inner.degree)
        self._area = np.abs(found[..., 0]) * (np.asarray(weights) @ _table(inner, rule))
        e1, e2 = found[..., 1:4], found[..., 4:]
        self._basis = np.stack([e1, e2, np.cross(e1, e2)], axis=2)
        self._held, self._q = not body.shell.stretching, fem.Function(mixed.space)
        parts = [*body.resultants(self._q), *_strains(body, self._q)]
        self._read = values_in_cells(ufl.as_vector(parts), points, domain)

    def energy(self, q: Floats) -> float:
        """The energy, J; collective.

        Args:
            q: Local array of a state.
        """
        self._q.x.array[:] = q
        read = self._read()
        tensors = [
            self._in_space(v[..., k], half)
            for v, half in ((read[..., :8], 1.0), (read[..., 8:], 0.5))
            for k in ((0, 1, 2, 6, 7), (3, 4, 5))
        ]
        values = np.concatenate(tensors, axis=-1)
        rough = values - self._smooth(values)
        found, whole = self._comm.allreduce(np.array([*map(self._stored, (rough, values))]))
        return 0.0 if self._held and found < JUMPS * whole else float(found)

    def _in_space(self, v: Floats, half: float) -> Floats:
        """Entries of symmetric tensors in space, shape (cells, points, 6).

        Args:
            v: Components 11, 22, 12, and 13, 23 if there are, shape (cells, points, 3 or 5).
            half: Entry of the tensor for a component 12 of one.
        """
        T = np.zeros((*v.shape[:2], 3, 3))
        for k, (i, j) in enumerate(PLACES[: v.shape[2]]):
            T[..., i, j] = T[..., j, i] = v[..., k] * (1.0 if i == j else half)
        e = self._basis
        return np.asarray(np.einsum("cgab,cgai,cgbj->cgij", T, e, e)[..., *np.triu_indices(3)])

    def _stored(self, values: Floats) -> float:
        stresses, strains = np.split(values, 2, axis=2)
        density = np.abs(np.sum(stresses * strains * np.tile([1, 2, 2, 1, 2, 1], 2), axis=-1))
        return float(np.sum(density * self._area) / 2)

    def _smooth(self, values: Floats) -> Floats:
        """Continuous field by the means at the nodes, shape (cells, points, 24)."""
        normals, ones = self._basis[:, :, 2], np.ones((*values.shape[:2], 1))
        at = np.einsum("ng,cgk->cnk", self._up, np.concatenate([values, normals, ones], axis=-1))
        sums = sums_at_nodes(self._space, at)
        found = (sums / np.maximum(sums[:, 27:], 1.0))[self._cells]
        folded = np.linalg.norm(found[..., 24:27], axis=-1) < FOLD
        found[folded] = at[folded]
        return np.asarray(np.einsum("gn,cnk->cgk", self._down, found[..., :24]))


def _strains(body: ShellModel, q: Expr) -> list[Expr]:
    """Strains of the elements, as many as resultants; of what does not stretch as if it did."""
    form, e = body.section.formulation, body.strain.value(q)
    n, Q = split(body.forces(q))
    if isinstance(form, LinearMixed):
        eps, gam = form.stretch(n, e), form.G_inv * Q
    else:
        eps, gam = split(body.layout.tying.strain(body.layout.forces(q, "S")))
    if not body.shell.stretching:
        assert isinstance(form, LinearOwn)
        eps = ufl.inv(12 / body.thickness**2 * form.D) * n
    return [*eps, *named(e).kap, *gam]


def _table(element: basix.finite_element.FiniteElement, points: Any) -> Floats:
    """Values of the functions of a scalar element at points, shape (points, functions)."""
    return np.asarray(element.tabulate(0, points))[0, :, :, 0]


class Mesh:
    """Measures of a mesh by which a shell locks in bending; collective.

    Args:
        body: The shell.

    Attributes:
        distorted: Whether it is not regular, or the body does not stretch.
        triangles: Whether it is of triangles.
        areas: Those of this rank's cells.
    """

    def __init__(self, body: ShellModel) -> None:
        self._body, domain = body, body.mixed.space.mesh
        count = domain.topology.index_map(2).size_local
        self.triangles = domain.basix_cell() == basix.CellType.triangle
        corners = 3 if self.triangles else 4
        # corners come first, of quadrilaterals in the order of a tensor product
        x = domain.geometry.x[domain.geometry.dofmaps[0][:count, :corners]]
        self._comm = domain.comm
        self._corners = body.mixed.subspaces["u"].dofmap.list[:count, :corners]
        if corners == 3:
            self._sides = [1, 2, 0], [0, 1, 2]
            normal = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
        else:
            self._sides = [3, 2], [0, 1]
            # half the product of the diagonals
            normal = np.cross(x[:, 3] - x[:, 0], x[:, 1] - x[:, 2]) / 2
        self.areas = np.linalg.norm(normal, axis=1)
        size = np.sqrt(self.areas)
        # h/t
        self._slender = size / body.section.thickness
        every = self._mean(size)
        # without stretching regular ones may lock, too
        if body.shell.stretching:
            size = size * _unlike_neighbours(domain, self.areas)
        self.distorted = self._mean(size) > REGULAR[domain.topology.cell_name()] * every
        # d h/t, with d over h
        self._shape = size / body.section.thickness

    def _mean(self, values: Floats) -> float:
        """Root of the mean square over the surface; collective."""
        here = np.array([np.sum(values**2 * self.areas), np.sum(self.areas)])
        self._comm.Allreduce(MPI.IN_PLACE, here)
        return float(np.sqrt(here[0] / here[1]))

    def proneness(self, directors: Floats) -> float:
        """`p`; collective.

        Args:
            directors: At the nodes, shape (n, 3).
        """
        return self._mean(self._shape * self._turned(directors))

    @property
    def curved(self) -> bool:
        """True for a thin and curved body; collective."""
        turned = self._turned(self._body.node_directors()[:, 0])
        return self._mean(self._slender * turned) >= CURVED

    def _turned(self, directors: Floats) -> Floats:
        d, (ends, starts) = directors[self._corners], self._sides
        return np.asarray(np.linalg.norm(d[:, ends] - d[:, starts], axis=2).max(axis=1))


def _unlike_neighbours(domain: mesh.Mesh, areas: Floats) -> Floats:
    """Part that areas of cells differ by from those around their vertices; collective.

    Args:
        domain: The mesh.
        areas: Those of this rank's cells, shape (cells,).
    """
    space = space_on(domain, ("Lagrange", 1, (2,)))
    cells = space.dofmap.list[: len(areas)]
    sums = sums_at_nodes(space, np.stack([areas, np.ones_like(areas)], axis=1)[:, None])
    around = (sums[:, 0] / np.maximum(sums[:, 1], 1.0))[cells].mean(axis=1)
    return np.asarray(np.abs(areas / around - 1))
