"""Beams in time: order of accuracy, energy law, momenta; curved, coupled and eccentric ones."""

import itertools
import math

import numpy as np
import pytest

from shellmb.running.execute import execute
from shellmb.scene import (
    Beam,
    CircularArc,
    Clamped,
    GeneralSection,
    InitialVelocity,
    Line,
    PointForce,
    Scene,
)
from shellmb.schemes.base import has_energy_law
from shellmb.schemes.registry import SCHEMES as REGISTRY
from shellmb.schemes.registry import make_scheme
from shellmb.simulate.simulation import Simulation

# every scheme of the registry with an energy law, those that dissipate with three values of alpha
SCHEMES = [
    (name, alpha)
    for name, make in REGISTRY.items()
    if make(1.0).dynamic and not make(1.0).linear and has_energy_law(make(1.0))
    for alpha in ((0.0, 0.5, 1.0) if make(1.0).dissipation()[0] else (0.0,))
]
# wave speeds of one: steps of 0.1 resolve all that an element can do
SOFT = GeneralSection(
    (1.0, 0.4, 0.4, 2e-3, 4e-3, 4e-3), mass_per_length=1.0, second_moments=(4e-3, 0.0, 4e-3)
)


def pulse(t: float) -> float:
    """Smooth, and zero at the beginning with three derivatives."""
    return math.sin(1.5 * t) ** 4


def swaying(scheme: str, alpha: float, dt: float, size: float) -> Scene:
    return Scene(
        "swaying",
        beams=Beam("b", Line((0, 0, 0), (1, 0, 0)), SOFT, elements=2),
        supports=Clamped("start"),
        loads=PointForce("end", (0.05 * size, 0.1 * size, 0.2 * size), time=pulse),
        scheme=scheme,
        alpha=alpha,
        dt=dt,
        t_end=1.6,
    )


def final(scene: Scene) -> np.ndarray:
    simulation = Simulation(scene)
    simulation.run()
    (beam,) = simulation.model.beams.values()
    return simulation.problem.levels[beam.name].q.x.array[beam.mixed.dofs["u"]].copy()


def slope(scene, steps: tuple[float, ...]) -> float:
    """Order by the changes from each step to half of it."""
    ends = [final(scene(dt)) for dt in (*steps, steps[-1] / 2)]
    changes = [np.linalg.norm(b - a) for a, b in itertools.pairwise(ends)]
    return float(np.polyfit(np.log(steps), np.log(changes), 1)[0])


@pytest.mark.parametrize(
    ("scheme", "alpha", "order"), [("ep", 0.0, 2), ("ed", 0.0, 4), ("ed", 1.0, 3)]
)
def test_order_of_small_motions(scheme, alpha, order) -> None:
    steps = (0.2, 0.1, 0.05)
    assert slope(lambda dt: swaying(scheme, alpha, dt, 1e-4), steps) > order - 0.25


@pytest.mark.parametrize(("scheme", "alpha"), [("ep", 0.0), ("ed", 0.0), ("ed", 1.0)])
def test_order_in_large_rotations(scheme, alpha) -> None:
    steps = (0.1, 0.05, 0.025)
    assert np.abs(final(swaying(scheme, alpha, 0.1, 1.0))).max() > 0.35
    assert slope(lambda dt: swaying(scheme, alpha, dt, 1.0), steps) > 1.8


def flight(beam: Beam, scheme: str, alpha: float) -> Scene:
    motion = InitialVelocity(linear=(0.1, -0.2, 0.3), spin=(0.6, 0.5, -0.9))
    return Scene(
        "flight", beams=beam, initial=motion, scheme=scheme, alpha=alpha, dt=0.1, t_end=3.0
    )


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_free_flight(flying, scheme, alpha) -> None:
    """A beam with couplings and a mass off its line, fast enough to bend: all laws of a step."""
    run = execute(flight(flying(), scheme, alpha))
    history, conserves = run.history, make_scheme(scheme, alpha).conserves
    energy = history["total_energy"]
    assert history["strain_energy"].max() > 1e-3 * energy[0]
    assert run.summary["energy_balance_error"] < 1e-10
    assert run.summary["linear_momentum_drift"] < 1e-10
    assert run.summary["director_max"] < 1e-11
    if "angular momentum" in conserves:
        assert run.summary["angular_momentum_drift"] < 1e-10
    if "energy" in conserves:
        assert np.ptp(energy) < 1e-10 * energy[0]
    else:
        assert (np.diff(energy) < 0).all()


def test_a_curved_cubic_beam_in_flight() -> None:
    """A half ring with elements of degree 3."""
    half = CircularArc((0, 0, 0), (0.5, 0, 0), (0, 0, 1), math.pi)
    run = execute(flight(Beam("b", half, SOFT, elements=2, degree=3), "ep", 0.0))
    assert run.summary["energy_balance_error"] < 1e-10
    assert run.summary["angular_momentum_drift"] < 1e-10
    assert run.history["strain_energy"].max() > 1e-3 * run.history["total_energy"][0]
