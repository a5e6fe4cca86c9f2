"""Terms of a body with a linear section over a step."""

from collections.abc import Callable

from ufl import Form
from ufl.core.expr import Expr

from shellmb.forms.path import Measure, Row
from shellmb.forms.pathwork import MixedSection, pair_change, pair_work
from shellmb.forms.state import Layout
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


def together(a: Term, b: Term) -> Term:
    """The sum of two terms as one."""
    derivatives = {
        c: tuple(f + g for f, g in zip(forms, b.derivatives[c], strict=True))
        for c, forms in a.derivatives.items()
    }
    return Term(a.residual + b.residual, derivatives)
