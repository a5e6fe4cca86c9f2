"""Derivatives of forms."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import ufl
from dolfinx import fem
from ufl import Form
from ufl.algorithms.analysis import extract_type, has_type
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives
from ufl.algorithms.map_integrands import map_integrands
from ufl.classes import Variable, VariableDerivative


def derivative(
    form: Form,
    function: fem.Function,
    others: Sequence[fem.Function] = (),
    shares: fem.Constant | None = None,
) -> Form:
    """The derivative of a form by functions that are among its coefficients; it may be empty.

    Args:
        form: A form.
        function: The function, or the first of them.
        others: More functions, all of one space, that change with the same unknown one.
        shares: Shares of that in all of them: a Constant, so that the derivatives by several
            unknown functions are alike. None: there is but one function.
    """
    trial = ufl.TrialFunction(function.function_space)
    if shares is not None:
        functions = (function, *others)
        return by_shares(form, functions, [shares[k] for k in range(len(functions))], trial)
    return through(
        form,
        lambda value: ufl.algorithms.expand_derivatives(ufl.derivative(value, function, trial)),
    )


def by_shares(form: Form, functions: Sequence[Any], shares: Sequence[Any], trial: Any) -> Form:
    """Derivative by what several functions have shares of.

    Args:
        form: The form.
        functions: Functions of one space.
        shares: Theirs.
        trial: Direction.
    """
    return by_directions(form, functions, [share * trial for share in shares])


def by_directions(form: Form, functions: Sequence[Any], directions: Sequence[Any]) -> Form:
    """Derivative by several functions, each in a direction of its own.

    Args:
        form: The form.
        functions: The functions.
        directions: A direction for each, linear in an argument.
    """
    # gradients are derived in directions that stand by themselves
    alone = tuple(ufl.Coefficient(f.ufl_function_space()) for f in functions)
    put = dict(zip(alone, directions, strict=True))

    def take(value: Any) -> Any:
        derivative = ufl.derivative(value, tuple(functions), alone)
        return ufl.replace(apply_derivatives(apply_algebra_lowering(derivative)), put)

    return through(form, take)


def through(form: Form, take: Callable[[Any], Any]) -> Form:
    """Derivative of a form through vectors that are marked as variables, by the chain rule.

    What is made of few numbers is derived by these, and not by all unknowns: kernels of angles have
    half the code. Forms that hold derivatives by variables are derived as they are.

    Args:
        form: The form.
        take: Derivative of a form or an expression in which variables are constant.
    """
    if has_type(form, VariableDerivative) or not has_type(form, Variable):
        return take(form)
    domain = form.ufl_domain()

    @cache
    def whole(value: Any) -> Any:
        marked = [v for v in extract_type(value, Variable) if len(v.ufl_shape) == 1]
        marked.sort(key=lambda v: v.label().count())
        held = {v: ufl.variable(ufl.Constant(domain, v.ufl_shape)) for v in marked}
        rest = ufl.replace(value, held)
        found, there = take(rest), extract_type(rest, Variable)
        for v, constant in held.items():
            if constant in there:
                by = apply_derivatives(apply_algebra_lowering(ufl.diff(rest, constant)))
                found += ufl.dot(by, whole(v.ufl_operands[0]))
        return ufl.replace(found, {c: v.ufl_operands[0] for v, c in held.items()})

    return map_integrands(whole, form)
