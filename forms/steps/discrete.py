"""Averages over a sub-interval of a time step and exact discrete gradients.

A sub-interval joins two states `a` and `b`. Configuration-dependent quantities are taken at the
mid-point (eq. 17); stresses are averages such that their work is exactly the change of the strain
energy (eq. 21). `beta` adds the stress jump of eq. (32).
"""

from collections.abc import Callable

import ufl
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives
from ufl.core.expr import Expr

# below this strain increment (squared, relative to strains of order one) the correction of the
# two-point average is smaller than round-off (it is of fifth order), and dividing by it is not safe
TINY_INCREMENT = 1e-8


def mean(a: Expr, b: Expr) -> Expr:
    """Mid-point average of eq. (17)."""
    return (a + b) / 2


def stress_average(tau_a: Expr, tau_b: Expr, beta: Expr | float) -> Expr:
    """Average stress with the dissipative jump of eq. (32): `(a+b)/2 + beta (b-a)/2`."""
    return (tau_a + tau_b) / 2 + beta * (tau_b - tau_a) / 2


def variation(measure: Callable[[Expr], Expr], q: Expr, dq: Expr) -> Expr:
    """Directional derivative of a measure at the state `q` in the direction `dq`.

    `q` may be any expression in the space's shape (the mean of two states, say), which
    `ufl.derivative` alone does not take.

    Args:
        measure: A function of the state, returning any tensor-valued expression.
        q: State at which to differentiate, built from functions of the space of `dq`.
        dq: Direction (test or trial function, or any expression of the same shape).

    Returns:
        The derivative, an expression of the shape that `measure` returns.
    """
    carriers = [
        *ufl.algorithms.extract_coefficients(q),
        *ufl.algorithms.extract_arguments(dq),
        *ufl.algorithms.extract_coefficients(dq),
    ]
    space = next(f.ufl_function_space() for f in carriers if f.ufl_shape == q.ufl_shape)
    z, put = ufl.Coefficient(space), {}
    direction = dq
    if not dq._ufl_is_terminal_:
        # gradients are derived in directions that stand by themselves
        direction = ufl.Coefficient(space)
        put[direction] = dq
    derivative = ufl.derivative(measure(z), z, direction)
    return ufl.replace(apply_derivatives(apply_algebra_lowering(derivative)), {z: q, **put})


def gradient(psi: Callable[[Expr], Expr], e: Expr) -> Expr:
    """Stress `d psi / d e` of a strain energy density at the strain `e`."""
    variable = ufl.variable(e)
    return ufl.diff(psi(variable), variable)


def discrete_gradient(
    psi: Callable[[Expr], Expr], e_a: Expr, e_b: Expr, weight: Expr | None = None
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
    small = ufl.lt(length2, TINY_INCREMENT)
    factor = ufl.conditional(small, 0.0, defect / ufl.conditional(small, 1.0, length2))
    return tau + factor * scaled
