"""Strips and beams: small deflections and frequencies, and the exact roll-up by an end moment.

Sources: Sze, Liu & Lo, Finite Elem. Anal. Des. 40 (2004) 1551-1569, sec. 3.2, for the roll-up;
Timoshenko, Strength of Materials, and Timoshenko, Young & Weaver, Vibration Problems in
Engineering, 4th ed. (1974), ch. 5, for the rest.
"""

import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

Ends = Literal["clamped-free", "clamped-clamped", "free-free", "hinged-hinged"]


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


def cantilever_uniform(
    load: float, stiffness: float, length: float, shear: float = math.inf
) -> float:
    """Tip deflection `p L^4 / (8 EI) + p L^2 / (2 kappa G A)` of a cantilever, m.

    Args:
        load: Load p per length, N/m.
        stiffness: Bending stiffness EI, N m^2.
        length: Length L, m.
        shear: Shear stiffness kappa G A, N; infinite for the slender beam.
    """
    return load * length**4 / (8 * stiffness) + load * length**2 / (2 * shear)


def wave_numbers(ends: Ends, count: int) -> NDArray[np.float64]:
    """First roots `k L > 0` of the frequency equation of a slender beam, shape (count,).

    `cos kL cosh kL = -1` for clamped-free, `= 1` for clamped-clamped and free-free,
    `sin kL = 0` for hinged-hinged. Rigid motions of the free beam are left out.
    """
    n = np.arange(1, count + 1)
    if ends == "hinged-hinged":
        return np.asarray(n * math.pi, dtype=np.float64)
    sign = 1.0 if ends == "clamped-free" else -1.0
    # the roots approach the zeros of the cosine, with one of them in each interval between
    # two multiples of pi; the first interval of the free and the clamped beam has none
    start = n - 1 if ends == "clamped-free" else n

    def equation(x: float) -> float:
        # 1/cosh(x), without overflow for high modes
        return math.cos(x) + sign * 2 * math.exp(-x) / (1 + math.exp(-2 * x))

    return np.array([brentq(equation, i * math.pi, (i + 1) * math.pi, xtol=1e-14) for i in start])


def beam_frequencies(
    ends: Ends, count: int, stiffness: float, length: float, mass: float
) -> NDArray[np.float64]:
    """First natural circular frequencies `(kL)^2 sqrt(EI / (m L^4))` of a slender beam.

    Args:
        ends: Supports at the two ends.
        count: Number of frequencies wanted.
        stiffness: Bending stiffness EI, N m^2.
        length: Length L, m.
        mass: Mass per length m, kg/m.

    Returns:
        Circular frequencies in rad/s, ascending, shape (count,).
    """
    return wave_numbers(ends, count) ** 2 * math.sqrt(stiffness / (mass * length**4))
