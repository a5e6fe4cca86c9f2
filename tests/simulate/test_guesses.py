"""First guesses of steps: polynomials through values and slopes, and what they save."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import shellmb as sm
from shellmb.scene import Solver
from shellmb.schemes.quadratic import QuadraticInTime
from shellmb.simulate.predictor import KNOTS, knot_weights
from shellmb.simulate.simulation import Simulation
from tests.bench.errors.mechanisms import chain

RANDOM = np.random.default_rng(0)


def test_polynomials_are_met_with_steps_of_any_length() -> None:
    times, dt = (0.0, -1.0, -2.5, -3.0), 0.25
    weights = knot_weights(times, dt)
    values, slopes = weights[::2], weights[1::2]
    for row, (count, known) in enumerate(KNOTS):
        p = np.polynomial.Polynomial(RANDOM.normal(size=count + known))
        # of each state its value, and its slope per unit of time
        data = np.stack([p(np.array(times)), p.deriv()(np.array(times)) / dt], axis=1).ravel()
        assert values[row] @ data == pytest.approx(p(1.0), rel=1e-11)
        assert slopes[row] @ data == pytest.approx(p.deriv()(1.0), rel=1e-11, abs=1e-11)


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("scheme", ["ep4", "ed3"])
def test_forces_are_continued_by_the_first_moments_that_tell_their_slopes(
    scheme: Any, degree: int
) -> None:
    """A link that hangs under a load that grows: the next forces are known before they are."""
    load = sm.Gravity((9.81, 0.0, 0.0), time=lambda t: 1.0 + (20.0 * t) ** degree)
    alpha = {"alpha": 1.0} if scheme == "ed3" else {}
    scene = chain(scheme, links=1, dt=0.05, t_end=0.5, **alpha)
    simulation = Simulation(replace(scene, loads=(load,)))
    problem = simulation.problem
    for _ in range(3):
        simulation.advance()
    guess = problem.predictor.guess(problem.switches, 0.05)
    assert guess is not None
    foreseen = guess.array.copy()
    simulation.advance()
    # round-off of forces of up to 50 N; with another slope they are off by newtons
    np.testing.assert_allclose(foreseen, problem.system.x.array_r, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("alpha", [0.0, 0.4])
def test_stresses_grow_as_their_slopes_say(alpha: float) -> None:
    """Of a stress `S_0 + S_1 P1` that is linear in time and begins where it was."""
    scheme = QuadraticInTime(alpha)
    mean, moment = np.array([3.0]), np.array([0.5])
    end = scheme.resultants(mean - moment, {"f": mean, "v": moment})
    assert end - (mean - moment) == pytest.approx(scheme.slopes[0] * moment, rel=1e-15)


@pytest.mark.parametrize(("newton", "most"), [("full", 7.0), ("auto", 9.5)])
def test_large_steps_of_a_long_chain_take_few_iterations(newton: Any, most: float) -> None:
    """Ten links turn by up to 1.4 rad in a step; guesses by positions alone: 10 and 14."""
    scene = chain("ep4", links=10, dt=0.04, t_end=0.8, solver=Solver(newton=newton))
    simulation = Simulation(scene)
    simulation.run()
    assert simulation.iterations / simulation.step < most


def test_short_steps_of_a_long_chain_take_the_two_iterations_of_their_own_factorisation() -> None:
    """With those of the steps before they take 4 iterations, and a factorisation all the same."""
    simulation = Simulation(chain("ep", links=10, dt=1e-3, t_end=0.1))
    simulation.run()
    factorisations = simulation.problem.iteration.factorisations
    assert simulation.iterations < 2.5 * simulation.step
    assert factorisations < 1.1 * simulation.step
