"""Terms of a body with a linear section over a step."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import ufl
from ufl import Form
from ufl.algorithms.analysis import extract_coefficients, extract_constants
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives
from ufl.core.expr import Expr

import shellmb.forms
from shellmb.derivatives import Written, written_as
from shellmb.forms.state import Layout
from shellmb.forms.steps.anystrain import AnyStrain
from shellmb.forms.steps.path import Change, Measure, Pair, Points, Row, Step
from shellmb.forms.steps.pathwork import (
    MixedSection,
    any_stresses,
    any_work,
    pair_change,
    pair_work,
)
from shellmb.forms.steps.pathwork_nonlinear import NonlinearPath
from shellmb.model.body import Term

FORMS = Path(shellmb.forms.__path__[0])


def path_terms(
    section: MixedSection,
    layout: Layout,
    strain: Measure,
    row: Row,
    dq: Expr,
    trial: Expr,
    integrate: Callable[[list[Expr]], Form],
) -> Term:
    """Internal forces of a row: its stresses in one form, and their derivatives one by one.

    So a residual takes the strains of the states once, and blocks of all Jacobians share one
    kernel, whatever the scheme; residuals have one with a bow and one without.

    Args:
        section: Its mixed form.
        layout: Parts of the state.
        strain: Its strains.
        row: What the row is made of.
        dq: Virtual displacement.
        trial: Direction of derivatives.
        integrate: Integral of densities, one for each quadrature rule.
    """
    common = (section, layout, strain)
    works = [pair_work(*common, row.states[: row.moving], pair, dq) for pair in row.pairs]
    residual = integrate([sum(densities) for densities in zip(*works, strict=True)])

    def change(pair: Pair, c: int) -> Written:
        change = pair.changes[c]
        return _written(
            "change",
            *(residual, row.states, pair, change),
            lambda: integrate(pair_change(*common, row.states, pair, change, dq, trial)),
        )

    columns = sorted({column for pair in row.pairs for column in pair.changes})
    return Term(residual, {c: tuple(change(pair, c) for pair in row.pairs) for c in columns})


def _written(
    label: str,
    residual: Form,
    states: Sequence[Expr],
    pair: Pair,
    change: Change,
    write: Callable[[], Form],
) -> Written:
    """A derivative by what differs from that of another pair, or by another state."""
    moment, slope, held = pair.moment, pair.slope, pair.moment.held
    parts = [
        *(*moment.linear, *moment.products, slope.c, *slope.weights, pair.own, pair.ahead),
        *(change.moment.c, *change.moment.weights),
        *(change.held, change.share, change.turn, change.gain),
    ]
    # they are components of vectors, some of one
    numbers = {id(part.ufl_operands[0]): part.ufl_operands[0] for part in parts}
    numbers |= {id(constant): constant for constant in extract_constants(held)}
    roles = (*states, *extract_coefficients(held))
    label += f"-{written_as(FORMS)}"
    return Written(residual, roles, tuple(numbers.values()), label, write)


def point_terms(
    section: NonlinearPath,
    states: Sequence[Expr],
    points: Points,
    k: int,
    dq: Expr,
    trial: Expr,
    integrate: Callable[[list[Expr]], Form],
) -> Term:
    """The same of a nonlinear section, at Gauss' points in time; arguments as of `path_terms`."""
    residual = integrate(section.work(k, dq))
    if points.dissipates:
        residual += integrate(section.damping(k, dq))

    def change(pair: Pair, c: int) -> Written:
        change = pair.changes[c]
        return _written(
            "change",
            *(residual, states, pair, change),
            lambda: integrate(section.change(pair, change, dq, trial)),
        )

    def damping(c: int) -> Written:
        pair = points.damping[k]
        return _written(
            "damping",
            *(residual, states, pair, pair.changes[c]),
            lambda: integrate(section.damping_change(k, c, dq, trial)),
        )

    columns = range(len(points.pairs[k][0].changes))
    derivatives = {c: [change(pair, c) for pair in points.pairs[k]] for c in columns}
    if points.dissipates:
        for c in columns:
            derivatives[c].append(damping(c))
    return Term(residual, {c: tuple(found) for c, found in derivatives.items()})


def any_terms(
    section: MixedSection,
    layout: Layout,
    strain: Callable[[Expr], Expr],
    product: Callable[[Expr, Expr], Expr],
    step: Step,
    k: int,
    dq: Expr,
    trial: Any,
    integrate: Callable[[list[Expr]], Form],
) -> Term:
    """The same of a linear section with strains of any form: one kernel for all derivatives.

    Args:
        section: Its mixed form.
        layout: Parts of the state.
        strain: Its strains as a function of the state.
        product: Product of two states, as of `AnyStrain.rest`.
        step: The step.
        k: Row.
        dq: Virtual displacement.
        trial: Direction of derivatives.
        integrate: Integral of densities, one for each quadrature rule.
    """
    row, held, alpha = step.whole.rows[k], (step.path.end, step.path.rate), step.path.alpha
    along = AnyStrain(strain, step.states, step.whole.places)
    work = integrate(any_work(section, layout, along, held, alpha, row, dq))
    first = [pair[0] for pair in any_stresses(section, layout, along, held, alpha)]
    rest = integrate([row.rest * along.rest(stress, product, dq) for stress in first])
    # gradients are derived in directions that stand by themselves
    unknown, space = (*step.states, *held), trial.ufl_function_space()
    directions = tuple(ufl.Coefficient(space) for _ in unknown)
    derivative = ufl.derivative(work, unknown, directions)
    derivative = apply_derivatives(apply_algebra_lowering(derivative))
    derivatives = {}
    for column, shares in enumerate(step.whole.shares):
        put = {d: share * trial for d, share in zip(directions, shares, strict=True)}
        derivatives[column] = (ufl.replace(derivative, put),)
    return Term(work + rest, derivatives)


def together(a: Term, b: Term) -> Term:
    """The sum of two terms as one."""
    residual = a.residual + b.residual

    def added(f: Form | Written, g: Form | Written) -> Form | Written:
        if isinstance(f, Written) and isinstance(g, Written):
            return f.plus(g, residual)
        return _form(f) + _form(g)

    derivatives = {
        c: (*(added(f, g) for f, g in zip(forms, b.derivatives[c], strict=False)), *forms[2:])
        for c, forms in a.derivatives.items()
    }
    return Term(residual, derivatives)


def _form(derivative: Form | Written) -> Form:
    return derivative.form() if isinstance(derivative, Written) else derivative
