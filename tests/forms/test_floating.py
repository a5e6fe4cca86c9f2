"""Strains relative to a floating frame, of a round tube: all turns, or directors do alone."""

import basix.ufl
import numpy as np
import pytest
import ufl
from scipy.spatial.transform import Rotation
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives

from shellmb.forms.floating.strains import of_shell
from shellmb.forms.shell import Surface

RADIUS = 2.0


@pytest.mark.parametrize("vector", [(0.0, 0.0, 0.0), (0.3, -0.5, 0.7)])
def test_directors_that_lean_in_a_tube(vector: tuple[float, float, float]) -> None:
    """By `t` about its axis: `gam = sin t`, and nothing of the length that linear theory sees.

    Without what is put back the curvature around falls by `(1 - cos t)/RADIUS`, of second order.
    """
    lean = 0.1
    mesh = ufl.Mesh(basix.ufl.element("Lagrange", "tetrahedron", 1, shape=(3,)))
    x = ufl.SpatialCoordinate(mesh)
    r = ufl.sqrt(x[0] ** 2 + x[1] ** 2)
    D = ufl.as_vector([x[0] / r, x[1] / r, 0 * x[0]])
    around = ufl.as_vector([-x[1] / r, x[0] / r, 0 * x[0]])
    surf = Surface(around, ufl.as_vector([0.0, 0.0, 1.0]), D)
    turn = Rotation.from_rotvec(vector).as_matrix()
    tilted = turn @ Rotation.from_rotvec([0.0, 0.0, lean]).as_matrix()

    def moved(by: np.ndarray, v: ufl.core.expr.Expr) -> ufl.core.expr.Expr:
        # a zero would have no mesh
        return ufl.dot(ufl.as_matrix((by - np.eye(3) + 1e-300).tolist()), v)

    frame = ufl.as_vector((turn - np.eye(3)).T.ravel().tolist())
    strains = of_shell(surf, lambda q: (moved(turn, x), moved(tilted, D), frame)).value(x)
    strains = apply_derivatives(apply_algebra_lowering(strains))
    found = np.array([strains[k]((RADIUS, 0.0, 0.0)) for k in range(8)])
    assert found == pytest.approx([0.0] * 6 + [np.sin(lean), 0.0], abs=1e-14)
