"""Springs: their average force does exactly the work that their energy changes by."""

from collections.abc import Callable

import numpy as np
import pytest
import ufl

from shellmb.forms.constraints import elements

U = ufl.as_ufl
SIZE = U(1.0)


def value(expression: ufl.core.expr.Expr) -> float:
    return float(ufl.algorithms.expand_derivatives(U(expression)))


POTENTIALS = {
    "linear": elements.linear_potential(U(3.0)),
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
    a, b = U(0.3), U(0.3 + step)
    work = value(elements.mean_slope(potential, a, b, SIZE)) * (float(b) - float(a))
    change = value(potential(b)) - value(potential(a))
    # round-off of energies of order one to ten
    assert work == pytest.approx(change, abs=1e-14)


@pytest.mark.parametrize("potential", POTENTIALS.values(), ids=POTENTIALS)
def test_small_increments_neither_jump_nor_divide_by_zero(
    potential: Callable[[ufl.core.expr.Expr], ufl.core.expr.Expr],
) -> None:
    slope = value(elements.slope(potential, U(0.3)))
    assert value(elements.mean_slope(potential, U(0.3), U(0.3), SIZE)) == pytest.approx(
        slope, rel=1e-14
    )
    limit = elements.SMALL_INCREMENT
    inside, outside = (
        value(elements.mean_slope(potential, U(0.3), U(0.3 + f * limit), SIZE))
        for f in (1 - 1e-9, 1 + 1e-9)
    )
    # the quotient loses four of sixteen digits
    assert inside == pytest.approx(outside, abs=1e-11 * max(1.0, abs(slope)))


def test_linear_springs_have_forms_of_their_own() -> None:
    k, a, b, beta = U(3.0), U(0.2), U(-0.5), U(0.7)
    potential = elements.linear_potential(k)
    general = elements.spring_force(potential, a, b, beta, SIZE)
    assert value(general) == pytest.approx(value(elements.linear_force(k, a, b, beta)), rel=1e-14)
    jump = elements.spring_jump(potential, a, b)
    assert value(jump) == pytest.approx(value(elements.linear_jump(k, a, b)), rel=1e-14)


@pytest.mark.parametrize("potential", POTENTIALS.values(), ids=POTENTIALS)
def test_the_jump_of_the_force_takes_out_energy(
    potential: Callable[[ufl.core.expr.Expr], ufl.core.expr.Expr],
) -> None:
    a, b, beta = U(0.3), U(0.9), U(1.0)
    force = value(elements.spring_force(potential, a, b, beta, SIZE))
    step = float(b) - float(a)
    change = value(potential(b)) - value(potential(a))
    jump = value(elements.spring_jump(potential, a, b))
    assert jump > 0
    assert force * step == pytest.approx(change + jump, rel=1e-13)
    assert np.isfinite(force)
