"""Quadrature rules of the integrals over shells and beams."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import basix
import numpy as np
import ufl
from dolfinx import mesh
from ufl import Form
from ufl.core.expr import Expr

from shellmb.meshes.tying import shell_forces


@dataclass(frozen=True)
class Rules:
    """Measures over the surface of a shell, or the line of a beam.

    Args:
        full: Rule for all that is integrated.
        nodes: Rule whose points are the nodes, so that the director is of unit length at each.
        taken: Points where strains are taken that forces of the elements work on.
    """

    full: ufl.Measure
    nodes: ufl.Measure
    taken: tuple[ufl.Measure, ...]


def quadrature_rules(domain: mesh.Mesh, degree: int) -> Rules:
    """Rules for a surface mesh.

    Args:
        domain: The mesh.
        degree: Degree of displacement and director.
    """
    cell = domain.basix_cell()
    taken = [custom(r.points, r.weights) for r in shell_forces(cell, degree).rules]
    if cell == basix.CellType.triangle:
        points = basix.create_element(basix.ElementFamily.P, cell, 2).points
        full, nodes = {"quadrature_degree": 4}, custom(points, np.full(6, 1 / 12))
    else:
        full = {"quadrature_degree": 2 * degree + 1}
        nodes = {"quadrature_rule": "GLL", "quadrature_degree": 2 * degree - 1}
    every = (ufl.Measure("dx", domain, metadata=metadata) for metadata in (full, nodes, *taken))
    whole, lumped, *others = every
    return Rules(whole, lumped, tuple(others))


def over_surface(rules: Rules, densities: Sequence[Expr]) -> Form:
    """Integral of densities over a shell, where strains are integrated and where they are taken.

    Args:
        rules: The rules.
        densities: The densities, of the first rules if they are fewer.
    """
    first, *others = densities
    return sum((d * dx for d, dx in zip(others, rules.taken, strict=False)), first * rules.full)


def over_line(rule: ufl.Measure, densities: Sequence[Expr]) -> Form:
    """Integral of a density over a beam.

    Args:
        rule: The rule.
        densities: The density.
    """
    return densities[0] * rule


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
        measure({"quadrature_rule": "GLL", "quadrature_degree": 2 * degree - 1}),
        # as many Gauss points as the degree
        (measure({"quadrature_degree": 2 * degree - 1}),),
    )


def custom(points: Any, weights: Any) -> dict[str, Any]:
    """Metadata of a rule given by its points and weights on the reference cell."""
    return {
        "quadrature_rule": "custom",
        "quadrature_points": points,
        "quadrature_weights": weights,
    }
