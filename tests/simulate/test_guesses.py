"""First guesses of steps: polynomials through values and velocities, and what they save."""

from typing import Any

import numpy as np
import pytest

from shellmb.scene import Solver
from shellmb.simulate.predictor import KNOTS, knot_weights
from shellmb.simulate.simulation import Simulation
from tests.bench.errors.mechanisms import chain

RANDOM = np.random.default_rng(0)


def test_polynomials_are_met_with_steps_of_any_length() -> None:
    times = (0.0, -1.0, -2.5, -3.0)
    values, slopes = knot_weights(times)
    for row, (count, known) in enumerate(KNOTS):
        p = np.polynomial.Polynomial(RANDOM.normal(size=count + known))
        data = np.concatenate([p(np.array(times)), p.deriv()(np.array(times))])
        assert values[row] @ data == pytest.approx(p(1.0), rel=1e-11)
        assert slopes[row] @ data == pytest.approx(p.deriv()(1.0), rel=1e-11, abs=1e-11)


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
