"""Quadrature rules of the integrals over shells (design, section 3) and beams."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import basix
import numpy as np
import ufl
from dolfinx import mesh
from ufl import Form
from ufl.core.expr import Expr

# Weight of the three points inside a triangle; the rest is that of the middles of its sides. With
# 0.9 the rule is of degree 3; the more the middles weigh, where elements share their displacements,
# the less do distorted ones lock in thin curved bodies that bend. Any weight is of degree 2, which
# is all that forces and strains of the nodes need.
INSIDE = 2 / 3
# Bubbles do need degree 3: by this rule a linear force works on their strains too much by
# (3 INSIDE + 9 (1 - INSIDE)) / 3.6, on any element, so that they count for less in strains.
BUBBLES = 3.6 / (9 - 6 * INSIDE)


@dataclass(frozen=True)
class Rules:
    """Measures over the surface of a shell, or the line of a beam.

    Args:
        full: Rule for bending, inertia, loads and the fully integrated share of the rest.
        reduced: Rule of the mixed resultants.
        nodes: Rule whose points are the nodes, so that the director is of unit length at each.
        lines: Rules with one more Gauss point along the second and along the first coordinate of
            the element, for the hourglass control; None on triangles and lines.
    """

    full: ufl.Measure
    reduced: ufl.Measure
    nodes: ufl.Measure
    lines: tuple[ufl.Measure, ufl.Measure] | None


def quadrature_rules(domain: mesh.Mesh, degree: int) -> Rules:
    """Rules for a surface mesh.

    Args:
        domain: The mesh.
        degree: Degree of displacement and director.
    """

    def measure(metadata: dict[str, Any]) -> ufl.Measure:
        return ufl.Measure("dx", domain, metadata=metadata)

    if domain.basix_cell() == basix.CellType.triangle:
        points = basix.create_element(basix.ElementFamily.P, basix.CellType.triangle, 2).points
        return Rules(
            measure({"quadrature_degree": 4}),
            measure(_triangle()),
            measure(custom(points, np.full(6, 1 / 12))),
            None,
        )
    few, many = (np.polynomial.legendre.leggauss(n) for n in (degree, degree + 1))
    lines = []
    for (xi, w_xi), (eta, w_eta) in ((few, many), (many, few)):
        # from [-1, 1] to [0, 1]
        points = np.array([[(1 + a) / 2, (1 + b) / 2] for a in xi for b in eta])
        lines.append(measure(custom(points, np.outer(w_xi, w_eta).ravel() / 4)))
    return Rules(
        measure({"quadrature_degree": 2 * degree + 1}),
        measure({"quadrature_degree": 2 * degree - 1}),
        measure({"quadrature_rule": "GLL", "quadrature_degree": 2 * degree - 1}),
        (lines[0], lines[1]),
    )


def over_surface(rules: Rules, densities: Sequence[Expr]) -> Form:
    """Integral of densities over a shell, for the full and the reduced rule.

    Args:
        rules: The rules.
        densities: The densities.
    """
    return densities[0] * rules.full + densities[1] * rules.reduced


def over_lines(rules: Rules, factor: Expr, densities: Sequence[Expr]) -> Form:
    """Difference of the finer rules and the reduced rule of a pair of densities.

    Args:
        rules: Rules, with those of lines.
        factor: Factor of both densities.
        densities: The densities.
    """
    assert rules.lines is not None
    first, second = (factor * density for density in densities)
    dx1, dx2 = rules.lines
    return first * dx1 + second * dx2 - (first + second) * rules.reduced


def over_line(rule: ufl.Measure, densities: Sequence[Expr]) -> Form:
    """Integral of a density over a beam.

    Args:
        rule: The rule.
        densities: The density.
    """
    return densities[0] * rule


def _triangle() -> dict[str, Any]:
    """Rule of the mixed resultants of triangles: points inside, and the middles of the sides."""
    inside, middles = np.array([[4, 1], [1, 4], [1, 1]]) / 6, np.array([[1, 1], [0, 1], [1, 0]]) / 2
    return custom(np.concatenate([inside, middles]), np.repeat([INSIDE, 1 - INSIDE], 3) / 6)


def line_rules(domain: mesh.Mesh, degree: int) -> Rules:
    """Rules for the mesh of a beam.

    Args:
        domain: The mesh.
        degree: Degree of displacement and directors.
    """

    def measure(metadata: dict[str, Any]) -> ufl.Measure:
        return ufl.Measure("dx", domain, metadata=metadata)

    return Rules(
        measure({"quadrature_degree": 2 * degree + 1}),
        # as many Gauss points as the degree
        measure({"quadrature_degree": 2 * degree - 1}),
        measure({"quadrature_rule": "GLL", "quadrature_degree": 2 * degree - 1}),
        None,
    )


def custom(points: Any, weights: Any) -> dict[str, Any]:
    """Metadata of a rule given by its points and weights on the reference cell."""
    return {
        "quadrature_rule": "custom",
        "quadrature_points": points,
        "quadrature_weights": weights,
    }
