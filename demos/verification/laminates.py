"""Simply supported laminated rectangles in first-order shear deformation theory.

Two families have solutions of a single wave (Reddy, Mechanics of Laminated Composite Plates and
Shells, 2nd ed. (2004), ch. 6 and 7). With `s, c` for sine and cosine of `m pi x / a` (first
factor) and `n pi y / b` (second factor):

===========  ==================  ====  ====  ====  ======  ======  ============================
edges        laminate            u     v     w     phi_x   phi_y   held along x = 0 and x = a
===========  ==================  ====  ====  ====  ======  ======  ============================
`SS-1`       cross-ply           c s   s c   s s   c s     s c     v, w, phi_y
`SS-2`       antisym. angle-ply  s c   c s   s s   c s     s c     u, w, phi_y
===========  ==================  ====  ====  ====  ======  ======  ============================

With these fields every strain is one wave times a linear combination of the five amplitudes, so
that energies need no more than the matrix of these combinations.
"""

import math
from typing import Literal, NamedTuple

import numpy as np

from shellmb.arrays import Floats

Edges = Literal["SS-1", "SS-2"]

# strains whose wave is cos cos (True) or sin sin (False): eps 11, 22, 12, then kappa 11, 22, 12
_IS_COSINE = {
    "SS-1": np.array([False, False, True, False, False, True]),
    "SS-2": np.array([True, True, False, False, False, True]),
}
# a coupling below this fraction of the two stiffnesses it couples is round-off of the lamination
_ROUND_OFF = 1e-10


class Stiffness(NamedTuple):
    """Stiffness of a laminate, components in the axes of the plate, Voigt order (11, 22, 2*12).

    Args:
        A: Membrane stiffness, N/m, shape (3, 3).
        B: Coupling stiffness, N, shape (3, 3).
        D: Bending stiffness, N m, shape (3, 3).
        G: Transverse shear stiffness (13, 23) with its correction factor, N/m, shape (2, 2).
    """

    A: Floats
    B: Floats
    D: Floats
    G: Floats


def _strain_amplitudes(edges: Edges, alpha: float, beta: float) -> tuple[Floats, Floats]:
    """Amplitudes of the in-plane strains (6, 5) and of (gamma_13, gamma_23) (2, 5).

    Columns: amplitudes of u, v, w, phi_x, phi_y.
    """
    sign = -1.0 if edges == "SS-1" else 1.0
    in_plane = np.zeros((6, 5))
    in_plane[0, 0] = sign * alpha
    in_plane[1, 1] = sign * beta
    in_plane[2, :2] = [-sign * beta, -sign * alpha]
    in_plane[3, 3] = -alpha
    in_plane[4, 4] = -beta
    in_plane[5, 3:] = [beta, alpha]
    shear = np.zeros((2, 5))
    shear[0, [2, 3]] = [alpha, 1.0]
    shear[1, [2, 4]] = [beta, 1.0]
    return in_plane, shear


def _check(edges: Edges, laminate: Stiffness) -> None:
    """Refuse a coupling of strains of different waves, with which the series is no solution."""
    A, B, D, G = laminate
    cosine = _IS_COSINE[edges]
    unlike = cosine[:, None] != cosine[None, :]
    C = np.block([[A, B], [B, D]])
    scale = np.sqrt(np.diag(C))
    relative = np.abs(C) / np.outer(scale, scale)
    if (relative[unlike] > _ROUND_OFF).any() or abs(G[0, 1]) > _ROUND_OFF * abs(G).max():
        kind = "a cross-ply" if edges == "SS-1" else "an antisymmetric angle-ply"
        raise ValueError(
            f"the solution for the edges {edges} needs {kind} laminate, and this one has "
            f"other couplings in A, B, D or G"
        )


def wave_stiffness(edges: Edges, laminate: Stiffness, alpha: float, beta: float) -> Floats:
    """Stiffness of the five amplitudes of a wave, times four per area, shape (5, 5)."""
    _check(edges, laminate)
    in_plane, shear = _strain_amplitudes(edges, alpha, beta)
    A, B, D, G = laminate
    return np.asarray(in_plane.T @ np.block([[A, B], [B, D]]) @ in_plane + shear.T @ G @ shear)


def sinusoidal_deflection(edges: Edges, laminate: Stiffness, a: float, b: float, q: float) -> float:
    """Centre deflection under the load `q sin(pi x / a) sin(pi y / b)`.

    Args:
        edges: Kind of simple support.
        laminate: Stiffness of the laminate.
        a: Length of the side along x, m.
        b: Length of the side along y, m.
        q: Load per area at the centre, Pa.

    Returns:
        Deflection, m.

    Raises:
        ValueError: If the laminate has couplings that these edges have no solution for.
    """
    stiffness = wave_stiffness(edges, laminate, math.pi / a, math.pi / b)
    load = np.array([0.0, 0.0, q, 0.0, 0.0])
    return float(np.linalg.solve(stiffness, load)[2])
