"""Contact of points with rigid obstacles, by a penalty on the penetration.

Obstacles are given by measures of the position that are at most quadratic, and the distance that
follows from them: of a plane the distance itself, of a ball or rod the square of that from its
centre or axis. So forces over a step are those of a potential of quadratic measures
(`forms.steps.potentials`): they point along the normal of a plane, and are central about a centre
or axis in the sense of the scheme, which keeps the momenta that the obstacle leaves free.

An obstacle that moves with a rigid body has the body's place `p` and directors `e_k`, which are
unknowns. Its measures are products of these and of `r = x - p` that a common rigid motion of both
bodies leaves as they are: forces are equal and opposite and have no moment, over a step, too. Of a
rod `|r|^2` and `r.e_3` are taken: that it turns about itself must not matter.

===========  =====================================================================  ==========
symbol       name                                                                   unit
===========  =====================================================================  ==========
`g`          distance of the surface that touches from the obstacle                 m
`p = -g`     penetration                                                            m
`k`          stiffness                                                              N/m, ...
`s`          smoothing: length over which the stiffness sets in                     m
`chi`        damping: normal force `F(p) (1 + chi dp/dt)`, but never less than 0    s/m
`mu, v_s`    friction: `mu N v/sqrt(v^2 + v_s^2)` against the slip `v`              -, m/s
===========  =====================================================================  ==========

The damping is K. H. Hunt and F. R. E. Crossley's (J. Appl. Mech. 42 (1975) 440-445).

Of shells that deform the facet counts that is nearest to a point: a triangle with corners `v_k`,
here relative to the point. The nearest place, on it, on one of its sides or at a corner, has
weights `w = w_0 + turns^T t` with the `t` that make `|sum w_k v_k|` least. Surfaces touch at one
point, the distance `arm` from the body's point towards the facet. On the body it moves with the
point and the directors, on the shell with the corners and the normal of the facet. So a common
rigid motion has no slip, and friction no moment; over a step of EP, too, whose momenta are about
its middle.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import ufl
from ufl.core.expr import Expr

from shellmb.forms.frame import spin
from shellmb.forms.steps.discrete import gradient

# corners of a facet
CORNERS = 3


class Law(NamedTuple):
    """Parameters of a contact.

    Args:
        stiffness: `k`.
        smoothing: `s`; may be zero.
        damping: `chi`; None: none.
        friction: `mu`; None: none.
        slip_speed: `v_s`; None without friction.
    """

    stiffness: Expr
    smoothing: Expr
    damping: Expr | None = None
    friction: Expr | None = None
    slip_speed: Expr | None = None


def energy(p: Expr, k: Expr, s: Expr) -> Expr:
    """Energy of a penetration: `k p^3/(6 s)` up to `p = s`, then `k [(p - s/2)^2 + s^2/12]/2`.

    Its force is once continuously differentiable; without smoothing it is `k p`, which is not.
    """
    # the quotient is not taken where s is zero
    rising = k * p**3 / (6 * ufl.conditional(ufl.gt(s, 0), s, 1))
    whole = k * ((p - s / 2) ** 2 + s**2 / 12) / 2
    return ufl.conditional(ufl.gt(p, 0), ufl.conditional(ufl.lt(p, s), rising, whole), 0)


def force(p: Expr, k: Expr, s: Expr) -> Expr:
    """Force of the contact, the slope of the energy."""
    return gradient(lambda depth: energy(depth, k, s), p)


def resisted(normal: Expr, rate: Expr, chi: Expr) -> Expr:
    """Force of the damping: it never attracts, and takes energy at any rate.

    Args:
        normal: The elastic force, N.
        rate: Rate of the penetration, m/s.
        chi: Damping.
    """
    share = chi * rate
    return normal * ufl.conditional(ufl.gt(share, -1), share, -1)


def friction(normal: Expr, slip: Expr, law: Law) -> Expr:
    """Coulomb's friction against a slip, regularised, shape (3,).

    Args:
        normal: Normal force, N.
        slip: Velocity along the obstacle, shape (3,), m/s.
        law: Coefficient and speed below which it is viscous.
    """
    assert law.friction is not None and law.slip_speed is not None
    return -law.friction * normal / ufl.sqrt(ufl.dot(slip, slip) + law.slip_speed**2) * slip


def surface(normal: Expr, arm: Expr, directors: Sequence[Expr]) -> Expr:
    """Place of the surface that touches, from the point, shape (3,), m.

    Of a shell it is on the director: moments about that have nothing to act on, and an arm across
    it would leave some of the angular momentum out.

    Args:
        normal: Normal from the obstacle to the body.
        arm: Distance of the surface from the point towards the obstacle, m.
        directors: Directors at the point; none where the surface is the point itself.
    """
    if not directors:
        return 0 * normal
    return -arm * (lever(normal, directors[0]) * directors[0] if len(directors) == 1 else normal)


def lever(normal: Expr, director: Expr) -> Expr:
    """Part of a normal along a director, in directors."""
    return ufl.dot(normal, director) / ufl.dot(director, director)


def surface_motion(
    motion: Expr, normal: Expr, arm: Expr, directors: Sequence[Expr], changes: Sequence[Expr]
) -> Expr:
    """Motion of the surface that touches, shape (3,).

    Args:
        motion: Motion of the point, shape (3,).
        normal: Normal from the obstacle to the body.
        arm: Distance of the surface from the point, m.
        directors: Directors at the point; none where the surface is the point itself.
        changes: Their motions.
    """
    if not directors:
        return motion
    if len(directors) == 1:
        return motion - arm * lever(normal, directors[0]) * changes[0]
    return motion - arm * ufl.cross(turn(directors, changes), normal)


def components(r: Expr, directors: Sequence[Expr]) -> list[Expr]:
    """Components of a vector along directors, which in the middle of a step are not orthonormal.

    Args:
        r: The vector, shape (3,), m.
        directors: The directors.
    """
    a, b, c = directors
    volume = ufl.dot(a, ufl.cross(b, c))
    return [ufl.dot(r, ufl.cross(*pair)) / volume for pair in ((b, c), (c, a), (a, b))]


def carried(y: Sequence[Expr], moved: Expr, changes: Sequence[Expr]) -> Expr:
    """Motion of a place that moves with a rigid body, shape (3,).

    Args:
        y: The place, from a point of the body: components along its directors, m.
        moved: Motion of the point.
        changes: Motions of the directors.
    """
    return sum((part * change for part, change in zip(y, changes, strict=True)), start=moved)


def box_distance(y: Sequence[Any], core: Sequence[Expr]) -> Expr:
    """Distance from a box, less than zero within it, m.

    Args:
        y: Components of the place from its centre along its edges, m.
        core: Half of its extents, m.
    """
    beyond = [abs(a) - c for a, c in zip(y, core, strict=True)]
    square = sum((ufl.conditional(ufl.gt(b, 0), b, 0) ** 2 for b in beyond), start=0 * y[0])
    outside = ufl.gt(square, 0)
    # a root of zero has no derivative
    far = ufl.sqrt(ufl.conditional(outside, square, 1))
    return ufl.conditional(outside, far, greatest(greatest(beyond[0], beyond[1]), beyond[2]))


def greatest(a: Expr, b: Expr) -> Expr:
    """The greater of two numbers."""
    return ufl.conditional(ufl.gt(a, b), a, b)


def turn(directors: Sequence[Expr], changes: Sequence[Expr]) -> Expr:
    """Rotation vector of a motion of the three directors of a frame, shape (3,).

    Args:
        directors: The three, shape (3,) each.
        changes: Their motions.
    """
    volume = ufl.dot(directors[0], ufl.cross(directors[1], directors[2]))
    pairs = zip(spin(directors, changes), directors, strict=True)
    return sum((s / volume * d for s, d in pairs), 0 * changes[0])


class Nearest(NamedTuple):
    """Data of the place that is nearest.

    Args:
        start: Weights of some place that may slide to it, three.
        turns: How they may change, twice three; zero where it may not slide.
        still: One for each of these that is zero, else zero.
    """

    start: Sequence[Expr]
    turns: Sequence[Sequence[Expr]]
    still: Sequence[Expr]


def combined(weights: Sequence[Expr], vectors: Sequence[Expr]) -> Expr:
    """Combination of vectors, shape (3,)."""
    return sum((w * v for w, v in zip(weights, vectors, strict=True)), start=0 * vectors[0])


def facet_normal(corners: Sequence[Expr], near: Nearest) -> Expr:
    """Unit vector from the nearest place to the point, shape (3,)."""
    place = combined(near.start, corners)
    one, two = (combined(turn, corners) for turn in near.turns)
    a, b, c = ufl.dot(one, one) + near.still[0], ufl.dot(one, two), ufl.dot(two, two)
    c += near.still[1]
    first, second = ufl.dot(one, place), ufl.dot(two, place)
    slid = (c * first - b * second) * one + (a * second - b * first) * two
    away = slid / (a * c - b**2) - place
    return away / ufl.sqrt(ufl.dot(away, away))


def on_facet(at: Expr, corners: Sequence[Expr], changes: Sequence[Expr]) -> Expr:
    """Motion of a place that moves with a facet, shape (3,).

    Args:
        at: The place, relative to the point.
        corners: Corners of the facet.
        changes: Their motions.
    """
    a, b = corners[1] - corners[0], corners[2] - corners[0]
    da, db = changes[1] - changes[0], changes[2] - changes[0]
    normals = ufl.cross(da, b) + ufl.cross(a, db)
    axes = a, b, ufl.cross(a, b)
    return carried(components(at - corners[0], axes), changes[0], (da, db, normals))


def facet_friction(
    state: Sequence[Expr],
    speed: Sequence[Expr],
    virtual: Sequence[Expr],
    near: Nearest,
    arm: Expr,
    law: Law,
) -> Expr:
    """Virtual work of friction for a normal force of one.

    Args:
        state: Corners of the facet relative to the point, then directors of the body there.
        speed: Their velocities.
        virtual: Their virtual motions.
        near: The nearest place.
        arm: Distance of the surface from the point, m.
        law: Coefficient of friction and slip speed.
    """
    corners, directors = state[:CORNERS], state[CORNERS:]
    n = facet_normal(corners, near)
    s = surface(n, arm, directors)

    def slip(moved: Sequence[Expr]) -> Expr:
        own = surface_motion(0 * n, n, arm, directors, moved[CORNERS:])
        return own - on_facet(s, corners, moved[:CORNERS])

    along = slip(speed)
    along = along - ufl.dot(along, n) * n
    return ufl.dot(friction(ufl.as_ufl(1.0), along, law), slip(virtual))
