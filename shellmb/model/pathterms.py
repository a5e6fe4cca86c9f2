"""Terms of a body with a linear section over a step."""

from collections.abc import Callable
from typing import Any

import ufl
from ufl import Form
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives
from ufl.core.expr import Expr

from shellmb.forms.state import Layout
from shellmb.forms.steps.anystrain import AnyStrain
from shellmb.forms.steps.path import Measure, Points, Row, Step
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
    columns = {column for pair in row.pairs for column in pair.changes}
    return Term(
        integrate([sum(densities) for densities in zip(*works, strict=True)]),
        {
            c: tuple(
                integrate(pair_change(*common, row.states, pair, pair.changes[c], dq, trial))
                for pair in row.pairs
            )
            for c in sorted(columns)
        },
    )


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
    derivatives = {
        c: (*(f + g for f, g in zip(forms, b.derivatives[c], strict=False)), *forms[2:])
        for c, forms in a.derivatives.items()
    }
    return Term(a.residual + b.residual, derivatives)
