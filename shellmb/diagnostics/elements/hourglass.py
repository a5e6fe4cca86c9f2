"""Modes of a shell that its elements hardly resist: they are none of the structure.

The strains that membrane forces of quadrilaterals see vanish for three motions along the surface,
of the nodes of an element against one another. Only hourglass control resists them, which falls as
`t/h`, so that on coarse meshes they may vibrate below the first true mode along the surface. Of
triangles the bubble is in all such motions: along the surface it goes with vertices against middles
of sides, across it alone, and compression buckles it before the structure where elements are large
or long. Of true modes these are the parts that elements of their size do not resolve.

Across a curved surface they are more: what vanishes where membrane forces are sampled stretches
the surface elsewhere only, so that of a pressurised membrane nothing but its prestress resists it.
A mode of which this is the larger part is none of the structure if these strains, of which its
elements see nothing, would have more energy than the mode has. Of a flat sheet, which moves across
its surface without any, it is a true one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import cached_property
from typing import NamedTuple

from mpi4py import MPI

import basix
import numpy as np

from shellmb.arrays import Floats
from shellmb.model.model import Model
from shellmb.model.shells.shell import ShellModel

# part of the square of a motion from which on a mode is none of the structure: of false ones it is
# 0.4 to 1, of true ones, as far as their frequencies and load factors are within 3 %, 0.06 at most
MOST = 0.3
# the same with what vanishes across a surface where membrane forces are sampled: false of coarse
# octants and tubes had 0.7 to 1; from 0.4 to 0.6 it is not known which are true; chosen from these
ALTERNATING = 0.5
# strains relative to the largest ones that are none
NONE = 1e-10
# displacements without rigid ones that are round-off, relative to places, and what Newton's method
# leaves, relative to all displacements
ROUND_OFF, LEFT = 1e-12, 1e-8
# small displacements, relative to the square root of the surface
SMALL = 1e-6
# so many modes are listed one by one
LISTED = 8


def unresisted_modes(
    model: Model,
    modes: Iterable[tuple[int, float, Sequence[Callable[[str], Floats]]]],
    what: tuple[str, str],
    state: Callable[[str], Floats] | None = None,
) -> list[str]:
    """Sentences on modes that elements hardly resist; collective.

    Args:
        model: The bodies.
        modes: Number of each elastic mode, its strain energy, J (infinite where it is not known),
            and its real and imaginary part by names of bodies.
        what: What is false of one of them, and of several.
        state: Local arrays of the state they are about, by names of bodies; None: the reference.
    """
    said, every = [], list(modes)
    for name, body in model.shells.items():
        look = Unresisted(body, None if state is None else state(name))
        found = [n for n, energy, parts in every if look.false(energy, *(p(name) for p in parts))]
        if not found:
            continue
        which = f"mode {found[0]} and its {what[0]}"
        if len(found) > 1:
            listed = ", ".join(map(str, found))
            if len(found) > LISTED:
                listed = f"{found[0]} to {found[-1]} ({len(found)} of them)"
            which = f"modes {listed} and their {what[1]}"
        helps = ", or quadrilaterals" if look.triangles else ""
        said.append(
            f"{which} are false: nodes of shell '{name}' move against one another within each "
            f"element there, which its elements hardly resist; use a finer mesh{helps}"
        )
    return said


class Unresisted:
    """Tells which part of a motion the elements of a shell hardly resist.

    Args:
        body: The shell.
        state: Local array of the displacement that motions are about; None: none.

    Attributes:
        triangles: Whether its elements are triangles.
    """

    def __init__(self, body: ShellModel, state: Floats | None = None) -> None:
        space, dofs = body.mixed.subspaces["u"], body.mixed.dofs
        domain, element = space.mesh, space.element.basix_element
        cell, self._comm = element.cell_type, domain.comm
        nodes = space.dofmap.list[: domain.topology.index_map(2).size_local]
        self._places, elements = dofs["u"].reshape(-1, 3)[nodes], [element]
        self.triangles = "bubble" in dofs
        if self.triangles:
            bubbles = body.mixed.subspaces["bubble"]
            own = dofs["bubble"].reshape(-1, 3)[bubbles.dofmap.list[: len(nodes)]]
            self._places = np.concatenate([self._places, own], axis=1)
            elements.append(bubbles.element.basix_element)
        points, weights = map(np.asarray, basix.make_quadrature(cell, 2 * element.degree + 2))
        values = np.hstack([_slopes(e, points, 0) for e in elements])
        self._mass = values.T @ (weights[:, None] * values)
        middle = np.mean(basix.geometry(cell), axis=0)[None]
        self._slopes = slopes = np.concatenate([_slopes(element, middle, k) for k in (1, 2)])
        self._x = space.tabulate_dof_coordinates()[nodes]
        if state is not None:
            self._x = self._x + state[dofs["u"].reshape(-1, 3)[nodes]]
        self._element, self._stiffness = element, body.section.sizes.stiffness
        self._tangents = slopes @ self._x
        self._area = np.linalg.norm(np.cross(self._tangents[:, 0], self._tangents[:, 1]), axis=1)
        if not self.triangles:
            self._back = _inverse(self._tangents)
            self._motions = _without_strains(element, self._mass)

    def false(self, energy: float, *q: Floats) -> bool:
        """Decide whether a mode is none of the structure; collective.

        Args:
            energy: Its strain energy, J.
            q: Local arrays of the motion: its real part, and its imaginary part if it has one.
        """
        sizes = np.sum([self._sizes(values[self._places]) for values in q], axis=0)
        self._comm.Allreduce(MPI.IN_PLACE, sizes)
        every, along, both, unseen = sizes
        return bool(along > MOST * every or (both > ALTERNATING * every and unseen > energy))

    def _sizes(self, u: Floats) -> Floats:
        """Squares of a motion, its part along and that and across, and energy elements miss."""
        every, along = self._size(u), self._size(self._within(u))
        if self.triangles:
            return np.array([every, along, 0.0, 0.0])
        unseen = self._stretch(u, 1) - self._stretch(u, -1)
        return np.array([every, along, along + self._across(u), unseen])

    def _across(self, u: Floats) -> float:
        """Square of what a motion across the surface is but for its values at the points."""
        element, root = self._element, np.linalg.cholesky(self._mass).T
        nodes = np.asarray(element.points, np.float64)
        normals = np.cross(*(_slopes(element, nodes, k) @ self._x for k in (1, 2)))
        normals /= np.linalg.norm(normals, axis=2, keepdims=True)
        at = np.asarray(basix.make_quadrature(element.cell_type, 2 * element.degree - 1)[0])
        free = np.linalg.svd(_slopes(element, at, 0) @ np.linalg.inv(root))[2][len(at) :]
        return float(self._area @ np.sum((np.sum(u * normals, 2) @ (free @ root).T) ** 2, 1))

    def _stretch(self, u: Floats, more: int) -> float:
        """Energy of strains along the surface by a rule of degree 2 k + `more`, J."""
        element = self._element
        degree = 2 * element.degree + more
        points, weights = map(np.asarray, basix.make_quadrature(element.cell_type, degree))
        slopes = np.stack([_slopes(element, points, k) for k in (1, 2)], axis=1)
        tangents, moved = (np.einsum("pan,cni->cpai", slopes, v) for v in (self._x, u))
        metric, strain = (tangents @ v.swapaxes(2, 3) for v in (tangents, moved))
        mixed = np.linalg.solve(metric, (strain + strain.swapaxes(2, 3)) / 2)
        squares = np.einsum("cpab,cpba->cp", mixed, mixed) * np.sqrt(np.linalg.det(metric))
        return float(self._stiffness / 2 * np.sum(squares @ weights))

    def shares(self, q: Floats, small: bool) -> Floats:
        """Mean squares of a displacement of quadrilaterals, but for rigid motions; collective.

        Args:
            q: Local array of the displacement.
            small: Whether it counts as a small one, whatever its size.

        Returns:
            Of the part that they hardly resist, and of all of it, m^2.
        """
        u, rest = q[self._places], self._rest
        far = self._comm.allreduce(float(np.abs(u).max(initial=0.0)), op=MPI.MAX)
        if far == 0:
            return np.zeros(2)
        factor = SMALL * np.sqrt(rest.surface) / far if small else 1.0
        y = self._x + factor * u
        # along the lines of the element as they are now, and in their units
        own = (y @ _inverse(self._slopes @ y) - rest.own) @ self._tangents
        sizes = np.array([self._size(self._within(own)), self._size(self._strained(y))])
        self._comm.Allreduce(MPI.IN_PLACE, sizes)
        sizes /= rest.surface
        least = max(LEFT * factor * far, ROUND_OFF * rest.far)
        return sizes / factor**2 if sizes[1] > least**2 else np.zeros(2)

    @cached_property
    def _rest(self) -> _Rest:
        """The shell before it moves; collective."""
        x, weights = self._x, self._mass.sum(axis=1) * self._area[:, None]
        sums = np.array([weights.sum(), *np.einsum("cn,cni->i", weights, x)])
        self._comm.Allreduce(MPI.IN_PLACE, sums)
        far = self._comm.allreduce(float(np.abs(x).max(initial=0.0)), op=MPI.MAX)
        arms = x - sums[1:] / sums[0]
        with_one = np.concatenate([np.ones((*x.shape[:2], 1)), arms], axis=2)
        moments = weights[:, :, None] * with_one / sums[0]
        return _Rest(float(sums[0]), far, x @ self._back, arms, moments.reshape(-1, 4).T)

    def _strained(self, y: Floats) -> Floats:
        """Displacement to places, less the rigid motion next to it, turned back by its rotation."""
        rest = self._rest
        sums = rest.moments @ y.reshape(-1, 3)
        self._comm.Allreduce(MPI.IN_PLACE, sums)
        left, _, right = np.linalg.svd(sums[1:])
        left[:, 2] *= np.linalg.det(left @ right)
        return np.asarray((y - sums[0]) @ (left @ right).T - rest.arms)

    def _within(self, u: Floats) -> Floats:
        if self.triangles:
            return u * (np.arange(u.shape[1]) == u.shape[1] - 1)[:, None]
        along = u @ self._tangents.transpose(0, 2, 1)
        motions = self._motions.transpose(0, 2, 1).reshape(len(self._motions), -1)
        # a rank may have no cells
        amounts = (self._mass @ along).reshape(len(u), motions.shape[1]) @ motions.T
        return np.asarray((amounts @ motions).reshape(along.shape) @ self._back.transpose(0, 2, 1))

    def _size(self, u: Floats) -> float:
        return float(np.einsum("cni,cni,c->", self._mass @ u, u, self._area))


class _Rest(NamedTuple):
    """A shell before it moves.

    Args:
        surface: Its surface, m^2.
        far: Its largest coordinate, m.
        own: Places of nodes along the lines of their elements, shape (cells, nodes, 2).
        arms: Places of nodes from its centre, shape (cells, nodes, 3), m.
        moments: Weights of nodes in means over the surface, and those times the arms, shape (4,
            cells nodes).
    """

    surface: float
    far: float
    own: Floats
    arms: Floats
    moments: Floats


def _inverse(tangents: Floats) -> Floats:
    """Vectors that give components along pairs of tangents, shape (cells, 3, 2), 1/m."""
    along = tangents.transpose(0, 2, 1)
    return np.asarray(along @ np.linalg.inv(tangents @ along))


def _slopes(element: basix.finite_element.FiniteElement, points: Floats, by: int) -> Floats:
    """Values (0) or derivatives by a coordinate (1, 2) of functions, shape (points, functions)."""
    return np.asarray(element.tabulate(1, points))[by, :, :, 0]


def _without_strains(element: basix.finite_element.FiniteElement, mass: Floats) -> Floats:
    """Motions along a quadrilateral without strains where forces are, but for rigid ones.

    Args:
        element: Its functions.
        mass: Their mass matrix, shape (n, n).

    Returns:
        Components along the coordinates of the cell, shape (motions, 2, n), orthonormal by that
        matrix.
    """
    at = np.asarray(basix.make_quadrature(element.cell_type, 2 * element.degree - 1)[0])
    first, second = (_slopes(element, at, k) for k in (1, 2))
    none, x, n = np.zeros_like(first), np.asarray(element.points, np.float64), len(mass)
    rigid = np.zeros((2, n, 3))
    rigid[0, :, 0] = rigid[1, :, 1] = 1.0
    rigid[:, :, 2] = -x[:, 1], x[:, 0]
    root = np.kron(np.eye(2), np.linalg.cholesky(mass).T)
    strains = np.block([[first, none], [none, second], [second, first]]) @ np.linalg.inv(root)
    held = np.linalg.qr(root @ rigid.reshape(2 * n, 3))[0].T
    _, sizes, rows = np.linalg.svd(np.vstack([strains, np.linalg.norm(strains) * held]))
    sizes = np.append(sizes, np.zeros(2 * n - len(sizes)))
    free = rows[sizes <= NONE * sizes[0]]
    return np.asarray((free @ np.linalg.inv(root).T).reshape(-1, 2, n))
