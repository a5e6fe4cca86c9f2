"""Quadratic constraints over a step that is quadratic in time: their rows, whose forces do no work.

Of what has inertia they hold at the end of a step for positions and velocities (Q4, in `path`).

Where a part has none its second unknown `r` stands for the state at the middle, `q_h`: what is the
velocity at the end elsewhere is a name for the bow here, by (Q1),

    q_h = (q_i + q_f)/2 - 3 z/2,    z = [(1 + alpha) r - (1 - alpha) p - 2 alpha D]/12.

`p` is the rate of the path at the end of the step before, times the step. Forces and energy law do
not depend on it; but strains have it in their own path (`y` in `path`), to the order of the scheme.

Constraints hold at the end and at the middle, `g(q_f) = 0` and `g(q_h) = 0`, by forces that do no
work (`H` is the Hessian of `g`):

    P0:  lambda_0 <Dg> + lambda_1 H D/2                                                         (Q6)
    P1:  lambda_0 H D/6 + lambda_1 [Dg((q_i + q_f)/2) + Dg(q_h)]/2

because with `g` quadratic the work of `lambda_1` is `2 lambda_1 [g_i + g_f - 2 g_h]`.
"""

from collections.abc import Callable
from typing import NamedTuple

from ufl.core.expr import Expr

from shellmb.forms.measure import measure
from shellmb.forms.steps.path import Path


class ConstraintRow(NamedTuple):
    """Constraints in a row of a step, all of shape (n,).

    Args:
        own: What the multipliers of the row itself act on.
        other: What those of the other row act on, eqs. (Q4) and (Q6); None without another row.
        value: What the row demands to vanish: their value at the end, and their rate times the step
            there, or their value at the middle.
        multipliers: States that hold the row's own multipliers and those of the other row.
    """

    own: Expr
    other: Expr | None
    value: Expr
    multipliers: tuple[Expr, Expr | None]


def held_row(
    function: Callable[[Expr], Expr], path: Path, k: int, dq: Expr, inertialess: bool = False
) -> ConstraintRow:
    """Quadratic constraints in one of the rows, eq. (Q4) or (Q6), and their forces without work.

    Args:
        function: The constraints as a function of the state.
        path: The step, whose rows say where multipliers act and what vanishes.
        k: Row, 0 for P0 and 1 for P1.
        dq: Direction.
        inertialess: Whether what they hold has no inertia.
    """
    g, row = measure(function), path.rows[k]
    held = row.massless if inertialess else row.holding
    own, other = (path.slope(g, slope, dq) for slope in (held.own, held.other))
    first, second = path.end, path.end_velocity
    return ConstraintRow(own, other, held.vanishes(g, path), ((first, second), (second, first))[k])
