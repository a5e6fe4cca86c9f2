"""Constraints of a body with their multipliers: forces in the steps of all schemes."""

from collections.abc import Callable
from dataclasses import dataclass, field

import ufl
from ufl import Form
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.forms.constraints.held import ConstraintRow, Law, VelocityJump
from shellmb.forms.steps.mixed import Interval
from shellmb.forms.steps.path import Path

# equations of velocities with their impulses, and forces in the rows of sub-intervals; None: none
JumpForms = tuple[Form, Form] | None


@dataclass(frozen=True)
class Constraints:
    """Constraints of a body at its nodes, or in the mean: `lambda . Dg dq + dlambda . g`.

    Args:
        law: What must vanish, shape (n,).
        multipliers: Multipliers of order one that a state holds, shape (n,) or a scalar.
        force: Size of their forces; a scalar, or one for each, shape (n,).
        dx: Measure whose points are the places.
        errors: Largest violations on this rank, relative, of some local states, shape (k, dofs).
        inertialess: Whether what is held has no inertia, and so no velocity of its own.
        moving: Whether velocities obey: not those of what has no inertia.
        on: One where a constraint acts, zero where it is off, shape (n,); None: all act.
    """

    law: Law
    multipliers: Callable[[Expr], Expr]
    force: Expr
    dx: ufl.Measure
    errors: Callable[[Floats], Floats] = field(compare=False)
    inertialess: bool = False
    moving: bool = True
    on: Expr | None = None

    def interval(self, span: Interval, dq: Expr) -> Form:
        """Constraint forces of a sub-interval, and the constraints at its end."""
        return self._form(self.law.interval(span, dq), dq)

    def path(self, path: Path, k: int, dq: Expr) -> Form:
        """Forces in row P0 or P1 of a step quadratic in time, and the constraints, (Q4), (Q6)."""
        return self._form(self.law.path(path, k, dq, self.inertialess), dq)

    def velocity(self, v: Expr, mid: Expr, dv: Expr) -> Form | None:
        """Constraints on velocities at the state `mid`, with their impulses; None without any."""
        return self._form(self.law.velocity(v, mid, dv), dv) if self.moving else None

    def jump(self, step: VelocityJump, dq: Expr) -> JumpForms:
        """Constraints on velocities at the end of a step that begins with a jump, eq. (N2)."""
        row = self.law.jump(step, dq) if self.moving else None
        if row is None:
            return None
        impulses = ConstraintRow(row.impulse, row.value, step.jump)
        # of linear constraints there is no force: zero, on the mesh
        forces = [a * row.force[k] for k, a in enumerate(self._of(step.jump))]
        return self._form(impulses, dq), self._weighed(forces) * self.dx

    def _of(self, q: Expr) -> list[Expr]:
        mu = self.multipliers(q)
        return [mu[k] for k in range(mu.ufl_shape[0])] if mu.ufl_shape else [mu]

    def _weighed(self, parts: list[Expr]) -> Expr:
        if not self.force.ufl_shape:
            return self.force * sum(parts[1:], parts[0])
        forced = [self.force[k] * part for k, part in enumerate(parts)]
        return sum(forced[1:], forced[0])

    def _form(self, row: ConstraintRow, dq: Expr) -> Form:
        mu, dmu, count = self._of(row.holder), self._of(dq), row.own.ufl_shape[0]
        parts = [mu[k] * row.own[k] + dmu[k] * row.value[k] for k in range(count)]
        if row.other is not None and row.second is not None:
            others = self._of(row.second)
            parts = [part + others[k] * row.other[k] for k, part in enumerate(parts)]
        if self.on is not None:
            on = [self.on] if not self.on.ufl_shape else [self.on[k] for k in range(len(parts))]
            parts = [
                s * part + (1 - s) * d * m for s, part, d, m in zip(on, parts, dmu, mu, strict=True)
            ]
        return self._weighed(parts) * self.dx
