"""Constraints as bodies list them, and their rows in the steps of all schemes.

A body states what must vanish. What its multipliers act on, and where it must vanish, follows here
from the step: at the end of a sub-interval (20), at the end of a step that is quadratic in time
(Q4), (Q6), (N1), for velocities, and at the end of a step with a jump of velocities (N2).

**Quadratic constraints over a step that is quadratic in time**, by forces that do no work.

Of what has inertia they hold at the end of a step for positions and velocities (Q4, in `path`).

Where a part has none its second unknown `r` stands for the state at the middle, `q_h`: what is the
velocity at the end elsewhere is a name for the bow here, by (Q1),

    q_h = (q_i + q_f)/2 - 3 z/2,    z = [(1 + alpha) r - (1 - alpha) p - 2 alpha D]/12.

`p` is the rate of the path at the end of the step before, times the step. Forces and energy law do
not depend on it; but strains have it in their own path (`y` in `path`), to the order of the scheme.

Constraints hold at the end and at the middle, `g(q_f) = 0` and `g(q_h) = 0`, by forces that do no
work (`H` is the Hessian of `g`):

    P0:  lambda_0 <Dg> + lambda_1 H D/2                                                         (Q6)
    P1:  lambda_0 H D/6 + lambda_1 [Dg((q_i + q_f)/2) + Dg(q_h)]/2

because with `g` quadratic the work of `lambda_1` is `2 lambda_1 [g_i + g_f - 2 g_h]`.

**A step of two sub-intervals whose velocities jump at its start, and constraints at its end.**

In the paper's scheme ED with `a = v_f - v_i`, `b = v_j - v_i`, `d_1 = q_j - q_i`, `d_2 = q_f - q_j`
and the chord `D = d_1 + d_2`, eq. (31) is `a + b = 2 D/h - 2 v_i`. The work of forces `P_j`, `P_f`
of both sub-intervals and of impulses `P_b` in the equation of the jump is `P_j.d_1 + P_f.d_2 +
P_b.b/2`. Usually constraints hold the jump, `A b = 0` at the middle of the first sub-interval, by
impulses that so do no work. What velocities violate a constraint by then changes its sign from step
to step and does not decay; with constraints on velocities, `A(q) q' = 0`, it grows.

Instead the velocities at the end may obey them, `A(q_f) v_f = 0`. With `B(., dq)` the derivative of
`A dq`, `A` being linear in `q`, and `q_m = (q_i + q_f)/2`::

    A(q_f) v_f + A(q_i) v_i = A(q_m)(2 D/h - b) + B(D, a)/2,
    A(q_m) D = A(q_m1) d_1 + A(q_m2) d_2 + [B(D, d_1) - B(d_1, D)]/2

so that, where both sub-intervals obey the constraints, these forces of a multiplier do no work::

    P_b:         A(q_m) dq                                                                 (N2)
    P_j, P_f:  - B(dq, a)/4 - [B(dq, d_1) - B(d_1, dq)]/(2 h)

Dissipation stays `alpha` times the energy of the jump, eq. (33). Of positions `g` with `A = Dg`
the derivative `B` is symmetric: the second part vanishes.
"""

from collections.abc import Callable
from typing import NamedTuple, Protocol

from ufl.core.expr import Expr

from shellmb.forms.measure import measure
from shellmb.forms.steps.discrete import mean, variation
from shellmb.forms.steps.mixed import Interval
from shellmb.forms.steps.path import Path


class ConstraintRow(NamedTuple):
    """Constraints in a row of a step, all of shape (n,).

    Args:
        own: What the multipliers of the row itself act on.
        value: What the row demands to vanish: their value at the end, and their rate times the step
            there, or their value at the middle.
        holder: State that holds the row's own multipliers.
        other: What those of the other row act on, eqs. (Q4) and (Q6); None without another row.
        second: State that holds these.
    """

    own: Expr
    value: Expr
    holder: Expr
    other: Expr | None = None
    second: Expr | None = None


class VelocityJump(NamedTuple):
    """The step.

    Args:
        start: State at the start, `q_i`.
        inner: State between the sub-intervals, `q_j`.
        end: State at the end, `q_f`.
        jump: Jump of the velocities, `b`.
        gain: What they change by in all, `a`.
        velocity: Velocity at the end, `v_f`.
        dt: Length of the step, `h`.
    """

    start: Expr
    inner: Expr
    end: Expr
    jump: Expr
    gain: Expr
    velocity: Expr
    dt: Expr


class JumpRow(NamedTuple):
    """Constraints on the velocities at the end, all of shape (n,).

    Args:
        value: What must vanish.
        impulse: What multipliers act on in the equation of the jump.
        force: What they act on in the rows of both sub-intervals.
    """

    value: Expr
    impulse: Expr
    force: Expr


class Law(Protocol):
    """Quantities that must vanish, and their rows in a step; all of shape (n,)."""

    def interval(self, span: Interval, dq: Expr) -> ConstraintRow:
        """Row of a sub-interval, or of a single state."""

    def path(self, path: Path, k: int, dq: Expr, inertialess: bool) -> ConstraintRow:
        """Row P0 (`k` is 0) or P1 of a step that is quadratic in time.

        Args:
            path: The step.
            k: Row.
            dq: Direction.
            inertialess: Whether what is fixed has no inertia.
        """

    def velocity(self, v: Expr, mid: Expr, dv: Expr) -> ConstraintRow:
        """Row of the velocities `v`, which hold impulses, at the state `mid`."""

    def jump(self, step: VelocityJump, dq: Expr) -> JumpRow | None:
        """Row of the velocities at the end of a step that begins with a jump; None: as of others.

        Then they hold the jump itself, as `velocity` says.
        """


class Held(NamedTuple):
    """Constraints on positions.

    Args:
        function: The constraints as a function of the state, at most quadratic, shape (n,).
    """

    function: Callable[[Expr], Expr]

    def interval(self, span: Interval, dq: Expr) -> ConstraintRow:
        """Hold constraints at the end; their forces are along the gradient at the middle."""
        g = self.function
        return ConstraintRow(variation(g, span.mid, dq), g(span.holding), span.unknown)

    def path(self, path: Path, k: int, dq: Expr, inertialess: bool) -> ConstraintRow:
        """Hold constraints and rates at the end (Q4), or constraints at the middle, too (Q6)."""
        g, row = measure(self.function), path.rows[k]
        held = row.massless if inertialess else row.holding
        own, other = (path.slope(g, slope, dq) for slope in (held.own, held.other))
        both = path.end, path.end_velocity
        return ConstraintRow(own, held.vanishes(g, path), both[k], other, both[1 - k])

    def velocity(self, v: Expr, mid: Expr, dv: Expr) -> ConstraintRow:
        """Velocities do not violate them."""
        g = self.function
        return ConstraintRow(variation(g, mid, dv), variation(g, mid, v), v)

    def jump(self, step: VelocityJump, dq: Expr) -> JumpRow:
        """Velocities at the end do not violate them (N2)."""
        g = self.function
        rate = variation(g, step.end, step.velocity)
        impulse = variation(g, mean(step.start, step.end), dq)
        return JumpRow(rate, impulse, -measure(g).quad(step.gain, dq) / 4)
