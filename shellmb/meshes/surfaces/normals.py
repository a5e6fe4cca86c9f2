"""Exact normals of a surface that is known by its map alone."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from shellmb.arrays import Floats
from shellmb.scene import Surface

__all__ = ["map_normals"]

STEP = 1e-5
SAMPLES = 101


def map_normals(surface: Surface) -> Callable[[Floats], Floats]:
    """Unit normals ``X_,xi x X_,eta`` at positions near a surface, by its map.

    The parameters of a position come from the nearest of a grid of samples and a few Gauss-Newton
    steps; derivatives from second-order differences that stay within the unit square.

    Args:
        surface: A surface with a map.

    Returns:
        Function from positions (3, n) to unit normals (3, n).
    """
    s = np.linspace(0, 1, SAMPLES)
    grid = np.stack([g.ravel() for g in np.meshgrid(s, s, indexing="ij")])
    tree = cKDTree(surface.position(grid[0], grid[1]).T)

    def normal(x: Floats) -> Floats:
        if x.shape[1] == 0:
            return np.zeros((3, 0))
        uv = grid[:, tree.query(x.T)[1]].copy()
        for _ in range(8):
            rest = x - surface.position(uv[0], uv[1])
            t1, t2 = _tangents(surface, uv)
            metric = np.array(
                [[(t1 * t1).sum(0), (t1 * t2).sum(0)], [(t1 * t2).sum(0), (t2 * t2).sum(0)]]
            )
            right = np.array([(t1 * rest).sum(0), (t2 * rest).sum(0)])
            det = metric[0, 0] * metric[1, 1] - metric[0, 1] ** 2
            step = np.array(
                [
                    metric[1, 1] * right[0] - metric[0, 1] * right[1],
                    metric[0, 0] * right[1] - metric[0, 1] * right[0],
                ]
            ) / np.where(det > 0, det, np.inf)
            uv = np.clip(uv + step, 0.0, 1.0)
        n = np.cross(*_tangents(surface, uv), axis=0)
        # where there is none it is not a number, which who asks refuses by name
        with np.errstate(invalid="ignore"):
            return np.asarray(n / np.linalg.norm(n, axis=0))

    return normal


def _tangents(surface: Surface, uv: Floats) -> tuple[Floats, Floats]:
    """Derivatives of the map by xi and by eta, shape (3, n) each."""
    return _difference(surface, uv, 0), _difference(surface, uv, 1)


def _difference(surface: Surface, uv: Floats, axis: int) -> Floats:
    """Derivative of the parabola through three points around, or at the border beside, a point."""
    middle = np.clip(uv[axis], STEP, 1 - STEP)
    values = []
    for k in (-1, 0, 1):
        moved = uv.copy()
        moved[axis] = middle + k * STEP
        values.append(surface.position(moved[0], moved[1]))
    low, centre, high = values
    curvature = (high - 2 * centre + low) / STEP**2
    return np.asarray((high - low) / (2 * STEP) + (uv[axis] - middle) * curvature)
