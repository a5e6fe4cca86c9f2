"""A step of two sub-intervals whose velocities jump at its start, and constraints at its end.

In the paper's scheme ED with `a = v_f - v_i`, `b = v_j - v_i`, `d_1 = q_j - q_i`, `d_2 = q_f - q_j`
and the chord `D = d_1 + d_2`, eq. (31) is `a + b = 2 D/h - 2 v_i`. The work of forces `P_j`, `P_f`
of both sub-intervals and of impulses `P_b` in the equation of the jump is `P_j.d_1 + P_f.d_2 +
P_b.b/2`. Usually constraints hold the jump, `A b = 0` at the middle of the first sub-interval, by
impulses that so do no work. What velocities violate a constraint by then changes its sign from step
to step and does not decay; with constraints on velocities, `A(q) q' = 0`, it grows.

Instead the velocities at the end may obey them, `A(q_f) v_f = 0`. With `B(., dq)` the derivative of
`A dq`, `A` being linear in `q`, and `q_m = (q_i + q_f)/2`,

    A(q_f) v_f + A(q_i) v_i = A(q_m)(2 D/h - b) + B(D, a)/2,
    A(q_m) D = A(q_m1) d_1 + A(q_m2) d_2 + [B(D, d_1) - B(d_1, D)]/2

so that, where both sub-intervals obey the constraints, these forces of a multiplier do no work:

    P_b:         A(q_m) dq                                                                 (N2)
    P_j, P_f:  - B(dq, a)/4 - [B(dq, d_1) - B(d_1, dq)]/(2 h)

Dissipation stays `alpha` times the energy of the jump, eq. (33). Of positions `g` with `A = Dg`
the derivative `B` is symmetric: the second part vanishes.
"""

from collections.abc import Callable
from typing import NamedTuple

from ufl.core.expr import Expr

from shellmb.forms.measure import measure
from shellmb.forms.steps.discrete import mean, variation

# what a state and its change violate, `A(q) dq`, shape (n,)
Slip = Callable[[Expr, Expr], Expr]


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


def slip_row(slip: Slip, step: VelocityJump, dq: Expr) -> JumpRow:
    """Constraints on velocities, eq. (N2).

    Args:
        slip: `A(q) dq`.
        step: The step.
        dq: Direction.
    """
    middle, first = mean(step.start, step.end), step.inner - step.start

    def turned(change: Expr, dq: Expr) -> Expr:
        """`B(change, dq)`: `A` is linear."""
        return variation(lambda q: slip(q, dq), middle, change)

    skew = turned(dq, first) - turned(first, dq)
    force = -turned(dq, step.gain) / 4 - skew / (2 * step.dt)
    return JumpRow(slip(step.end, step.velocity), slip(middle, dq), force)


def jump_row(function: Callable[[Expr], Expr], step: VelocityJump, dq: Expr) -> JumpRow:
    """Row of a velocity jump of quadratic constraints on positions.

    Args:
        function: The constraints as a function of the state.
        step: The step.
        dq: Direction.
    """
    rate = variation(function, step.end, step.velocity)
    impulse = variation(function, mean(step.start, step.end), dq)
    return JumpRow(rate, impulse, -measure(function).quad(step.gain, dq) / 4)
