"""Constraints as bodies list them, and their rows in the steps of all schemes.

A body states what must vanish. What its multipliers act on, and where it must vanish, follows here
from the step: at the end of a sub-interval (20), at the end of a step that is quadratic in time
(Q4), (Q6), (N1), for velocities, and at the end of a step with a jump of velocities (N2).
"""

from collections.abc import Callable
from typing import NamedTuple, Protocol

import ufl
from ufl.core.expr import Expr

from shellmb.forms.constraints.nonholonomic import Slip, interval_row, path_row
from shellmb.forms.constraints.pathconstraints import ConstraintRow, held_row
from shellmb.forms.constraints.velocity_jump import JumpRow, VelocityJump, jump_row, slip_row
from shellmb.forms.steps.discrete import variation
from shellmb.forms.steps.mixed import Interval
from shellmb.forms.steps.path import Path


class Law(Protocol):
    """Quantities that must vanish, and their rows in a step; all of shape (n,)."""

    def interval(self, span: Interval, dq: Expr) -> ConstraintRow:
        """Row of a sub-interval, or of a single state."""
        ...

    def path(self, path: Path, k: int, dq: Expr, inertialess: bool) -> ConstraintRow:
        """Row P0 (`k` is 0) or P1 of a step that is quadratic in time.

        Args:
            path: The step.
            k: Row.
            dq: Direction.
            inertialess: Whether what is fixed has no inertia.
        """
        ...

    def velocity(self, v: Expr, mid: Expr, dv: Expr) -> ConstraintRow:
        """Row of the velocities `v`, which hold impulses, at the state `mid`."""
        ...

    def jump(self, step: VelocityJump, dq: Expr) -> JumpRow:
        """Row of the velocities at the end of a step that begins with a jump."""
        ...


class Held(NamedTuple):
    """Constraints on positions.

    Args:
        function: The constraints as a function of the state, at most quadratic, shape (n,).
    """

    function: Callable[[Expr], Expr]

    def interval(self, span: Interval, dq: Expr) -> ConstraintRow:
        """Hold constraints at the end; their forces are along the gradient at the middle."""
        g = self.function
        return ConstraintRow(
            variation(g, span.mid, dq), None, g(span.holding), (span.unknown, None)
        )

    def path(self, path: Path, k: int, dq: Expr, inertialess: bool) -> ConstraintRow:
        """Hold constraints and rates at the end (Q4), or constraints at the middle, too (Q6)."""
        return held_row(self.function, path, k, dq, inertialess)

    def velocity(self, v: Expr, mid: Expr, dv: Expr) -> ConstraintRow:
        """Velocities do not violate them."""
        g = self.function
        return ConstraintRow(variation(g, mid, dv), None, variation(g, mid, v), (v, None))

    def jump(self, step: VelocityJump, dq: Expr) -> JumpRow:
        """Velocities at the end do not violate them (N2)."""
        return jump_row(self.function, step, dq)


class Rolling(NamedTuple):
    """Constraints on positions, and behind them those on velocities `A(q) q' = 0`.

    Args:
        held: The former.
        slip: `A(q) dq`, shape (m,).
        reference: State from which nothing has slipped where a single state is looked at.
    """

    held: Held
    slip: Slip
    reference: Expr

    def interval(self, span: Interval, dq: Expr) -> ConstraintRow:
        """No slip from the start to the end; in equilibrium, none from the reference."""
        row = self.held.interval(span, dq)
        if span.a is span.b:
            span = span._replace(a=self.reference, mid=self.reference)
        work, slips = interval_row(self.slip, span, dq)
        return row._replace(own=both(row.own, work), value=both(row.value, slips))

    def path(self, path: Path, k: int, dq: Expr, inertialess: bool) -> ConstraintRow:
        """No slip in the mean, nor at the end (N1)."""
        a = held_row(self.held.function, path, k, dq)
        b = path_row(self.slip, path, k, dq)
        other = None if a.other is None or b.other is None else both(a.other, b.other)
        return ConstraintRow(both(a.own, b.own), other, both(a.value, b.value), a.multipliers)

    def velocity(self, v: Expr, mid: Expr, dv: Expr) -> ConstraintRow:
        """Velocities violate neither."""
        row = self.held.velocity(v, mid, dv)
        own, value = both(row.own, self.slip(mid, dv)), both(row.value, self.slip(mid, v))
        return row._replace(own=own, value=value)

    def jump(self, step: VelocityJump, dq: Expr) -> JumpRow:
        """Velocities at the end violate neither (N2)."""
        pairs = zip(self.held.jump(step, dq), slip_row(self.slip, step, dq), strict=True)
        return JumpRow(*(both(a, b) for a, b in pairs))


def both(a: Expr, b: Expr) -> Expr:
    """Two vectors, one behind the other."""
    return ufl.as_vector([*(a[k] for k in range(len(a))), *(b[k] for k in range(len(b)))])
