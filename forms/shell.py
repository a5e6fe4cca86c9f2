"""Kinematics of the geometrically exact shell: strains, director constraint, inertia.

Unknowns are the displacement `u` (eq. 4) and the change of the director `w`, so that
`x = X + u` and `E3 = d = D + w`. Writing the strains in `u` and `w` instead of `x` and `d`
avoids the cancellation of two almost equal metrics in thin, little deformed shells.

===========  =============================================  ========  ==========
symbol       name                                           unit      equation
===========  =============================================  ========  ==========
`u`          displacement of the reference surface          m         (4)
`w`          change of the unit director, `d = D + w`       -         (7), `E_3`
`eps`        membrane strain (11, 22, 2*12)                 -         (9)
`kap`        change of curvature (11, 22, 2*12)             1/m       (9)
`gam`        transverse shear strain (13, 23)               -         (9)
`m,s,I`      mass, first and second moment per area         kg/m^2..  (16)
===========  =============================================  ========  ==========
"""

from collections.abc import Sequence
from typing import NamedTuple

import ufl
from ufl.core.expr import Expr

from shellmb.forms.surface import Surface, along, unit


class ShellStrains(NamedTuple):
    """Strains of eq. (9) in the local orthonormal basis, engineering (Voigt) components.

    Args:
        eps: Membrane strains (11, 22, 2*12), shape (3,), dimensionless.
        kap: Bending strains (11, 22, 2*12), shape (3,), 1/m.
        gam: Transverse shear strains (2*13, 2*23), shape (2,), dimensionless.
    """

    eps: Expr
    kap: Expr
    gam: Expr


def membrane_strain(u: Expr, surf: Surface) -> Expr:
    """Green-Lagrange strain of the reference surface, `(E^T E - I)/2` of eq. (9), shape (3,)."""
    e1, e2 = surf.e1, surf.e2
    u1, u2 = along(u, e1), along(u, e2)
    return ufl.as_vector(
        [
            ufl.dot(e1, u1) + ufl.dot(u1, u1) / 2,
            ufl.dot(e2, u2) + ufl.dot(u2, u2) / 2,
            ufl.dot(e1, u2) + ufl.dot(e2, u1) + ufl.dot(u1, u2),
        ]
    )


def bending_strain(u: Expr, w: Expr, surf: Surface) -> Expr:
    """Change of curvature, `(E^T H + H^T E + kappa)/2` of eq. (9), shape (3,), 1/m."""
    e1, e2 = surf.e1, surf.e2
    u1, u2 = along(u, e1), along(u, e2)
    w1, w2 = along(w, e1), along(w, e2)
    D1, D2 = along(surf.D, e1), along(surf.D, e2)
    return ufl.as_vector(
        [
            ufl.dot(e1 + u1, w1) + ufl.dot(u1, D1),
            ufl.dot(e2 + u2, w2) + ufl.dot(u2, D2),
            ufl.dot(e1 + u1, w2) + ufl.dot(e2 + u2, w1) + ufl.dot(u1, D2) + ufl.dot(u2, D1),
        ]
    )


def shear_strain(u: Expr, w: Expr, surf: Surface) -> Expr:
    """Transverse shear strain, components 13 and 23 of `E^T E` in eq. (9), shape (2,)."""
    e1, e2 = surf.e1, surf.e2
    u1, u2 = along(u, e1), along(u, e2)
    return ufl.as_vector(
        [
            ufl.dot(e1 + u1, w) + ufl.dot(u1, surf.D),
            ufl.dot(e2 + u2, w) + ufl.dot(u2, surf.D),
        ]
    )


def shell_strains(u: Expr, w: Expr, surf: Surface) -> ShellStrains:
    """All strains of eq. (9). Each is quadratic in `(u, w)`, which is what eq. (20) needs."""
    return ShellStrains(
        membrane_strain(u, surf), bending_strain(u, w, surf), shear_strain(u, w, surf)
    )


class Tangents(NamedTuple):
    """What strains of the next order are taken along: derivatives of position and director.

    Args:
        x1: Derivative of the position along `e1`, shape (3,).
        x2: The same along `e2`.
        d: Director, shape (3,).
        d1: Its derivative along `e1`, 1/m.
        d2: The same along `e2`.
    """

    x1: Expr
    x2: Expr
    d: Expr
    d1: Expr
    d2: Expr


def reference_tangents(surf: Surface) -> Tangents:
    """Those of the reference configuration."""
    e1, e2 = surf.e1, surf.e2
    return Tangents(e1, e2, surf.D, along(surf.D, e1), along(surf.D, e2))


def tangents(u: Expr, w: Expr, surf: Surface) -> Tangents:
    """Those of a displacement and a director change, without the reference."""
    e1, e2 = surf.e1, surf.e2
    return Tangents(along(u, e1), along(u, e2), w, along(w, e1), along(w, e2))


def combined(parts: Sequence[tuple[Expr | float, Tangents]]) -> Tangents:
    """Weighted sum."""
    (weight, first), *others = parts
    total = [weight * part for part in first]
    for weight, tangent in others:
        total = [a + weight * b for a, b in zip(total, tangent, strict=True)]
    return Tangents(*total)


def strain_change(at: Tangents, du: Expr, dw: Expr, surf: Surface) -> ShellStrains:
    """Change of the strains of eq. (9) for a change of displacement and director, eq. (20).

    It is linear in both: at the reference it is their linear part, at a displacement alone their
    bilinear part (`forms.steps.path`).

    Args:
        at: Where.
        du: Change of the displacement.
        dw: Change of the director.
        surf: Reference surface.
    """
    return bilinear(at, tangents(du, dw, surf))


def bilinear(at: Tangents, change: Tangents) -> ShellStrains:
    """The same for a change of the tangents; symmetric in both."""
    u1, u2, w, w1, w2 = change
    x1, x2, d, d1, d2 = at

    def dot(a: Expr, b: Expr) -> Expr:
        return ufl.dot(a, b)

    return ShellStrains(
        ufl.as_vector([dot(x1, u1), dot(x2, u2), dot(x1, u2) + dot(x2, u1)]),
        ufl.as_vector(
            [
                dot(x1, w1) + dot(d1, u1),
                dot(x2, w2) + dot(d2, u2),
                dot(x1, w2) + dot(x2, w1) + dot(d1, u2) + dot(d2, u1),
            ]
        ),
        ufl.as_vector([dot(x1, w) + dot(d, u1), dot(x2, w) + dot(d, u2)]),
    )


def normal(u: Expr, surf: Surface) -> Expr:
    """Unit normal of the deformed surface, shape (3,), on the side of the reference director."""
    e1, e2 = surf.e1, surf.e2
    return unit(ufl.cross(e1 + along(u, e1), e2 + along(u, e2)))


def director_constraint(w: Expr, D: Expr) -> Expr:
    """Half of `|d|^2 - 1` with `d = D + w` and `|D| = 1`, dimensionless scalar."""
    return ufl.dot(D, w) + ufl.dot(w, w) / 2


class Mass(NamedTuple):
    """Mass coefficients per area of eq. (16); None where the effect is left out.

    Args:
        m: Mass, kg/m^2.
        s: First moment about the reference surface, kg/m.
        I: Second moment, rotary inertia of the director, kg.
        centred: Mass less what goes with the moments, `m - s^2/I`, where there is a first one.
    """

    m: Expr
    s: Expr | None
    I: Expr | None  # noqa: E741 (the paper's symbol)
    centred: Expr | None = None


def momenta(v: Expr, dw: Expr, mass: Mass) -> tuple[Expr, Expr]:
    """Linear and director momentum per area, `h` and `g` below eq. (16), shapes (3,).

    Args:
        v: Velocity of the reference surface, shape (3,), m/s.
        dw: Velocity of the director, shape (3,), 1/s.
        mass: Mass coefficients.
    """
    h, g = mass.m * v, 0 * dw
    if mass.s is not None:
        h, g = h + mass.s * dw, g + mass.s * v
    if mass.I is not None:
        g = g + mass.I * dw
    return h, g


def without_director(mass: Mass) -> Mass:
    """The mass alone, which moves the reference surface."""
    return Mass(mass.m, None, None)


def director_inertia(mass: Mass) -> Mass:
    """First and second moment alone, which are integrated at the nodes (see `tangent_jump`)."""
    return Mass(0 * mass.m, mass.s, mass.I)


def tangent_jump(b: Expr, db: Expr, d: Expr, arm: Expr | None) -> Expr:
    """Jump of the director's velocity without momentum along the director, shape (3,).

    With `|d| = 1` at both ends of a sub-interval, eq. (31) would tie the velocity *along* the
    director to a
    chord that has no component there, while in truth it changes by `-dt |d'|^2`. That spoils the
    energy decaying scheme (to first order for alpha = 1; for alpha = 0 it does not even converge).
    Only the jump across the director obeys eq. (31); along it the momentum `s* b + I* db` does not
    jump. Then the energy law (33) is as exact as before, provided the two moments of inertia are
    integrated at the nodes, where the constraint holds.

    Args:
        b: Jump of the velocity of the surface, shape (3,), m/s.
        db: Jump of the director's velocity by eq. (31), shape (3,), 1/s.
        d: Mean director of the sub-interval, shape (3,), not necessarily of unit length.
        arm: First over second moment of the mass, `s*/I*`, 1/m; None without a first moment.
    """
    momentum = db if arm is None else db + arm * b
    return db - ufl.dot(momentum, d) / ufl.dot(d, d) * d


def kinetic_density(v: Expr, dw: Expr, mass: Mass) -> Expr:
    """Kinetic energy per reference area, eq. (14) integrated through the thickness, J/m^2."""
    h, g = momenta(v, dw, mass)
    return (ufl.dot(h, v) + ufl.dot(g, dw)) / 2
