"""Schemes that are quadratic in time: their closed forms, orders in large motion, and forces."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import numpy as np
import pytest

from shellmb.demos import slider_crank
from shellmb.demos.verification.problems.mechanisms import double_pendulum, pendulum_centers
from shellmb.forms.steps.path import PAIRS
from shellmb.scene import (
    Beam,
    InitialVelocity,
    Isotropic,
    JointSpring,
    Line,
    Rectangle,
    RectangularSection,
    Revolute,
    RigidBody,
    Scene,
    Shell,
    Solver,
    Spherical,
)
from shellmb.scene.schemes import DISSIPATIVE
from shellmb.schemes.quadratic import BOW, P0, P1, QuadraticInTime, strains
from shellmb.schemes.registry import SCHEMES, make_scheme
from shellmb.simulate.simulation import BaseObserver, Simulation

PAGE, SLOPES = QuadraticInTime().page, (P0.stresses, P1.stresses)
GENERAL = np.random.default_rng(3)
SIZE = 4
# columns of combinations of the states of a step
START, START_VELOCITY, END, END_VELOCITY = range(4)
# exact for what stands in the forms: of degree 5 at most
TAUS, WEIGHTS = np.polynomial.legendre.leggauss(5)
TAUS, WEIGHTS = (1 + TAUS) / 2, WEIGHTS / 2
P = (np.ones_like(TAUS), 2 * TAUS - 1)
KINDS = (("ep4", 0.0, 4), ("ed3", 0.5, 3), ("ed3", 1.0, 3))


@pytest.fixture
def measure() -> tuple[np.ndarray, np.ndarray]:
    """A quadratic scalar measure `L q + q.Q q/2`."""
    Q = GENERAL.normal(size=(SIZE, SIZE))
    return GENERAL.normal(size=SIZE), Q + Q.T


def at(states: Sequence[np.ndarray], tau: np.ndarray) -> np.ndarray:
    """The path, shape (n, size)."""
    x, D, z, *_ = states
    return x + np.outer(tau - 0.5, D) + np.outer(6 * tau**2 - 6 * tau + 1, z)


def evaluated(weights: np.ndarray, states: np.ndarray, L: np.ndarray, Q: np.ndarray) -> float:
    pairs = sum(w * states[a] @ Q @ states[b] for (a, b), w in zip(PAIRS, weights[4:], strict=True))
    return float(weights[:4] @ states @ L + pairs)


@pytest.mark.parametrize("alpha", [0.0, 0.3, 1.0])
def test_moments_are_those_of_a_path_of_the_strain(alpha: float, measure) -> None:
    """(Q3): the path (Q1) through the strains at both ends, with their rates there."""
    (L, Q), known = measure, GENERAL.normal(size=(4, SIZE))
    ends, pushes = known[[START, END]], known[[START_VELOCITY, END_VELOCITY]]
    e = ends @ L + np.einsum("ni,ij,nj->n", ends, Q, ends) / 2
    rates = pushes @ L + np.einsum("ni,ij,nj->n", ends, Q, pushes)
    mean, chord, bow, _ = PAGE.states(alpha) @ [e[0], rates[0], e[1], rates[1]]
    states = PAGE.states(alpha) @ known
    found = [evaluated(m, states, L, Q) for m in (*strains(alpha), BOW)]
    # round-off of some dozens of products
    np.testing.assert_allclose(found, [mean, chord / 2 + alpha * bow, 2 * bow], rtol=1e-11)


@pytest.mark.parametrize("alpha", [0.0, 0.3, 1.0])
def test_forces_work_on_the_path_of_the_strain(alpha: float, measure) -> None:
    """(Q4): the mean forces act on is that over the path, and their work is that on `s'`."""
    (L, Q), known = measure, GENERAL.normal(size=(4, SIZE))
    states = PAGE.states(alpha) @ known
    gradient = L + at(states, TAUS) @ Q
    slopes = np.array(
        [[slope[0] * L + Q @ (slope[1:] @ states) for slope in row] for row in SLOPES]
    )
    for row in range(2):
        exact = np.einsum("n,n,ni->i", WEIGHTS, P[row], gradient)
        np.testing.assert_allclose(slopes[row, 0], exact, rtol=1e-12, atol=1e-12)
    # those of P1 are tested with `q' = D + 6 z P1`
    work = np.einsum("rki,ri->k", slopes, [states[1], 6 * states[2]])
    change = 2 * evaluated(strains(0.0)[1], states, L, Q)
    np.testing.assert_allclose(work, [change, evaluated(BOW, states, L, Q)], rtol=1e-11)


@pytest.mark.parametrize("alpha", [0.0, 0.3, 1.0])
def test_the_path_obeys_the_equations_of_its_velocity(alpha: float) -> None:
    """(Q1): `<q' - h v> = 0`, `<P1 (q' - h v)> = alpha h v_2 / 3`, and the ends."""
    known = GENERAL.normal(size=(4, SIZE))
    states = PAGE.states(alpha) @ known
    ends = at(states, np.array([0.0, 1.0]))
    np.testing.assert_allclose(ends, known[[START, END]], rtol=1e-12, atol=1e-12)
    rate = states[1] + np.outer(6 * (2 * TAUS - 1), states[2])
    # the velocity that is quadratic, with its ends and, by P0, its mean
    first, last = known[START_VELOCITY], known[END_VELOCITY]
    second = (first + last) / 2 - states[1]
    v = at((states[1], last - first, second), TAUS)
    np.testing.assert_allclose(WEIGHTS @ (rate - v), 0, atol=1e-12)
    np.testing.assert_allclose((WEIGHTS * P[1]) @ (rate - v), alpha * second / 3, atol=1e-12)


def amplification(alpha: float, angle: float) -> np.ndarray:
    """Matrix of a step of the oscillator `q'' = -angle^2 q` on `(q, h v)`, by (Q1) to (Q3)."""
    combine, (first, second) = PAGE.states(alpha), strains(alpha)
    # rows P0 and P1 of the four states; the strain is q itself
    inertia = np.zeros((2, 4))
    inertia[0, [START_VELOCITY, END_VELOCITY]] = -1, 1
    inertia[1, [START_VELOCITY, END_VELOCITY]] = 1, 1
    inertia[1] -= 2 * combine[1]
    stress = angle**2 * np.array([first[:4] @ combine, second[:4] @ combine])
    forces = [[slope[0] for slope in row] for row in SLOPES]
    rows = inertia + forces @ stress
    return np.linalg.solve(rows[:, [END, END_VELOCITY]], -rows[:, [START, START_VELOCITY]])


@pytest.mark.parametrize("alpha", [0.0, 0.3, 0.5, 1.0])
def test_amplitudes_of_vibrations(alpha: float) -> None:
    """Gauss' method for alpha = 0; at high frequencies the spectral radius of the paper's ED."""
    radii = [np.abs(np.linalg.eigvals(amplification(alpha, w))) for w in (0.1, 1.0, 1e5)]
    np.testing.assert_allclose(radii[-1], (1 - alpha) / (1 + alpha), atol=1e-4)
    if alpha == 0:
        np.testing.assert_allclose(radii, 1, rtol=1e-9)
    else:
        assert np.all(np.array(radii) < 1)
    # what is lost in a slow vibration is of fourth order in its angle in a step
    np.testing.assert_allclose(1 - radii[0], alpha * 0.1**4 / 72, rtol=0.05, atol=1e-12)


class Swing(BaseObserver):
    """Centre and velocity of the lower rod at the end, and its forces."""

    def __init__(self) -> None:
        self.torques: list[float] = []

    def solved(self, simulation: Simulation) -> None:
        for coordinate in simulation.model.mechanism.drivers.values():
            self.torques.append(coordinate.drive(simulation.problem))


def slope(sizes: list[int], errors: list[float]) -> float:
    """Order by regression."""
    return float(-np.polyfit(np.log(sizes), np.log(errors), 1)[0])


@pytest.mark.parametrize(("scheme", "alpha", "order"), KINDS)
def test_order_in_large_motion(scheme: str, alpha: float, order: int) -> None:
    """A rigid double pendulum that falls by a large angle, against the equations of motion."""
    exact, errors, counts = pendulum_centers(np.array([0.5]))[0, 1], [], [20, 40, 80]
    for steps in counts:
        simulation = Simulation(double_pendulum(scheme, alpha, steps, t_end=0.5))
        simulation.run()
        rigid = simulation.model.rigid
        q = simulation.problem.levels[rigid.name].q.x.array
        center = rigid.bodies[rigid.index["b"]].center + q[rigid.local("b", "u")]
        errors.append(float(np.linalg.norm(center[:2] - exact)))
    assert slope(counts, errors) == pytest.approx(order, abs=0.25)
    assert errors[-1] < (1e-6 if order == 4 else 1e-4)


@pytest.mark.parametrize(("scheme", "alpha", "order"), KINDS)
def test_driving_torques_are_means_of_the_full_order(scheme: str, alpha: float, order: int) -> None:
    """The mean over a step is that of the means over its parts; nothing alternates."""
    means, counts = {}, [20, 40, 160]
    for steps in counts:
        torque = Swing()
        scene = slider_crank.scene(dt=0.08 / steps, t_end=0.08)
        Simulation(replace(scene, scheme=scheme, alpha=alpha)).run([torque])
        means[steps] = np.array(torque.torques)
    errors = []
    for steps in counts[:-1]:
        exact = means[160].reshape(steps, -1).mean(axis=1)
        errors.append(float(np.abs(means[steps] - exact).max() / np.abs(exact).max()))
    assert np.log2(errors[0] / errors[1]) > order - 0.35
    assert errors[-1] < 1e-4


SOFT = Isotropic(E=1.0, nu=0.3, thickness=0.2, density=1.0)
ROD = RectangularSection(E=1.0, nu=0.3, width=0.1, height=0.2, density=1.0)


def thrown(**more: Any) -> Scene:
    shell = Shell("plate", Rectangle(1.0, 0.5), more.pop("section", SOFT), mesh=(2, 1))
    motion = InitialVelocity(linear=(0.1, -0.2, 0.3), spin=(0.4, 0.6, -0.3))
    return Scene("thrown", shell, initial=motion, dt=0.2, t_end=0.6, **more)


@pytest.mark.parametrize(("scheme", "alpha", "order"), KINDS[:2])
def test_reduced_and_unreduced_systems_have_the_same_solution(
    scheme: str, alpha: float, order: int
) -> None:
    states = []
    for solve in ("reduced", "full"):
        simulation = Simulation(
            thrown(scheme=scheme, alpha=alpha, solver=Solver(solve=solve, newton="full"))
        )
        simulation.run()
        levels, body = simulation.problem.levels["plate"], simulation.model.shells["plate"]
        dofs = np.concatenate([body.mixed.dofs["u"], body.mixed.dofs["w"]])
        states.append(np.stack([levels.q.x.array[dofs], levels.rates["v"].x.array[dofs]]))
        if solve == "reduced":
            # five unknowns per node and row, less those of one cell only
            reduction: Any = simulation.problem.iteration.linear
            assert reduction.size <= 2 * 5 * len(body.mixed.nodes("u"))
    # both leave the square of Newton's tolerance
    np.testing.assert_allclose(states[0], states[1], atol=1e-11)


def turning(**more: Any) -> Scene:
    """A rigid body and a beam, a spring on the angle of a joint."""
    arm = RigidBody("arm", 2.0, (0.1, 0.2, 0.3), position=(0.5, 0.0, 0.0))
    return Scene(
        "turning",
        rigid_bodies=arm,
        beams=Beam("rod", Line((1.0, 0.0, 0.0), (2.0, 0.0, 0.0)), ROD, elements=1),
        joints=(
            Revolute("pin", "ground", "arm", at=(0.0, 0.0, 0.0), axis=(0, 0, 1)),
            Spherical("ball", "arm", "rod", at=(1.0, 0.0, 0.0)),
        ),
        force_elements=JointSpring("spring", "pin", 3.0),
        dt=0.2,
        t_end=0.6,
        **more,
    )


@pytest.mark.parametrize(
    "scene, scheme, alpha",
    [
        (thrown, "ed3", 0.5),
        (turning, "ed3", 0.5),
        # angles are derived through cosine and sine in all schemes
        (turning, "ep", 0.0),
        (turning, "ed", 1.0),
    ],
)
def test_the_tangent_of_the_rows(scene: Callable[..., Scene], scheme: str, alpha: float) -> None:
    """Jacobian times a direction, against differences of the residual, unreduced."""
    simulation = Simulation(
        scene(scheme=scheme, alpha=alpha, solver=Solver(solve="full", newton="full"))
    )
    problem, system = simulation.problem, simulation.problem.system
    problem.prepare(0.0, 0.2)
    problem.start_from_state()
    system.gather()
    x = system.x.duplicate()
    x.array[:] = system.x.array + 1e-2 * GENERAL.normal(size=x.array.size)
    direction, b = system.x.duplicate(), [system.b.duplicate() for _ in range(2)]
    direction.array[:] = GENERAL.normal(size=x.array.size)
    step = 1e-5
    for sign, residual in zip((1, -1), b, strict=True):
        moved = x.copy()
        moved.axpy(sign * step, direction)
        system.scatter(moved)
        system.residual(moved, residual)
    system.scatter(x)
    system.jacobian(x, system.A)
    exact = system.A.createVecLeft()
    system.A.mult(direction, exact)
    found = (b[0].array - b[1].array) / (2 * step)
    # central differences of polynomials of degree four in the step: its square, and round-off
    assert np.abs(found - exact.array).max() < 1e-7 * np.abs(exact.array).max()


def test_every_dissipation_reaches_its_scheme() -> None:
    """Whether it is given with the scene or, as on the command line, in place of the scene's."""
    assert [n for n, make in SCHEMES.items() if getattr(make(0.25), "alpha", 0) == 0.25] == list(
        DISSIPATIVE
    )
    for name in DISSIPATIVE:
        scene = double_pendulum("ep", 0.0, 20).with_options(scheme=name, alpha=0.25)
        made: Any = make_scheme(scene.scheme, scene.dissipation)
        assert made.alpha == 0.25
