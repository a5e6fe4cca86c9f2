"""Rolling and sliding without slip: constraints `A(q) q' = 0` on velocities that no position obeys.

Contact coordinates are unknowns of their own, without mass: the point of contact in the plane of
the first body, where the second one is touched, and its heading. They are tied to both
bodies by constraints on positions, at most quadratic, whose multipliers carry the forces to the
bodies. Velocities then obey equations between contact coordinates alone, with `A` linear in them,
also on a plane that moves.

With the axes `e1, e2, e3` of the plane (`e3` its normal on the side of the other body) and its
point `p`, the axes `d1, d2, d3` of the other body and its point `c`:

==========  =======================================  ===================================  =========
kind        unknowns                                 on positions                         rows
==========  =======================================  ===================================  =========
wheel       `y` point of contact; `t` direction it   `c + R r_k d_k = p + y_j e_j`;       7 and 2
            rolls in; `r` radius vector to the       `t_j e_j = r_2 d1 - r_1 d2`;
            ground in its own axes                   `|r| = 1`
sphere      `y`; `Q` the body's axes in the plane's  `c - R e3 = p + y_j e_j`;            12 and 2
                                                     `Q_kj = d_k . e_j`
knife edge  `y`; `t` direction of the blade          `c = p + y_j e_j`; `t_j = d3 . e_j`  5 and 1
==========  =======================================  ===================================  =========

==========  =============================================================================
kind        on velocities
==========  =============================================================================
wheel       `t . y' = R (r_2 r_1' - r_1 r_2')`, `t_1 y_2' = t_2 y_1'`
sphere      `y_j' + R Q_kj Q_k3' = 0`, j = 1, 2
knife edge  `t_1 y_2' = t_2 y_1'`
==========  =============================================================================

`d3` is the axis of the wheel, which rolls along `t` as it turns about it, and the direction of the
blade. The point of contact moves as fast over the one body as over the other: that is rolling.

**Over a step.** Where the path is linear, `A(q_m)(q_b - q_a) = 0` with forces along `A(q_m)`, which
work by the multipliers times what vanishes: not at all. Where it is quadratic
(`forms.steps.path`), the mean of the slip and the slip at the end vanish::

    <A q'> = A(x) D + B(D, z) = 0,     A(q_f) v_f = 0

with `B(., dq)` the derivative of `A dq`. The forces are those of multipliers `l_0 + l_1 P1` along
`A(q)`, but for terms of third order in the step, as moments::

    P0:  l_0 A(x) dq + l_1 [B(D, dq) + (1 - alpha^2) B(dq, h v_2) + 4 alpha B(dq, z)
                            + 2 alpha B(z, dq)]/6                                          (N1)
    P1:  l_0 B(D, dq)/6 + l_1 A((q_i + q_f)/2) dq/3

Their work is `l_0 <A q'>`, and `l_1` times what vanishes by both equations: with (Q1)::

    A(q_m) 6z/3 = [(1 + alpha) A(q_m) h v_f - (1 - alpha) A(q_m) h v_i - 2 alpha A(q_m) D]/6

where `A(q_m) v_f = -B(D, v_f)/2`, `A(q_m) v_i = B(D, v_i)/2`, `A(q_m) D = B(z, D) - B(D, z)`. For a
symmetric `B`, where `A q'` is the rate of a position, (N1) is (Q4). With `<P1 A q'> = 0` in place
of the equation at the end all forces would be along `A(q)`, but slip would remain in the velocities
at the ends of steps, of second order, and add up.
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import ufl
from ufl.core.expr import Expr

from shellmb.forms.constraints.held import ConstraintRow, Held, JumpRow, VelocityJump
from shellmb.forms.constraints.joints import JointKind, Place
from shellmb.forms.steps.discrete import mean, variation
from shellmb.forms.steps.mixed import Interval
from shellmb.forms.steps.path import Path

Own = Mapping[str, Expr]
# slip of a state and a direction, `A(q) dq`, shape (n,)
Slip = Callable[[Expr, Expr], Expr]


def _touching(a: Place, point: Expr, y: Expr) -> list[Expr]:
    gap = point - a.x - y[0] * a.e[0] - y[1] * a.e[1]
    return [gap[0], gap[1], gap[2]]


def _wheel(a: Place, b: Place, own: Own, size: Expr) -> list[Expr]:
    r, t = own["r"], own["t"]
    lowest = b.x + size * (r[0] * b.e[0] + r[1] * b.e[1])
    turn = size * (t[0] * a.e[0] + t[1] * a.e[1] + r[0] * b.e[1] - r[1] * b.e[0])
    unit = size * (r[0] ** 2 + r[1] ** 2 - 1) / 2
    return [*_touching(a, lowest, own["y"]), turn[0], turn[1], turn[2], unit]


def _wheel_slip(own: Own, d: Own, size: Expr) -> list[Expr]:
    r, t, dr, dy = own["r"], own["t"], d["r"], d["y"]
    rolled = size * (r[1] * dr[0] - r[0] * dr[1])
    return [t[0] * dy[0] + t[1] * dy[1] - rolled, *_edge_slip(own, d, size)]


def _sphere(a: Place, b: Place, own: Own, size: Expr) -> list[Expr]:
    turned = [
        size * (own["Q"][3 * k + j] - ufl.dot(b.e[k], a.e[j])) for k in range(3) for j in range(3)
    ]
    return [*_touching(a, b.x - size * a.e[2], own["y"]), *turned]


def _sphere_slip(own: Own, d: Own, size: Expr) -> list[Expr]:
    Q, dQ = own["Q"], d["Q"]
    rolled = [sum(Q[3 * k + j] * dQ[3 * k + 2] for k in range(3)) for j in range(2)]
    return [d["y"][j] + size * rolled[j] for j in range(2)]


def _edge(a: Place, b: Place, own: Own, size: Expr) -> list[Expr]:
    heading = [size * (own["t"][j] - ufl.dot(b.e[2], a.e[j])) for j in range(2)]
    return [*_touching(a, b.x, own["y"]), *heading]


def _edge_slip(own: Own, d: Own, size: Expr) -> list[Expr]:
    return [own["t"][0] * d["y"][1] - own["t"][1] * d["y"][0]]


_ROLLING = {"y": 2, "t": 2, "r": 2}
CONTACTS: dict[str, JointKind] = {
    "wheel": JointKind(7, _wheel, (3, 3), parts=_ROLLING, slips=2, slip=_wheel_slip),
    "sphere": JointKind(12, _sphere, (3, 3), parts={"y": 2, "Q": 9}, slips=2, slip=_sphere_slip),
    "knife edge": JointKind(5, _edge, (3, 3), parts={"y": 2, "t": 2}, slips=1, slip=_edge_slip),
}


def path_row(slip: Slip, path: Path, k: int, dq: Expr) -> ConstraintRow:
    """Row of a nonholonomic constraint over a step that is quadratic in time, eq. (N1).

    Args:
        slip: The constraints.
        path: The step.
        k: Row, 0 for P0 and 1 for P1.
        dq: Direction.
    """

    def turned(change: Expr, dq: Expr) -> Expr:
        """`B(change, dq)`: `A` is linear."""
        return variation(lambda q: slip(q, dq), path.mean, change)

    D, z, alpha = path.chord, path.bow, path.alpha
    if k == 0:
        extra = (1 - alpha**2) / 6 * path.shake + 2 * alpha / 3 * z
        other = turned(D, dq) / 6 + turned(dq, extra) + alpha / 3 * turned(z, dq)
        value = slip(path.mean, D) + turned(D, z)
        return ConstraintRow(slip(path.mean, dq), value, path.end, other, path.end_velocity)
    own, value = slip(path.middle, dq) / 3, slip(path.end, path.end_velocity)
    return ConstraintRow(own, value, path.end_velocity, turned(D, dq) / 6, path.end)


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
        own, value = self.slip(span.mid, dq), self.slip(span.mid, span.b - span.a)
        return row._replace(own=both(row.own, own), value=both(row.value, value))

    def path(self, path: Path, k: int, dq: Expr, inertialess: bool) -> ConstraintRow:
        """No slip in the mean, nor at the end (N1)."""
        a = self.held.path(path, k, dq, inertialess=False)
        b = path_row(self.slip, path, k, dq)
        other = None if a.other is None or b.other is None else both(a.other, b.other)
        return a._replace(own=both(a.own, b.own), value=both(a.value, b.value), other=other)

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
