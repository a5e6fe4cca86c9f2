"""How distorted quadrilaterals lock where a thin curved body bends.

Bending a curved surface without stretching it asks for displacements along it that stand in ratio
to those across. Elements that are no parallelograms cannot follow: over an element whose normal
turns by `kappa h` a curvature `chi` leaves membrane strains of the size `d kappa h * h chi`, `d`
being the part of its shape that is no parallelogram, beside bending strains of `t chi`. Whether a
body can lock is thus a matter of its mesh, `p = d kappa h * h / t`. By how much it does the run
shows: these strains change sign within elements and jump between them, while true ones are smooth
on any mesh that is fine enough. The energy of what membrane forces differ by from their means at
the nodes (O. C. Zienkiewicz and J. Z. Zhu, Int. J. Numer. Meth. Engng 24 (1987) 337-357), as a
share `s` of the strain energy, is what the body is too stiff by, `s / (1 - 3 s / 2)`: the body
wrinkles to lessen it, which takes half as much again in bending.

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
from shellmb.forms.steps.mixed import LinearMixed
from shellmb.meshes.spaces import reading_element
from shellmb.model.shells.shell import ShellModel
from shellmb.native.expressions import compiled_expression

# of stiffness: what smooth fields leave on coarse meshes stays below
BOUND = 0.03
# `p`, root of the mean square, below which nothing was too stiff by BOUND
PRONE = 2.0
# from which on the estimate is too low: of the excess, and of `p`
MUCH, FAR = 0.4, 20.0


class Held(NamedTuple):
    """Where a body is held by forces of little energy.

    Args:
        least: `s p` beyond which it is: with degree 2 regular meshes of trapezoids have 0.06, and
            what is too stiff has 1.8 and more; with degree 3 these are 4 and 85.
        each: `p` over what the body is then too stiff by at least.
        most: What it is then too stiff by at least however large `p` is.
    """

    least: float
    each: float
    most: float


HELD = {2: Held(1.0, 500.0, 1.0), 3: Held(30.0, 5000.0, 0.3)}
# of a body that does not stretch: of `s`, and what it is too stiff by at least
MULTIPLE, LEAST = 20.0, 0.1
# sides that are parallel to this part of the thickness
NOTHING = 1e-6

# cosine of an angle of 20 degrees: fields are not continued across folds
FOLD = 0.94


class Excess(NamedTuple):
    """What a body is too stiff by, as a part of its stiffness.

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
    """What a body is too stiff by.

    Args:
        body: The shell.
        share: Of jumps of membrane forces in its strain energy, `s`.
        prone: How far its mesh makes it lock, `p`.
    """
    if not body.shell.stretching:
        return Excess(LEAST if share > MULTIPLE else 0.0, True)
    value = share / max(1 - 1.5 * share, 0.2)
    held = HELD[body.shell.degree]
    if prone > FAR and share * prone > held.least:
        value = max(value, min(prone / held.each, held.most))
    return Excess(value, value > MUCH or prone > FAR)


def least(body: ShellModel) -> float:
    """`p` below which nothing locks; bodies that do not stretch do so wherever it is not zero."""
    return PRONE if body.shell.stretching else NOTHING


def why(body: ShellModel, share: float) -> str:
    """What is wrong and what helps, in words; arguments as of `excess`."""
    if not body.shell.stretching:
        return (
            "on distorted quadrilaterals a curved body that is held not to stretch cannot bend as "
            "it should; use a regular mesh, or stretching=True"
        )
    return (
        f"{100 * share:.3g} % of its strain energy is of membrane forces that jump between "
        "elements, as those of distorted quadrilaterals do where a thin curved body bends; use a "
        "finer or a more regular mesh, or degree=3"
    )


def places(body: ShellModel) -> Mesh | None:
    """The mesh of a shell, if it can lock; None where it cannot. Collective."""
    if body.mixed.space.mesh.basix_cell() != basix.CellType.quadrilateral:
        return None
    mesh = Mesh(body)
    return mesh if mesh.distorted else None


class Mesh:
    """How far a mesh makes a shell of quadrilaterals lock in bending.

    Args:
        body: The shell.

    Attributes:
        distorted: Whether there is anything but parallelograms on it, as seen from its surface.
    """

    def __init__(self, body: ShellModel) -> None:
        domain = body.mixed.space.mesh
        count = domain.topology.index_map(2).size_local
        # corners come first, in the order of a tensor product
        x = domain.geometry.x[domain.geometry.dofmaps[0][:count, :4]]
        self._comm, self._corners = domain.comm, body.mixed.subspaces["u"].dofmap.list[:count, :4]
        first = (x[:, 1] - x[:, 0] + x[:, 3] - x[:, 2]) / 2
        second = (x[:, 2] - x[:, 0] + x[:, 3] - x[:, 1]) / 2
        normal = np.cross(first, second)
        self._area = np.linalg.norm(normal, axis=1)
        normal /= self._area[:, None]
        bilinear = x[:, 0] - x[:, 1] - x[:, 2] + x[:, 3]
        bilinear -= np.sum(bilinear * normal, axis=1)[:, None] * normal
        # d h/t, with d over h
        self._shape = np.linalg.norm(bilinear, axis=1) / body.section.sizes.thickness
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
        d = directors[self._corners]
        return self._mean(self._shape * np.linalg.norm(d[:, [3, 2]] - d[:, [0, 1]], axis=2).max(1))


class Roughness:
    """Energy of what the membrane forces of a shell differ by from their means at the nodes.

    Args:
        body: A shell of quadrilaterals.
    """

    def __init__(self, body: ShellModel) -> None:
        mixed, inner = body.mixed, reading_element(body.mixed.subspaces["u"])
        domain, form = mixed.space.mesh, body.section.formulation
        nodes = basix.ufl.element("P", domain.basix_cell(), max(body.shell.degree - 1, 1))
        self._space = fem.functionspace(domain, basix.ufl.blocked_element(nodes, shape=(10,)))
        self._cells = self._space.dofmap.list[: domain.topology.index_map(2).size_local]
        at, points = nodes.basix_element.points, np.asarray(inner.points, dtype=np.float64)
        self._up = _table(inner, at)
        self._down = _table(nodes.basix_element, points)
        rule, weights = basix.make_quadrature(domain.basix_cell(), 2 * inner.degree)
        self._places = {
            part: mixed.dofs[part].reshape(-1, len(points), 5)[: len(self._cells), :, :3]
            for part in ("N", "S")
            if part in mixed.dofs
        }
        self._scale = body.section.sizes.stiffness
        area = ufl.JacobianDeterminant(domain)
        wanted = [area, *body.surface.e1, *body.surface.e2]
        if "S" not in self._places:
            assert isinstance(form, LinearMixed)
            # held strains have no compliance, but the section has
            compliance = ufl.inv(form.A) if form.A_inv is None else form.A_inv
            wanted += [compliance[i, j] for i in range(3) for j in range(3)]
        values = compiled_expression(ufl.as_vector(wanted), points)
        found = np.asarray(values.eval(domain, np.arange(len(self._cells), dtype=np.int32)))
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
        N = self._scale * self._rough(q[self._places["N"]], 1.0)
        if "S" in self._places:
            strain = self._rough(q[self._places["S"]], 0.5)
        else:
            strain = np.einsum("cgij,cgj->cgi", self._compliance, N)
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
