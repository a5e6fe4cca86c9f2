"""States before the first step: bodies moved so that joints close, or into static equilibrium.

Both are steps of the same relaxation, `M (q - q0)/tau^2 + F(q) = p` with all constraints at `q`. A
single one without loads moves the bodies as little as possible, in the metric of the mass, and
barely deforms them. Many of them with growing `tau` lead to a stable equilibrium, also of a
mechanism whose stiffness is singular until it carries its load.
"""

from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from typing import Protocol

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import ufl
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.errors import ConvergenceError
from shellmb.model.body import LoadFactors, Rates, TimeFunction
from shellmb.model.model import Model
from shellmb.preprocessing.bodyfields import (
    NONE,
    body_field,
    parts_of,
    relative_size,
    residual_terms,
)
from shellmb.schemes.base import Levels
from shellmb.schemes.interval import at_state
from shellmb.schemes.residuals.residual import sub_forces
from shellmb.schemes.residuals.rows import Span
from shellmb.system.assembly.blocks import BlockSystem
from shellmb.system.assembly.fields import DependentFunctions, Field
from shellmb.system.direct.mumps import new_prefix
from shellmb.system.newton.iteration import Iteration, NewtonSettings
from shellmb.system.newton.solver import NEWTON

# equilibrium: least and largest number of steps, growth of tau, and motion in a step at its end
GROWTH, STEPS, AT_REST = 4.0, 60, 1e-10


class Frame(Protocol):
    """A frame in which a body comes to rest."""

    def rates(self, q: Expr) -> Rates:
        """Absolute velocities at a state at rest in the frame."""
        ...

    def carried(self, q: Expr, dq: Expr) -> Form | None:
        """Virtual work of the inertia forces there; None without any."""
        ...


class Relaxation:
    """Moves the bodies without inertia forces but those of a frame that they come to rest in.

    Args:
        model: The bodies, with masses.
        levels: Their functions; `q` is the state before and after.
        tau: Time that sets how far bodies move in a step, s.
        frames: A moving frame for each body, by name; None: they come to rest in space.
        time: When loads and prescribed motions are taken, s.
        untested: Parts that are not wanted, and do not have to converge.
    """

    def __init__(
        self,
        model: Model,
        levels: dict[str, Levels],
        tau: float,
        frames: Mapping[str, Frame] | None = None,
        time: float = 0.0,
        untested: Collection[str] = (),
    ) -> None:
        self.model, self.levels, self.tau, self.time = model, levels, tau, time
        self.functions: dict[str, fem.Function] = {}
        self._weights: list[fem.Constant] = []
        self._loads: list[LoadFactors] = []
        numbers = {body.name: k for k, body in enumerate(model.bodies)}
        fields: list[Field] = []
        followers: list[DependentFunctions] = []
        for body in model.bodies:
            space, q = body.mixed.space, levels[body.name].q
            unknown = fem.Function(space, name=f"relaxed_{body.name}")
            self.functions[body.name] = unknown
            test = ufl.TestFunction(space)
            weight = fem.Constant(space.mesh, 1.0)
            self._weights.append(weight)
            sub = Span(at_state(unknown), [unknown], 0)
            internal, terms = sub_forces(body, sub, test, ufl.TrialFunction(space))
            forms = [body.inertia(weight * (unknown - q), test), internal]
            # what the user's terms and motors do to a body at rest
            rest, now = fem.Function(space), fem.Constant(space.mesh, time)
            frame = frames[body.name] if frames is not None else None
            rates = Rates(rest, rest) if frame is None else frame.rates(unknown)
            extra = body.applied(unknown, rates, test, now)
            forms.append(None if extra is None else -extra)
            forms.append(None if frame is None else frame.carried(unknown, test))
            loads = body.loads()
            if loads is not None:
                self._loads.append(loads)
                work = loads.virtual_work(unknown, test)
                forms.append(None if work is None else -work)
            parts = parts_of(body, "{}", {p.name for p in body.parts} - {*untested})
            field = body_field(body, unknown, forms, numbers, parts)
            fields.append(replace(field, terms=residual_terms(terms, [numbers[body.name]])))
            if sub.states is not None:
                followers.append(DependentFunctions(**vars(sub.states)))
        self._fields = {f.name: f for f in fields}
        self.system = BlockSystem(model.comm, fields, followers)
        self._newton = NEWTON["newton"](
            Iteration(self.system, NewtonSettings(1e-9, 50), new_prefix(self))
        )

    def step(self, tau: float, factor: float) -> float:
        """One step with a given `tau` and factor of loads; returns the largest motion, relative."""
        for weight in self._weights:
            weight.value = 1 / tau**2  # type: ignore[assignment]

        def average(function: TimeFunction | None) -> float:
            return factor * (1.0 if function is None else float(function(self.time)))

        for loads in self._loads:
            loads.update(average)
        for body in self.model.bodies:
            self.functions[body.name].x.array[:] = self.levels[body.name].q.x.array
            if body.fixed:
                given = np.concatenate([f.value(self.time) for f in body.fixed])
                self._fields[body.name].values[:] = given
        self._newton.solve()
        moved = 0.0
        for body in self.model.bodies:
            q, unknown = self.levels[body.name].q.x.array, self.functions[body.name].x.array
            moved = max(moved, relative_size(body, unknown - q))
            q[:] = unknown
        return float(self.model.comm.allreduce(moved, op=MPI.MAX))

    def joined(self) -> tuple[float, str]:
        """Give joints the places of the nodes that they are at; collective.

        Returns:
            How far nodes of two bodies that are one are apart, relative to their scales, and a body
            that has them.
        """
        fields = self.system.fields
        self.system.join([self.levels[field.name].q.x.array.copy() for field in fields])
        worst, mechanism = (0.0, ""), {body.name for body in self.model.mechanism.bodies}
        for body in self.model.bodies:
            q, joined = self.levels[body.name].q.x.array, self.functions[body.name].x.array
            if body.kinematic and body.name not in mechanism:
                worst = max(worst, (relative_size(body, joined - q), body.name))
            linked = np.concatenate([NONE, *(link.dofs for link in body.links)])
            q[linked] = joined[linked]
        return max(self.model.comm.allgather(worst))

    def tangent(self, columns: bool = False) -> PETSc.Mat:
        """Derivative of the forces at the state without `M/tau^2`, as eigenproblems need it.

        Args:
            columns: Whether those of fixed dofs stay.
        """
        for weight in self._weights:
            weight.value = 0.0  # type: ignore[assignment]
        return self.system.symmetric_matrix(None, 0.0 if columns else 1.0, columns)

    def forces(self, factor: Callable[[TimeFunction | None], float]) -> Floats:
        """Forces at the state by all unknowns, without those of `M/tau^2`, shape (unknowns,).

        Args:
            factor: Factor of each load by its function of time.
        """
        for weight in self._weights:
            weight.value = 0.0  # type: ignore[assignment]
        for loads in self._loads:
            loads.update(factor)
        self.system.gather()
        self.system.residuals.refresh()
        found = self.system.b.duplicate()
        self.system.evaluate(self.system.x, found)
        return np.asarray(found.array.copy())

    def assemble(self) -> None:
        """Move the bodies so that all constraints hold.

        Raises:
            ConvergenceError: If there is no such position near by.
        """
        try:
            self.step(self.tau, 0.0)
        except ConvergenceError as error:
            raise error.reworded(
                "the bodies cannot be assembled: no position near the given one closes all joints; "
                f"check their places and lengths ({error})"
            ) from error

    def equilibrium(self) -> None:
        """Move the bodies into static equilibrium under the loads at the time zero.

        Raises:
            ConvergenceError: If none is reached.
        """
        tau = self.tau
        for _ in range(STEPS):
            try:
                moved = self.step(tau, 1.0)
            except ConvergenceError:
                tau /= GROWTH**2
                continue
            if moved < AT_REST:
                return
            tau *= GROWTH
        raise ConvergenceError(
            f"no static equilibrium was reached in {STEPS} steps; something can still move, or "
            "loads are too large; start='given' begins without one"
        )
