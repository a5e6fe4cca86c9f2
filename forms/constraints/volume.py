"""The volume between a surface and a point, and forces of a pressure that work exactly its change.

The cone from a point `c` over a surface has the volume `V = <x.(x_,1 x x_,2)>/3`, `x` from `c`: a
cubic form `T(x, x, x)` with a symmetric `T`. Surfaces that are closed by planes through `c`, or by
other surfaces, enclose the sum of their cones. With `D` the chord of a sub-interval and `m` its
middle the force

    3 T(m, m, dq) + T(D, D, dq)/4                                                              (V1)

works `V_b - V_a`. Over a step that is quadratic in time, with mean `x`, chord `D`, bow `z` and mean
velocity `y` (`steps.path`), `p_0 + P1 p_1` exerts

    P0:  p_0 [3 T(x, x, dq) + T(D, D, dq)/4 + 3 T(z, z, dq)/5] + p_1 [6 T(x + z, y, dq)
             + alpha T(D, D, dq)/2]                                                            (V2)
    P1:  p_0 [T(x, D, dq) + 2 T(D, z, dq)/5] + p_1 [3 T(x + z, x + z, dq) + 3 T(D, D, dq)/4]

`p_0` is the mean over the true path and works `V_f - V_i`. What `p_1` works is three times the bow
that (Q1) gives a coordinate with the values and rates of `V` at both ends; so does (Q4) with
constraints that are quadratic, of which `T(D, D, dq)` vanishes.

Only the second part of (V1) has a moment about the middle. With the rotation `w` of the chord in
the mean over the surface, `<m_,a x (D_,a - w x m_,a)> = 0`, and with `R = w x m` the force

    3 T(m, m, dq) + [T(D, D, dq) + T(D, R, dq) + T(R, R, dq)]/4 - <(b x m_,a).dq_,a>           (V3)

has neither a moment, by its `b`, nor a resultant. It works `V_b - V_a`: the bracket works
`T(D, D, D)` on `D - R`, because `T` stays where all of its arguments turn and `T(R, R, R) = 0`;
what it works on `R` is what `b` works on `D`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import ufl
from ufl.core.expr import Expr

from shellmb.forms.constraints.held import ConstraintRow, Held, JumpRow, VelocityJump
from shellmb.forms.materials import log_of_one_and
from shellmb.forms.shell import Surface, along
from shellmb.forms.steps.discrete import mean, variation
from shellmb.forms.steps.mixed import Interval
from shellmb.forms.steps.path import Path


class Patch(NamedTuple):
    """Positions on a surface, or their changes, with derivatives along it; shape (3,) each."""

    x: Expr
    x_1: Expr
    x_2: Expr


def patch(x: Expr, surf: Surface) -> Patch:
    """A field of positions, or of their changes."""
    return Patch(x, along(x, surf.e1), along(x, surf.e2))


def _cone(a: Patch, b: Patch, c: Patch) -> Expr:
    return ufl.dot(a.x, ufl.cross(b.x_1, c.x_2)) / 3


def cone(a: Patch) -> Expr:
    """Density of the volume, `T(a, a, a)`."""
    return _cone(a, a, a)


def slope(a: Patch, d: Patch) -> Expr:
    """Derivative of the volume, `3 T(a, a, d)`."""
    return _cone(d, a, a) + _cone(a, d, a) + _cone(a, a, d)


def bend(a: Patch, b: Patch, d: Patch) -> Expr:
    """Second derivative of the volume, `6 T(a, b, d)`."""
    return (
        (_cone(d, a, b) + _cone(d, b, a))
        + (_cone(a, d, b) + _cone(b, d, a))
        + (_cone(a, b, d) + _cone(b, a, d))
    )


@dataclass(frozen=True)
class Cones:
    """Less the volume of a surface: a part of what multipliers hold at zero, with `Content`.

    Args:
        place: Positions at a state, from the point of the cones.
        change: Their changes with a change of the state.
        sign: One where the director points out of the volume, or minus one.
    """

    place: Callable[[Expr], Patch]
    change: Callable[[Expr], Patch]
    sign: float

    def _signed(self, e: Expr) -> Expr:
        return ufl.as_vector([-self.sign * e])

    def interval(self, span: Interval, dq: Expr) -> ConstraintRow:
        """The volume at the end, and the force (V1)."""
        d = self.change(dq)
        own = slope(self.place(span.mid), d)
        if span.a is not span.b:
            own += slope(self.change(span.b - span.a), d) / 12
        value = cone(self.place(span.holding))
        return ConstraintRow(self._signed(own), self._signed(value), span.unknown)

    def path(self, path: Path, k: int, dq: Expr, inertialess: bool) -> ConstraintRow:
        """The volume or its rate at the end, and the forces (V2)."""
        d, D, z = self.change(dq), self.change(path.chord), self.change(path.bow)
        both = path.end, path.end_velocity
        middle, bent = self.place(path.middle), slope(D, d)
        if k == 0:
            own = slope(self.place(path.mean), d) + bent / 12 + slope(z, d) / 5
            other = bend(middle, self.change(path.mean_velocity), d) + path.alpha * bent / 6
            value = cone(self.place(path.end))
        else:
            own = slope(middle, d) + bent / 4
            other = bend(self.place(path.mean), D, d) / 6 + bend(D, z, d) / 15
            value = slope(self.place(path.end), self.change(path.end_velocity))
        own, value, other = map(self._signed, (own, value, other))
        return ConstraintRow(own, value, both[k], other, both[1 - k])

    def velocity(self, v: Expr, mid: Expr, dv: Expr) -> ConstraintRow:
        """The rate of the volume at the state `mid`, and the impulse for it."""
        x = self.place(mid)
        own, value = (self._signed(slope(x, self.change(rate))) for rate in (dv, v))
        return ConstraintRow(own, value, v)

    def jump(self, step: VelocityJump, dq: Expr) -> JumpRow:
        """The jump of the velocities itself, by impulses that so do no work."""

        def rate(mid: Expr, v: Expr) -> Expr:
            return self.velocity(v, mid, v).own

        return held_jump(rate, step, dq)


class RotationAndCouple(NamedTuple):
    """Motion and couple of a whole volume in (V3), shape (3,) each.

    Args:
        rotation: Rotation of the chord, `w`.
        couple: What keeps the force free of a moment, `b`, m.
    """

    rotation: Expr
    couple: Expr


@dataclass(frozen=True)
class MomentFreeCones(Cones):
    """`Cones` with a force over a sub-interval that has no moment, (V3), shape (7,).

    Behind the volume stands what determines the rotation and the couple.

    Args:
        motion: Rotation and couple that a state holds.
        length: Size of the volume, m.
    """

    motion: Callable[[Expr], RotationAndCouple]
    length: Expr

    def interval(self, span: Interval, dq: Expr) -> ConstraintRow:
        """The volume at the end, and the force (V3)."""
        held, (w, b) = super().interval(span, dq), self.motion(span.unknown)
        if span.a is span.b:
            return _seven(held, [*w, *b])
        m, D = self.place(span.mid), self.change(span.b - span.a)
        R = _crossed(w, m)

        def more(d: Patch) -> Expr:
            """Parts of (V3) beyond `3 T(m, m, d)`, with the sign of the volume."""
            curved = (slope(D, d) + bend(D, R, d) / 2 + slope(R, d)) / 12
            return self.sign * curved - _along(_crossed(b, m), d)

        d = self.change(dq)
        own = ufl.as_vector([-self.sign * slope(m, d) - more(d)])
        still = self.length * (ufl.cross(m.x_1, D.x_1 - R.x_1) + ufl.cross(m.x_2, D.x_2 - R.x_2))
        moments = [more(_crossed(ufl.unit_vector(k, 3), m)) for k in range(3)]
        return _seven(held._replace(own=own), [*(still[k] for k in range(3)), *moments])

    def velocity(self, v: Expr, mid: Expr, dv: Expr) -> ConstraintRow:
        """The rate of the volume; nothing turns."""
        w, b = self.motion(v)
        return _seven(super().velocity(v, mid, dv), [*w, *b])


def _seven(row: ConstraintRow, values: list[Expr]) -> ConstraintRow:
    """A row of the volume with six values that exert nothing themselves."""
    own = ufl.as_vector([row.own[0], *(0 * value for value in values)])
    return row._replace(own=own, value=ufl.as_vector([row.value[0], *values]))


def _crossed(w: Expr, a: Patch) -> Patch:
    return Patch(*(ufl.cross(w, part) for part in a))


def _along(a: Patch, b: Patch) -> Expr:
    return ufl.dot(a.x_1, b.x_1) + ufl.dot(a.x_2, b.x_2)


class Content(Held):
    """Content of the volume; linear in the state, and stored as `Cones` are."""

    def jump(self, step: VelocityJump, dq: Expr) -> JumpRow:
        """The jump of the velocities itself, by impulses that so do no work."""
        return held_jump(lambda mid, v: variation(self.function, mid, v), step, dq)


def gas_energy(v: Expr, pressure: Expr, n: Expr | None, outside: Expr) -> Expr:
    """Energy of a gas at the volume `V0 (1 + v)`, with what lies outside, over `V0`.

    `p (1 + v)^(1 + n)` stays. This is

        p0 [((1 + v)^-n - 1)/n + v] + (outside - p0) v,

    without the difference of ones.

    Args:
        v: Relative change of the volume.
        pressure: Absolute pressure `p0` at `v = 0`.
        n: Above 0; None: 0, where the temperature stays.
        outside: Absolute pressure outside.
    """
    log = log_of_one_and(v)
    if n is None:
        work = -log
    else:
        # expm1(-n log)/n
        half = ufl.tanh(-n / 2 * log)
        work = 2 * half / (1 - half) / n
    return pressure * (work + v) + (outside - pressure) * v


def held_jump(rate: Callable[[Expr, Expr], Expr], step: VelocityJump, dq: Expr) -> JumpRow:
    """Row of a jump of velocities that violates nothing at the middle of the first sub-interval.

    Args:
        rate: Rate of the constraints at a state with a velocity.
        step: The step.
        dq: Direction.
    """
    middle = mean(step.start, step.inner)
    impulse = rate(middle, dq)
    return JumpRow(rate(middle, step.jump), impulse, 0 * impulse)
