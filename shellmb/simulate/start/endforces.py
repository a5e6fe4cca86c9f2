"""Accelerations and constraint forces at an instant: for the report, and to start with.

What a scheme solves for are means over a step. Forces at an instant follow from the state there, by
the equations of motion with the constraints differentiated twice (index 1):

    M a + f_int(q) + Dg(q)^T lambda = f_ext,        Dg(q) a = -D2g(q)(v, v)

with `a` given where a motion prescribes it. They are reported at the end of a step, and schemes
that keep accelerations begin with them, also where velocities jump. Their order is that of the
state. The velocities are the nearest ones that the constraints allow: those of EP and ED are not.
Resultants are taken anew from the strains at the end, so nothing is needed of how a scheme averages
stresses.
"""

from collections.abc import Callable

import numpy as np
import ufl
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.model.body import Body, Rates, added
from shellmb.preprocessing.bodyfields import (
    body_field,
    dofs_of,
    kinematic_dofs,
    parts_of,
    without_jump,
)
from shellmb.schemes.base import at_state, end_acceleration, end_velocity
from shellmb.schemes.residuals.residual import Sample, interval_forces, velocity_constraint
from shellmb.simulate.problem import Problem
from shellmb.simulate.start.consistent import Instant
from shellmb.system.assembly.blocks import BlockSystem
from shellmb.system.assembly.fields import Field
from shellmb.system.newton.solver import newton_alone

# what belongs to the strains of a state: resultants and assumed strains
STRESSES = ("N", "S")


class EndForces(Instant):
    """Solves for accelerations and multipliers.

    Args:
        problem: The problem whose steps are looked at.

    Attributes:
        velocity: Functions that hold the velocities by body, the nearest ones that constraints
            allow.
    """

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem.model, problem.levels, "end")
        self._problem, bodies = problem, problem.model.bodies
        self.velocity = {
            b.name: fem.Function(b.mixed.space, name=f"v_end_{b.name}") for b in bodies
        }
        self._samples: list[Sample] = []
        self._following: list[Callable[[], None]] = []
        self.fields = [self._field(body) for body in self.model.bodies]
        self.system = BlockSystem(self.model.comm, self.fields)
        self._newton = newton_alone(self, self.system, 20)
        for body in self.model.bodies:
            # a guess of resultants and assumed strains; then that of the step before serves
            here, q = dofs_of(body, _stresses(body)), self.levels[body.name].q
            self.functions[body.name].x.array[here] = q.x.array[here]

    def solve(self, t: float, dt: float) -> None:
        """Take the state that was accepted last.

        Args:
            t: Its time, s.
            dt: Length of the step that led there, s; negative: of that which leads on, where
                prescribed motions are known only behind it.

        Raises:
            ConvergenceError: If accelerations do not follow, as of parts without inertia.
        """
        begin = t - dt
        found = self._problem.projection.nearest(lambda f: end_velocity(f.value, begin, dt))
        for name, velocity in self.velocity.items():
            velocity.x.array[:] = found[name]
        self.hold(lambda f: end_acceleration(f.value, begin, dt))
        for sample in self._samples:
            sample.update(begin, dt, self._problem.start_factor)
        for follow in self._following:
            follow()
        self._newton.solve()

    def _field(self, body: Body) -> Field:
        """Equations of one body."""
        name, space = body.name, body.mixed.space
        unknown, v, q = self.functions[name], self.velocity[name], self.levels[name].q
        dq = ufl.TestFunction(space)
        sample = Sample(
            q, Rates(v, v), body.loads(), ((1.0, 1.0),), fem.Constant(space.mesh, 0.0), 1.0
        )
        self._samples.append(sample)
        following = None if body.damping is None else body.damping.following(q, v)
        if following is not None:
            self._following.append(following)
        branches = self._problem.branches.get(name, ())
        self._following += [own.follow for own in branches]
        rate = velocity_constraint(body, v, q, dq)
        # multipliers of the velocities are zero: what is left is the constraints' own second rate
        turned = None if rate is None else ufl.derivative(rate, q, v)
        acting = [sample.of_loads(dq), sample.of_terms(body, dq)]
        holds = body in self._problem.model.constraint_groups
        forms: list[Form | None] = [
            body.inertia(unknown, dq),
            velocity_constraint(body, unknown, q, dq),
            turned,
            None if holds else _internal(body, q, unknown, dq),
            None if body.damping is None else body.damping.at(q, v, dq),
            *(own.held(q, dq) for own in branches),
            *(None if form is None else -form for form in acting),
        ]
        stresses = dofs_of(body, _stresses(body))
        idle = [d[~np.isin(d, stresses)] for d in without_jump(body)]
        # the others are linear in them: they are exact when these are
        parts = parts_of(body, "{} at the end of the step", STRESSES, "a smaller step")
        row = [added(forms)]
        return body_field(body, unknown, row, self.numbers, parts, without=idle)


def begin_accelerations(
    problem: Problem, forces: Callable[[], EndForces], t: float, dt: float
) -> None:
    """Begin the accelerations that a scheme keeps with those of the equations of motion.

    Args:
        problem: Its scheme may keep such rates or not.
        forces: Makes what solves for accelerations, if that is needed.
        t: Time, s.
        dt: As of `EndForces.solve`.
    """
    kept = problem.scheme.accelerations
    if not kept:
        return
    found = forces()
    found.solve(t, dt)
    for body in problem.model.bodies:
        dofs, rates = kinematic_dofs(body), problem.levels[body.name].rates
        for rate in kept:
            rates[rate].x.array[dofs] = found.state(body.name).x.array[dofs]


def _stresses(body: Body) -> list[str]:
    """Parts that follow from the strains of a state: not what holds strains at zero."""
    return [p for p in STRESSES if p in body.mixed.elementwise]


def _internal(body: Body, q: fem.Function, unknown: fem.Function, dq: Expr) -> Form | None:
    """Internal forces at a state, their resultants being unknown there, too."""
    size = ufl.shape(q)[0]
    owner: list[Expr] = [q[k] for k in range(size)]
    for name, (first, count) in body.mixed.parts.items():
        for k in range(first, first + count):
            if name in _stresses(body):
                owner[k] = unknown[k]
            elif name in ("lam", "hold"):
                # forces of the nodes' constraints are those of accelerations
                owner[k] = ufl.as_ufl(0.0)
    state = ufl.as_vector(owner)
    return interval_forces(body, at_state(state), dq)
