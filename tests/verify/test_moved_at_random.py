"""Hypars whose nodes are moved at random: rows as of issue 50, beside those of `shellmb verify`."""

import numpy as np
import pytest

from shellmb.arrays import Floats
from shellmb.demos.verification.problems.elements.curved import half_hypar
from shellmb.demos.verification.problems.elements.rows import MOVED, Mesh
from shellmb.meshes.raw import (
    boundary_facets,
    geometry_element,
    shape_functions,
    vertex_count,
)
from shellmb.meshes.surfaces import structured


def moved(plan: structured.Layout, fraction: float, seed: int = 1) -> Floats:
    """Coordinates of nodes whose vertices are moved along each axis, as `structured.distorted`."""
    count = vertex_count(plan.cell)
    vertices = np.unique(plan.cells[:, :count])
    inner = np.setdiff1d(vertices, boundary_facets(plan.cells, plan.cell)[0])
    x = plan.plane
    inner = inner[np.lexsort(np.round(x[inner], 9).T[::-1])]
    cells = [len(np.unique(np.round(x[vertices, k], 9))) - 1 for k in range(2)]
    away = np.random.default_rng(seed).uniform(-1, 1, (len(inner), 2))
    shift = np.zeros_like(x)
    shift[inner] = fraction * away * np.ptp(x, axis=0) / cells
    order = 1 if plan.cells.shape[1] == count else 2
    points = np.asarray(geometry_element(plan.cell, order).points)
    shift[plan.cells] = shape_functions(plan.cell, 1, points) @ shift[plan.cells[:, :count]]
    return np.asarray(x + shift)


@pytest.mark.parametrize(
    ("size", "thickness", "value", "trial"),
    [
        ((16, 8), 1e-3, 0.987, 1.017),
        ((16, 8), 1e-4, 0.899, 0.888),
        pytest.param((32, 16), 1e-4, 0.977, 0.964, marks=pytest.mark.slow),
    ],
)
def test_quadrilaterals(monkeypatch, size, thickness: float, value: float, trial: float) -> None:
    """Deflection over the reference: at least as near to it as the trial of the element."""
    monkeypatch.setattr(structured, "distorted", moved)
    found = half_hypar(Mesh("quad", size, MOVED), thickness)[""]
    assert found == pytest.approx(value, abs=1e-3)
    assert abs(found - 1) < abs(trial - 1)
