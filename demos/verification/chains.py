"""Plane chains of hinged rigid links: the pendulum, the double pendulum, and so on.

Written in the absolute angles of the links, so that no constraint is left: nothing is shared with
a formulation in directors and multipliers.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from shellmb.arrays import Floats
from shellmb.demos.references.rigid import RTOL

Vector = Sequence[float] | Floats


@dataclass(frozen=True)
class Link:
    """A rigid link of a hanging chain, its centre of mass on the line between its hinges.

    Args:
        mass: Mass, kg.
        length: Distance from its upper to its lower hinge, m.
        center: Distance of the centre of mass from the upper hinge, m.
        inertia: Moment of inertia about the centre of mass, kg m^2.
    """

    mass: float
    length: float
    center: float
    inertia: float

    @classmethod
    def rod(cls, mass: float, length: float) -> "Link":
        """A homogeneous thin rod between two hinges at its ends."""
        return cls(mass, length, length / 2, mass * length**2 / 12)


@dataclass(frozen=True)
class ChainMotion:
    """Motion of a chain of `k` links at `n` instants, hanging from the origin of the x-y plane.

    Args:
        links: The links, from the top.
        gravity: Acceleration of gravity along -y, m/s^2.
        time: Instants, s, shape (n,).
        angle: Angles of the links with the direction -y, positive about z, rad, shape (n, k).
        rate: Their rates, rad/s, shape (n, k).
    """

    links: tuple[Link, ...]
    gravity: float
    time: Floats
    angle: Floats
    rate: Floats

    def centers(self) -> Floats:
        """Positions of the centres of mass, m, shape (n, k, 2)."""
        return _points(self.angle, _levers(self.links))

    def hinges(self) -> Floats:
        """Positions of the lower ends of the links, m, shape (n, k, 2)."""
        lengths = np.array([link.length for link in self.links])
        return _points(self.angle, np.tril(np.ones((len(lengths),) * 2)) * lengths)

    def energy(self) -> tuple[Floats, Floats]:
        """Kinetic energy, and potential energy (zero at the height of the origin), J, (n,)."""
        m = np.array([link.mass for link in self.links])
        J = np.array([link.inertia for link in self.links])
        v = _velocities(self.angle, self.rate, _levers(self.links))
        kinetic = 0.5 * ((v**2).sum(axis=2) @ m + self.rate**2 @ J)
        return kinetic, self.gravity * self.centers()[:, :, 1] @ m

    def hinge_forces(self) -> Floats:
        """Force on each link at its upper hinge, N, shape (n, k, 2)."""
        levers = _levers(self.links)
        m = np.array([link.mass for link in self.links])
        states = zip(self.angle, self.rate, strict=True)
        second = np.array([_accelerate(self.links, self.gravity, a, w) for a, w in states])
        tangential = _velocities(self.angle, second, levers)
        inward = -_points(self.angle, levers, self.rate**2)
        weighed = m[:, None] * (tangential + inward + np.array([0.0, self.gravity]))
        # a hinge carries all that hangs below it
        return np.asarray(np.cumsum(weighed[:, ::-1], axis=1)[:, ::-1])


def chain(
    links: Sequence[Link], angle: Vector, rate: Vector, time: Vector, gravity: float = 9.81
) -> ChainMotion:
    """Hanging chain of hinged rigid links: a pendulum, a double pendulum, and so on.

    Integrated to about 1e-11; a chaotic motion multiplies that by its own growth.

    Args:
        links: The links, from the top.
        angle: Angles with the downward vertical at time zero, rad.
        rate: Their rates at time zero, rad/s.
        time: Instants in ascending order, s, shape (n,).
        gravity: Acceleration of gravity along -y, m/s^2.
    """
    links, k = tuple(links), len(links)
    t = np.asarray(time, dtype=np.float64)
    start = np.concatenate([np.asarray(angle, dtype=np.float64), np.asarray(rate, np.float64)])

    def rates(_: float, y: Floats) -> Floats:
        return np.concatenate([y[k:], _accelerate(links, gravity, y[:k], y[k:])])

    y = solve_ivp(rates, (0.0, t[-1]), start, method="DOP853", t_eval=t, rtol=RTOL, atol=RTOL).y.T
    return ChainMotion(links, gravity, t, y[:, :k], y[:, k:])


def _levers(links: Sequence[Link]) -> Floats:
    """Length of link j on the way to the centre of link i, shape (k, k)."""
    lengths = np.array([link.length for link in links])
    k = len(links)
    return np.tril(np.ones((k, k)), -1) * lengths + np.diag([link.center for link in links])


def _points(angle: Floats, levers: Floats, weight: Floats | float = 1.0) -> Floats:
    """Sums of levers times directions (times a weight), shape (n, k, 2)."""
    x, y = weight * np.sin(angle), -weight * np.cos(angle)
    return np.stack([x @ levers.T, y @ levers.T], axis=2)


def _velocities(angle: Floats, rate: Floats, levers: Floats) -> Floats:
    x, y = rate * np.cos(angle), rate * np.sin(angle)
    return np.stack([x @ levers.T, y @ levers.T], axis=2)


def _accelerate(links: Sequence[Link], gravity: float, angle: Floats, rate: Floats) -> Floats:
    """Angular accelerations from Lagrange's equations, rad/s^2, shape (k,)."""
    m = np.array([link.mass for link in links])
    levers = _levers(links)
    a = levers.T @ (m[:, None] * levers)
    difference = angle[:, None] - angle[None, :]
    mass = a * np.cos(difference) + np.diag([link.inertia for link in links])
    force = (a * np.sin(difference)) @ rate**2 + gravity * (m @ levers) * np.sin(angle)
    return np.linalg.solve(mass, -force)
