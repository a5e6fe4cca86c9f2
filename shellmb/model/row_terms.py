"""Terms of a body with a linear section over a step."""

from collections.abc import Callable, Sequence
from typing import Any

import ufl
from ufl import Form
from ufl.core.expr import Expr

from shellmb.forms.measure import Measure
from shellmb.forms.state import Layout
from shellmb.forms.steps.general_hyperelastic import GeneralPath
from shellmb.forms.steps.general_strains import GeneralStrain
from shellmb.forms.steps.path import Change, Pair, Points, Rows, Step, Stress
from shellmb.forms.steps.stress_work import (
    MixedSection,
    general_stresses,
    general_work,
    pair_change,
    stress_work,
)
from shellmb.forms.steps.stress_work_nonlinear import NonlinearPath
from shellmb.model.body import Term
from shellmb.native.derivatives import by_shares


def path_terms(
    section: MixedSection,
    layout: Layout,
    strain: Measure,
    rows: Rows,
    tests: Sequence[Expr],
    trial: Expr,
    integrate: Callable[[list[Expr]], Form],
) -> Term:
    """Internal forces of some rows: all stresses in one form, their derivatives one by one.

    So a residual takes the strains of the states once.

    Args:
        section: Its mixed form.
        layout: Parts of the state.
        strain: Its strains.
        rows: What the rows are made of.
        tests: Virtual displacement of each row.
        trial: Direction of derivatives.
        integrate: Integral of densities, one for each quadrature rule.
    """
    common, states, dq = (section, layout, strain), rows.states, _single(trial)
    moving, stresses = states[: rows.moving], rows.stresses
    residual = _stress_work(*common, moving, stresses, tuple(tests), integrate)

    def write(pair: Pair, change: Change) -> Form:
        return integrate(pair_change(*common, states, pair, change, dq, trial))

    return Term(residual, rows.numbers, _changes(rows, write))


def _stress_work(
    section: MixedSection,
    layout: Layout,
    strain: Measure,
    states: Sequence[Expr],
    stresses: Sequence[Stress],
    tests: Sequence[Expr],
    integrate: Callable[[list[Expr]], Form],
) -> Form:
    """Work of some stresses, with what remains of their compatibility."""
    works = [stress_work(section, layout, strain, states, s, tests) for s in stresses]
    return integrate([sum(densities) for densities in zip(*works, strict=True)])


def _single(trial: Any) -> Expr:
    """Virtual displacement of a single row."""
    return ufl.TestFunction(trial.ufl_function_space())


def _changes(
    rows: Rows, write: Callable[[Pair, Change], Form]
) -> dict[tuple[int, int], tuple[Form, ...]]:
    """Derivatives of stresses by the numbers of their row and of the unknown state."""
    return {
        (number, c): tuple(write(pair, pair.changes[c]) for pair in pairs)
        for number, pairs in zip(rows.numbers, rows.pairs, strict=True)
        for c in sorted({column for pair in pairs for column in pair.changes})
    }


def point_terms(
    section: NonlinearPath,
    points: Points,
    tests: Sequence[Expr],
    trial: Expr,
    integrate: Callable[[list[Expr]], Form],
) -> Term:
    """Terms of a nonlinear section, at Gauss' points in time; arguments as of `path_terms`."""
    residual, dq = integrate(section.work(tests)), _single(trial)
    if points.dissipates:
        residual += integrate(section.damping(tests))

    def change(pair: Pair, change: Change) -> Form:
        return integrate(section.change(pair, change, dq, trial))

    def damping(pair: Pair, change: Change) -> Form:
        return integrate(section.damping_change(pair, change, dq, trial))

    derivatives = _changes(points.rows, change)
    if points.dissipates:
        for place, found in _changes(points.damping, damping).items():
            derivatives[place] += found
    return Term(residual, points.rows.numbers, derivatives)


def general_terms(
    section: MixedSection,
    layout: Layout,
    strain: Measure,
    product: Callable[[Expr, Expr], Expr],
    step: Step,
    tests: Sequence[Expr],
    trial: Any,
    integrate: Callable[[list[Expr]], Form],
) -> Term:
    """Terms of a linear section with strains of any form: one kernel for all derivatives.

    Args:
        section: Its mixed form.
        layout: Parts of the state.
        strain: Its strains.
        product: Product of two states, as of `GeneralStrain.rest`.
        step: The step.
        tests: Virtual displacement of each row.
        trial: Direction of derivatives.
        integrate: Integral of densities, one for each quadrature rule.
    """
    held, alpha = (step.path.end, step.path.end_velocity), step.path.alpha
    along = GeneralStrain(strain, step.states, step.whole.places)
    common = section, layout, along, held, alpha
    first = [pair[0] for pair in general_stresses(*common)]
    residual = integrate([along.rest(stress, product, tests[0]) for stress in first])
    derivatives: dict[tuple[int, int], tuple[Form, ...]] = {}
    for k, (row, dq) in enumerate(zip(step.whole.rows, tests, strict=True)):
        residual += integrate(general_work(*common, row, dq))
        work = integrate(general_work(*common, row, _single(trial)))
        for column, shares in enumerate(step.whole.shares):
            derivatives[k, column] = (by_shares(work, (*step.states, *held), shares, trial),)
    return Term(residual, step.rows.numbers, derivatives)


def hyperelastic_terms(
    along: GeneralPath,
    product: Callable[[Expr, Expr], Expr],
    step: Step,
    tests: Sequence[Expr],
    trial: Any,
    integrate: Callable[[list[Expr]], Form],
) -> Term:
    """Forces of a hyperelastic section with strains of any form; as `general_terms`."""
    held = step.path.end, step.path.end_velocity
    residual = integrate(along.rest(product, tests[0]))
    derivatives: dict[tuple[int, int], tuple[Form, ...]] = {}
    for k, (row, dq) in enumerate(zip(step.whole.rows, tests, strict=True)):
        residual += integrate(along.work(row, dq))
        work = integrate(along.simple_work(row, _single(trial)))
        for column, shares in enumerate(step.whole.shares):
            derivatives[k, column] = (by_shares(work, (*step.states, *held), shares, trial),)
    return Term(residual, step.rows.numbers, derivatives)


def together(a: Term, b: Term) -> Term:
    """The sum of two terms as one."""
    derivatives = {
        c: (*(f + g for f, g in zip(forms, b.derivatives[c], strict=False)), *forms[2:])
        for c, forms in a.derivatives.items()
    }
    return Term(a.residual + b.residual, a.rows, derivatives)
