"""Lateral buckling of a narrow cantilever under a dead tip load: critical load, and what follows.

Critical load of a Kirchhoff plate by the Ritz method, and the deflected shape of an inextensible
rod by shooting: independent of all finite elements here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from scipy.integrate import solve_ivp
from scipy.linalg import eigh
from scipy.optimize import root

from shellmb.arrays import Floats


@dataclass(frozen=True)
class Strip:
    """A cantilever strip standing on edge.

    Args:
        length: Length [m].
        height: Height of the section, in the plane of the load [m].
        thickness: Thickness [m].
        E: Young's modulus [Pa].
        nu: Poisson's ratio.
    """

    length: float
    height: float
    thickness: float
    E: float
    nu: float

    @property
    def weak(self) -> float:
        """Bending stiffness out of the plane [N m^2]."""
        return self.E * self.height * self.thickness**3 / 12

    @property
    def strong(self) -> float:
        """Bending stiffness in the plane [N m^2]."""
        return self.E * self.thickness * self.height**3 / 12

    @property
    def torsion(self) -> float:
        """Torsional stiffness of a narrow rectangle, `b t^3/3 (1 - 0.63 t/b)` [N m^2]."""
        shear = self.E / (2 * (1 + self.nu))
        correction = 1 - 0.63 * self.thickness / self.height
        return shear * self.height * self.thickness**3 / 3 * correction

    @property
    def wagner(self) -> float:
        """Coefficient of the third power of the twist in the torque, `E t b^5/360` [N m^4].

        Fibres away from the axis become helices, and longer (S. P. Timoshenko, Strength of
        Materials II, "torsion of thin strips").
        """
        return self.E * self.thickness * self.height**5 / 360


def beam_critical_load(strip: Strip, constant: float) -> float:
    """Critical tip load of the strip as a beam, its deflection in the plane included [N].

    `P = c sqrt(EI GJ) / L^2 / sqrt((1 - EI/EI1) (1 - GJ/EI1))`: the strip is curved in its plane
    when it buckles (D. A. Hodges and D. A. Peters, Int. J. Solids Struct. 11 (1975) 1269-1280).

    Args:
        strip: The strip.
        constant: 4.0126 for a load at the centroid, `analytic.beams.lateral_buckling`.
    """
    curved = (1 - strip.weak / strip.strong) * (1 - strip.torsion / strip.strong)
    return float(constant * np.sqrt(strip.weak * strip.torsion / curved) / strip.length**2)


def plate_critical_load(strip: Strip, terms: tuple[int, int] = (20, 8)) -> float:
    """Critical tip load of the strip as a Kirchhoff plate [N].

    Ritz method with Legendre polynomials; membrane forces of beam theory, `N_xx = P (L - x) z/I`
    and `N_xz = -P (b^2/4 - z^2)/(2 I)` with `I = b^3/12`. It knows that the clamped edge restrains
    warping and lateral contraction, and not that shear near the edges softens the plate by parts
    of `t/b`.

    Args:
        strip: The strip.
        terms: Numbers of polynomials along and across.
    """
    L, b, nu = strip.length, strip.height, strip.nu
    x, weight_x, X = _basis(terms[0], L, clamped=True)
    z, weight_z, Z = _basis(terms[1], b, clamped=False)
    z = z - b / 2
    weights = np.outer(weight_x, weight_z).ravel()

    def field(along: int, across: int) -> Floats:
        values = np.einsum("ip,jq->ijpq", X[along], Z[across])
        return np.asarray(values.reshape(terms[0] * terms[1], len(x) * len(z)))

    def product(a: Floats, c: Floats, factor: Floats | float = 1.0) -> Floats:
        return np.asarray((a * (weights * factor)) @ c.T)

    xx, zz, xz = field(2, 0), field(0, 2), field(1, 1)
    bending = product(xx, xx) + product(zz, zz) + nu * (product(xx, zz) + product(zz, xx))
    bending += 2 * (1 - nu) * product(xz, xz)
    second = b**3 / 12
    normal = np.outer(L - x, z).ravel() / second
    shear = np.outer(np.ones_like(x), -(b**2 / 4 - z**2) / (2 * second)).ravel()
    dx, dz = field(1, 0), field(0, 1)
    geometric = product(dx, dx, normal) + product(dx, dz, shear) + product(dz, dx, shear)
    largest = float(np.max(np.abs(eigh(geometric, bending, eigvals_only=True))))
    stiffness = strip.E * strip.thickness**3 / (12 * (1 - nu**2))
    return stiffness / largest


def _basis(count: int, length: float, clamped: bool) -> tuple[Floats, Floats, Floats]:
    """Gauss points and weights on `[0, length]`; polynomials there with two derivatives."""
    points, weights = legendre.leggauss(count + 6)
    scale, rows = 2 / length, []
    for k in range(count):
        series = np.eye(k + 1)[k]
        if clamped:
            # times the square of the distance from the clamped end
            series = legendre.legmul(series, legendre.legmul([1.0, 1.0], [1.0, 1.0]))
        derivatives = [series, *(legendre.legder(series, m) for m in (1, 2))]
        rows.append([legendre.legval(points, d) * scale**m for m, d in enumerate(derivatives)])
    values = np.array(rows).transpose(1, 0, 2)
    return (points + 1) / scale, weights / scale, values


def rod_tip(
    strip: Strip, load: float, guess: Floats, wagner: bool = False
) -> tuple[Floats, Floats]:
    """Tip displacement of the strip as an inextensible rod, from the exact equations.

    `R' = R k^`, `r' = R e1`, `m' = -r' x n` with the dead force `n = (0, 0, -P)` and `m(L) = 0`,
    solved by shooting for the moment at the clamped end.

    Args:
        strip: The strip, along x, its height along z.
        load: Force downwards [N].
        guess: Moment at the clamped end, shape (3,), [N m]; on a branch, from a point of it.
        wagner: Whether the torque has its part of third order in the twist.

    Returns:
        Displacement of the tip, shape (3,), [m], and the moment at the clamped end.

    Raises:
        ValueError: If the shooting does not converge.
    """
    force = np.array([0.0, 0.0, -load])
    cubic = strip.wagner if wagner else 0.0

    def slope(s: float, state: Floats) -> Floats:
        R, m = state[3:12].reshape(3, 3), state[12:]
        own = R.T @ m
        k = own / np.array([strip.torsion, strip.strong, strip.weak])
        for _ in range(30 if cubic else 0):
            wrong = strip.torsion * k[0] + cubic * k[0] ** 3 - own[0]
            k[0] -= wrong / (strip.torsion + 3 * cubic * k[0] ** 2)
        skew = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
        return np.concatenate([R[:, 0], (R @ skew).ravel(), -np.cross(R[:, 0], force)])

    def end(moment: Floats) -> Floats:
        start = np.concatenate([np.zeros(3), np.eye(3).ravel(), moment])
        path = solve_ivp(slope, (0.0, strip.length), start, rtol=1e-9, atol=1e-11)
        return np.asarray(path.y[:, -1])

    scale = load * strip.length
    found = root(lambda m: end(m * scale)[12:] / scale, guess / scale, tol=1e-10)
    if not found.success and np.max(np.abs(found.fun)) > 1e-7:
        raise ValueError(f"shooting for the rod under {load:g} N does not converge")
    tip = end(found.x * scale)[:3] - np.array([strip.length, 0.0, 0.0])
    return tip, found.x * scale
