"""Closed forms that tests alone compare with; others are in `demos/references`, with their sources.

The pendulum: Landau & Lifshitz, Mechanics, 3rd ed. (1976), sec. 11.
"""

import math
from collections.abc import Sequence

import numpy as np
from scipy.linalg import eigh
from scipy.optimize import brentq
from scipy.special import ellipj, ellipk

from shellmb.arrays import Floats
from shellmb.demos.references.beams import Ends
from shellmb.demos.references.plates import Plate, double_series
from shellmb.demos.references.rigid import Vector
from shellmb.demos.verification import tables
from shellmb.demos.verification.laminates import Edges, Stiffness, wave_stiffness


def free_top_period(inertia: Vector, omega: Vector) -> float:
    """Time after which the angular velocity of a free body returns in its own axes, s.

    Infinite for a steady rotation. Arguments as for `free_top_omega`.
    """
    A, B, C = np.sort(np.asarray(inertia, dtype=np.float64))
    a, b, c = np.asarray(omega, dtype=np.float64)[np.argsort(inertia, kind="stable")]
    if C * (C - B) * c**2 < A * (B - A) * a**2:
        A, C, a, c = C, A, c, a
    p = A * (C - A) * a**2 + B * (C - B) * b**2
    q = B * (B - A) * b**2 + C * (C - A) * c**2
    rate = math.sqrt((C - B) * q / (A * B * C))
    if p * rate == 0.0 or (a == 0.0 and c == 0.0):
        return math.inf
    return 4 * float(ellipk((B - A) * p / ((C - B) * q))) / rate


def steady_precession(
    transverse: float, axial: float, moment: float, spin: float, tilt: float, gravity: float = 9.81
) -> tuple[float, float]:
    """Slow and fast steady precession of a symmetric heavy top.

    Roots of `(A cos(tilt)) W^2 - C w W + m g l = 0`; for a tilt of 90 degrees the fast one is
    infinite.

    Args:
        transverse: Moment of inertia A about an axis across the figure axis, kg m^2.
        axial: Moment of inertia C about the figure axis, kg m^2.
        moment: Mass times distance of the centre from the fixed point, kg m.
        spin: Component w of the angular velocity along the figure axis, positive, rad/s.
        tilt: Angle of the figure axis with the upward vertical, rad.
        gravity: Acceleration of gravity, m/s^2.

    Returns:
        Rates of precession about the upward vertical, rad/s.

    Raises:
        ValueError: If the top spins too slowly to precess steadily at this tilt.
    """
    half = axial * spin / 2
    lever = moment * gravity
    a = transverse * math.cos(tilt)
    root = half**2 - a * lever
    if root < 0:
        raise ValueError(f"a spin of {spin} rad/s is too slow for a steady precession")
    large = half + math.sqrt(root)
    # cos(pi/2) is not quite zero in floating point
    fast = math.inf if abs(a) < 1e-15 * transverse else large / a
    return lever / large, fast


def pendulum_period(amplitude: float, frequency: float) -> float:
    """Period `4 K(sin(amplitude/2)) / frequency` of a rigid pendulum about a fixed axis, s.

    Args:
        amplitude: Largest angle with the vertical, rad, below pi.
        frequency: Circular frequency of small swings, `sqrt(m g l / I)` with the moment of
            inertia I about the axis, rad/s.
    """
    return 4 * float(ellipk(math.sin(amplitude / 2) ** 2)) / frequency


def pendulum(amplitude: float, frequency: float, time: Vector) -> tuple[Floats, Floats]:
    """Angle and its rate of a rigid pendulum let go at rest at its amplitude.

    Args:
        amplitude: Angle with the downward vertical at time zero, rad.
        frequency: Circular frequency of small swings, rad/s.
        time: Instants, s, shape (n,).

    Returns:
        Angle in rad and its rate in rad/s, each of shape (n,).
    """
    k = math.sin(amplitude / 2)
    phase = frequency * np.asarray(time, dtype=np.float64) + ellipk(k**2)
    sn, cn, _, _ = ellipj(phase, k**2)
    return 2 * np.arcsin(k * sn), 2 * frequency * k * cn


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


def wave_numbers(ends: Ends, count: int) -> Floats:
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
) -> Floats:
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


def rectangle_frequencies(
    plate: Plate, a: float, b: float, modes: Sequence[tuple[int, int]], rotary_inertia: bool = True
) -> Floats:
    """Natural circular frequencies of a simply supported rectangle, bending modes.

    Mindlin (1951): the lower root of the quadratic that is left of his eq. (37) for a mode
    `sin(m pi x / a) sin(n pi y / b)`.

    Args:
        plate: The plate, with its density.
        a: Length of the first side, m.
        b: Length of the second side, m.
        modes: Numbers of half waves (m, n), one pair per mode.
        rotary_inertia: Whether the cross-section's rotation has inertia.

    Returns:
        Circular frequencies in rad/s, shape (len(modes),), in the order of `modes`.
    """
    m, n = np.array(modes, dtype=float).reshape(-1, 2).T
    k2 = (np.pi * m / a) ** 2 + (np.pi * n / b) ** 2
    mass = plate.density * plate.thickness
    rotary = mass * plate.thickness**2 / 12 if rotary_inertia else 0.0
    bending, compliance = plate.bending, 1 / plate.shear
    # (k2 - mass w^2/S)(D k2 - rotary w^2) = mass w^2, written so that S = inf and rotary = 0
    # leave the thin plate without cancellation
    p = mass * rotary * compliance
    r = mass + rotary * k2 + mass * bending * k2 * compliance
    c = bending * k2**2
    return np.asarray(np.sqrt(2 * c / (r + np.sqrt(r**2 - 4 * p * c))))


def mass_on_springs(rate: float, first: float, second: float, damping: float = 0.0) -> Floats:
    """Eigenvalues of a point mass on two springs across one another that turn about it.

    `x'' - 2 Omega y' + 2 d x' + (a^2 - Omega^2) x = 0` and its like for y; unstable where the
    rate is between `a` and `b`, the critical speeds.

    Args:
        rate: Rate Omega, rad/s.
        first: Frequency a at rest along the first spring, rad/s.
        second: That along the second one, b, rad/s.
        damping: Rate d at which dampers beside both springs damp, 1/s.

    Returns:
        The four eigenvalues, complex, 1/s.
    """
    system = np.zeros((4, 4))
    system[:2, 2:] = np.eye(2)
    system[2:, :2] = -np.diag([first**2 - rate**2, second**2 - rate**2])
    system[2:, 2:] = 2 * rate * np.array([[0, 1], [-1, 0]]) - 2 * damping * np.eye(2)
    return np.asarray(np.linalg.eigvals(system))


def wave_frequencies(
    edges: Edges,
    laminate: Stiffness,
    mass: tuple[float, float],
    a: float,
    b: float,
    mode: tuple[int, int] = (1, 1),
) -> Floats:
    """The five natural circular frequencies of a wave with m by n half waves, m, n >= 1.

    The lowest one is the bending mode. Rotary inertia is kept; the density is taken as symmetric
    about the reference surface (no first moment of mass).

    Args:
        edges: Kind of simple support.
        laminate: Stiffness of the laminate.
        mass: Mass per area, kg/m^2, and its second moment through the thickness, kg.
        a: Length of the side along x, m.
        b: Length of the side along y, m.
        mode: Numbers of half waves m along x and n along y.

    Returns:
        Circular frequencies in rad/s, ascending, shape (5,).

    Raises:
        ValueError: If the laminate has couplings that these edges have no solution for.
    """
    m, n = mode
    stiffness = wave_stiffness(edges, laminate, m * math.pi / a, n * math.pi / b)
    inertia = np.diag([mass[0]] * 3 + [mass[1]] * 2)
    return np.asarray(np.sqrt(eigh(stiffness, inertia, eigvals_only=True)))


def rectangle_uniform_moment(plate: Plate, a: float, b: float, q: float) -> float:
    """Bending moment `M_11` per length at the centre, uniform load, N; the same with shear.

    The moment bends the fibres along the side `a`. Source and arguments as for
    `rectangle_uniform_deflection`.
    """
    alpha, beta, weight = double_series(a, b)
    terms = weight * (alpha**2 + plate.nu * beta**2) / (alpha**2 + beta**2) ** 2
    return float(16 * q / math.pi**2 * terms.sum())


def plate_wave_frequencies(a_over_h: float) -> dict[tuple[int, int], float]:
    """Exact `omega a^2 sqrt(rho h / D)` of the hard simply supported square, by half waves (m, n).

    Args:
        a_over_h: Side over thickness: 5, 10, 20, 100 or 1000.

    Raises:
        KeyError: If the table has no such plate.
    """
    data = tables.read("plate_ss_square_freq")
    rows = data[data["a_over_h"] == a_over_h]
    if rows.empty:
        known = sorted(set(data["a_over_h"]))
        raise KeyError(f"table plate_ss_square_freq has a_over_h in {known}, not {a_over_h}")
    return {
        (int(m), int(n)): float(value)
        for m, n, value in zip(rows["m"], rows["n"], rows["lambda"], strict=True)
    }
