"""Locking of distorted quadrilaterals, and of triangles, where a thin curved body bends.

Bending a curved surface without stretching it asks for displacements along it that stand in ratio
to those across. Elements that are no parallelograms cannot follow: over an element whose normal
turns by `kappa h` a curvature `chi` leaves membrane strains of the size `d kappa h * h chi`, `d`
being the part of its shape that is no parallelogram, beside bending strains of `t chi`. Whether a
body can lock is thus a matter of its mesh, `p = d kappa h * h / t`; of triangles `d` is one. By
how much it does the run shows: these strains change sign within elements and jump between them,
while true ones are smooth on any mesh that is fine enough. The energy of what membrane forces
differ by from their means at the nodes (O. C. Zienkiewicz and J. Z. Zhu, Int. J. Numer. Meth. Engng
24 (1987) 337-357), as a share `s` of the strain energy, is what the body is too stiff by,
`s / (1 - 3 s / 2)`: the body wrinkles to lessen it, which takes half as much again in bending.

Where `p` is large the body is held by these forces, however small their energy is: it falls as
`1/p`. Measured (`docs/limits.md`). A body that is held not to stretch is the end of this: its
forces have no energy, and what they would have with the stiffness of the section is a multiple of
what is in bending.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from mpi4py import MPI

import basix
import numpy as np
import ufl
from dolfinx import fem, la

from shellmb.arrays import Floats
from shellmb.forms.steps.mixed import LinearMixed, LinearOwn
from shellmb.meshes.shared import space_on
from shellmb.meshes.spaces import reading_element
from shellmb.model.shells.shell import ShellModel
from shellmb.native.expressions import compiled_expression


class Kind(NamedTuple):
    """Measured locking of a kind of element.

    Args:
        bound: Excess of stiffness that smooth fields on coarse meshes do not have.
        prone: `p`, root of the mean square, below which nothing was too stiff by that.
        far: `p` from which on the estimate is too low.
        held: `s p` beyond which a body is held by forces of little energy.
        each: `p` over what the body is then too stiff by at least.
        most: What it is then too stiff by at least however large `p` is.
        still: `s` beyond which a body that does not stretch does not bend either.
    """

    bound: float
    prone: float
    far: float
    held: float
    each: float
    most: float
    still: float


# `s p` of regular meshes, as far as they do not lock, and of the least distorted ones that do: 0.06
# and 1.8, 4 and 85, 4 and 27
KINDS = {
    ("quadrilateral", 2): Kind(0.03, 2.0, 20.0, 1.0, 500.0, 1.0, 20.0),
    ("quadrilateral", 3): Kind(0.03, 2.0, 20.0, 30.0, 5000.0, 0.3, 20.0),
    ("triangle", 2): Kind(0.05, 10.0, 10.0, 20.0, 2000.0, 0.3, 1e-6),
}
# excess from which on the estimate is too low
MUCH = 0.4
# of a body that does not stretch: what it is too stiff by at least; and the part that jumps have in
# the energy of all membrane forces, below which these carry loads
LEAST, JUMPS = 0.1, 0.1
# sides that are parallel to this part of the thickness
NOTHING = 1e-6

# cosine of an angle of 20 degrees: fields are not continued across folds
FOLD = 0.94


class Excess(NamedTuple):
    """Excess of a body's stiffness, as a part of it.

    Args:
        value: The part.
        least: Whether it may be much more.
    """

    value: float
    least: bool

    @property
    def said(self) -> str:
        """In words."""
        return f"{'at least ' if self.least else ''}about {100 * self.value:.0f} %"


def excess(body: ShellModel, share: float, prone: float) -> Excess:
    """Excess of a body's stiffness.

    Args:
        body: The shell.
        share: Of jumps of membrane forces in its strain energy, `s`.
        prone: How far its mesh makes it lock, `p`.
    """
    found = kind(body)
    if not body.shell.stretching:
        return Excess(LEAST if share > found.still else 0.0, True)
    value = share / max(1 - 1.5 * share, 0.2)
    if prone > found.far and share * prone > found.held:
        value = max(value, min(prone / found.each, found.most))
    return Excess(value, value > MUCH or prone > found.far)


def kind(body: ShellModel) -> Kind:
    """Measured locking of its elements."""
    return KINDS[body.mixed.space.mesh.topology.cell_name(), body.shell.degree]


def least(body: ShellModel) -> float:
    """`p` below which nothing locks; bodies that do not stretch do so wherever it is not zero."""
    return kind(body).prone if body.shell.stretching else NOTHING


def why(body: ShellModel, share: float) -> str:
    """Cause and remedy, in words; arguments as in `excess`."""
    if not body.shell.stretching:
        return (
            "on distorted elements a curved body that is held not to stretch cannot bend as it "
            "should; use a regular mesh of quadrilaterals, or stretching=True"
        )
    whose, helps = "distorted quadrilaterals", "or degree=3"
    if body.mixed.space.mesh.basix_cell() == basix.CellType.triangle:
        whose, helps = "triangles", "or quadrilaterals"
    return (
        f"{100 * share:.3g} % of its strain energy is of membrane forces that jump between "
        f"elements, as those of {whose} do where a thin curved body bends; use a finer or a more "
        f"regular mesh, {helps}"
    )


def places(body: ShellModel) -> Mesh | None:
    """The mesh of a shell, if it can lock; None where it cannot. Collective."""
    mesh = Mesh(body)
    return mesh if mesh.distorted else None


class Mesh:
    """Measures of a mesh by which a shell locks in bending.

    Args:
        body: The shell.

    Attributes:
        distorted: Whether there is anything but parallelograms on it, as seen from its surface.
    """

    def __init__(self, body: ShellModel) -> None:
        domain = body.mixed.space.mesh
        count = domain.topology.index_map(2).size_local
        corners = 3 if domain.basix_cell() == basix.CellType.triangle else 4
        # corners come first, of quadrilaterals in the order of a tensor product
        x = domain.geometry.x[domain.geometry.dofmaps[0][:count, :corners]]
        self._comm = domain.comm
        self._corners = body.mixed.subspaces["u"].dofmap.list[:count, :corners]
        if corners == 3:
            self._sides = [1, 2, 0], [0, 1, 2]
            self._area = np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1)
            size = np.sqrt(self._area)
        else:
            self._sides = [3, 2], [0, 1]
            first = (x[:, 1] - x[:, 0] + x[:, 3] - x[:, 2]) / 2
            second = (x[:, 2] - x[:, 0] + x[:, 3] - x[:, 1]) / 2
            normal = np.cross(first, second)
            self._area = np.linalg.norm(normal, axis=1)
            normal /= self._area[:, None]
            bilinear = x[:, 0] - x[:, 1] - x[:, 2] + x[:, 3]
            bilinear -= np.sum(bilinear * normal, axis=1)[:, None] * normal
            size = np.linalg.norm(bilinear, axis=1)
        # d h/t, with d over h
        self._shape = size / body.section.sizes.thickness
        self.distorted = self._mean(self._shape) > NOTHING

    def _mean(self, values: Floats) -> float:
        """Root of the mean square over the surface; collective."""
        here = np.array([np.sum(values**2 * self._area), np.sum(self._area)])
        self._comm.Allreduce(MPI.IN_PLACE, here)
        return float(np.sqrt(here[0] / here[1]))

    def proneness(self, directors: Floats) -> float:
        """`p`; collective.

        Args:
            directors: At the nodes, shape (n, 3).
        """
        d, (ends, starts) = directors[self._corners], self._sides
        return self._mean(self._shape * np.linalg.norm(d[:, ends] - d[:, starts], axis=2).max(1))


class Roughness:
    """Energy of what the membrane forces of a shell differ by from their means at the nodes.

    Args:
        body: The shell.
    """

    def __init__(self, body: ShellModel) -> None:
        mixed, inner = body.mixed, reading_element(body.mixed.subspaces["u"])
        domain, form = mixed.space.mesh, body.section.formulation
        nodes = basix.ufl.element("P", domain.basix_cell(), max(body.shell.degree - 1, 1))
        self._space = space_on(domain, basix.ufl.blocked_element(nodes, shape=(10,)))
        self._cells = self._space.dofmap.list[: domain.topology.index_map(2).size_local]
        at, points = nodes.basix_element.points, np.asarray(inner.points, dtype=np.float64)
        self._up = _table(inner, at)
        self._down = _table(nodes.basix_element, points)
        rule, weights = basix.make_quadrature(domain.basix_cell(), 2 * inner.degree)
        self._q = fem.Function(mixed.space)
        layout, stretching = body.layout, body.shell.stretching
        assert layout.tying is not None
        forces = body.section.sizes.stiffness * layout.tying.force(layout.forces(self._q))
        parts = [forces[k] for k in range(3)]
        # of constrained strains next to nothing is left, but the section has a stiffness
        self._own = "S" in mixed.parts and stretching
        if self._own:
            own = layout.tying.strain(layout.forces(self._q, "S"))
            parts += [own[k] for k in range(3)]
        self._read = compiled_expression(ufl.as_vector(parts), points)
        self._held = not stretching
        area = ufl.JacobianDeterminant(domain)
        wanted = [area, *body.surface.e1, *body.surface.e2]
        if not self._own:
            if isinstance(form, LinearMixed):
                compliance = form.A_inv
            else:
                assert isinstance(form, LinearOwn)
                compliance = ufl.inv(12 / body.thickness**2 * form.D)
            wanted += [compliance[i, j] for i in range(3) for j in range(3)]
        values = compiled_expression(ufl.as_vector(wanted), points)
        self._every = np.arange(len(self._cells), dtype=np.int32)
        found = np.asarray(values.eval(domain, self._every))
        found = found.reshape(len(self._cells), len(points), len(wanted))
        self._area = np.abs(found[..., 0]) * (np.asarray(weights) @ _table(inner, rule))
        self._axes, self._compliance = (
            part.reshape(*found.shape[:2], -1, 3) for part in np.split(found[..., 1:], [6], axis=2)
        )

    def energy(self, q: Floats) -> float:
        """The energy, J, of the cells of this rank; collective.

        Args:
            q: Local array of a state.
        """
        self._q.x.array[:] = q
        read = np.asarray(self._read.eval(self._q.function_space.mesh, self._every))
        every, *own = np.split(read.reshape(*self._area.shape, -1), [3], axis=2)
        N = self._rough(every, 1.0)
        if self._own:
            return self._stored(N, self._rough(own[0], 0.5))
        found = self._stored(N, self._strain(N))
        if self._held and found < JUMPS * self._stored(every, self._strain(every)):
            return 0.0
        return found

    def _strain(self, N: Floats) -> Floats:
        return np.asarray(np.einsum("cgij,cgj->cgi", self._compliance, N))

    def _stored(self, N: Floats, strain: Floats) -> float:
        return float(np.sum(np.abs(np.sum(N * strain, axis=-1)) * self._area) / 2)

    def _rough(self, v: Floats, half: float) -> Floats:
        """Components less those of the continuous field, shape (cells, points, 3).

        Args:
            v: Components (11, 22, 12) at the points of the cells, shape (cells, points, 3).
            half: Entry of the tensor for a component 12 of one.
        """
        e = self._axes
        T = np.zeros((*v.shape[:2], 2, 2))
        T[..., 0, 0], T[..., 1, 1] = v[..., 0], v[..., 1]
        T[..., 0, 1] = T[..., 1, 0] = half * v[..., 2]
        in_space = np.einsum("cgab,cgai,cgbj->cgij", T, e, e)
        rows, columns = np.triu_indices(3)
        normal = np.cross(e[..., 0, :], e[..., 1, :])
        one = np.ones((*v.shape[:2], 1))
        at = np.concatenate([in_space[..., rows, columns], normal, one], axis=-1)
        at = np.einsum("ng,cgk->cnk", self._up, at)
        total = fem.Function(self._space)
        sums = total.x.array.reshape(-1, 10)
        np.add.at(sums, self._cells, at)
        total.x.scatter_reverse(la.InsertMode.add)
        total.x.scatter_forward()
        mean = sums / np.maximum(sums[:, 9:], 1.0)
        found = mean[self._cells]
        folded = np.linalg.norm(found[..., 6:9], axis=-1) < FOLD
        found[folded] = at[folded]
        smooth = np.zeros((*v.shape[:2], 3, 3))
        entries = np.einsum("gn,cnk->cgk", self._down, found[..., :6])
        smooth[..., rows, columns] = entries
        smooth[..., columns, rows] = entries
        back = np.einsum("cgij,cgai,cgbj->cgab", smooth, e, e)
        kept = np.stack([back[..., 0, 0], back[..., 1, 1], back[..., 0, 1] / half], axis=-1)
        return np.asarray(v - kept)


def _table(element: basix.finite_element.FiniteElement, points: Any) -> Floats:
    """Values of the functions of a scalar element at points, shape (points, functions)."""
    return np.asarray(element.tabulate(0, points))[0, :, :, 0]
