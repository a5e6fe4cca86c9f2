"""Simply supported cross-ply plates in three-dimensional elasticity.

Pagano's exact solutions under one wave of pressure at the upper face: cylindrical bending (J.
Compos. Mater. 3 (1969) 398-411) and rectangular plates (J. Compos. Mater. 4 (1970) 20-34; Pagano &
Hatfield, AIAA J. 10 (1972) 931-933). They are found here by the transfer matrix of each layer.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from shellmb.arrays import Floats


@dataclass(frozen=True)
class Solid:
    """An orthotropic solid, axes 1 along the fibres, 2 across and 3 along the normal.

    Args:
        E: Young's moduli 1, 2, 3, Pa.
        nu: Poisson's ratios 12, 13, 23.
        G: Shear moduli 12, 13, 23, Pa.
    """

    E: tuple[float, float, float]
    nu: tuple[float, float, float]
    G: tuple[float, float, float]

    def stiffness(self, turned: bool) -> tuple[Floats, Floats]:
        """Stiffness of normal strains x, y, z (3, 3), and shear moduli xy, xz, yz, Pa.

        Args:
            turned: Whether the fibres are along y, and not along x.
        """
        (E1, E2, E3), (n12, n13, n23), (G12, G13, G23) = self.E, self.nu, self.G
        S = np.array(
            [
                [1 / E1, -n12 / E1, -n13 / E1],
                [-n12 / E1, 1 / E2, -n23 / E2],
                [-n13 / E1, -n23 / E2, 1 / E3],
            ]
        )
        order = [1, 0, 2] if turned else [0, 1, 2]
        shear = [G12, G23, G13] if turned else [G12, G13, G23]
        return np.linalg.inv(S)[np.ix_(order, order)], np.array(shear)


@dataclass(frozen=True)
class Wave:
    """Amplitudes at one height.

    Args:
        normal: `sigma_x`, `sigma_y` (times sin sin), Pa.
        in_plane: `tau_xy` (times cos cos), Pa.
        transverse: `tau_xz` (times cos sin), `tau_yz` (times sin cos), Pa.
        deflection: `w` (times sin sin), m.
    """

    normal: Floats
    in_plane: float
    transverse: Floats
    deflection: float


def pagano(
    solid: Solid,
    plies: Sequence[tuple[float, bool]],
    a: float,
    b: float,
    q: float,
    heights: Sequence[tuple[int, float]],
) -> list[Wave]:
    """Amplitudes under the load `q sin(pi x / a) sin(pi y / b)` at the upper face.

    Args:
        solid: Material of all plies.
        plies: Thickness, m, of each from the lower face, and whether its fibres are along y.
        a: Length along x, m.
        b: Length along y, m; infinite: cylindrical bending, without the factor of y.
        q: Load per area, Pa.
        heights: Where: number of the ply, and share of its thickness.
    """
    alpha, beta = math.pi / a, math.pi / b
    matrices = [_matrix(*solid.stiffness(turned), alpha, beta) for _, turned in plies]
    below = [np.eye(6)]
    for (h, _), A in zip(plies, matrices, strict=True):
        below.append(expm(A * h) @ below[-1])
    # U, V, W, X, Y, Z: displacements, and stresses xz, yz, zz, which vanish at the lower face
    start = np.zeros(6)
    start[:3] = np.linalg.solve(below[-1][3:, :3], [0.0, 0.0, q])
    found = []
    for ply, share in heights:
        U, V, W, X, Y, Z = expm(matrices[ply] * share * plies[ply][0]) @ below[ply] @ start
        C, G = solid.stiffness(plies[ply][1])
        stretch = (Z + C[0, 2] * alpha * U + C[1, 2] * beta * V) / C[2, 2]
        normal = C[:2] @ [-alpha * U, -beta * V, stretch]
        transverse = np.array([X, Y])
        found.append(Wave(normal, float(G[0] * (beta * U + alpha * V)), transverse, float(W)))
    return found


def _matrix(C: Floats, G: Floats, a: float, b: float) -> Floats:
    """Derivatives of U, V, W, X, Y, Z along the normal by themselves."""
    A = np.zeros((6, 6))
    A[0, 2], A[0, 3] = -a, 1 / G[1]
    A[1, 2], A[1, 4] = -b, 1 / G[2]
    A[2, [0, 1, 5]] = np.array([C[0, 2] * a, C[1, 2] * b, 1.0]) / C[2, 2]
    for row, k, wave in ((3, 0, a), (4, 1, b)):
        # sigma_x and sigma_y by U, V and Z
        normal = C[k, 2] * A[2] - np.array([C[k, 0] * a, C[k, 1] * b, 0, 0, 0, 0])
        A[row] = -wave * normal
    A[3, :2] += b * G[0] * np.array([b, a])
    A[4, :2] += a * G[0] * np.array([b, a])
    A[5, 3:5] = a, b
    return A
