"""Rolling and sliding on a blade: Chaplygin's sleigh, the disc, the ball on a turntable.

Sources: J. I. Neimark, N. A. Fufaev, Dynamics of Nonholonomic Systems (AMS, 1972), ch. II and III
(sleigh, disc); D. T. Greenwood, Advanced Dynamics (Cambridge, 2003), ch. 3 (disc); the ball goes
back to Earnshaw (1844), for example K. Weltner, Am. J. Phys. 47 (1979) 984-986.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from shellmb.arrays import Floats

# tolerance of the integration, near the smallest that scipy takes
RTOL = 1e-13
UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Sleigh:
    """Chaplygin's sleigh: a body in a plane on a blade, its centre ahead of the blade.

    Args:
        mass: Mass, kg.
        inertia: Moment of inertia about the centre of mass, kg m^2.
        ahead: Distance of the centre from the blade, along it, m.
        speed: Speed of the blade's point at the start, m/s.
        spin: Angular velocity at the start, rad/s, not zero.
    """

    mass: float
    inertia: float
    ahead: float
    speed: float
    spin: float

    def motion(self, time: Sequence[float] | Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Motion in closed form: the sleigh ends up running straight, its centre ahead.

        Returns:
            Speed along the blade, m/s, angular velocity, rad/s, angle, rad, and the force across
            the blade, N, shape (n,) each.
        """
        t = np.asarray(time, dtype=np.float64)
        a, k = self.ahead, math.sqrt(self.inertia / self.mass + self.ahead**2)
        V = math.hypot(self.speed, k * self.spin)
        s = math.atanh(self.speed / V) + a * V / k**2 * t
        side = math.copysign(1.0, self.spin)
        v, w = V * np.tanh(s), side * V / k / np.cosh(s)
        # the integral of 1/cosh is Gudermann's function
        turned = 2 * np.arctan(np.tanh(s / 2))
        angle = side * k / a * (turned - 2 * math.atan(math.tanh(math.atanh(self.speed / V) / 2)))
        return v, w, angle, self.mass * v * w * (1 - a**2 / k**2)


@dataclass(frozen=True)
class Disc:
    """A thin disc, and its steady rolling, inclined, along a circle on a horizontal plane.

    Args:
        mass: Mass, kg.
        axial: Moment of inertia about the axis, kg m^2.
        across: Moment of inertia about a diameter, kg m^2.
        radius: Radius, m.
        gravity: Acceleration of gravity, m/s^2.
    """

    mass: float
    axial: float
    across: float
    radius: float
    gravity: float = 9.81

    def rate(self, tilt: float, circle: float) -> float:
        """Rate at which the centre goes round, rad/s.

        By `R u x F = z x H rate` of the angular momentum about the centre, with the contact force
        `F = m (g z - rate^2 circle e)`, `u` to the point of contact and `e` from the circle's
        middle to the centre.

        Args:
            tilt: Angle of the axis with the vertical, rad; the disc leans inwards.
            circle: Radius of the circle of the centre, m.
        """
        m, R, s, c = self.mass, self.radius, math.sin(tilt), math.cos(tilt)
        inertia = s * circle * (m * R + self.axial / R) + self.across * s * c
        return math.sqrt(m * self.gravity * R * c / inertia)

    def spin(self, tilt: float, circle: float) -> float:
        """Rate about the axis that turns with the precession, for a positive `rate`, rad/s."""
        return -self.rate(tilt, circle) * (math.cos(tilt) + circle / self.radius)


def rolling_disc(
    disc: Disc, axis: Sequence[float], omega: Sequence[float], time: Sequence[float]
) -> tuple[Floats, Floats]:
    """Any motion of a disc that rolls on the plane z = 0 from above the origin, integrated.

    The equations of motion about the point of contact in the rotation alone, without multipliers:
    `v = -omega x r`, `r` from the centre to the contact.

    Args:
        disc: The disc.
        axis: Its axis at the start.
        omega: Angular velocity at the start, rad/s.
        time: Ascending instants, s, the first one is 0.

    Returns:
        Positions of the centre, m, and its velocities, m/s, shape (n, 3) each.
    """
    a0 = np.asarray(axis) / np.linalg.norm(axis)
    m, A, C = disc.mass, disc.across, disc.axial

    def arm(a: Floats) -> tuple[Floats, Floats]:
        """From centre to contact, and the matrix that gives its rate from that of the axis."""
        p = UP - (UP @ a) * a
        size = float(np.linalg.norm(p))
        slope = -np.outer(a, UP) - (UP @ a) * np.eye(3)
        u = p / size
        return -disc.radius * u, -disc.radius * (np.eye(3) - np.outer(u, u)) @ slope / size

    def cross(r: Floats) -> Floats:
        return np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])

    def rates(t: float, y: Floats) -> Floats:
        a, w = y[3:6], y[6:9]
        r, slope = arm(a)
        inertia = A * np.eye(3) + (C - A) * np.outer(a, a)
        turned = slope @ np.cross(w, a)
        # F = m (v' + g z) with v' = r x w' - w x r'
        known = m * (disc.gravity * UP - np.cross(w, turned))
        matrix = inertia - m * cross(r) @ cross(r)
        torque = np.cross(r, known) - np.cross(w, inertia @ w)
        return np.concatenate([-np.cross(w, r), np.cross(w, a), np.linalg.solve(matrix, torque)])

    start = np.concatenate([-arm(a0)[0], a0, np.asarray(omega, dtype=np.float64)])
    found = solve_ivp(
        rates, (0.0, time[-1]), start, "DOP853", t_eval=time, rtol=RTOL, atol=RTOL
    ).y.T
    v = np.array([-np.cross(y[6:9], arm(y[3:6])[0]) for y in found])
    return found[:, :3], v


def ball_on_turntable(
    rate: float, start: Sequence[float], velocity: Sequence[float], time: Sequence[float] | Floats
) -> Floats:
    """Path of the centre of a homogeneous ball: a circle, at 2/7 of the turntable's rate.

    Args:
        rate: Rate of the turntable about z, rad/s.
        start: Position at the start, shape (3,), m.
        velocity: Velocity then, shape (3,), m/s, horizontal.
        time: Instants, s.

    Returns:
        Positions, shape (n, 3), m.
    """
    w = 2 / 7 * rate * UP
    x, v = np.asarray(start, dtype=np.float64), np.asarray(velocity, dtype=np.float64)
    # v = w x (x - middle)
    middle = x + np.cross(w, v) / (w @ w)
    turns = Rotation.from_rotvec(np.outer(np.asarray(time), w))
    return np.asarray(middle + turns.apply(x - middle))
