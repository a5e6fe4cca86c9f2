"""What a term added to the weak form by a user may depend on."""

from typing import NamedTuple

from ufl.core.expr import Expr

from shellmb.forms.shell import Mass
from shellmb.forms.surface import Surface


class Point(NamedTuple):
    """Fields at a point of a shell over one sub-interval of a step.

    A term is a function of this that returns the virtual work, per reference area, of forces that
    act on the shell; it enters the work account.

    Args:
        u: Displacement at the mid-point, shape (3,), m.
        w: Director change at the mid-point, shape (3,).
        v: Velocity over the sub-interval, shape (3,), m/s; None in statics.
        dw_dt: Velocity of the director, shape (3,), 1/s; None in statics.
        du: Variation of the displacement.
        dw: Variation of the director.
        surf: Reference surface.
        mass: Mass coefficients; None in statics.
        time: Time at the middle of the step, s.
    """

    u: Expr
    w: Expr
    v: Expr | None
    dw_dt: Expr | None
    du: Expr
    dw: Expr
    surf: Surface
    mass: Mass | None
    time: Expr
