"""Kinematics of the geometrically exact shell: basis, strains, director constraint, inertia.

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

Local orthonormal basis of the reference surface and derivatives along it.

===========  ==================================================  =======  ===========
symbol       name                                                unit     equation
===========  ==================================================  =======  ===========
`e1`, `e2`   unit tangent vectors of the reference surface       -        (3)
`D`          reference director (unit normal at the nodes)       -        (3), `e_3`
`v_,a`       derivative of a field along `e_a`                   [v]/m    below (2)
===========  ==================================================  =======  ===========
"""

from collections.abc import Callable
from typing import NamedTuple

import ufl
from ufl.core.expr import Expr

from shellmb.forms.measure import Measure, quadratic, value


class Surface(NamedTuple):
    """Reference surface of a shell.

    Args:
        e1: Unit tangent vector along the material direction, shape (3,).
        e2: Unit tangent vector completing a right-handed triad with the director, shape (3,).
        D: Reference director, shape (3,).
    """

    e1: Expr
    e2: Expr
    D: Expr


def unit(v: Expr) -> Expr:
    """Vector of unit length along `v`."""
    return v / ufl.sqrt(ufl.dot(v, v))


def surface(jacobian: Expr, direction: Expr, D: Expr) -> Surface:
    """Orthonormal triad of eq. (3), with `e1` the material direction projected on the surface.

    Args:
        jacobian: Jacobian of the reference surface, shape (3, 2).
        direction: Material 1-direction, shape (3,); need not be tangent, must not be normal.
        D: Reference director, shape (3,); only its side of the surface is used for the basis.

    Returns:
        The triad `e1, e2` (exactly tangent) and the director.
    """
    normal = unit(ufl.cross(jacobian[:, 0], jacobian[:, 1]))
    # the cell's own normal may point either way; the director says which way is up
    normal = ufl.sign(ufl.dot(normal, D)) * normal
    e1 = unit(direction - ufl.dot(direction, normal) * normal)
    return Surface(e1, ufl.cross(normal, e1), D)


def along(v: Expr, e: Expr) -> Expr:
    """Derivative of the vector field `v` along the unit tangent `e`, shape (3,)."""
    return ufl.dot(ufl.grad(v), e)


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


class Tangents(NamedTuple):
    """Vectors that strains are made of, of the reference, of a state or changes of either.

    Args:
        x1: Derivative of the position along `e1`, `E_1` of eq. (7), shape (3,).
        x2: Derivative of the position along `e2`, `E_2`.
        d: Director, `E_3`, shape (3,).
        d1: Derivative of the director along `e1`, 1/m.
        d2: Derivative of the director along `e2`, 1/m.
    """

    x1: Expr
    x2: Expr
    d: Expr
    d1: Expr
    d2: Expr


def membrane_strain(a: Tangents, b: Tangents) -> Expr:
    """Membrane strain `(E^T E - I)/2` of eq. (9) as a bilinear form, 11, 22 and 2*12, shape (3,).

    With `a = b` half of it, less that of the reference, is the strain; see `forms.measure`.
    """
    return ufl.as_vector(
        [
            ufl.dot(a.x1, b.x1),
            ufl.dot(a.x2, b.x2),
            ufl.dot(a.x1, b.x2) + ufl.dot(a.x2, b.x1),
        ]
    )


def bending_strain(a: Tangents, b: Tangents) -> Expr:
    """Change of curvature `(E^T H + H^T E + kappa)/2` of eq. (9), as `membrane_strain`, 1/m."""
    return ufl.as_vector(
        [
            ufl.dot(a.x1, b.d1) + ufl.dot(a.d1, b.x1),
            ufl.dot(a.x2, b.d2) + ufl.dot(a.d2, b.x2),
            ufl.dot(a.x1, b.d2) + ufl.dot(a.x2, b.d1) + ufl.dot(a.d1, b.x2) + ufl.dot(a.d2, b.x1),
        ]
    )


def shear_strain(a: Tangents, b: Tangents) -> Expr:
    """Transverse shear strain, 13 and 23 of `E^T E` in eq. (9), as `membrane_strain`, (2,)."""
    return ufl.as_vector(
        [
            ufl.dot(a.x1, b.d) + ufl.dot(a.d, b.x1),
            ufl.dot(a.x2, b.d) + ufl.dot(a.d, b.x2),
        ]
    )


def strain_form(a: Tangents, b: Tangents) -> Expr:
    """All strains of eq. (9) as a symmetric bilinear form, (eps, kap, gam), shape (8,)."""
    return ufl.as_vector([*membrane_strain(a, b), *bending_strain(a, b), *shear_strain(a, b)])


def reference_tangents(surf: Surface) -> Tangents:
    """Tangents of the reference configuration."""
    e1, e2 = surf.e1, surf.e2
    return Tangents(e1, e2, surf.D, along(surf.D, e1), along(surf.D, e2))


def tangents(u: Expr, w: Expr, surf: Surface) -> Tangents:
    """Changes of the tangents by a displacement and a change of the director."""
    e1, e2 = surf.e1, surf.e2
    return Tangents(along(u, e1), along(u, e2), w, along(w, e1), along(w, e2))


def strain_measure(surf: Surface, moved: Callable[[Expr], tuple[Expr, Expr]]) -> Measure:
    """Strains of eq. (9), which are quadratic, as eq. (20) needs, shape (8,).

    Args:
        surf: Reference surface.
        moved: Displacement and change of the director in a state.
    """
    rest = reference_tangents(surf)
    return quadratic(strain_form, rest, lambda q: tangents(*moved(q), surf))


def shell_strains(u: Expr, w: Expr, surf: Surface) -> ShellStrains:
    """Strains of eq. (9) of a displacement and a change of the director."""
    rest, change = reference_tangents(surf), tangents(u, w, surf)
    return named(value(strain_form, rest, change))


def named(e: Expr) -> ShellStrains:
    """Strains by their names from a vector of all of them, shape (8,)."""
    eps, kap, gam = (ufl.as_vector([e[k] for k in part]) for part in ((0, 1, 2), (3, 4, 5), (6, 7)))
    return ShellStrains(eps, kap, gam)


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


def momentum_work(v: Expr, dw: Expr, mass: Mass, dv: Expr, ddw: Expr) -> Expr:
    """`h.dv + g.dd`: work of momenta per area, or twice the kinetic energy, eqs. (14), (26), (27).

    Args:
        v: Velocity of the reference surface, shape (3,), m/s; in virtual work its rate.
        dw: Velocity of the director, shape (3,), 1/s.
        mass: Mass coefficients.
        dv: What the linear momentum works on.
        ddw: What that of the director works on.
    """
    h, g = momenta(v, dw, mass)
    return ufl.dot(h, dv) + ufl.dot(g, ddw)
