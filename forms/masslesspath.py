"""Constraints over a step that is quadratic in time where a part has no inertia.

Such a part has no velocity, and nothing of it is carried from step to step but its state. Its
second unknown stands for the state at the middle, `q_h`: what is the velocity at the end elsewhere
is a name for the bow here, by (Q1) with the velocity at the start set to zero,

    q_h = (q_i + q_f)/2 - 3 z/2,    z = [(1 + alpha) r - 2 alpha D]/12.

Constraints hold at the end and at the middle, `g(q_f) = 0` and `g(q_h) = 0`, by forces that do no
work (`H` is the Hessian of `g`, `lambda_1` three times that of eq. Q6):

    P0:  lambda_0 <Dg> + lambda_1 H D/2                                                         (Q6)
    P1:  lambda_0 H D/6 + lambda_1 [Dg((q_i + q_f)/2) + Dg(q_h)]/2

because with `g` quadratic the work of `lambda_1` is `2 lambda_1 [g_i + g_f - 2 g_h]`.
"""

from collections.abc import Callable

from ufl.core.expr import Expr

from .discrete import variation
from .path import ConstraintRow, Path, measure


def massless_row(function: Callable[[Expr], Expr], path: Path, k: int, dq: Expr) -> ConstraintRow:
    """As `path.constraint_row`, eq. (Q6); the row P1 demands the value at the middle.

    Args:
        function: The constraints as a function of the state.
        path: The step, its `push` being zero.
        k: Row, 0 for P0 and 1 for P1.
        dq: Direction.
    """
    quad = measure(function).quad
    if k == 0:
        mean, chord = variation(function, path.mean, dq), quad(path.chord, dq) / 2
        return ConstraintRow(mean, chord, function(path.end), (path.end, path.rate))
    turned, chord = path.middle - 0.75 * path.bow, quad(path.chord, dq) / 6
    value = function(path.middle - 1.5 * path.bow)
    return ConstraintRow(variation(function, turned, dq), chord, value, (path.rate, path.end))
