"""Snap-through and snap-back of an arch, and buckling of a column from round-off."""

import numpy as np
import pytest
from scipy.optimize import brentq

from shellmb.observers.probes import Probes
from shellmb.scene import (
    Clamped,
    EdgeForce,
    Hinged,
    InitialVelocity,
    Isotropic,
    Parametric,
    PointForce,
    Probe,
    Rectangle,
    Scene,
    Shell,
    Table,
)
from shellmb.simulate.simulation import BaseObserver, Simulation
from tests.hard.conftest import EVERY

RADIUS = 5.1
HALF = np.arcsin(1 / RADIUS)
RISE = RADIUS * (1 - np.cos(HALF))
THICKNESS, WIDTH = 0.01, 0.25


class Path(BaseObserver):
    """A probe's numbers after every step."""

    def __init__(self, probes: Probes) -> None:
        self.probes = probes
        self.t: list[float] = []
        self.rows: list[dict[str, float]] = []

    def accepted(self, simulation: Simulation) -> None:
        self.t.append(simulation.t)
        self.rows.append(dict(self.probes.measure()))

    def __getitem__(self, name: str) -> np.ndarray:
        return np.array([row[name] for row in self.rows])


def _arch(xi: np.ndarray, eta: np.ndarray) -> np.ndarray:
    angle = HALF * (2 * xi - 1)
    return np.array([RADIUS * np.sin(angle), WIDTH * eta, RADIUS * (np.cos(angle) - np.cos(HALF))])


@pytest.mark.parametrize(("scheme", "alpha"), EVERY)
def test_snap_through_and_snap_back(scheme, alpha, watch, worst) -> None:
    """A force pushes the crown down and lets go; the arch jumps there, and swings back."""
    section = Isotropic(E=1.0, nu=0.0, thickness=THICKNESS, density=1.0)
    pulse = Table((0, 5, 40, 45), (0, 1, 1, 0))
    crown = [(0.0, y, RISE) for y in (0.0, WIDTH)]
    scene = Scene(
        "arch",
        Shell("plate", Parametric(_arch), section, mesh=(8, 1)),
        supports=Hinged(("left", "right")),
        loads=[PointForce(p, (0, 0, -2e-6), time=pulse) for p in crown],
        probes=Probe("crown", crown[0], component=2),
        scheme=scheme,
        alpha=alpha,
        dt=2.0,
        t_end=160.0,
    )
    path = Path(Probes())
    watched = watch(scene, path.probes, path)
    watched.check(worst)
    z = path["crown"] / RISE
    # the mirrored arch is at -2: well beyond it, and back
    lowest = int(np.argmin(z))
    assert z[lowest] < -2.5 and z[lowest:].max() > -0.2
    # of 80: one where the arch jumps, in EP
    worst("steps that had to be repeated", watched.rejected, 3)


def _growth(stiffness: float, force: float, mass: float, length: float) -> float:
    """Rate at which a clamped column beyond Euler's load leaves its axis, 1/s.

    `EI w'''' + P w'' + m r^2 w = 0` has the solutions cos and sin of p x and q x; at the free end
    moment and shear force are zero.
    """

    def determinant(rate: float) -> float:
        root = np.sqrt(force**2 - 4 * stiffness * mass * rate**2 + 0j)
        p, q = (np.sqrt((force + sign * root) / (2 * stiffness)) for sign in (-1, 1))
        c, s, d, e = (f(k * length) for k in (p, q) for f in (np.cos, np.sin))
        moment = q**2 * d - p**2 * c, q * e - p * s
        shear = (
            stiffness * (p**3 * s - q**3 * e) + force * (q * e - p * s),
            stiffness * (q**2 * d - p**2 * c) + force * (c - d),
        )
        return float((moment[0] * shear[1] - moment[1] * shear[0]).real)

    # at this rate p = q, where the determinant is zero without a meaning
    double = force / (2 * np.sqrt(stiffness * mass))
    return float(brentq(determinant, 1.01 * double, 2.0 * double))


@pytest.mark.parametrize(("scheme", "alpha"), EVERY)
def test_buckling_from_round_off(scheme, alpha, watch, worst) -> None:
    """A column under 1.5 of Euler's load whose only imperfection is a velocity of 1e-16 m/s."""
    E, h, length, dt = 1.0, 0.02, 1.0, 8.0
    section = Isotropic(E=E, nu=0.0, thickness=h, density=1.0)
    stiffness = E * h**3 / 12
    force = 1.5 * np.pi**2 * stiffness / (4 * length**2)
    scene = Scene(
        "column",
        Shell("plate", Rectangle(length, 0.25), section, mesh=(4, 1)),
        supports=Clamped("left"),
        loads=EdgeForce("right", (-force, 0.0, 0.0)),
        initial=InitialVelocity(linear=(0, 0, 1e-16)),
        probes=Probe("tip", "right-top", component=2),
        scheme=scheme,
        alpha=alpha,
        dt=dt,
        t_end=2400.0,
    )
    path = Path(Probes())
    watched = watch(scene, path.probes, path)
    watched.check(worst)
    tip = np.abs(path["tip"])
    # straight for a long time (1e-9, as round-off is), then a large swing that stays bounded
    assert tip[: len(tip) // 3].max() < 1e-7 and 0.3 < tip.max() < length
    grown = np.flatnonzero((tip > 1e-12) & (tip < 1e-4))
    rate = np.polyfit(np.array(path.t)[grown], np.log(tip[grown]), 1)[0]
    # of second order in the step: (rate dt)^2/12 = 0.13 per cent
    exact = _growth(stiffness, force, h, length)
    worst("growth over 8 decades, off the theory of columns", abs(rate / exact - 1), 3e-3)
    worst("steps that had to be repeated", watched.rejected, 1)
