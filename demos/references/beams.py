"""Strips and beams: small deflections, frequencies, lateral buckling, and the exact roll-up.

Sources: Sze, Liu & Lo, Finite Elem. Anal. Des. 40 (2004) 1551-1569, sec. 3.2, for the roll-up;
Timoshenko & Gere, Theory of Elastic Stability, 2nd ed. (1961), art. 6.3, for lateral buckling;
Timoshenko, Strength of Materials, and Timoshenko, Young & Weaver, Vibration Problems in
Engineering, 4th ed. (1974), ch. 5, for the rest. Large deflections in space: `cantilever`.
"""

import math
from typing import Literal

import numpy as np
from numpy.polynomial import legendre
from scipy.linalg import eigh, expm, null_space
from scipy.optimize import brentq
from scipy.special import jv

from shellmb.arrays import Floats

Ends = Literal["clamped-free", "clamped-clamped", "free-free", "hinged-hinged"]

# what vanishes at an end, as indices into (w, phi, M, V)
_VANISH = {"clamped": (0, 1), "hinged": (0, 2), "free": (2, 3)}


def roll_up(moment: float, stiffness: float, length: float) -> tuple[float, float]:
    """Tip displacement of a cantilever strip bent by an end moment, however large.

    The strip keeps its length and becomes an arc of the angle `phi = M L / EI`; the moment
    `2 pi EI / L` closes the circle. Exact for any thickness where Poisson's ratio is zero.

    Args:
        moment: End moment M, N m.
        stiffness: Bending stiffness EI, N m^2.
        length: Length L, m.

    Returns:
        Displacement of the tip along the strip and across it (to the side it is bent to), m.
    """
    phi = moment * length / stiffness
    # sin(phi)/phi and (1 - cos(phi))/phi without the division by zero at phi = 0
    sin_over = float(np.sinc(phi / math.pi))
    half = float(np.sinc(phi / (2 * math.pi)))
    return length * (sin_over - 1), length * phi / 2 * half**2


def cantilever_end_force(
    force: float, stiffness: float, length: float, shear: float = math.inf
) -> float:
    """Tip deflection `P L^3 / (3 EI) + P L / (kappa G A)` of a cantilever, m.

    Args:
        force: Force P across the free end, N.
        stiffness: Bending stiffness EI, N m^2.
        length: Length L, m.
        shear: Shear stiffness kappa G A, N; infinite for the slender beam.
    """
    return force * length**3 / (3 * stiffness) + force * length / shear


def timoshenko_frequencies(
    ends: Ends,
    count: int,
    stiffness: float,
    length: float,
    mass: float,
    shear: float,
    rotary: float = 0.0,
) -> Floats:
    """First natural circular frequencies of a beam with shear and rotary inertia.

    The equations `phi' = M / EI`, `w' = phi + V / kappa GA`, `M' = -V - J w^2 phi`,
    `V' = -m w^2 w` have constant coefficients, so that a frequency is a root of a determinant made
    from one matrix exponential. The roots are sought where a Ritz solution puts them, so that none
    is missed. Rigid motions of the free beam are left out.

    Args:
        ends: Supports at the two ends.
        count: Number of frequencies wanted, up to 8: the exponential of a slender beam loses the
            digits of high ones (the fourth is right to 1e-12, the eighth to 1e-6).
        stiffness: Bending stiffness EI, N m^2.
        length: Length L, m.
        mass: Mass per length m, kg/m.
        shear: Shear stiffness kappa G A, N; infinite for the beam rigid in shear.
        rotary: Rotary inertia J per length (rho I), kg m.

    Returns:
        Circular frequencies in rad/s, ascending, shape (count,).

    Raises:
        ValueError: If a root is not where the Ritz solution puts it.
    """
    # in units of L, EI / L and sqrt(m L^4 / EI)
    compliance = stiffness / (shear * length**2)
    inertia = rotary / (mass * length**2)
    first, last = (list(_VANISH[end]) for end in ends.split("-"))
    rest = [i for i in range(4) if i not in first]

    def determinant(omega: float) -> float:
        w2 = omega**2
        rates = np.array(
            [
                [0.0, 1.0, 0.0, compliance],
                [0.0, 0.0, 1.0, 0.0],
                [0.0, -w2 * inertia, 0.0, -1.0],
                [-w2, 0.0, 0.0, 0.0],
            ]
        )
        return float(np.linalg.det(expm(rates)[np.ix_(last, rest)]))

    found = []
    for near in _ritz_frequencies(ends, count, compliance, inertia):
        low, high = near * (1 - 1e-4), near * (1 + 1e-4)
        found.append(brentq(determinant, low, high, xtol=1e-15 * near, rtol=1e-14))
    return np.array(found) * math.sqrt(stiffness / (mass * length**4))


def _ritz_frequencies(ends: Ends, count: int, compliance: float, inertia: float) -> Floats:
    """Frequencies of the beam of unit length, stiffness and mass, to some six digits.

    Polynomials for the deflection w and the shear angle g, with the rotation `phi = w' - g`: the
    rigid shear is then no limit in which digits are lost.
    """
    degree = 16 + 3 * count
    x, weights = legendre.leggauss(degree + 2)

    def basis(order: int, at: Floats) -> Floats:
        # derivative by the length 1, where Legendre's interval has the length 2
        columns = 2.0**order * legendre.legder(np.eye(degree + 1), order)
        return np.asarray(legendre.legval(at, columns).T)

    size = degree + 1
    # all basis functions of w first, then those of the scaled shear angle g / sqrt(compliance)
    scale = math.sqrt(compliance)
    value, slope, bend = basis(0, x), basis(1, x), basis(2, x)
    zero = np.zeros_like(value)
    w = np.hstack([value, zero])
    phi = np.hstack([slope, -scale * value])
    kappa = np.hstack([bend, -scale * slope])
    gamma = np.hstack([zero, value])
    half = weights[:, None] / 2
    K = kappa.T @ (half * kappa) + gamma.T @ (half * gamma)
    M = w.T @ (half * w) + inertia * phi.T @ (half * phi)

    held = []
    for end, at in zip(ends.split("-"), (-1.0, 1.0), strict=True):
        edge = np.array([at])
        if end != "free":
            held.append(np.hstack([basis(0, edge)[0], np.zeros(size)]))
        if end == "clamped":
            held.append(np.hstack([basis(1, edge)[0], -scale * basis(0, edge)[0]]))
    Z = null_space(np.array(held)) if held else np.eye(2 * size)
    # the largest eigenvalues of the inverse problem: M may be singular (no rotary inertia), and a
    # shift makes the stiffness of the free beam definite
    shift = 1.0
    inverse = eigh(Z.T @ M @ Z, Z.T @ (K + shift * M + 1e-14 * np.eye(2 * size)) @ Z)[0][::-1]
    rigid = 2 if ends == "free-free" else 0
    return np.asarray(np.sqrt(1 / inverse[rigid : rigid + count] - shift))


def lateral_buckling(held: bool = False) -> float:
    """Load factor `P L^2 / sqrt(EI GJ)` at which a narrow cantilever buckles sideways.

    The force P acts at the centroid of the free end, in the plane of the large stiffness, which
    is taken as infinite. With `s` from the free end the twist obeys
    `GJ theta'' + (P s)^2 / EI theta = 0`, which Bessel functions of order 1/4 of
    `lambda s^2 / (2 L^2)` solve: `J_{-1/4}(lambda / 2) = 0` for the free end (4.0126;
    Timoshenko & Gere art. 6.3). If the end is fixed against lateral displacement and
    free to turn, the reaction adds a constant to the twist, and the condition of no displacement
    turns into `J_{3/4}(lambda / 2) = 0` (6.9820).

    Args:
        held: Whether the centroid of the loaded end is fixed against lateral displacement.
    """
    order, low, high = (0.75, 3.0, 4.0) if held else (-0.25, 1.5, 2.5)
    return 2 * float(brentq(lambda z: jv(order, z), low, high, xtol=1e-15))


def heated_arch(stretching: float, bending: float, span: float, rise: float) -> tuple[float, float]:
    """Symmetric limit point of a shallow sine arch on fixed hinges that curves by itself.

    Without axial force it would have the curvature ``-pi^2 rise/span^2 sin(pi x/span) + kappa``.
    With the thrust ``P = bending k^2`` the deflection beyond the arch is ``c sin(pi x/span)`` with
    ``c = P rise/(P_E - P)`` and a part ``kappa/k^2 [1 - cos k(x - span/2)/cos(k span/2)]`` that
    makes moments vanish at the hinges; the thrust follows from the shortening, which is a quadratic
    equation for ``kappa``.

    Args:
        stretching: Axial stiffness [N].
        bending: Bending stiffness [N m^2].
        span: Distance of the hinges [m].
        rise: Rise of the arch [m].

    Returns:
        Thrust at the limit point, in units of ``P_E = pi^2 bending/span^2``, and the curvature
        ``kappa`` there [1/m].
    """
    x, weights = np.polynomial.legendre.leggauss(60)
    x, weights = span / 2 * (1 + x), span / 2 * weights
    arch = rise * math.pi / span * np.cos(math.pi * x / span)
    euler = math.pi**2 * bending / span**2

    def curvature(ratio: float) -> float:
        """The larger curvature that has a thrust above Euler's."""
        P = ratio * euler
        k = math.sqrt(P / bending)
        whole = arch * (1 + ratio / (1 - ratio))
        own = np.sin(k * (x - span / 2)) / (k * math.cos(k * span / 2))
        # stretching/(2 span) int arch^2 - (whole + kappa own)^2 = P
        c0 = weights @ (arch**2 - whole**2) - 2 * span * P / stretching
        c1, c2 = -2 * weights @ (whole * own), -weights @ own**2
        return float((-c1 - math.sqrt(c1**2 - 4 * c0 * c2)) / (2 * c2))

    # a fine grid, then a parabola through its highest points
    ratios = np.linspace(2.0, 8.0, 6001)
    values = np.array([curvature(float(r)) for r in ratios])
    top = int(np.argmax(values))
    return float(ratios[top]), float(values[top])
