"""Classical lamination theory and transverse shear of layered sections, in plain NumPy.

Everything is of one point, or of many at once: then thicknesses, angles and what follows from them
are arrays with the points as their first axes, written (...).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np

from shellmb.arrays import Floats
from shellmb.scene.values.damping import Prony

# columns of `shear_step` in cylindrical bending along 1 and along 2: M_11,1 and M_22,2
PURE = [3, 10]


@dataclass(frozen=True)
class Layer:
    """One layer in the axes of the shell.

    Args:
        plane: Plane-stress stiffness in the order 11, 22, 12, shape (..., 3, 3) [Pa].
        transverse: Transverse shear stiffness in the order 13, 23, shape (..., 2, 2) [Pa].
        density: Mass density [kg/m^3].
        thickness: Thickness, shape (...) [m].
        angle: From the shell's 1-direction to the layer's own, shape (...) [degrees].
        strength: Strengths of its material (`Strength`), if there are any.
        relaxation: Prony series of its moduli; None: elastic.
    """

    plane: Floats
    transverse: Floats
    density: float
    thickness: Any
    angle: Any = 0.0
    strength: Any = None
    relaxation: Prony | None = None

    def scaled(self, factor: float) -> Layer:
        """The layer with another stiffness."""
        return replace(self, plane=factor * self.plane, transverse=factor * self.transverse)

    @property
    def long_term(self) -> Layer:
        """The layer with its long-term moduli instead of the given ones."""
        return self if self.relaxation is None else self.scaled(self.relaxation.long_term)

    def from_own(self, strains: Sequence[float]) -> tuple[Floats, Floats]:
        """Strains in its axes, and their changes along the normal, in the shell's axes."""
        at, slope = np.reshape(strains, (2, 3)) @ strain_turn(-self.angle).mT
        return at, slope

    def turned(self, degrees: Any) -> Layer:
        """The layer with its axes turned about the normal by an angle, shape (...) [degrees]."""
        t, r = strain_turn(degrees), vector_turn(degrees)
        return replace(
            self,
            plane=t.mT @ self.plane @ t,
            transverse=r.mT @ self.transverse @ r,
            angle=self.angle + degrees,
        )


def cos_sin(degrees: Any) -> tuple[Floats, Floats]:
    """Exact at multiples of 90 degrees, so that a cross-ply laminate has no spurious coupling."""
    quarter, rest = np.divmod(degrees, 90.0)
    c, s = np.cos(np.radians(rest)), np.sin(np.radians(rest))
    turn = np.asarray(quarter, dtype=int) % 4
    return np.choose(turn, (c, -s, -c, s)), np.choose(turn, (s, c, -s, -c))


def strain_turn(degrees: Any) -> Floats:
    """Turn strains 11, 22, 2*12 into axes turned by an angle, shape (..., 3, 3).

    Stresses turn by the transpose of the opposite turn.
    """
    c, s = cos_sin(degrees)
    return matrix(
        [[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2 * c * s, 2 * c * s, c * c - s * s]]
    )


def vector_turn(degrees: Any) -> Floats:
    """Turn vectors, as transverse shear 13, 23, into axes turned by an angle, (..., 2, 2)."""
    c, s = cos_sin(degrees)
    return matrix([[c, s], [-s, c]])


def matrix(rows: Sequence[Sequence[Any]]) -> Floats:
    """A matrix at each point from its components, shape (..., rows, columns)."""
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def plane_stress(E1: float, E2: float, nu12: float, G12: float) -> Floats:
    """Plane-stress stiffness in the material axes, order 11, 22, 12, shape (3, 3) [Pa]."""
    d = 1 - nu12**2 * E2 / E1
    return np.array([[E1 / d, nu12 * E2 / d, 0], [nu12 * E2 / d, E2 / d, 0], [0, 0, G12]])


@dataclass(frozen=True)
class Layup:
    """A stack of layers at one point, or at many.

    Args:
        layers: From the lower to the upper face.
        shear_correction: Factor on the integrated transverse shear stiffness, or ``"energy"``.
        offset: Height of the section's middle above the reference surface, shape (...) [m].
    """

    layers: tuple[Layer, ...]
    shear_correction: float | Literal["energy"]
    offset: Any

    @cached_property
    def thickness(self) -> Any:
        """Total thickness, shape (...) [m]."""
        return sum(layer.thickness for layer in self.layers)

    @cached_property
    def _faces(self) -> list[Any]:
        """Heights of the faces of the layers above the section's middle."""
        faces = [-self.thickness / 2]
        for layer in self.layers:
            faces.append(faces[-1] + layer.thickness)
        return faces

    @property
    def heights(self) -> list[Any]:
        """Heights above the reference surface, one more than layers, shape (...) [m]."""
        return [z + self.offset for z in self._faces]

    @cached_property
    def _about_middle(self) -> tuple[Floats, Floats, Floats]:
        """`A`, `B` and `D` about the section's middle."""
        h = np.asarray(self.thickness)[..., None, None]
        moments = []
        for k in (1, 2, 3):
            by_layer = (
                layer.plane * np.asarray((b**k - a**k) / k)[..., None, None]
                for layer, a, b in zip(self.layers, self._faces, self._faces[1:], strict=False)
            )
            moments.append(sum(by_layer, np.zeros((3, 3))))
        size = np.abs(moments[0]).max(axis=(-2, -1), keepdims=True)
        A, B, D = (_clean(m, size * h**k) for k, m in enumerate(moments))
        return A, B, D

    @property
    def _offset(self) -> Floats:
        return np.asarray(self.offset)[..., None, None]

    @property
    def A(self) -> Floats:
        """Membrane stiffness, shape (..., 3, 3) [N/m]."""
        return self._about_middle[0]

    @cached_property
    def B(self) -> Floats:
        """Coupling of membrane and bending, shape (..., 3, 3) [N]."""
        A, B, _ = self._about_middle
        return np.asarray(B + self._offset * A)

    @cached_property
    def D(self) -> Floats:
        """Bending stiffness, shape (..., 3, 3) [N m]."""
        A, B, D = self._about_middle
        return np.asarray(D + 2 * self._offset * B + self._offset**2 * A)

    @cached_property
    def G(self) -> Floats:
        """Transverse shear stiffness with its correction, shape (..., 2, 2) [N/m]."""
        if self.shear_correction == "energy":
            return shear_by_energy(self.layers, self._faces, *self._about_middle)
        by_layer = (p.transverse * np.asarray(p.thickness)[..., None, None] for p in self.layers)
        G = self.shear_correction * sum(by_layer, np.zeros((2, 2)))
        return _clean(G, np.abs(G).max(axis=(-2, -1), keepdims=True))

    @cached_property
    def branches(self) -> dict[tuple[float, ...], dict[tuple[float, bool], float]]:
        """Maxwell branches of long-term layers.

        Of each set of shares of the layers, the largest of which is one, factors by the branches'
        times [s] and whether they begin relaxed.
        """
        given = [{} if p.relaxation is None else p.relaxation.branches for p in self.layers]
        found: dict[tuple[float, ...], dict[tuple[float, bool], float]] = {}
        for key in sorted({key for branches in given for key in branches}):
            factors = np.array([branches.get(key, 0.0) for branches in given])
            shares = tuple(np.round(factors / factors.max(), 14).tolist())
            found.setdefault(shares, {})[key] = float(factors.max())
        return found

    @property
    def at_rest(self) -> Layup:
        """The section as statics has it, which has no branches."""
        given = [p.relaxation for p in self.layers]
        if not any(given):
            return self
        found = self.scaled([1.0 if r is None else r.at_rest / r.long_term for r in given])
        return replace(found, layers=tuple(replace(p, relaxation=None) for p in found.layers))

    def among(self, rows: Floats, number: int) -> Floats:
        """Rows of a layer by its strain, from N and M that strains of the layers would give.

        Args:
            rows: From N and M of an elastic section, shape (..., n, 6).
            number: The layer, from 0 at the lower face.

        Returns:
            From those of the section's strain, and of the springs of each set of branches: what
            the long-term section would have of them, shape (..., n, 6 (1 + sets)).
        """
        return np.concatenate([rows, *(shares[number] * rows for shares in self.branches)], axis=-1)

    def natural_strain(self, plies: Sequence[Sequence[float]]) -> Floats:
        """Membrane strains and curvatures without resultants of a section at one point, shape (6,).

        Args:
            plies: Strains that layers would have alone, as of `NaturalStrain`.
        """
        A, B, D = (np.asarray(part, dtype=float) for part in (self.A, self.B, self.D))
        forces, z = np.zeros((2, 3)), [float(height) for height in self.heights]
        for layer, given, low, high in zip(self.layers, plies, z, z[1:], strict=False):
            at, slope = layer.from_own(given)
            first, second, third = ((high**k - low**k) / k for k in (1, 2, 3))
            forces[0] += layer.plane @ (at * first + slope * second)
            forces[1] += layer.plane @ (at * second + slope * third)
        return np.linalg.solve(np.block([[A, B], [B, D]]), forces.ravel())

    def scaled(self, factors: Sequence[float]) -> Layup:
        """The section with a factor on the stiffness of each layer."""
        pairs = zip(self.layers, factors, strict=True)
        return replace(self, layers=tuple(layer.scaled(factor) for layer, factor in pairs))

    @cached_property
    def mass(self) -> tuple[Any, Any, Any]:
        """``(m, s_star, I_star)`` of eq. 16 about the reference surface, each of shape (...)."""
        z = self._faces
        pairs = list(zip(self.layers, z, z[1:], strict=False))
        m, s, i = (sum(p.density * (b**k - a**k) / k for p, a, b in pairs) for k in (1, 2, 3))
        s = np.where(np.abs(s) < 1e-12 * m * z[-1], 0.0, s)[()]
        c = self.offset
        return m, s + c * m, i + 2 * c * s + c**2 * m


def _clean(matrix: Floats, size: Floats) -> Floats:
    """Rounding errors become zero, so that an effect that is absent costs nothing."""
    return np.where(np.abs(matrix) < 1e-12 * size, 0.0, matrix)


def shear_by_energy(
    layers: Sequence[Layer], z: Sequence[Any], A: Floats, B: Floats, D: Floats
) -> Floats:
    """Transverse shear stiffness from the stresses that equilibrium asks for.

    In cylindrical bending along x (and along y) the moment grows by the shear force,
    ``M_11,1 = Q_1`` (``M_22,2 = Q_2``), at zero membrane force. The in-plane stresses follow from
    lamination theory and the transverse ones by integrating equilibrium from the lower face, where
    they vanish: ``(tau_13, tau_23)(z) = sum_i f_i(z) Q_i``. Equal energy gives the flexibility
    ``S_ij = int f_i . Gz^-1 f_j dz``, and the stiffness is its inverse. A homogeneous section gives
    5/6 (Rolfes and Rohwer, Int. J. Numer. Meth. Engng 40 (1997) 51-60).

    Args:
        layers: From the lower to the upper face.
        z: Heights of their faces above the section's middle, each of shape (...).
        A: Membrane stiffness about the section's middle, shape (..., 3, 3).
        B: Coupling about the middle, shape (..., 3, 3).
        D: Bending stiffness about the middle, shape (..., 3, 3).

    Returns:
        Stiffness in the order 13, 23, shape (..., 2, 2) [N/m].
    """
    compliance = np.linalg.inv(np.block([[A, B], [B, D]]))
    points, weights = np.polynomial.legendre.leggauss(3)  # f is quadratic in a layer, f.f quartic
    S = np.zeros((2, 2))
    face = np.zeros((2, 2))
    for layer, low, high in zip(layers, z, z[1:], strict=False):
        half = (high - low) / 2
        for x, w in zip(points, weights, strict=True):
            f = face + shear_step(layer, compliance, low, low + half * (1 + x))[..., PURE]
            share = f.mT @ np.linalg.solve(layer.transverse, f)
            S = S + np.asarray(half * w)[..., None, None] * share
        face = face + shear_step(layer, compliance, low, high)[..., PURE]
    stiff = np.linalg.inv(S)
    return _clean((stiff + stiff.mT) / 2, np.abs(stiff).max(axis=(-2, -1), keepdims=True))


def shear_step(layer: Layer, compliance: Floats, low: Any, z: Any) -> Floats:
    """Change of `tau_13, tau_23` between two heights by equilibrium, shape (..., 2, 12).

    Columns: derivatives of N and M (11, 22, 12) along 1, and along 2.

    Args:
        layer: The layer that both heights are in.
        compliance: Membrane strains and curvatures from N and M, shape (..., 6, 6).
        low: The lower height, shape (...) [m].
        z: The other one.
    """
    first, second = (np.asarray((z**k - low**k) / k)[..., None, None] for k in (1, 2))
    slope = layer.plane @ (compliance[..., :3, :] * first + compliance[..., 3:, :] * second)
    # rows of slope: 11, 22, 12; tau_13 balances 11 along 1 and 12 along 2
    along_1, along_2 = slope[..., [0, 2], :], slope[..., [2, 1], :]
    return np.asarray(-np.concatenate([along_1, along_2], axis=-1))
