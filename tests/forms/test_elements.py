"""Springs: their average force does exactly the work that their energy changes by."""

from collections.abc import Callable

import numpy as np
import pytest
import ufl

from shellmb.forms.steps import potentials

U = ufl.as_ufl


def value(expression: ufl.core.expr.Expr) -> float:
    return float(ufl.algorithms.expand_derivatives(U(expression))(()))


def row(x: float) -> ufl.core.expr.Expr:
    return ufl.as_vector([U(x)])


def stress(
    potential: Callable[[ufl.core.expr.Expr], ufl.core.expr.Expr],
    a: float,
    b: float,
    beta: ufl.core.expr.Expr | float = 0.0,
) -> float:
    """Mean force of a spring whose coordinate is of size one."""
    smooth = potentials.SMALL_INCREMENT
    found = potentials.interval_stress(lambda e: potential(e[0]), row(a), row(b), beta, smooth)
    return value(found[0])


def jump(
    potential: Callable[[ufl.core.expr.Expr], ufl.core.expr.Expr], a: float, b: float
) -> float:
    return value(potentials.interval_jump(lambda e: potential(e[0]), row(a), row(b)))


POTENTIALS = {
    "linear": potentials.linear_potential(U(3.0)),
    "cubic": lambda e: 2 * e**4 + e**3,
    "pendulum": lambda e: 5 * (1 - ufl.cos(e)),
    "stop": lambda e: 1e3 * ufl.conditional(ufl.gt(e, 0.5), (e - 0.5) ** 2, 0 * e),
    "steep": lambda e: ufl.exp(8 * e),
}


@pytest.mark.parametrize("step", [0.7, -0.2, 1.1e-4, -3e-3])
@pytest.mark.parametrize("potential", POTENTIALS.values(), ids=POTENTIALS)
def test_work_is_the_change_of_the_energy(
    potential: Callable[[ufl.core.expr.Expr], ufl.core.expr.Expr], step: float
) -> None:
    a, b = 0.3, 0.3 + step
    change = value(potential(U(b))) - value(potential(U(a)))
    # round-off of energies of order one to ten
    assert stress(potential, a, b) * (b - a) == pytest.approx(change, abs=1e-14)


@pytest.mark.parametrize("potential", POTENTIALS.values(), ids=POTENTIALS)
def test_small_increments_neither_jump_nor_divide_by_zero(
    potential: Callable[[ufl.core.expr.Expr], ufl.core.expr.Expr],
) -> None:
    slope = value(potentials.slope(potential, U(0.3)))
    assert stress(potential, 0.3, 0.3) == pytest.approx(slope, rel=1e-14)
    limit = potentials.SMALL_INCREMENT
    inside, outside = (stress(potential, 0.3, 0.3 + f * limit) for f in (1 - 1e-9, 1 + 1e-9))
    # the correction loses four of sixteen digits
    assert inside == pytest.approx(outside, abs=1e-11 * max(1.0, abs(slope)))


def test_the_stiffness_of_linear_springs_is_that_of_their_energy() -> None:
    k, a, b, beta = U(3.0), 0.2, -0.5, 0.7
    potential = potentials.linear_potential(k)
    own = value(potentials.linear_stiffness(k))
    force = own * ((a + b) / 2 + beta * (b - a) / 2)
    assert stress(potential, a, b, U(beta)) == pytest.approx(force, rel=1e-14)
    assert jump(potential, a, b) == pytest.approx(own * (b - a) ** 2 / 2, rel=1e-14)


@pytest.mark.parametrize("potential", POTENTIALS.values(), ids=POTENTIALS)
def test_the_jump_of_the_force_takes_out_energy(
    potential: Callable[[ufl.core.expr.Expr], ufl.core.expr.Expr],
) -> None:
    a, b = 0.3, 0.9
    force, out = stress(potential, a, b, U(1.0)), jump(potential, a, b)
    change = value(potential(U(b))) - value(potential(U(a)))
    assert out > 0
    assert force * (b - a) == pytest.approx(change + out, rel=1e-13)
    assert np.isfinite(force)
