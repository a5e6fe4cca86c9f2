"""Holonomic constraints of joints between two places, each at most quadratic in the unknowns.

A place is a point and, where its body has directors there, vectors that move with it; both are
linear in the nodal unknowns. So `g(q_b) - g(q_a) = Dg(q_m)[q_b - q_a]` holds for every constraint
here, and multipliers along the mid-point gradient do no work (eq. 20; sections 3 and 5). Functions
of time that they contain are unknowns that are given, in which they are quadratic, too; the force
that moves these does the work.

The vectors `e1, e2, e3` of both places coincide in the reference configuration (of a universal
joint, `e3` is the place's own axis); the axis of a joint is `e3`.

==============  ==================================================================  =====
kind            constraints                                                         count
==============  ==================================================================  =====
spherical       `x2 - x1 = 0`                                                       3
revolute        spherical, `e1 . e3' = e2 . e3' = 0`                                5
universal       spherical, `e3 . e3' = 0`                                           4
cylindrical     `e1 . e3' = e2 . e3' = 0`, `e1 . (x2 - x1) = e2 . (x2 - x1) = 0`    4
prismatic       cylindrical, `e1 . e2' = 0`                                         5
planar          `e3 . (x2 - x1) = 0`, `e1 . e3' = e2 . e3' = 0`                     3
weld            spherical, `e1 . e2' = e2 . e3' = e3 . e1' = 0`                     6
distance        `(|x2 - x1|^2 - L^2) / 2 L = 0`                                     1
given distance  `(|x2 - x1|^2 - s^2) / 2 L = 0`, `s` a function of time             1
in-plane        `e3 . (x2 - x1) = 0`                                                1
fixed point      spherical, a point of a frame and one without directors             3
shell revolute  spherical, `e1 . E3 = e2 . E3 = 0` (eq. 35)                         5
==============  ==================================================================  =====

Constraints between single nodes; all at most quadratic, so the mid-point gradient is exact.

`g(q_b) - g(q_a) = Dg(q_m)[q_b - q_a]` holds for each of them, hence their multipliers do no work.
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import ufl
from ufl.core.expr import Expr


class Place(NamedTuple):
    """A place on a body at a state.

    Args:
        x: Position, shape (3,), m.
        e: Vectors that move with the body: three of a frame, the director of a shell, or none.
    """

    x: Expr
    e: tuple[Expr, ...]


NO_PARTS: Mapping[str, int] = {}


class JointKind(NamedTuple):
    """A kind of joint.

    Args:
        rows: Number of constraints.
        constraints: Their values at two places; the third argument is the joint's length, further
            ones are values over time, those of the description's `given`.
        vectors: Number of vectors that the first and the second place must have.
        directions: Rows that are products of two unit vectors; all others are lengths.
        parts: Sizes of unknowns of its own, by name, which come as the third argument: contact
            coordinates (`nonholonomic`).
        slips: Number of constraints on velocities, behind the others.
        slip: Their values `A(own) change` for these unknowns, a change of them and the length.
    """

    rows: int
    constraints: Callable[..., list[Expr]]
    vectors: tuple[int, int]
    directions: tuple[int, ...] = ()
    parts: Mapping[str, int] = NO_PARTS
    slips: int = 0
    slip: Callable[..., list[Expr]] | None = None


def _gap(a: Place, b: Place) -> Expr:
    return b.x - a.x


def _together(a: Place, b: Place) -> list[Expr]:
    gap = _gap(a, b)
    return [gap[0], gap[1], gap[2]]


def _aligned(a: Place, b: Place) -> list[Expr]:
    """The axes stay parallel."""
    return [ufl.dot(a.e[0], b.e[-1]), ufl.dot(a.e[1], b.e[-1])]


def _on_axis(a: Place, b: Place) -> list[Expr]:
    """The second point stays on the axis of the first place."""
    return [ufl.dot(a.e[0], _gap(a, b)), ufl.dot(a.e[1], _gap(a, b))]


def _off_plane(a: Place, b: Place) -> list[Expr]:
    return [ufl.dot(a.e[2], _gap(a, b))]


def _distance(a: Place, b: Place, length: Expr, now: Expr | None = None) -> list[Expr]:
    gap = _gap(a, b)
    return [(ufl.dot(gap, gap) - (length if now is None else now) ** 2) / (2 * length)]


def _weld(a: Place, b: Place, length: Expr) -> list[Expr]:
    turn = [ufl.dot(a.e[k], b.e[(k + 1) % 3]) for k in range(3)]
    return _together(a, b) + turn


KINDS: dict[str, JointKind] = {
    "spherical": JointKind(3, lambda a, b, length: _together(a, b), (0, 0)),
    "revolute": JointKind(5, lambda a, b, length: _together(a, b) + _aligned(a, b), (3, 3), (3, 4)),
    "universal": JointKind(
        4, lambda a, b, length: [*_together(a, b), ufl.dot(a.e[2], b.e[2])], (3, 3), (3,)
    ),
    "cylindrical": JointKind(
        4, lambda a, b, length: _aligned(a, b) + _on_axis(a, b), (3, 3), (0, 1)
    ),
    "prismatic": JointKind(
        5,
        lambda a, b, length: [*_aligned(a, b), *_on_axis(a, b), ufl.dot(a.e[0], b.e[1])],
        (3, 3),
        (0, 1, 4),
    ),
    "planar": JointKind(3, lambda a, b, length: _off_plane(a, b) + _aligned(a, b), (3, 3), (1, 2)),
    "weld": JointKind(6, _weld, (3, 3), (3, 4, 5)),
    "distance": JointKind(1, _distance, (0, 0)),
    "given distance": JointKind(1, _distance, (0, 0)),
    "in-plane": JointKind(1, lambda a, b, length: _off_plane(a, b), (3, 0)),
    "fixed point": JointKind(3, lambda a, b, length: _together(a, b), (3, 0)),
    "shell revolute": JointKind(
        5, lambda a, b, length: _together(a, b) + _aligned(a, b), (3, 1), (3, 4)
    ),
}
# what users add to the table is looked through, which takes a hundredth of a second for each kind
BUNDLED = frozenset(kind.constraints for kind in KINDS.values())


def locked_kink(d1: Expr, d2: Expr, reference: Expr) -> Expr:
    """Two smooth parts of a shell keep the angle between their directors at a common edge.

    The two directors have four parameters, the rotation of the kinked edge three: one constraint.

    Args:
        d1: Director of the first part, shape (3,).
        d2: Director of the second part, shape (3,).
        reference: Value of `d1 . d2` in the reference configuration.
    """
    return ufl.dot(d1, d2) - reference


def in_plane(q: Expr, normal: Expr) -> Expr:
    """A nodal vector (displacement, director change) stays in the plane with the given normal."""
    return ufl.dot(q, normal)
