"""Averages over a sub-interval of a time step and exact discrete gradients.

A sub-interval joins two states `a` and `b`. Configuration-dependent quantities are taken at the
mid-point (eq. 17); stresses are averages such that their work is exactly the change of the strain
energy (eq. 21). `beta` adds the stress jump of eq. (32).
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import ufl
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives
from ufl.core.expr import Expr
from ufl.core.terminal import FormArgument
from ufl.corealg.traversal import unique_pre_traversal

# below this strain increment (squared, relative to strains of order one) the correction of the
# two-point average is smaller than round-off (it is of fifth order), and dividing by it is not safe
TINY_INCREMENT = 1e-8


def mean(a: Expr, b: Expr) -> Expr:
    """Mid-point average of eq. (17)."""
    return (a + b) / 2


def stress_average(tau_a: Any, tau_b: Any, beta: Expr | float) -> Any:
    """Average stress with the dissipative jump of eq. (32): `(a+b)/2 + beta (b-a)/2`.

    Of linear laws that of the strains alike, as the pages of schemes have it in numbers.
    """
    return (tau_a + tau_b) / 2 + beta * (tau_b - tau_a) / 2


def variation(measure: Callable[[Expr], Expr], q: Expr, dq: Expr, *like: Expr) -> Expr:
    """Directional derivative of a measure at the state `q` in the direction `dq`.

    `q` may be any expression in the space's shape (the mean of two states, say), which
    `ufl.derivative` alone does not take.

    Args:
        measure: A function of the state, returning any tensor-valued expression.
        q: State at which to differentiate, built from functions of the space of `dq`.
        dq: Direction (test or trial function, or any expression of the same shape).
        like: States of functions of the space, where neither of both is built from such.

    Returns:
        The derivative, an expression of the shape that `measure` returns.
    """
    derivative, (z, direction) = derivatives(measure, _space(q, dq, *like), 1)
    return ufl.replace(derivative, {z: q, direction: dq})


def second_variation(measure: Callable[[Expr], Expr], q: Expr, first: Expr, second: Expr) -> Expr:
    """Second variation, in two directions."""
    derivative, (z, *directions) = derivatives(measure, _space(q, first, second), 2)
    return ufl.replace(derivative, dict(zip((z, *directions), (q, first, second), strict=True)))


def at_rest(measure: Callable[[Expr], Expr], like: Expr) -> Expr:
    """Value of a measure where the state is zero.

    Args:
        measure: A function of the state.
        like: A state, built from functions of the space.
    """
    value, (z,) = derivatives(measure, _space(like), 0)
    return ufl.replace(apply_derivatives(apply_algebra_lowering(value)), {z: 0 * z})


def _space(*states: Expr) -> Any:
    """The function space of which states and directions are built."""
    terms = (term for state in states for term in unique_pre_traversal(state))
    shape = states[0].ufl_shape
    carriers = (t for t in terms if isinstance(t, FormArgument) and t.ufl_shape == shape)
    return next(carriers).ufl_function_space()  # type: ignore[attr-defined]


# derivatives that were taken, by measure, space and number
_TAKEN: ContextVar[dict[Any, Any] | None] = ContextVar("taken", default=None)


@contextmanager
def taken_once() -> Iterator[None]:
    """Derivatives of a measure are taken once in here, wherever the rows of a step ask for them.

    To take them is a third of the time in which forms are written; to put in states is little.
    """
    before = _TAKEN.set({} if _TAKEN.get() is None else _TAKEN.get())
    try:
        yield
    finally:
        _TAKEN.reset(before)


def derivatives(
    measure: Callable[[Expr], Expr], space: Any, count: int
) -> tuple[Expr, tuple[Expr, ...]]:
    """Derivative of a measure in `count` directions, and what stands for the state and for these.

    Args:
        measure: A function of the state.
        space: Its function space.
        count: Number of directions.
    """
    # spaces of DOLFINx have no hash; what is kept keeps them
    taken, key = _TAKEN.get(), (measure, id(space), count)
    if taken is not None and key in taken:
        return taken[key]
    if count == 0:
        z = ufl.Coefficient(space)
        found: tuple[Expr, tuple[Expr, ...]] = (measure(z), (z,))
    else:
        # gradients are derived in directions that stand by themselves
        value, places = derivatives(measure, space, count - 1)
        direction = ufl.Coefficient(space)
        derivative = ufl.derivative(value, places[0], direction)
        lowered = apply_derivatives(apply_algebra_lowering(derivative))
        found = lowered, (*places, direction)
    if taken is not None:
        taken[key] = found
    return found


def gradient(psi: Callable[[Expr], Expr], e: Expr) -> Expr:
    """Stress `d psi / d e` of a strain energy density at the strain `e`."""
    variable = ufl.variable(e)
    return ufl.diff(psi(variable), variable)


def discrete_gradient(
    psi: Callable[[Expr], Expr],
    e_a: Expr,
    e_b: Expr,
    weight: Expr | None = None,
    tiny: Expr | float = TINY_INCREMENT,
) -> Expr:
    """Average stress of eq. (21): `tau . (e_b - e_a) = psi(e_b) - psi(e_a)` exactly.

    The mean of the stresses at the two Gauss points between `e_a` and `e_b`, plus the correction
    along the increment that makes the identity exact (O. Gonzalez, J. Nonlinear Sci. 6 (1996)
    449-467, here on top of a higher-order average, so that it is tiny for small increments).

    Args:
        psi: Strain energy density as a function of a strain vector.
        e_a: Strain at the start of the sub-interval, shape (n,).
        e_b: Strain at its end, shape (n,).
        weight: Scale of each strain component, shape (n,), by which components of unlike units
            become comparable; ones if omitted.
        tiny: Square of an increment below which there is no correction.

    Returns:
        Stress, shape (n,).
    """
    middle, half = mean(e_a, e_b), (e_b - e_a) / 2
    offset = half / ufl.sqrt(3)
    tau = mean(gradient(psi, middle - offset), gradient(psi, middle + offset))
    increment = e_b - e_a
    n = increment.ufl_shape[0]
    if weight is None:
        scaled = increment
    else:
        scaled = ufl.as_vector([weight[k] ** 2 * increment[k] for k in range(n)])
    length2 = ufl.dot(scaled, increment)
    defect = psi(e_b) - psi(e_a) - ufl.dot(tau, increment)
    small = ufl.lt(length2, tiny)
    factor = ufl.conditional(small, 0.0, defect / ufl.conditional(small, 1.0, length2))
    return tau + factor * scaled
