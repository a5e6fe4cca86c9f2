"""Rigid bodies in motion: what does not depend on the description, closed forms, and cost."""

import time as clock
from dataclasses import replace
from typing import Any

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import numpy as np
import pytest

from shellmb.demos import slider_crank
from shellmb.demos.verification.problems.mechanisms import free_body, path_of
from shellmb.native.kernels import watched
from shellmb.observers.account.energy import EnergyAccount
from shellmb.observers.account.momentum import Momentum
from shellmb.running.execute import execute
from shellmb.scene import (
    GROUND,
    Driver,
    Gravity,
    InitialVelocity,
    Revolute,
    RigidBody,
    Scene,
    Spherical,
)
from shellmb.scene.multibody.rigid import rotation_matrix
from shellmb.simulate.simulation import Simulation
from tests.analytic.solutions import pendulum

SCHEMES = [("ep", 0.0), ("ed", 0.0), ("ed", 1.0), ("ep4", 0.0), ("ed3", 0.5)]
GRAVITY = Gravity((0, 0, -9.81))
TILT = rotation_matrix((0.3, -0.5, 0.4))


def _tumbling(described: RigidBody, scheme: str, alpha: float) -> Scene:
    return Scene(
        "top",
        rigid_bodies=described,
        joints=Spherical("tip", GROUND, "top", at=(0.1, 0.2, 0.0)),
        loads=GRAVITY,
        initial=InitialVelocity(spin=(1.0, 4.0, -2.0), about=(0.1, 0.2, 0.0)),
        scheme=scheme,
        alpha=alpha,
        dt=0.02,
        t_end=0.4,
    )


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_the_description_of_a_body_does_not_matter(scheme: str, alpha: float) -> None:
    """Principal axes through the centre, or any axes at any reference point: the same motion."""
    inertia, center = np.diag([0.5, 0.7, 0.4]), np.array([0.4, 0.1, 0.3])
    plain = RigidBody("top", mass=2.0, inertia=(0.5, 0.7, 0.4), position=tuple(center))
    away = np.array([-0.7, 0.2, 1.1])
    tilted = RigidBody(
        "top",
        mass=2.0,
        inertia=(TILT.T @ inertia @ TILT).tolist(),
        position=tuple(center + away),
        rotation=TILT.tolist(),
        com=tuple(-TILT.T @ away),
    )
    paths = [path_of(_tumbling(body, scheme, alpha), "top") for body in (plain, tilted)]
    first, second = (np.array(path.positions) for path in paths)
    # round-off of 20 steps, and the tolerance of Newton's method
    assert second == pytest.approx(first, abs=1e-10)
    turned = np.array(paths[1].axes) @ TILT.T
    assert turned == pytest.approx(np.array(paths[0].axes), abs=1e-10)
    assert np.abs(first - first[0]).max() > 0.1


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_free_flight_conserves(scheme: str, alpha: float) -> None:
    scene = replace(
        free_body(scheme, alpha, 50, 5.0),
        initial=InitialVelocity(linear=(1.0, 0.5, 0.2), spin=(0.05, 2.0, 0.1)),
    )
    account = EnergyAccount()
    momentum = Momentum(account)
    Simulation(scene).run([account, momentum])
    assert account.relative_error is not None and account.relative_error < 1e-12
    assert momentum.relative_drift("momentum") < 1e-12
    if scheme == "ep":
        assert momentum.relative_drift("angular momentum") < 1e-12
    dissipated = account.values["dissipation"]
    assert (dissipated > 1e-6) == (scheme in ("ed", "ed3") and alpha > 0)


@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_pendulum_swings_as_the_elliptic_function(scheme: str, alpha: float) -> None:
    """A body on a revolute joint with a skew axis of its own: a plane pendulum of large swings."""
    inertia, mass, length, amplitude = 0.3, 2.0, 0.5, 2.0
    down = np.array([0.0, np.sin(amplitude), -np.cos(amplitude)])
    body = RigidBody("bob", mass=mass, inertia=(inertia, 0.5, 0.4), position=tuple(length * down))
    scene = Scene(
        "pendulum",
        rigid_bodies=body,
        joints=Revolute("hinge", GROUND, "bob", at=(0, 0, 0), axis=(1, 0, 0)),
        loads=GRAVITY,
        scheme=scheme,
        alpha=alpha,
        dt=0.01,
        t_end=2.0,
    )
    path = path_of(scene, "bob")
    x = np.array(path.positions)
    frequency = np.sqrt(mass * 9.81 * length / (inertia + mass * length**2))
    angle, _ = pendulum(amplitude, frequency, path.time)
    exact = length * np.stack([0 * angle, np.sin(angle), -np.cos(angle)], 1)
    # second order: 0.05 rad per step
    assert np.abs(x - exact).max() < 1e-3
    assert np.ptp(angle) > 3.5


def test_driven_crank_turns_many_times() -> None:
    """Angles count beyond a turn, in steps of a radian, and no error adds up."""
    scene = slider_crank.scene(dt=0.04, t_end=1.6)
    run = execute(scene, results=slider_crank.results)
    assert slider_crank.crank(1.6)[0] > 7 * 2 * np.pi
    assert run.results["slider_error"] < 1e-12
    assert run.results["constraint_max"] < 1e-10
    assert run.results["energy_balance_error"] < 1e-9


def test_driver_takes_the_torque_of_the_equation_of_motion() -> None:
    """One rotor, its angle given: torque is the moment of inertia times the acceleration."""
    rotor = RigidBody("rotor", mass=1.0, inertia=(0.3, 0.2, 0.1))
    scene = Scene(
        "rotor",
        rigid_bodies=rotor,
        joints=Revolute("shaft", GROUND, "rotor", at=(0, 0, 0), axis=(1, 0, 0)),
        drivers=Driver("drive", "shaft", rotation=lambda t: 2.0 * t**2),
        scheme="ep",
        dt=0.05,
        t_end=2.0,
    )
    torque = execute(scene).history["drive.torque"].to_numpy()[1:]
    # with a turn of h in a step the scheme sees the rate 2/dt tan(h/2) and, by energy, the moment
    # J a (1 + h^2/12) (1 + h^2/4): second order, an eighth more for what comes behind it
    h = 4.0 * 0.05 * np.arange(0.5, 40) * 0.05
    assert np.all(np.abs(torque / (0.3 * 4.0) - 1) < 1.125 * h**2 / 3 + 1e-9)


def test_stiff_coupler_converges_to_the_rigid_one() -> None:
    slider, deflections = [], []
    for modulus in (70e9, 70e10, 70e11):
        scene = slider_crank.scene(flexible=True, modulus=modulus, t_end=0.14)
        found = execute(scene, results=slider_crank.results).results
        slider.append(found["slider_error"])
        deflections.append(found["largest_deflection"])
    # all is proportional to the compliance, but for the dynamic amplification of the softest
    for values in (slider, deflections):
        assert np.divide(values[1:], values[:-1]) == pytest.approx(0.1, rel=0.12)


def _chain(rod: Any, count: int) -> Scene:
    ends = [(0.5 * k, 0.0, -0.1 * k) for k in range(count + 1)]
    names = [GROUND, *(f"rod{k}" for k in range(count))]
    return Scene(
        "chain",
        rigid_bodies=[rod(names[k + 1], ends[k], ends[k + 1]) for k in range(count)],
        joints=[Spherical(f"j{k}", names[k], names[k + 1], at=ends[k]) for k in range(count)],
        loads=GRAVITY,
        scheme="ed",
        dt=1e-3,
        t_end=1e-2,
    )


def test_cost_grows_linearly_with_the_chain(rod) -> None:
    """Processor time of a Newton iteration; the smallest, which other processes disturb least."""
    counts, costs = (4, 8, 16, 32, 64), []
    for count in counts:
        simulation = Simulation(_chain(rod, count))
        steps = []
        for _ in range(5):
            begin = clock.process_time()
            simulation.advance()
            assert simulation.last is not None
            steps.append((clock.process_time() - begin) / simulation.last.iterations)
        costs.append(min(steps))
    # of the longer chains: in the shorter ones the overhead of a step counts. What pairs of bodies
    # cost would give 2, dense factors 3; caches and neighbours of a busy machine move it by tenths
    slope = np.polyfit(np.log(counts[2:]), np.log(costs[2:]), 1)[0]
    assert slope < 1.6, dict(zip(counts, costs, strict=True))


def test_joints_of_a_kind_share_their_kernels(rod) -> None:
    kernels = []
    for count in (2, 9):
        with watched() as found:
            Simulation(_chain(rod, count)).run([EnergyAccount()])
        kernels.append(found)
    assert kernels[0] == kernels[1]
    assert len(kernels[0]) > 5
