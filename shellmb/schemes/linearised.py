"""Small displacements: forms linearised about the reference configuration.

A scheme that is linear takes its forms at functions that stay zero, the reference, and their
derivatives there in the direction of the states: internal forces and constraints become linear,
energies quadratic. Loads act on the reference configuration; what is at rest there has no initial
stress.
"""

from collections.abc import Sequence
from typing import Any

import ufl
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.model.body import Body
from shellmb.model.body import strain_energy as stored
from shellmb.schemes.base import Levels


def at_reference(levels: Levels) -> Levels:
    """Functions that stay zero, one for each of a body's.

    Args:
        levels: The body's functions.
    """

    def zero(function: fem.Function) -> fem.Function:
        return fem.Function(function.function_space, name=f"{function.name}_reference")

    return Levels(
        zero(levels.q),
        {name: zero(rate) for name, rate in levels.rates.items()},
        {name: zero(unknown) for name, unknown in levels.unknown.items()},
    )


def change[F: (Form, Expr)](form: F, levels: Levels) -> F | None:
    """Linear part of what is taken at the reference; None if it depends on no state.

    Args:
        form: A form or an expression, of the functions `levels.reference`.
        levels: The body's functions.
    """
    at = levels.reference
    assert at is not None
    pairs = [(at.q, levels.q)]
    pairs += [(at.rates[name], rate) for name, rate in levels.rates.items()]
    pairs += [(at.unknown[name], unknown) for name, unknown in levels.unknown.items()]
    extract: Any = ufl.algorithms.extract_coefficients
    used = form.coefficients() if isinstance(form, Form) else extract(form)
    found = [pair for pair in pairs if pair[0] in used]
    return _change(form, found) if found else None


def _change(form: Any, pairs: Sequence[tuple[fem.Function, fem.Function]]) -> Any:
    """Derivatives of a form by functions in the directions of others, added up."""
    parts = [ufl.derivative(form, zero, state) for zero, state in pairs]
    return sum(parts[1:], parts[0])


def strain_energy(body: Body, levels: Levels) -> Form | None:
    """Strain energy of a body at its state: where forms are linearised, the quadratic part of it.

    Args:
        body: The body.
        levels: Its functions.
    """
    at = levels.reference
    if at is None:
        return stored(body, levels.q)
    energy = stored(body, at.q)
    if energy is None:
        return None
    return _quadratic(energy, at.q, levels.q)


def _quadratic(energy: Form, zero: fem.Function, state: fem.Function) -> Form:
    work = ufl.derivative(energy, zero, state)
    return 0.5 * ufl.derivative(work, zero, state)
