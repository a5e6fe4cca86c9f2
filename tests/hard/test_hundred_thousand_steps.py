"""Laws that hold in each step hold in a hundred thousand: nothing adds up but round-off."""

import numpy as np
import pytest

from shellmb.demos.verification.problems.mechanisms import double_pendulum
from shellmb.running.execute import execute

SCHEMES = [("ep", 0.0), ("ed", 1.0), ("ep4", 0.0), ("ed3", 0.5)]


@pytest.mark.parametrize(
    "steps", [500, pytest.param(100_000, marks=pytest.mark.slow)], ids=lambda n: f"{n}"
)
@pytest.mark.parametrize(("scheme", "alpha"), SCHEMES)
def test_a_pendulum_that_turns_over_for_ever(scheme, alpha, steps, worst) -> None:
    """A rigid double pendulum, chaotic, with up to 0.1 rad a step."""
    run = execute(double_pendulum(scheme, alpha, steps, t_end=0.01 * steps))
    # round-off adds up at random
    worst("energy law", run.summary["energy_balance_error"], 1e-12 * steps**0.5)
    worst("constraints", run.summary["constraint_max"], 1e-11)
    assert run.summary["rejected_steps"] == 0
    total = run.column("total_energy") - run.column("work_loads")
    if alpha:
        assert np.all(np.diff(run.column("dissipation")) >= 0)
    else:
        size = run.column("kinetic_energy").max()
        worst("energy", np.ptp(total) / size, 1e-12 * steps**0.5)
