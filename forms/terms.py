"""Quantities on which a user's term in the weak form may depend."""

from typing import NamedTuple

from ufl.core.expr import Expr

from shellmb.forms.shell import Mass, ShellStrains
from shellmb.forms.surface import Surface


class Point(NamedTuple):
    """Fields at a point of a shell over one sub-interval of a step.

    A term is a function of this that returns the virtual work, per reference area, of forces that
    act on the shell; it enters the energy balance.

    Args:
        u: Displacement at the mid-point, shape (3,), m.
        w: Director change at the mid-point, shape (3,).
        v: Velocity over the sub-interval, shape (3,), m/s; None in statics.
        dw_dt: Velocity of the director, shape (3,), 1/s; None in statics.
        du: Variation of the displacement.
        dw: Variation of the director.
        surf: Reference surface.
        mass: Mass coefficients; None in statics.
        time: Time, s; what depends on it is averaged over a step.
        x: Current position, shape (3,), m.
        d: Current director, shape (3,); of unit length at the nodes.
        normal: Unit normal of the deformed surface, shape (3,), on the director's side.
        strain_rate: Rates of the strains over the sub-interval, 1/s and 1/(m s); None in statics.
            Times the step they are the change of the strains, where these are quadratic.
        dstrain: Variation of the strains: what stresses act on.
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
    x: Expr
    d: Expr
    normal: Expr
    strain_rate: ShellStrains | None
    dstrain: ShellStrains
