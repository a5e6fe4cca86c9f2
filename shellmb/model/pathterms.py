"""Terms of a body with a linear section over a step."""

from collections.abc import Callable
from typing import Any

import ufl
from ufl import Form
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives
from ufl.core.expr import Expr

from shellmb.derivatives import Written
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
        def write() -> Form:
            return integrate(pair_change(*common, row.states, pair, pair.changes[c], dq, trial))

        roles, numbers = (*row.states, pair.moment.held), _numbers(pair, pair.changes[c])
        return Written(residual, roles, numbers, "change", write)

    columns = sorted({column for pair in row.pairs for column in pair.changes})
    return Term(residual, {c: tuple(change(pair, c) for pair in row.pairs) for c in columns})


def _numbers(pair: Pair, change: Change) -> list[Expr]:
    """The Constants of a pair and of one of its derivatives, in the order of their fields."""
    moment, slope = pair.moment, pair.slope
    parts = [
        *(*moment.linear, *moment.products, slope.c, *slope.weights, pair.own, pair.ahead),
        *(change.moment.c, *change.moment.weights),
        *(change.held, change.share, change.turn, change.gain),
    ]
    # they are components of vectors
    found = {id(part.ufl_operands[0]): part.ufl_operands[0] for part in parts}
    return list(found.values())


def point_terms(
    section: NonlinearPath,
    points: Points,
    k: int,
    dq: Expr,
    trial: Expr,
    integrate: Callable[[list[Expr]], Form],
) -> Term:
    """The same of a nonlinear section, at Gauss' points in time; arguments as of `path_terms`."""
    residual = integrate(section.work(k, dq))
    derivatives = {}
    for c in range(len(points.pairs[k][0].changes)):
        forms = [section.change(p, p.changes[c], dq, trial) for p in points.pairs[k]]
        if points.dissipates:
            forms.append(section.damping_change(k, c, dq, trial))
        derivatives[c] = tuple(integrate(form) for form in forms)
    if points.dissipates:
        residual += integrate(section.damping(k, dq))
    return Term(residual, derivatives)


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
