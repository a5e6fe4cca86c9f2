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
from shellmb.forms.steps.path import Points, Rows, Step, Stress
from shellmb.forms.steps.stress_work import (
    MixedSection,
    general_stresses,
    general_work,
    stress_work,
)
from shellmb.forms.steps.stress_work_nonlinear import NonlinearPath
from shellmb.model.body import Term


def path_terms(
    section: MixedSection,
    layout: Layout,
    strain: Measure,
    rows: Rows,
    tests: Sequence[Expr],
    trial: Expr,
    integrate: Callable[[list[Expr]], Form],
) -> Term:
    """Internal forces of some rows: all stresses in one form.

    So a residual takes the strains of the states once.

    Args:
        section: Its mixed form.
        layout: Parts of the state.
        strain: Its strains.
        rows: What the rows are made of.
        tests: Virtual displacement of each row.
        trial: Trial function of the space of an unknown state.
        integrate: Integral of densities, one for each quadrature rule.
    """
    common = section, layout, strain, rows.states[: rows.moving]
    residual = _stress_work(*common, rows.stresses, tuple(tests), integrate)
    alone = tuple(
        _stress_work(*common, [s.in_row(k) for s in rows.stresses], (_single(trial),), integrate)
        for k in range(len(rows.numbers))
    )
    return Term(residual, rows.numbers, alone)


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


def point_terms(
    section: NonlinearPath,
    points: Points,
    tests: Sequence[Expr],
    trial: Expr,
    integrate: Callable[[list[Expr]], Form],
) -> Term:
    """Terms of a nonlinear section, at Gauss' points in time; arguments as of `path_terms`."""
    residual, dq = integrate(section.work(tests)), _single(trial)
    alone = [integrate(section.simple_work(k, dq)) for k in (0, 1)]
    if points.dissipates:
        residual += integrate(section.damping([points.damping], tests))
        for k in (0, 1):
            alone[k] += integrate(section.damping([points.damping.in_row(k)], [dq]))
    return Term(residual, (0, 1), tuple(alone))


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
    """Terms of a linear section with strains of any form; derivatives are those without the rest.

    Args:
        section: Its mixed form.
        layout: Parts of the state.
        strain: Its strains.
        product: Product of two states, as of `GeneralStrain.rest`.
        step: The step.
        tests: Virtual displacement of each row.
        trial: Trial function of the space of an unknown state.
        integrate: Integral of densities, one for each quadrature rule.
    """
    held, alpha = (step.path.end, step.path.end_velocity), step.path.alpha
    along = GeneralStrain(strain, step.states, step.whole.places)
    common = section, layout, along, held, alpha
    first = [pair[0] for pair in general_stresses(*common)]
    residual = integrate([along.rest(stress, product, tests[0]) for stress in first])
    for row, dq in zip(step.whole.rows, tests, strict=True):
        residual += integrate(general_work(*common, row, dq))
    rows = step.whole.rows
    alone = tuple(integrate(general_work(*common, row, _single(trial))) for row in rows)
    return Term(residual, step.rows.numbers, alone)


def hyperelastic_terms(
    along: GeneralPath,
    product: Callable[[Expr, Expr], Expr],
    step: Step,
    tests: Sequence[Expr],
    trial: Any,
    integrate: Callable[[list[Expr]], Form],
) -> Term:
    """Forces of a hyperelastic section with strains of any form; as `general_terms`."""
    residual = integrate(along.rest(product, tests[0]))
    for row, dq in zip(step.whole.rows, tests, strict=True):
        residual += integrate(along.work(row, dq))
    alone = tuple(integrate(along.simple_work(row, _single(trial))) for row in step.whole.rows)
    return Term(residual, step.rows.numbers, alone)


def together(a: Term, b: Term) -> Term:
    """The sum of two terms as one."""
    alone = tuple(f + g for f, g in zip(a.alone, b.alone, strict=True))
    return Term(a.residual + b.residual, a.rows, alone)
