"""Derivatives of forms: written down for programs, which take them, and taken for DOLFINx."""

from collections.abc import Sequence
from functools import cache
from typing import Any

import ufl
from dolfinx import fem
from ufl import Form
from ufl.algorithms.analysis import has_type
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives
from ufl.algorithms.map_integrands import map_integrands
from ufl.classes import CoefficientDerivative, ExprList, Variable, VariableDerivative


def derivative(
    form: Form,
    function: fem.Function,
    others: Sequence[fem.Function] = (),
    shares: fem.Constant | None = None,
) -> Form:
    """The derivative of a form by functions that are among its coefficients; it may vanish.

    Args:
        form: A form.
        function: The function, or the first of them.
        others: More functions, all of one space, that change with the same unknown one.
        shares: Shares of that in all of them: a Constant, so that the derivatives by several
            unknown functions are alike. None: there is but one function.
    """
    trial = ufl.TrialFunction(function.function_space)
    if shares is None:
        return ufl.derivative(form, function, trial)
    functions = (function, *others)
    return by_directions(form, functions, [shares[k] * trial for k in range(len(functions))])


def by_directions(form: Form, functions: Sequence[Any], directions: Sequence[Any]) -> Form:
    """Derivative by several functions, each in a direction of its own.

    Args:
        form: The form.
        functions: The functions.
        directions: A direction for each, linear in an argument.
    """
    return ufl.derivative(form, tuple(functions), tuple(directions))


def expanded(form: Form) -> Form:
    """A form whose derivatives are taken, for DOLFINx; it may be empty."""
    return map_integrands(taken, form)


def taken(value: Any) -> Any:
    """An expression whose derivatives by functions are taken.

    UFL takes those of gradients in directions that stand by themselves alone.
    """
    if not has_type(value, CoefficientDerivative):
        return value
    marked = has_type(value, VariableDerivative)

    @cache
    def take(value: Any) -> Any:
        if value._ufl_is_terminal_:
            return value
        operands = [take(operand) for operand in value.ufl_operands]
        if isinstance(value, Variable) and not marked:
            return operands[0]
        if not isinstance(value, CoefficientDerivative):
            return value._ufl_expr_reconstruct_(*operands)
        of, functions, directions, more = operands
        alone = [ufl.Coefficient(f.ufl_function_space()) for f in functions.ufl_operands]
        derived = CoefficientDerivative(of, functions, ExprList(*alone), more)
        put = dict(zip(alone, directions.ufl_operands, strict=True))
        return ufl.replace(apply_derivatives(apply_algebra_lowering(derived)), put)

    return take(value)
