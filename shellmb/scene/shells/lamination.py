"""Classical lamination theory and transverse shear of layered sections, in plain NumPy."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

__all__ = ["Layer", "Stiffness", "mass", "plane_stress", "stiffness"]

type Matrix = NDArray[np.float64]


@dataclass(frozen=True)
class Layer:
    """One layer in the axes of the shell.

    Args:
        plane: Plane-stress stiffness in the order 11, 22, 12, shape (3, 3) [Pa].
        transverse: Transverse shear stiffness in the order 13, 23, shape (2, 2) [Pa].
        density: Mass density [kg/m^3].
        thickness: Thickness [m].
    """

    plane: Matrix
    transverse: Matrix
    density: float
    thickness: float

    def turned(self, degrees: float) -> Layer:
        """The layer with its axes turned about the normal by an angle [degrees]."""
        c, s = _cos_sin(degrees)
        # strains in the layer's axes from those in the shell's axes
        t = np.array(
            [[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2 * c * s, 2 * c * s, c * c - s * s]]
        )
        r = np.array([[c, s], [-s, c]])
        return replace(self, plane=t.T @ self.plane @ t, transverse=r.T @ self.transverse @ r)


def _cos_sin(degrees: float) -> tuple[float, float]:
    """Exact at multiples of 90 degrees, so that a cross-ply laminate has no spurious coupling."""
    quarter, rest = divmod(degrees, 90.0)
    c, s = (float(f(np.radians(rest))) for f in (np.cos, np.sin))
    turns = ((c, s), (-s, c), (-c, -s), (s, -c))
    return turns[int(quarter) % 4]


def plane_stress(E1: float, E2: float, nu12: float, G12: float) -> Matrix:
    """Plane-stress stiffness in the material axes, order 11, 22, 12, shape (3, 3) [Pa]."""
    d = 1 - nu12**2 * E2 / E1
    return np.array([[E1 / d, nu12 * E2 / d, 0], [nu12 * E2 / d, E2 / d, 0], [0, 0, G12]])


@dataclass(frozen=True)
class Stiffness:
    """Stiffness of a section per unit area; see :class:`shellmb.scene.LinearSection`."""

    A: Matrix
    B: Matrix
    D: Matrix
    G: Matrix


def _heights(layers: Sequence[Layer]) -> Matrix:
    """Heights of the faces of the layers above the section's middle, shape (n + 1,) [m]."""
    t = np.array([layer.thickness for layer in layers])
    z = np.concatenate([[0.0], np.cumsum(t)])
    return np.asarray(z - z[-1] / 2)


def stiffness(
    layers: Sequence[Layer], shear_correction: float | Literal["energy"], offset: float
) -> Stiffness:
    """Integrate through the thickness.

    Args:
        layers: From the lower to the upper face.
        shear_correction: Factor on the integrated transverse shear stiffness, or ``"energy"``.
        offset: Height of the section's middle above the reference surface [m].

    Returns:
        ``A``, ``B``, ``D``, ``G`` about the reference surface.
    """
    z = _heights(layers)
    pairs = list(zip(layers, z, z[1:], strict=False))
    A = sum((p.plane * (b - a) for p, a, b in pairs), np.zeros((3, 3)))
    B = sum((p.plane * (b**2 - a**2) / 2 for p, a, b in pairs), np.zeros((3, 3)))
    D = sum((p.plane * (b**3 - a**3) / 3 for p, a, b in pairs), np.zeros((3, 3)))
    h = z[-1] - z[0]
    A, B, D = (_clean(m, np.abs(A).max() * h**k) for k, m in enumerate((A, B, D)))
    if shear_correction == "energy":
        G = shear_by_energy(layers, A, B, D)
    else:
        G = shear_correction * sum((p.transverse * (b - a) for p, a, b in pairs), np.zeros((2, 2)))
        G = _clean(G, np.abs(G).max())
    return Stiffness(A, B + offset * A, D + 2 * offset * B + offset**2 * A, G)


def _clean(matrix: Matrix, size: float) -> Matrix:
    """Rounding errors become zero, so that an effect that is absent costs nothing."""
    return np.where(np.abs(matrix) < 1e-12 * size, 0.0, matrix)


def mass(layers: Sequence[Layer], offset: float) -> tuple[float, float, float]:
    """``(m, s_star, I_star)`` of eq. 16 about the reference surface, per unit area."""
    z = _heights(layers)
    rho = np.array([layer.density for layer in layers])
    m, s, i = (float(rho @ np.diff(z**k) / k) for k in (1, 2, 3))
    s = 0.0 if abs(s) < 1e-12 * m * float(z[-1]) else s
    return m, s + offset * m, i + 2 * offset * s + offset**2 * m


def shear_by_energy(layers: Sequence[Layer], A: Matrix, B: Matrix, D: Matrix) -> Matrix:
    """Transverse shear stiffness from the stresses that equilibrium asks for.

    In cylindrical bending along x (and along y) the moment grows by the shear force,
    ``M_11,1 = Q_1`` (``M_22,2 = Q_2``), at zero membrane force. The in-plane stresses follow from
    lamination theory and the transverse ones by integrating equilibrium from the lower face, where
    they vanish: ``(tau_13, tau_23)(z) = sum_i f_i(z) Q_i``. Equal energy gives the flexibility
    ``S_ij = int f_i . Gz^-1 f_j dz``, and the stiffness is its inverse. A homogeneous section gives
    5/6 (Rolfes and Rohwer, Int. J. Numer. Meth. Engng 40 (1997) 51-60).

    Args:
        layers: From the lower to the upper face.
        A: Membrane stiffness about the section's middle, shape (3, 3).
        B: Coupling about the middle, shape (3, 3).
        D: Bending stiffness about the middle, shape (3, 3).

    Returns:
        Stiffness in the order 13, 23, shape (2, 2) [N/m].
    """
    z = _heights(layers)
    compliance = np.linalg.inv(np.block([[A, B], [B, D]]))
    eps, kappa = compliance[:3, 3:5], compliance[3:, 3:5]  # columns: unit M_11,1 and unit M_22,2
    points, weights = np.polynomial.legendre.leggauss(3)  # f is quadratic in a layer, f.f quartic
    S = np.zeros((2, 2))
    face = np.zeros((2, 2))
    for layer, low, high in zip(layers, z, z[1:], strict=False):
        half = (high - low) / 2
        for x, w in zip(points, weights, strict=True):
            f = face + _shear_step(layer, eps, kappa, low, low + half * (1 + x))
            S += half * w * f.T @ np.linalg.solve(layer.transverse, f)
        face = face + _shear_step(layer, eps, kappa, low, high)
    stiff = np.linalg.inv(S)
    return _clean((stiff + stiff.T) / 2, np.abs(stiff).max())


def _shear_step(layer: Layer, eps: Matrix, kappa: Matrix, low: float, z: float) -> Matrix:
    """Change of ``[f_1, f_2]`` between two heights of a layer, shape (2, 2)."""
    slope = layer.plane @ (eps * (z - low) + kappa * (z**2 - low**2) / 2)
    # rows of slope: 11, 22, 12; a force along 1 differentiates along 1, one along 2 along 2
    along_1 = [slope[0, 0], slope[2, 0]]
    along_2 = [slope[2, 1], slope[1, 1]]
    return -np.array([along_1, along_2]).T
