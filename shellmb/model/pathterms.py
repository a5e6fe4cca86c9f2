"""Terms of a body with a linear section over a step."""

from collections.abc import Callable

from ufl import Form
from ufl.core.expr import Expr

from shellmb.forms.state import Layout
from shellmb.forms.steps.path import Measure, Points, Row
from shellmb.forms.steps.pathwork import MixedSection, pair_change, pair_work
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


def together(a: Term, b: Term) -> Term:
    """The sum of two terms as one."""
    derivatives = {
        c: (*(f + g for f, g in zip(forms, b.derivatives[c], strict=False)), *forms[2:])
        for c, forms in a.derivatives.items()
    }
    return Term(a.residual + b.residual, derivatives)
