"""Spaces of forces of shells, with the points where the strains are taken that they work on.

Strains are covariant tensors of the reference cell: along lines where neighbouring elements see the
same, their components are interpolated (K. J. Bathe, E. N. Dvorkin, Int. J. Numer. Meth. Eng. 21
(1985) 367-383; M. L. Bucalem, K. J. Bathe, ibid. 36 (1993) 3729-3754; M. Neunteufel, J. Schoeberl,
J. Comput. Phys. 442 (2021) 110463). Forces are in the dual space, in contravariant components, so
that each works on values of the strains at such points:

=============  ===============================================================================
quadrilateral  11 at k Gauss points along the first coordinate and k + 1 from edge to edge along the
               second one, 22 the other way round, 12 at k x k Gauss points; of these polynomials
               what has no mean, and in its place what is constant in space: forces that are in
               equilibrium with a uniform strain are there on any mesh. Shear: 13 where 11 is, 23
               where 22 is; of these polynomials those of degree k - 1 in each coordinate, and the
               highest one, which works on the only bending that k x k Gauss points do not see.
triangle       membrane: along each edge at two Gauss points, and the mean inside (Regge's element
               of degree 1). Shear: the mean along each edge (Nedelec's element of degree 0).
=============  ===============================================================================

A force whose functional is not a sum over Gauss points has two values: its weight where strains are
taken, and the force itself.
"""

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, NamedTuple

import basix
import basix.ufl
import numpy as np
from basix import CellType
from dolfinx import mesh

from shellmb.arrays import Floats
from shellmb.meshes.raw import interval_nodes

# An element of Basix, whose class has no public name
Element = Any
# values of some functions at points, shape (functions, points, components)
Functions = Callable[[Floats], Floats]
# degrees of polynomials in the first and the second coordinate
Powers = Sequence[tuple[int, ...]]

# What forces of twist of nine-node elements have beside them, times how far a cell is from a
# parallelogram: so they see, to first order in that, the same of cubic displacements as of their
# interpolation.
BESIDE_TWIST = 5 / 3


class Rule(NamedTuple):
    """Points where strains are taken.

    Args:
        points: On the reference cell, shape (n, 2).
        weights: Their weights, shape (n,).
        strains: Numbers of the strains that are taken there: 11, 22, 2*12, 13, 23.
    """

    points: Floats
    weights: Floats
    strains: tuple[int, ...]


class Forces(NamedTuple):
    """A space of forces.

    Args:
        element: The element.
        weights: Components of its values that weigh strains at the points, for each strain.
        polynomials: Components that are the forces 11, 22, 12, 13, 23 in contravariant components.
        constants: Components of membrane forces that are constant in space, if there are.
        twists: Components 11, 22 of what forces of twist have beside them, by how far a cell is
            from a parallelogram, if there are.
        rules: Where strains are taken.
    """

    element: Element
    weights: tuple[int, ...]
    polynomials: tuple[int, ...]
    constants: tuple[int, ...]
    twists: tuple[int, ...]
    rules: tuple[Rule, ...]


@cache
def shell_forces(cell: CellType, degree: int) -> Forces:
    """Forces of shells whose displacements are of a degree.

    Args:
        cell: Triangle or quadrilateral.
        degree: Degree of displacements and directors; 2 on triangles.
    """
    return _triangle() if cell == CellType.triangle else _quadrilateral(degree)


def coordinate_element(domain: mesh.Mesh) -> Any:
    """Element of Basix that gives cells of a mesh their shape."""
    described = domain.ufl_domain()
    assert described is not None
    return described.ufl_coordinate_element().sub_elements[0].basix_element


def cell_squares(domain: mesh.Mesh) -> Floats:
    """Sum of the squares of the sides of each cell of this rank over four, ghosts included, m^2."""
    sides = np.array(basix.topology(domain.basix_cell())[1])
    ends = domain.geometry.x[domain.geometry.dofmaps[0][:, sides]]
    return np.asarray(np.sum((ends[:, :, 1] - ends[:, :, 0]) ** 2, axis=(1, 2)) / 4)


def cell_directions(domain: mesh.Mesh) -> Floats:
    """First line through the middle of each cell of this rank, ghosts included, shape (c, 3)."""
    middle = _corners(domain.basix_cell()).mean(axis=0, keepdims=True)
    return tangents_at(domain, middle)[0][:, 0]


def cell_bows(domain: mesh.Mesh) -> Floats:
    """Distances of cells of this rank from parallelograms, ghosts included, shape (c, 2).

    Half the change of the tangents from side to side, in the basis of those in the middle.
    """
    a, b, c, d = np.moveaxis(domain.geometry.x[domain.geometry.dofmaps[0][:, :4]], 1, 0)
    basis = np.stack([b + d - a - c, c + d - a - b], axis=2) / 2
    return np.asarray(np.linalg.pinv(basis) @ (a + d - b - c)[:, :, None] / 2)[:, :, 0]


def tangents_at(domain: mesh.Mesh, points: Floats) -> tuple[Floats, Floats]:
    """Derivatives of the position by the coordinates of the reference cell, shape (c, n, 3)."""
    _, *slopes = coordinate_element(domain).tabulate(1, points)[..., 0]
    nodes = domain.geometry.x[domain.geometry.dofmaps[0]]
    first, second = (np.einsum("pn,cni->cpi", slope, nodes) for slope in slopes)
    return first, second


def _quadrature(cell: CellType, degree: int) -> tuple[Floats, Floats]:
    """Points and weights, which Basix's stubs take for anything like arrays."""
    points, weights = basix.make_quadrature(cell, degree)
    return np.asarray(points), np.asarray(weights)


def _corners(cell: CellType) -> Floats:
    return np.asarray(basix.geometry(cell))


def _gauss(n: int) -> tuple[Floats, Floats]:
    points, weights = _quadrature(CellType.interval, 2 * n - 1)
    return points[:, 0], weights


def _quadrilateral(degree: int) -> Forces:
    k = degree
    (inner, weights), edges = _gauss(k), interval_nodes(k)
    membrane, shear, rules = [], [], []
    for number, lines in enumerate(((inner, edges), (edges, inner))):
        points = _grid(*lines)
        orders = len(lines[0]) - 1, len(lines[1]) - 1
        powers = list(np.ndindex(*(n + 1 for n in orders)))
        bending = [p for p in powers if max(p) < k or p == orders]
        membrane.append(_line_element(points, orders, powers[1:]))
        shear.append(_line_element(points, orders, bending))
        rules.append(Rule(points, np.ones(len(points)), (number, number + 3)))
    both = _grid(inner, inner)
    rules.append(Rule(both, np.outer(weights, weights).ravel(), (2,)))
    twist, cell = _tensor(list(np.ndindex(k, k))[1:]), CellType.quadrilateral
    constant = basix.ufl.element("DG", cell, 0, shape=(3,))
    if k > 2:
        membrane += [_custom(cell, twist, 1, k - 1), constant]
        element = basix.ufl.mixed_element([*membrane, *shear])
        return Forces(element, (0, 2, 4, 8, 10), (1, 3, 4, 9, 11), (5, 6, 7), (), tuple(rules))
    membrane += [_custom(cell, _twisting, 3, 2), constant]
    element = basix.ufl.mixed_element([*membrane, *shear])
    places = (0, 2, 4, 10, 12), (1, 3, 4, 11, 13), (7, 8, 9), (5, 6)
    return Forces(element, *places, tuple(rules))


def _twisting(x: Floats) -> Floats:
    """Twist, linear in the second, in the first and in both coordinates, and what is beside it."""
    values = np.polynomial.legendre.legvander(2 * x - 1, 2)
    (a, b), (a2, b2) = values[..., 1].T, BESIDE_TWIST * values[..., 2].T
    nothing = 0 * a
    every = (b, nothing, b2), (a, a2, nothing), (a * b, nothing, nothing)
    return np.stack([np.stack(found, axis=-1) for found in every])


def _line_element(points: Floats, orders: tuple[int, int], powers: Powers) -> Element:
    """Forces along one coordinate, with their weights at the points of strains.

    Args:
        points: Where strains are taken.
        orders: Degrees of the polynomials that have any values there.
        powers: Degrees of those of them that are forces.
    """
    cell, degree = CellType.quadrilateral, max(orders)
    whole = _tensor(list(np.ndindex(*(n + 1 for n in orders))))
    functions = _tensor(powers)
    x, w = _quadrature(cell, 2 * degree)
    # polynomials with given values at the points, which strains are, too
    through = np.linalg.inv(whole(points)[..., 0])
    shapes = np.einsum("pm,mq->pq", through, whole(x)[..., 0])
    weights = np.einsum("fq,pq,q->fp", functions(x)[..., 0], shapes, w)

    def pair(x: Floats) -> Floats:
        at_points = np.einsum("fp,pm,mq->fq", weights, through, whole(x)[..., 0])
        return np.stack([at_points, functions(x)[..., 0]], axis=-1)

    return _custom(cell, pair, 2, degree)


def _triangle() -> Forces:
    cell = CellType.triangle
    gauss, _ = _gauss(2)
    corners = _corners(cell)
    on_edges, along = [], []
    for a, b in basix.topology(cell)[1]:
        t = corners[b] - corners[a]
        on_edges += [corners[a] + x * t for x in gauss]
        along += [t, t]
    inside, means = _quadrature(cell, 2)
    points, t = np.concatenate([on_edges, inside]), np.array(along)
    n = len(t)
    membrane = np.zeros((n + 3, len(points), 3))
    for i in range(n):
        membrane[i, i] = t[i, 0] ** 2, t[i, 1] ** 2, t[i, 0] * t[i, 1]
    for c in range(3):
        membrane[n + c, n:, c] = means
    shear = np.zeros((n // 2, len(points), 2))
    for i in range(n):
        shear[i // 2, i] = t[i] / 2

    def tensors(x: Floats) -> Floats:
        ones = np.stack([np.ones(len(x)), *x.T])
        return np.einsum("fp,cd->fcpd", ones, np.eye(3)).reshape(-1, len(x), 3)

    def edges(x: Floats) -> Floats:
        turned = np.stack([-x[:, 1], x[:, 0]], axis=1)
        constant = np.broadcast_to(np.eye(2)[:, None], (2, len(x), 2))
        return np.concatenate([constant, turned[None]])

    parts = [_pair_element(points, f, s) for f, s in ((membrane, tensors), (shear, edges))]
    rule = Rule(points, np.ones(len(points)), (0, 1, 2, 3, 4))
    element = basix.ufl.mixed_element(parts)
    return Forces(element, (0, 1, 2, 6, 7), (3, 4, 5, 8, 9), (), (), (rule,))


def _pair_element(points: Floats, functionals: Floats, strains: Functions) -> Element:
    """Forces that are dual to functionals of strains, with their weights at the points.

    Args:
        points: Where strains are taken.
        functionals: Their weights there, shape (functionals, points, components).
        strains: The strains that are interpolated.
    """
    cell, size = CellType.triangle, functionals.shape[-1]
    dual = np.linalg.inv(np.einsum("fpc,npc->fn", functionals, strains(points)))
    x, w = _quadrature(cell, 4)

    def interpolated(x: Floats) -> Floats:
        return np.einsum("nqc,nf->fqc", strains(x), dual)

    gram = np.einsum("fqc,gqc,q->fg", interpolated(x), interpolated(x), w)
    inverse = np.linalg.inv(gram)
    # cubic functions have any values at the points
    fitted = np.einsum("fpc,pm->fcm", functionals, np.linalg.pinv(_monomials(3, points)))

    def pair(x: Floats) -> Floats:
        at_points = np.einsum("fcm,mq->fqc", fitted, _monomials(3, x))
        forces = np.einsum("fg,gqc->fqc", inverse, interpolated(x))
        return np.concatenate([at_points, forces], axis=-1)

    return _custom(cell, pair, 2 * size, 3)


def _grid(first: Floats, second: Floats) -> Floats:
    return np.array([[a, b] for a in first for b in second])


def _tensor(powers: Powers) -> Functions:
    """Products of Legendre's polynomials of two degrees, orthogonal to one another."""
    first, second = np.transpose(powers)

    def functions(x: Floats) -> Floats:
        values = np.polynomial.legendre.legvander(2 * x - 1, np.max(powers))
        return (values[:, 0, first] * values[:, 1, second]).T[..., None]

    return functions


def _monomials(degree: int, x: Floats) -> Floats:
    powers = [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]
    return np.array([x[:, 0] ** i * x[:, 1] ** j for i, j in powers])


def _custom(cell: CellType, functions: Functions, size: int, degree: int) -> Element:
    """A discontinuous element of functions, with their coefficients as unknowns.

    Args:
        cell: Its cell.
        functions: They, with values of shape (size,).
        size: Number of values.
        degree: Highest degree of the polynomials.
    """
    x, w = _quadrature(cell, 2 * degree)
    values = functions(x)
    legendre: Floats = np.asarray(
        basix.tabulate_polynomials(basix.PolynomialType.legendre, cell, degree, x)
    )
    coefficients = np.einsum("nqc,bq,q->ncb", values, legendre, w).reshape(len(values), -1)
    gram = np.einsum("nqc,mqc,q->nm", values, values, w)
    moments = np.einsum("nm,mqc,q->ncq", np.linalg.inv(gram), values, w)[..., None]
    orthogonal = np.ascontiguousarray(np.linalg.qr(coefficients.T)[0].T)
    topology = basix.topology(cell)
    points: Any = [[np.zeros((0, 2)) for _ in entities] for entities in topology]
    matrices: Any = [[np.zeros((0, size, 0, 1)) for _ in entities] for entities in topology]
    points[2], matrices[2] = [x], [np.ascontiguousarray(moments)]
    points.append([])
    matrices.append([])
    return basix.ufl.custom_element(
        cell,
        [size] if size > 1 else [],
        orthogonal,
        points,
        matrices,
        0,
        basix.MapType.identity,
        basix.SobolevSpace.L2,
        True,
        0,
        degree,
        basix.PolysetType.standard,
    )
