"""Virtual work of external loads, and what terms of the user's may depend on.

Each function gives the density of the virtual work at a configuration `u, w` (the mid-point of the
sub-interval), in the direction `du, dw`.
"""

from collections.abc import Sequence
from typing import NamedTuple

import ufl
from ufl.core.expr import Expr

from shellmb.forms.frame import spin
from shellmb.forms.shell import Mass, ShellStrains, Surface, along, momenta


def dead_force(force: Expr, du: Expr) -> Expr:
    """Force of constant direction, in N/m^2 on a surface, N/m on an edge, N at a point."""
    return ufl.dot(force, du)


def gravity(acceleration: Expr, mass: Mass, du: Expr, dw: Expr) -> Expr:
    """Weight, with the first moment `s*` of eq. (16) acting on the director.

    Args:
        acceleration: Acceleration of gravity, shape (3,), m/s^2.
        mass: Mass coefficients of eq. (16).
        du: Variation of the displacement.
        dw: Variation of the director.
    """
    moved, _ = momenta(du, dw, mass)
    return ufl.dot(acceleration, moved)


def follower_force(components: Expr, u: Expr, w: Expr, surf: Surface, du: Expr) -> Expr:
    """Force with constant components in the convected basis `E1, E2, E3` of eq. (7)."""
    E1 = surf.e1 + along(u, surf.e1)
    E2 = surf.e2 + along(u, surf.e2)
    force = components[0] * E1 + components[1] * E2 + components[2] * (surf.D + w)
    return ufl.dot(force, du)


def pressure(p: Expr, u: Expr, surf: Surface, du: Expr) -> Expr:
    """Pressure along the deformed normal `x_,1 x x_,2` on the deformed area; `p` in Pa."""
    x1 = surf.e1 + along(u, surf.e1)
    x2 = surf.e2 + along(u, surf.e2)
    return p * ufl.dot(ufl.cross(x1, x2), du)


def director_moment(moment: Expr, d: Expr, dd: Expr) -> Expr:
    """Moment of constant direction: the rotation of the director about itself does no work.

    `dd = r x d` gives `m . r` for every `r` across `d`, also where `d` is no unit vector (at a
    mid-point, between nodes), so that the angular momentum grows by the moment's impulse exactly.

    Args:
        moment: Moment per length of edge (N) or at a node (N m), shape (3,).
        d: Director at the mid-point.
        dd: Its variation.
    """
    return ufl.dot(ufl.cross(moment, d), dd) / ufl.dot(d, d)


def follower_frame_force(components: Expr, d: Sequence[Expr], du: Expr) -> Expr:
    """Force with constant components along the directors.

    Args:
        components: N/m on a beam, N at a node, shape (3,).
        d: Directors at the mid-point.
        du: Variation of the displacement.
    """
    return ufl.dot(components[0] * d[0] + components[1] * d[1] + components[2] * d[2], du)


def frame_moment(moment: Expr, d: Sequence[Expr], dd: Sequence[Expr]) -> Expr:
    """Moment of constant direction on a frame: the work on the spin of the directors.

    `dd_k = r x d_k` gives `m . r` also where the directors are not orthonormal (at a mid-point, in
    a Newton iteration), so that the angular momentum grows by the moment's impulse exactly.

    Args:
        moment: N m/m on a beam, N m at a node, shape (3,).
        d: Directors at the mid-point.
        dd: Their variations.
    """
    volume = ufl.dot(d[0], ufl.cross(d[1], d[2]))
    components = ufl.as_vector([ufl.dot(moment, dk) / volume for dk in d])
    return follower_frame_moment(components, d, dd)


def follower_frame_moment(components: Expr, d: Sequence[Expr], dd: Sequence[Expr]) -> Expr:
    """Moment with constant components along the directors, as the moments inside a beam are.

    Args:
        components: N m/m on a beam, N m at a node, shape (3,).
        d: Directors at the mid-point.
        dd: Their variations.
    """
    return ufl.dot(components, ufl.as_vector(spin(d, dd)))


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
