"""Terms of a body with a linear section over a step that is quadratic in time."""

from collections.abc import Callable

from ufl import Form
from ufl.core.expr import Expr

from shellmb.forms.path import Measure, Step
from shellmb.forms.pathwork import MixedSection, pair_change, pair_work
from shellmb.forms.state import Layout
from shellmb.model.body import Term


def path_terms(
    section: MixedSection,
    layout: Layout,
    strain: Measure,
    step: Step,
    k: int,
    dq: Expr,
    trial: Expr,
    integrate: Callable[[list[Expr]], Form],
) -> list[Term]:
    """Internal forces of row `k`: one term for each of the two stresses.

    Args:
        section: Its mixed form.
        layout: Parts of the state.
        strain: Its strains.
        step: The step.
        k: Row.
        dq: Virtual displacement.
        trial: Direction of derivatives.
        integrate: Integral of densities, one for each quadrature rule.
    """
    common = section, layout, strain, step.states
    return [
        Term(
            integrate(pair_work(*common, pair, dq)),
            {
                c: integrate(pair_change(*common, pair, change, dq, trial))
                for c, change in enumerate(pair.changes)
            },
        )
        for pair in step.pairs[k]
    ]


def together(a: Term, b: Term) -> Term:
    """The sum of two terms as one."""
    derivatives = {c: form + b.derivatives[c] for c, form in a.derivatives.items()}
    return Term(a.residual + b.residual, derivatives)
