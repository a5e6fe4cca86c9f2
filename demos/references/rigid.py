"""Rotating rigid bodies: the free top in closed form, any top about a fixed point.

Body axes are fixed in the body and coincide with fixed axes at the start. Source: Landau &
Lifshitz, Mechanics, 3rd ed. (1976), sec. 36 and 37, for the free top.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from scipy.special import ellipj, ellipkinc

from shellmb.arrays import Floats

Vector = Sequence[float] | Floats

# tolerance of the integrations, near the smallest that scipy takes
RTOL = 1e-13


@dataclass(frozen=True)
class RotatingBody:
    """Rotation of a body about its fixed point or centre at `n` instants.

    Args:
        time: Instants, s, shape (n,).
        rotation: Rotation from body axes to fixed axes, shape (n, 3, 3).
        omega: Angular velocity in body axes, rad/s, shape (n, 3).
    """

    time: Floats
    rotation: Floats
    omega: Floats

    @property
    def spatial_omega(self) -> Floats:
        """Angular velocity in fixed axes, rad/s, shape (n, 3)."""
        return np.einsum("nij,nj->ni", self.rotation, self.omega)

    def position(self, point: Vector) -> Floats:
        """Positions of a point of the body relative to the fixed one, m, shape (n, 3).

        Args:
            point: The point in body axes, m.
        """
        return np.asarray(self.rotation @ np.asarray(point, dtype=np.float64))

    def velocity(self, point: Vector) -> Floats:
        """Velocities of a point of the body relative to the fixed one, m/s, shape (n, 3)."""
        return np.cross(self.spatial_omega, self.position(point))

    def kinetic_energy(self, inertia: Floats) -> Floats:
        """Energy of the rotation with an inertia tensor in body axes, J, shape (n,)."""
        return np.asarray(0.5 * np.einsum("ni,ij,nj->n", self.omega, inertia, self.omega))

    def angular_momentum(self, inertia: Floats) -> Floats:
        """Angular momentum in fixed axes, N m s, shape (n, 3)."""
        return np.einsum("nij,jk,nk->ni", self.rotation, inertia, self.omega)


def free_top_omega(inertia: Vector, omega: Vector, time: Vector) -> Floats:
    """Angular velocity of a free body in its principal axes, by Jacobi's elliptic functions.

    Args:
        inertia: Principal moments of inertia, kg m^2, shape (3,), in any order.
        omega: Angular velocity at time zero in the principal axes, rad/s, shape (3,).
        time: Instants, s, shape (n,).

    Returns:
        Angular velocity in the principal axes, rad/s, shape (n, 3).
    """
    moments = np.asarray(inertia, dtype=np.float64)
    w = np.asarray(omega, dtype=np.float64)
    t = np.asarray(time, dtype=np.float64)
    order = np.argsort(moments, kind="stable")
    A, B, C = moments[order]
    a, b, c = w[order]
    if C * (C - B) * c**2 < A * (B - A) * a**2:
        # the momentum circles the axis of the smallest moment: the two ends change places
        order = order[::-1]
        A, B, C = moments[order]
        a, b, c = w[order]
    # 2 E C - L^2 and L^2 - 2 E A without cancellation, both of the sign of C - A
    p = A * (C - A) * a**2 + B * (C - B) * b**2
    q = B * (B - A) * b**2 + C * (C - A) * c**2
    rate = math.sqrt((C - B) * q / (A * B * C))
    if p * rate == 0.0 or (a == 0.0 and c == 0.0):
        return np.tile(w, (len(t), 1))
    a_max, b_max = math.sqrt(p / (A * (C - A))), math.sqrt(p / (B * (C - B)))
    c_max = math.sqrt(q / (C * (C - A)))
    m = min(1.0, (B - A) * p / ((C - B) * q))
    # an odd order of the axes is a left-handed system: the motion runs as in a right-handed one
    # with the opposite angular velocity. So does the change of places, whose C - A is negative:
    # both are in the sign for which a = cn, b = side sn, c = side' dn solves Euler's equations
    parity = 1.0 if tuple(order) in {(0, 1, 2), (1, 2, 0), (2, 0, 1)} else -1.0
    handed = parity * math.copysign(1.0, C - A)
    up = 1.0 if c >= 0 else -1.0
    side = handed * up
    phase = ellipkinc(math.atan2(side * b / b_max, a / a_max), m)
    sn, cn, dn, _ = ellipj(rate * t + phase, m)
    result = np.empty((len(t), 3))
    result[:, order] = np.stack([a_max * cn, side * b_max * sn, up * c_max * dn], axis=1)
    return result


def free_top(inertia: Vector, omega: Vector, time: Vector) -> RotatingBody:
    """Motion of a free body about its centre: angular velocity and orientation.

    The angular velocity is the closed form, and the orientation an integration of it to about
    1e-11. Arguments as for `free_top_omega`; the principal axes are the coordinate axes at the
    time zero, and the instants are in ascending order from there.
    """
    t = np.asarray(time, dtype=np.float64)

    def rates(now: float, q: Floats) -> Floats:
        return _turn(q, free_top_omega(inertia, omega, [now])[0])

    q = _solve(rates, np.array([0.0, 0.0, 0.0, 1.0]), t)
    return RotatingBody(t, Rotation.from_quat(q).as_matrix(), free_top_omega(inertia, omega, t))


def heavy_top(
    inertia: Floats,
    moment: Vector,
    omega: Vector,
    time: Vector,
    gravity: Vector = (0.0, 0.0, -9.81),
) -> RotatingBody:
    """Motion of any body about a fixed point in gravity, by integration to about 1e-10.

    Args:
        inertia: Inertia tensor about the fixed point in body axes, kg m^2, shape (3, 3).
        moment: Mass times the vector from the fixed point to the centre in body axes, kg m.
        omega: Angular velocity at time zero, rad/s.
        time: Instants in ascending order, s, shape (n,); the motion begins at time zero.
        gravity: Acceleration of gravity in fixed axes, m/s^2.
    """
    I = np.asarray(inertia, dtype=np.float64)  # noqa: E741 - the symbol of mechanics
    s, g = np.asarray(moment, dtype=np.float64), np.asarray(gravity, dtype=np.float64)
    inverse = np.linalg.inv(I)
    t = np.asarray(time, dtype=np.float64)

    def rates(_: float, y: Floats) -> Floats:
        q, w = y[:4], y[4:]
        down = Rotation.from_quat(q).apply(g, inverse=True)
        torque = np.cross(s, down) - np.cross(w, I @ w)
        return np.concatenate([_turn(q, w), inverse @ torque])

    start = np.concatenate([[0.0, 0.0, 0.0, 1.0], np.asarray(omega, dtype=np.float64)])
    y = _solve(rates, start, t)
    return RotatingBody(t, Rotation.from_quat(y[:, :4]).as_matrix(), y[:, 4:])


def _turn(q: Floats, w: Floats) -> Floats:
    """Rate of a quaternion (x, y, z, w) at the angular velocity in body axes."""
    v, s = q[:3], q[3]
    return 0.5 * np.append(s * w + np.cross(v, w), -v @ w)


def _solve(rates: Callable[[float, Floats], Floats], start: Floats, time: Floats) -> Floats:
    """States at the instants, shape (n, len(start)), of a motion that begins at time zero."""
    end = float(time[-1])
    if end == 0.0:
        return np.tile(start, (len(time), 1))
    atol = RTOL * np.maximum(1.0, np.abs(start).max())
    solution = solve_ivp(
        rates, (0.0, end), start, method="DOP853", t_eval=time, rtol=RTOL, atol=atol
    )
    return np.asarray(solution.y.T)
