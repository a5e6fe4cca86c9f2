"""Small displacements: forms linearised about the reference configuration.

A scheme that is linear takes its forms at functions that stay zero, the reference, and their
derivatives there in the direction of the states: internal forces and constraints become linear,
energies quadratic. Loads act on the reference configuration; what is at rest there has no initial
stress.
"""

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
    used = ufl.algorithms.extract_coefficients(form)
    parts = [ufl.derivative(form, zero, state) for zero, state in pairs if zero in used]
    return sum(parts[1:], parts[0]) if parts else None


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
    work = ufl.derivative(energy, at.q, levels.q)
    return 0.5 * ufl.derivative(work, at.q, levels.q)
