"""Velocity jumps, impulsive loads, release of a joint, what an impulsive start leaves behind."""

from typing import Any

import numpy as np
import pytest

from shellmb.observers.probes import Probes
from shellmb.scene import (
    GROUND,
    Clamped,
    EdgeForce,
    InitialVelocity,
    Isotropic,
    Lock,
    Probe,
    Revolute,
    RigidBody,
    Scene,
    Spherical,
    Table,
)
from shellmb.simulate.simulation import BaseObserver, Simulation
from tests.hard.conftest import EVERY, RIGID


class Rows(BaseObserver):
    """What an observer measures after every step."""

    def __init__(self, observer: Any) -> None:
        self.observer = observer
        self.t: list[float] = []
        self.rows: list[dict[str, float]] = []

    def accepted(self, simulation: Simulation) -> None:
        self.t.append(simulation.t)
        self.rows.append(dict(self.observer.measure()))

    def __getitem__(self, name: str) -> np.ndarray:
        return np.array([row[name] for row in self.rows])


@pytest.mark.parametrize(("scheme", "alpha"), EVERY)
def test_blow_of_one_step(scheme, alpha, plate, watch, worst) -> None:
    """An edge of a free plate is hit: it flies off at a third of the wave speed, and trembles."""
    blow = Table((0.1, 0.15, 0.2), (0.0, 1.0, 0.0))
    loads = EdgeForce("right", (0.3, -0.2, 1.0), time=blow)
    watched = watch(plate(scheme, alpha, loads=loads, dt=0.1, t_end=4.0))
    watched.check(worst)
    assert watched.total[1] == 0.0 and watched.total[2] > 1e-3


@pytest.mark.parametrize(("scheme", "alpha"), RIGID)
def test_lock_stops_a_knee_in_full_swing(scheme, alpha, watch, worst) -> None:
    """Velocities of two rods jump when their joint is locked; the lock holds, and lets go."""
    rods = [
        RigidBody(n, 1.0, (0.01, 0.1, 0.1), position=(x, 0, 0)) for n, x in (("a", 0.5), ("b", 1.5))
    ]
    joints = [
        Revolute("hip", GROUND, "a", at=(0, 0, 0), axis=(0, 0, 1)),
        Revolute("knee", "a", "b", at=(1, 0, 0), axis=(0, 0, 1)),
    ]
    watched = watch(
        Scene(
            "knee",
            rigid_bodies=rods,
            joints=joints,
            initial=[
                InitialVelocity(spin=(0, 0, 2.0), body="a"),
                InitialVelocity(spin=(0, 0, -7.0), about=(1, 0, 0), body="b"),
            ],
            locks=Lock("knee", (0.31, 0.77)),
            scheme=scheme,
            alpha=alpha,
            dt=0.02,
            t_end=1.2,
        )
    )
    watched.check(worst)
    # the impact takes energy away, once
    lost = watched.total[0] - watched.total[-1]
    assert lost > 0.05 * watched.total[0]


@pytest.mark.parametrize(("scheme", "alpha"), RIGID)
def test_release_of_a_joint_in_full_swing(scheme, alpha, watch, worst) -> None:
    """A spinning rod is let go at the time 0.7: its centre goes straight on, at constant speed."""
    spin = 3.0
    rod = RigidBody("rod", 1.0, (0.01, 0.1, 0.1), position=(0.5, 0, 0))
    watched_rows = Rows(Probes())
    watched = watch(
        Scene(
            "sling",
            rigid_bodies=rod,
            joints=Spherical("hand", GROUND, "rod", at=(0, 0, 0), active=(0.0, 0.7)),
            initial=InitialVelocity(spin=(0, 0, spin)),
            probes=[Probe("x", "center", "position", 0), Probe("y", "center", "position", 1)],
            scheme=scheme,
            alpha=alpha,
            dt=0.05,
            t_end=2.0,
        ),
        watched_rows.observer,
        watched_rows,
    )
    watched.check(worst)
    t = np.array(watched_rows.t)
    free = t > 0.7 - 1e-9
    x = np.stack([watched_rows["x"], watched_rows["y"]], 1)[free]
    speed = np.diff(x, axis=0) / np.diff(t[free])[:, None]
    worst("change of velocity in free flight", float(np.ptp(speed, axis=0).max()) / spin, 1e-9)


def _high(scheme: str, alpha: float, plate: Any) -> dict[str, tuple[float, float]]:
    """Energy above half of the Nyquist frequency of resultants, as it is and as a share of all."""
    section = Isotropic(E=1.0, nu=0.3, thickness=0.02, density=1.0)
    names = ("membrane", "bending", "shear")
    rows = Rows(Probes())
    scene = plate(
        scheme,
        alpha,
        section=section,
        mesh=(4, 1),
        supports=Clamped("left"),
        initial=InitialVelocity(linear=(0.0, 0.0, 0.02)),
        probes=[Probe(name, (0.5, 0.25, 0.0), name, component=0) for name in names],
        dt=1.0,
        t_end=256.0,
    )
    Simulation(scene).run([rows.observer, rows])
    found = {}
    for name in names:
        signal = rows[name]
        power = np.abs(np.fft.rfft((signal - signal.mean()) * np.hanning(len(signal)))) ** 2
        high = float(power[len(power) // 2 :].sum())
        found[name] = high, high / float(power.sum())
    return found


def test_high_frequencies_after_an_impulsive_start(plate, worst) -> None:
    """All points but the clamp begin to move at once: waves far above the step, in EP for ever."""
    ep, ed = (_high(*scheme, plate) for scheme in (("ep", 0.0), ("ed", 1.0)))
    # means over a step, as resultants are, leave little of what alternates from step to step
    assert ep["membrane"][1] > 0.5 and ep["shear"][1] > 0.03
    for name in ep:
        worst(f"{name}, energy above half Nyquist: ED over EP", ed[name][0] / ep[name][0], 0.02)
        worst(f"{name}, share above half Nyquist: ED over EP", ed[name][1] / ep[name][1], 0.1)
