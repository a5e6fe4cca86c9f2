"""A cantilever of the geometrically exact beam theory, solved as a boundary value problem.

The beam of Reissner and Simo in space: section force and moment are linear in the strains

    Gamma = R^T r' - e1,     kappa = axial(R^T R') - K,

(or in those of our beams, which measure the stretch by the line itself: `stretch_of_line`)
with `R = (d1, d2, d3)` the axes of the section, `d1` along the unloaded axis, `K` the curvature
of the unloaded beam and `'` the derivative by the unloaded arc length. Balance asks
`n' + f = 0` and `m' + r' x n = 0` (Simo, Comput. Methods Appl. Mech. Eng. 49 (1985) 55-70;
Simo & Vu-Quoc, Comput. Methods Appl. Mech. Eng. 58 (1986) 79-116). Under loads that keep their
direction `n` is known, and what is left is an initial value problem with three unknown moments at
the clamped end: a solution by shooting is exact to ten digits, and knows no finite elements.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from shellmb.arrays import Floats
from shellmb.errors import ShellmbError

Vector = Sequence[float] | Floats

_RTOL = 1e-13
# on the way to the full load less will do
_COARSE = 1e-8
# the moments at the clamp are found when the moment at the tip is right to this, relatively; no
# less, because the moment at the tip magnifies the errors of the integration
_CLOSED = 1e-10
# moments, in units of EI / L, by which a load step may miss its prediction: with more, Newton could
# run to another equilibrium
_JUMP = 0.2
# first load step, small enough for the linear beam to be a prediction of the second
_FIRST = 1e-3


@dataclass(frozen=True)
class Deformed:
    """A loaded cantilever at `n` points of its axis.

    Args:
        s: Unloaded arc length from the clamped end, m, shape (n,).
        position: Position of the axis, m, shape (n, 3).
        rotation: Axes d1, d2, d3 of the section as columns, shape (n, 3, 3).
        force: Section force n in fixed axes, N, shape (n, 3).
        moment: Section moment m in fixed axes, N m, shape (n, 3).
        start: Position of the axis without load, m, shape (n, 3).
    """

    s: Floats
    position: Floats
    rotation: Floats
    force: Floats
    moment: Floats
    start: Floats

    @property
    def displacement(self) -> Floats:
        """Displacement of the axis, m, shape (n, 3)."""
        return self.position - self.start

    @property
    def tip(self) -> Floats:
        """Displacement of the free end, m, shape (3,)."""
        return np.asarray(self.displacement[-1])


def section_stiffness(
    axial: float,
    shear2: float,
    shear3: float,
    torsion: float,
    bending2: float,
    bending3: float,
) -> Floats:
    """Stiffness (6, 6) of a section without couplings.

    Args:
        axial: EA, N.
        shear2: Shear stiffness along d2, N.
        shear3: Shear stiffness along d3, N.
        torsion: GJ, N m^2.
        bending2: EI about d2, N m^2.
        bending3: EI about d3, N m^2.
    """
    return np.diag([axial, shear2, shear3, torsion, bending2, bending3]).astype(np.float64)


def exact_cantilever(
    stiffness: Floats,
    length: float,
    *,
    force: Vector = (0.0, 0.0, 0.0),
    moment: Vector = (0.0, 0.0, 0.0),
    load: Vector = (0.0, 0.0, 0.0),
    curvature: Vector | Callable[[float], Floats] = (0.0, 0.0, 0.0),
    frame: Floats | None = None,
    root_at: Vector = (0.0, 0.0, 0.0),
    points: int = 33,
    stretch_of_line: bool = False,
) -> Deformed:
    """Clamped beam of constant section under dead loads, however large.

    The load is raised in small steps, so that of several equilibria it is the stable one that is
    reached continuously from the unloaded beam.

    Args:
        stiffness: Stiffness of the section, shape (6, 6), symmetric and positive definite: forces
            (n1, n2, n3) and moments (m1, m2, m3) in the axes of the section by the strains
            (Gamma, kappa); n1 is axial and m1 the torque.
        length: Unloaded arc length L, m.
        force: Force at the free end, N, in fixed axes.
        moment: Moment at the free end, N m, in fixed axes (its direction does not turn).
        load: Constant force per unloaded length, N/m, in fixed axes.
        curvature: Curvature K of the unloaded beam in section axes, 1/m: the twist and the
            curvatures about d2 and d3; an arc of radius R bending towards d2 has (0, 0, 1/R).
            Constant, or a function of the unloaded arc length.
        frame: Axes d1, d2, d3 of the clamped section as columns, right-handed; default unit matrix.
        root_at: Position of the clamped end, m.
        points: Number of points of the answer, equally spaced.
        stretch_of_line: Whether the axial strain is `(r'.r' - 1)/2` of the line through the tension
            centre, as of our beams (`docs/theory/shells.md`).

    Raises:
        ShellmbError: If the equilibrium cannot be followed up to the full load.
    """
    C = np.asarray(stiffness, dtype=np.float64)
    law = partial(_by_line, C) if stretch_of_line else partial(_by_axes, np.linalg.inv(C))
    K = curvature if callable(curvature) else _constant(np.asarray(curvature, dtype=np.float64))
    axes = np.eye(3) if frame is None else np.asarray(frame, dtype=np.float64)
    loads = np.array([force, moment, load], dtype=np.float64)
    size = _scale(stiffness, length)

    def shoot(clamp: Floats, factor: float, at: Floats, rtol: float = _RTOL) -> Floats:
        return _integrate(law, K, axes, factor * loads, clamp, length, at, rtol)

    def miss(clamp: Floats, factor: float, rtol: float) -> Floats:
        end = shoot(clamp * size, factor, np.array([length]), rtol)
        return np.asarray((end[7:, -1] - factor * loads[1]) / size)

    clamp = size * _follow(miss)

    s = np.linspace(0.0, length, points)
    state = shoot(clamp, 1.0, s)
    rest = shoot(np.zeros(3), 0.0, s)
    origin = np.asarray(root_at, dtype=np.float64)
    return Deformed(
        s=s,
        position=origin + length * state[:3].T,
        rotation=_matrices(axes, state[3:7]),
        force=loads[0] + (length - s)[:, None] * loads[2],
        moment=state[7:].T,
        start=origin + length * rest[:3].T,
    )


def _follow(miss: Callable[[Floats, float, float], Floats]) -> Floats:
    """Root of `miss(x, 1, rtol)` reached continuously from `x = 0` of `miss(x, 0, rtol)`."""
    factors, found, step = [0.0], [np.zeros(3)], _FIRST
    while factors[-1] < 1.0:
        if step < 0.1 * _FIRST:
            raise ShellmbError(
                f"the clamped beam: its equilibrium cannot be followed beyond {factors[-1]:.4g} "
                f"times the load; it may be unstable there"
            )
        target = min(1.0, factors[-1] + step)
        guess = _extrapolated(factors[-3:], found[-3:], target)
        x, sign = _newton(miss, guess, target, _COARSE)
        # the determinant changes its sign where the equilibrium loses its stability
        if x is None or np.abs(x - guess).max() > _JUMP or sign < 0:
            step /= 2
            continue
        factors.append(target)
        found.append(x)
        step *= 1.5
    last, _ = _newton(miss, found[-1], 1.0, _RTOL)
    if last is None:
        raise ShellmbError(
            "the clamped beam: the moments at the clamp are not found to the digits requested; "
            "the beam is too soft for its load"
        )
    return last


def _extrapolated(factors: list[float], values: list[Floats], to: float) -> Floats:
    """The polynomial through the last values, at a later load factor."""
    result = np.zeros(3)
    for i, (at, value) in enumerate(zip(factors, values, strict=True)):
        others = factors[:i] + factors[i + 1 :]
        result += math.prod((to - other) / (at - other) for other in others) * value
    return result


def _newton(
    miss: Callable[[Floats, float, float], Floats], x: Floats, factor: float, rtol: float
) -> tuple[Floats | None, float]:
    """Root near `x`, or None; and the sign of the determinant there (positive without load)."""
    value = miss(x, factor, rtol)
    for _ in range(8):
        # a difference with the best compromise of its two errors
        h = math.sqrt(rtol) * max(1.0, float(np.abs(x).max()))
        columns = [(miss(x + h * e, factor, rtol) - value) / h for e in np.eye(3)]
        tangent = np.array(columns).T
        x = x - np.linalg.solve(tangent, value)
        value = miss(x, factor, rtol)
        if np.abs(value).max() < _CLOSED * rtol / _RTOL * max(1.0, float(np.abs(x).max())):
            return x, float(np.sign(np.linalg.det(tangent)))
    return None, 0.0


def _scale(stiffness: Floats, length: float) -> float:
    """Moment that bends or twists the beam the soft way by about one radian, N m."""
    return float(np.min(np.diag(np.asarray(stiffness))[3:])) / length


def _constant(value: Floats) -> Callable[[float], Floats]:
    return lambda s: value


def _by_axes(compliance: Floats, resultants: Floats, K: Floats) -> Floats:
    """Strains (Gamma, kappa) of force and moment in the axes of the section, linear in them."""
    return np.asarray(compliance @ resultants)


def _by_line(C: Floats, resultants: Floats, K: Floats) -> Floats:
    """Strains where the axial strain is that of the line through the tension centre."""
    B = np.linalg.solve(C[:3, :3], C[:3, 3:])
    c2, c3 = -B[0, 2], B[0, 1]
    # from the line to the centre: Gamma + Hc kappa
    Hc = np.array([[0.0, c3, -c2], [-c3, 0.0, 0.0], [c2, 0.0, 0.0]])
    rest = np.array([1.0, 0.0, 0.0]) + Hc @ K
    x = np.linalg.solve(C, resultants)
    for _ in range(20):
        change = x[:3] + Hc @ x[3:]
        # derivative of the strain of the centre's line by what it changes by
        slope = np.eye(3)
        slope[0] = np.array([rest[0] + change[0], change[1], change[2]]) / rest[0]
        strain = np.array([change[0] + change @ change / (2 * rest[0]), change[1], change[2]])
        J = np.block([[slope, slope @ Hc - Hc], [np.zeros((3, 3)), np.eye(3)]])
        e = np.concatenate([strain - Hc @ x[3:], x[3:]])
        lever = np.hstack([np.eye(3), Hc])
        stress = C @ e
        miss = J.T @ stress - resultants
        tangent = J.T @ C @ J + stress[0] / rest[0] * lever.T @ lever
        step = np.linalg.solve(tangent, miss)
        x = x - step
        if np.abs(step).max() < 1e-15 * max(1.0, float(np.abs(x).max())):
            break
    return np.asarray(x)


def _integrate(
    law: Callable[[Floats, Floats], Floats],
    K: Callable[[float], Floats],
    axes: Floats,
    loads: Floats,
    clamp: Floats,
    length: float,
    at: Floats,
    rtol: float,
) -> Floats:
    """States (r/L, quaternion scalar last, m), shape (10, n), from given moments at the clamp.

    The position is scaled to make all components but the moments of order one; the moments enter
    the tolerance with their own size.
    """
    force, moment, load = loads

    def rates(s: float, y: Floats) -> Floats:
        R = axes @ _matrix(y[3:7])
        n = force + (length - s) * load
        strain = law(np.concatenate([R.T @ n, R.T @ y[7:]]), K(s))
        tangent = R @ (strain[:3] + np.array([1.0, 0.0, 0.0]))
        turn = 0.5 * _times(y[3:7], strain[3:] + K(s))
        return np.concatenate([tangent / length, turn, -np.cross(tangent, n)])

    # what moments may be, for the absolute tolerance; all is zero in the unloaded beam
    scales = [clamp, moment, force * length, load * length**2]
    size = float(np.abs(scales).max()) or 1.0
    atol = rtol * np.array([1.0] * 7 + [size] * 3)
    start = np.concatenate([np.zeros(3), [0.0, 0.0, 0.0, 1.0], clamp])
    solution = solve_ivp(
        rates, (0.0, length), start, method="DOP853", t_eval=at, rtol=rtol, atol=atol
    )
    return np.asarray(solution.y)


def _matrix(q: Floats) -> Floats:
    """Rotation of a quaternion (x, y, z, w) that need not be of unit length, shape (3, 3)."""
    x, y, z, w = q / math.sqrt(q @ q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def _times(q: Floats, k: Floats) -> Floats:
    """Quaternion (x, y, z, w) times the vector k, which is in the axes that q turns."""
    x, y, z, w = q
    a, b, c = k
    return np.array(
        [
            w * a + y * c - z * b,
            w * b + z * a - x * c,
            w * c + x * b - y * a,
            -x * a - y * b - z * c,
        ]
    )


def _matrices(axes: Floats, quaternions: Floats) -> Floats:
    return np.asarray(axes @ Rotation.from_quat(quaternions.T).as_matrix())
