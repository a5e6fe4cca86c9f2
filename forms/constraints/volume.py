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
"""

from collections.abc import Callable
from typing import NamedTuple

import ufl
from ufl.core.expr import Expr

from shellmb.forms.constraints.held import Held
from shellmb.forms.constraints.pathconstraints import ConstraintRow
from shellmb.forms.constraints.velocity_jump import JumpRow, VelocityJump
from shellmb.forms.steps.discrete import mean, variation
from shellmb.forms.steps.mixed import Interval
from shellmb.forms.steps.path import Path
from shellmb.forms.surface import Surface, along


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


class Cones(NamedTuple):
    """Less the volume of a surface: a part of what multipliers hold at zero, with `Content`.

    Args:
        place: Positions at a state, from the point of the cones.
        change: Their changes with a change of the state.
        sign: One where the director points out of the volume, or minus one.
    """

    place: Callable[[Expr], Patch]
    change: Callable[[Expr], Patch]
    sign: float

    def _row(
        self, own: Expr, other: Expr | None, value: Expr, multipliers: tuple[Expr, Expr | None]
    ) -> ConstraintRow:
        def one(e: Expr) -> Expr:
            return ufl.as_vector([-self.sign * e])

        return ConstraintRow(
            one(own), None if other is None else one(other), one(value), multipliers
        )

    def interval(self, span: Interval, dq: Expr) -> ConstraintRow:
        """The volume at the end, and the force (V1)."""
        d = self.change(dq)
        own = slope(self.place(span.mid), d)
        if span.a is not span.b:
            own += slope(self.change(span.b - span.a), d) / 12
        return self._row(own, None, cone(self.place(span.at)), (span.unknown, None))

    def path(self, path: Path, k: int, dq: Expr, inertialess: bool) -> ConstraintRow:
        """The volume or its rate at the end, and the forces (V2)."""
        d, D, z = self.change(dq), self.change(path.chord), self.change(path.bow)
        first, second = path.end, path.end_velocity
        middle, bent = self.place(path.middle), slope(D, d)
        if k == 0:
            own = slope(self.place(path.mean), d) + bent / 12 + slope(z, d) / 5
            other = bend(middle, self.change(path.mean_velocity), d) + path.alpha * bent / 6
            return self._row(own, other, cone(self.place(path.end)), (first, second))
        own = slope(middle, d) + bent / 4
        other = bend(self.place(path.mean), D, d) / 6 + bend(D, z, d) / 15
        rate = slope(self.place(path.end), self.change(path.end_velocity))
        return self._row(own, other, rate, (second, first))

    def velocity(self, v: Expr, mid: Expr, dv: Expr) -> ConstraintRow:
        """The rate of the volume at the state `mid`, and the impulse for it."""
        x = self.place(mid)
        return self._row(slope(x, self.change(dv)), None, slope(x, self.change(v)), (v, None))

    def jump(self, step: VelocityJump, dq: Expr) -> JumpRow:
        """The jump of the velocities itself, by impulses that so do no work."""

        def rate(mid: Expr, v: Expr) -> Expr:
            return self.velocity(v, mid, v).own

        return held_jump(rate, step, dq)


class Content(Held):
    """Content of the volume; linear in the state, and held as `Cones` are."""

    def jump(self, step: VelocityJump, dq: Expr) -> JumpRow:
        """The jump of the velocities itself, by impulses that so do no work."""
        return held_jump(lambda mid, v: variation(self.function, mid, v), step, dq)


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
