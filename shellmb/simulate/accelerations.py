"""Accelerations that solve the equations of motion of a state, with its constraints.

`M a + Dg^T mu = p - f(q, v)` with `Dg a = -D(Dg v) v`: the system of index 1. Schemes that keep
accelerations begin with them, and begin again where velocities jump.
"""

from __future__ import annotations

from collections.abc import Callable

import ufl
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.model.body import Body, FixedDofs, LoadFactors, Rates, TimeFunction
from shellmb.model.model import Model
from shellmb.schemes.base import Levels, Values, at_state
from shellmb.simulate.consistent import VelocityProjection
from shellmb.simulate.pushes import Pushes

# part of the step by which second differences of prescribed motions are taken: of third order
PART = 0.05


class Accelerations(VelocityProjection):
    """Solves for them.

    Args:
        model: The bodies.
        levels: Their functions: `q` the state, `rates["v"]` its velocities.
        factor: Factor of a load with a time function at a time.
    """

    title = "acceleration"

    def __init__(
        self,
        model: Model,
        levels: dict[str, Levels],
        factor: Callable[[float, TimeFunction | None], float],
    ) -> None:
        self._factor = factor
        self._loads: list[LoadFactors] = []
        self._times: list[fem.Constant] = []
        # velocities of all that the forms see, those of linked nodes, too
        self._moving = {
            body.name: Levels(
                levels[body.name].q,
                levels[body.name].rates,
                {},
                push=fem.Function(body.mixed.space, name=f"velocity_{body.name}"),
            )
            for body in model.bodies
        }
        super().__init__(model, levels)
        fields = [(self._moving[body.name], True) for body in model.bodies]
        self._pushes = Pushes(self.system, fields, [body.links for body in model.bodies])

    def rows(self, body: Body, unknown: fem.Function, test: Expr) -> list[Form | None]:
        """Equations of motion and of the constraints' second derivative in time."""
        q, v = self._moving[body.name].q, self._moving[body.name].push
        assert v is not None
        found = [
            body.inertia(unknown, test),
            body.internal(at_state(q), test),
            body.velocity_constraint(unknown, q, test),
        ]
        allowed = body.velocity_constraint(v, q, test)
        if allowed is not None:
            found.append(ufl.derivative(allowed, q, v))
        time = fem.Constant(body.mixed.space.mesh, 0.0)
        loads = body.loads()
        work = None if loads is None else loads.virtual_work(q, test)
        if loads is not None:
            self._loads.append(loads)
        self._times.append(time)
        acting = [work, body.extra(q, Rates(v, v), test, time)]
        return found + [None if form is None else -form for form in acting]

    def take(self, t: float, dt: float) -> None:
        """Give the bodies their accelerations at a time; collective.

        Args:
            t: Time, s.
            dt: Length of the next step, s.
        """
        for time in self._times:
            time.value = t  # type: ignore[assignment]
        for loads in self._loads:
            loads.update(lambda function: self._factor(t, function))
        self._pushes.take(1.0)
        for body in self._bodies.values():
            self.functions[body.name].x.array[:] = 0.0
            first = 0
            for fixed in body.fixed:
                last = first + len(fixed.dofs)
                self.fields[body.name].values[first:last] = _second_rate(fixed, t, PART * dt)
                first = last
        self._newton.solve()
        for name, found in self.functions.items():
            dofs, rates = self._kinematic[name], self._levels[name].rates
            for rate in ("a", "acceleration"):
                rates[rate].x.array[dofs] = found.x.array[dofs]


def _second_rate(fixed: FixedDofs, t: float, h: float) -> Values | float:
    """Second derivative of a prescribed motion, shape (n,); one-sided."""
    if not fixed.moving:
        return 0.0
    weights = (35, -104, 114, -56, 11)
    return sum(w * fixed.value(t + k * h) for k, w in enumerate(weights)) / (12 * h**2)
