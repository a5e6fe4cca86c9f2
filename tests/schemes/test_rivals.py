"""The rivals: orders in large motion, energy, and what generalized-alpha begins with."""

from dataclasses import replace
from typing import Any

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import numpy as np
import pytest

from shellmb.demos import slider_crank
from shellmb.demos.verification.problems.mechanisms import double_pendulum, pendulum_centers
from shellmb.running.execute import execute
from shellmb.scene import Driver, Gravity, InitialVelocity, Revolute, RigidBody, Scene
from shellmb.schemes.rivals import GeneralizedAlpha
from shellmb.simulate.simulation import Simulation


def errors(scheme: str, alpha: float, counts: list[int]) -> list[float]:
    """Of the lower rod of a double pendulum in a large fall, against the equations of motion."""
    exact, found = pendulum_centers(np.array([0.5]))[0, 1], []
    for steps in counts:
        simulation = Simulation(double_pendulum(scheme, alpha, steps, t_end=0.5))
        simulation.run()
        rigid = simulation.model.rigid
        q = simulation.problem.levels[rigid.name].q.x.array
        center = rigid.bodies[rigid.index["b"]].center + q[rigid.local("b", "u")]
        found.append(float(np.linalg.norm(center[:2] - exact)))
    return found


@pytest.mark.parametrize(
    ("scheme", "alpha", "order", "largest"),
    [
        ("generalized-alpha", 0.0, 2, 1e-3),
        ("generalized-alpha", 1 / 3, 2, 1e-3),
        ("ed-printed", 1.0, 1, 1e-2),
    ],
)
def test_orders_in_large_motion(scheme: str, alpha: float, order: int, largest: float) -> None:
    counts = [20, 40, 80]
    found = errors(scheme, alpha, counts)
    slope = -np.polyfit(np.log(counts), np.log(found), 1)[0]
    assert slope == pytest.approx(order, abs=0.2)
    assert found[-1] < largest


def test_ed_as_printed_without_dissipation_does_not_converge() -> None:
    """What ED does without our change of eq. (31); with it these errors are below 1e-4."""
    coarse, fine = errors("ed-printed", 0.0, [20, 80])
    assert fine > 0.9 * coarse > 0.05


@pytest.mark.parametrize("alpha", [0.0, 1.0])
def test_the_energy_of_ed_as_printed(alpha: float) -> None:
    """Its law is as exact as that of ED, also with joints: what is wrong is the order."""
    run = execute(double_pendulum("ed-printed", alpha, 40, t_end=0.5))
    # Newton's tolerance squared, and round-off
    assert run.summary["energy_balance_error"] < 1e-11
    change = np.diff(run.history["dissipation"])
    assert (change > 0).all() if alpha else not change.any()


# of an oscillation in a step that does not resolve it
ANGLE = 1e5


def test_amplitudes_of_generalized_alpha_at_high_frequency() -> None:
    """The oscillator `q'' = -w^2 q` on (q, h v, h^2 a, h^2 acceleration): rho of Chung, Hulbert."""
    for alpha in (0.0, 0.25, 1.0):
        scheme = GeneralizedAlpha(alpha)

        def end(start: np.ndarray, qf: float, weights: Any = scheme.weights) -> tuple[float, ...]:
            rates = dict(zip(("v", "a", "acceleration"), start[1:], strict=True))
            return (qf, *weights.end(start[0], rates, qf, 1.0))

        def residual(start: np.ndarray, qf: float) -> float:
            return end(start, qf)[3] + ANGLE**2 * qf

        columns = []
        for start in np.eye(4):
            fixed, one = residual(start, 0.0), residual(start, 1.0)
            columns.append(end(start, -fixed / (one - fixed)))
        radius = np.abs(np.linalg.eigvals(np.array(columns).T)).max()
        # equal roots: the square root of round-off, and 1/angle
        assert radius == pytest.approx(scheme.rho, abs=2e-2)


ARM = RigidBody("arm", 2.0, (0.1, 0.2, 0.3), position=(0.5, 0.0, 0.0))
PIN = Revolute("pin", "ground", "arm", at=(0.0, 0.0, 0.0), axis=(0, 0, 1))


def acceleration(scene: Scene) -> np.ndarray:
    """Of the centre of the arm at the start."""
    simulation = Simulation(replace(scene, scheme="generalized-alpha"))
    rigid = simulation.model.rigid
    found = simulation.problem.levels[rigid.name].rates["acceleration"].x.array
    return np.array(found[rigid.local("arm", "u")])


def test_accelerations_at_the_start() -> None:
    """A pendulum that turns, with the gravity and the curvature of its path; and a driven one."""
    spin, g = 3.0, 9.81
    times: dict[str, Any] = {"dt": 0.01, "t_end": 0.1}
    scene = Scene(
        "pendulum",
        rigid_bodies=ARM,
        joints=PIN,
        loads=Gravity((0.0, -g, 0.0)),
        initial=InitialVelocity(spin=(0, 0, spin)),
        **times,
        scheme="ep",
    )
    # parallel axes: inertia about the pin
    turn = -2.0 * g * 0.5 / (0.3 + 2.0 * 0.25)
    np.testing.assert_allclose(acceleration(scene), [-(spin**2) / 2, turn / 2, 0], atol=1e-9)
    driver = Driver("motor", "pin", rotation=lambda t: spin * t + 2 * t**2)
    driven = Scene("driven", rigid_bodies=ARM, joints=PIN, drivers=driver, **times, scheme="ep")
    # second differences of the motion: round-off over the square of half a millisecond
    np.testing.assert_allclose(acceleration(driven), [-(spin**2) / 2, 2.0, 0], atol=1e-6)


def test_the_slider_crank_agrees_with_ep4() -> None:
    """Driver, joints and a mechanism in motion: positions of second order."""
    ends = {}
    for scheme, steps in (("ep4", 40), ("generalized-alpha", 40), ("generalized-alpha", 80)):
        scene = slider_crank.scene(dt=0.08 / steps, t_end=0.08)
        simulation = Simulation(replace(scene, scheme=scheme, alpha=0.0))
        simulation.run()
        rigid = simulation.model.rigid
        ends[scheme, steps] = simulation.problem.levels[rigid.name].rates["v"].x.array.copy()
    exact = ends["ep4", 40]
    coarse, fine = (np.abs(ends["generalized-alpha", n] - exact).max() for n in (40, 80))
    assert fine < 0.3 * coarse
    assert fine < 1e-2 * np.abs(exact).max()
