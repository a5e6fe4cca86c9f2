"""Velocities and positions made consistent with the constraints: projected, and relaxed.

Velocities are made so at the start, and where a joint begins to act. Of all velocities that violate
no constraint the nearest one in the metric of the kinetic energy is taken: `M (v - v0) + Dg^T mu =
0`, `Dg v = 0`. Mechanically that is an impact without restitution, whose impulses are the
multipliers. Schemes whose rows take rates have them, too, where bodies are linked.

Positions are made so before the first step: bodies are moved so that joints close, or into static
equilibrium. Both are steps of the same relaxation, `M (q - q0)/tau^2 + F(q) = p` with all
constraints at `q`. A single one without loads moves the bodies as little as possible, in the metric
of the mass, and barely deforms them. Many of them with growing `tau` lead to a stable equilibrium,
also of a mechanism whose stiffness is singular until it carries its load.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import Protocol

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import ufl
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.arrays import Floats, Ints
from shellmb.errors import ConvergenceError
from shellmb.model.body import Body, FixedDofs, LoadFactors, Rates, TimeFunction, added
from shellmb.model.model import Model
from shellmb.preprocessing.bodyfields import (
    NONE,
    body_field,
    dofs_of,
    kinematic_dofs,
    parts_of,
    relative_size,
    residual_terms,
    without_jump,
)
from shellmb.schemes.base import END, Levels
from shellmb.schemes.interval import at_state
from shellmb.schemes.residuals.residual import sub_forces, velocity_constraint
from shellmb.schemes.residuals.rows import Span
from shellmb.system.assembly.blocks import BlockSystem
from shellmb.system.assembly.fields import DependentFunctions, Field
from shellmb.system.direct.linear import Unreduced
from shellmb.system.direct.mumps import ALIKE
from shellmb.system.newton.solver import newton_alone

# parts that are no motion: multipliers, resultants and assumed strains
FORCES = ("mu", "lam", "hold", "N", "S")

type Pair = tuple[Floats, Floats]
# times the way that a speed at the start carries a body in a step it is no motion of it
FLOWN = 10.0
# an array, some of its places, and what belongs to them
type Pairs = tuple[Floats, Ints, Ints]


# a body, its functions, and a stage
type Staged = tuple[Body, Levels, str]


class Instant:
    """A solution for all bodies at an instant, read as a `Problem` is.

    Args:
        model: The bodies.
        levels: Their functions.
        kind: What is solved for, in names of functions.

    Attributes:
        functions: Functions of the solution by body.
        system: The block system; its reactions are the forces that hold and move fixed unknowns.
        fields: Its fields, one for each body.
        last: Name of the only stage.
    """

    system: BlockSystem
    fields: list[Field]
    last = END

    def __init__(self, model: Model, levels: dict[str, Levels], kind: str) -> None:
        self.model, self.levels = model, levels
        spaces = {body.name: body.mixed.space for body in model.bodies}
        self.functions = {n: fem.Function(s, name=f"{kind}_{n}") for n, s in spaces.items()}
        self.numbers = {name: k for k, name in enumerate(spaces)}

    def number(self, body: str, stage: str) -> int:
        """Number of a body's field in the system."""
        return self.numbers[body]

    def state(self, body: str) -> fem.Function:
        """Function that holds what is solved for of a body: rates, and forces or impulses."""
        return self.functions[body]

    def unknown(self, body: str) -> list[fem.Function]:
        """That function."""
        return [self.functions[body]]

    def hold(self, value: Callable[[FixedDofs], Floats]) -> None:
        """Give fixed dofs their values.

        Args:
            value: Gives those of dofs whose motion is prescribed; others are zero.
        """
        for body, field in zip(self.model.bodies, self.fields, strict=True):
            given = [value(f) if f.moving else np.zeros(len(f.dofs)) for f in body.fixed]
            values = np.concatenate([*given, np.zeros(0)])
            field.values[: len(values)] = values


class VelocityProjection(Instant):
    """Projects velocities on those that the constraints allow.

    Args:
        model: The bodies.
        levels: Their functions: `q` the state, `rates["v"]` the velocities.
    """

    def __init__(self, model: Model, levels: dict[str, Levels]) -> None:
        super().__init__(model, levels, "v")
        self.fields = []
        for body in model.bodies:
            unknown, test = self.functions[body.name], ufl.TestFunction(body.mixed.space)
            at, v = levels[body.name].reference or levels[body.name], levels[body.name].rates["v"]
            rows = (body.inertia(unknown - v, test), velocity_constraint(body, unknown, at.q, test))
            parts, without = parts_of(body, "velocity of {}", ()), without_jump(body)
            row = [added(rows)]
            field = body_field(body, unknown, row, self.numbers, parts, without=without)
            self.fields.append(field)
        self._held = {b.name: sum(len(f.dofs) for f in b.fixed) for b in model.bodies}
        self._kinematic = {b.name: kinematic_dofs(b) for b in model.bodies}
        self.system = BlockSystem(model.comm, self.fields)
        # masses beside forces of multipliers: all unknowns, scaled until they are alike
        self._newton = newton_alone(
            self, self.system, 5, lambda nodes, prefix: Unreduced(nodes.system, prefix, ALIKE)
        )

    def take_given(self) -> None:
        """Take velocities from the bodies' functions, those of fixed dofs as given."""
        for (name, unknown), field in zip(self.functions.items(), self.fields, strict=True):
            v = self.levels[name].rates["v"].x.array
            unknown.x.array[:] = 0.0
            unknown.x.array[self._kinematic[name]] = v[self._kinematic[name]]
            held = self._held[name]
            field.values[:held] = v[field.fixed[:held]]

    def given(self) -> dict[str, fem.Function]:
        """Velocities as they are, at nodes that are linked to other bodies, too; collective."""
        self.take_given()
        arrays = []
        for field in self.system.fields:
            arrays.append(field.function.x.array.copy())
            for link in field.links:
                arrays[-1][link.dofs] = np.nan
        self.system.x.array[:] = self.system.global_values(arrays, known=True)
        self.system.scatter(self.system.x)
        return self.functions

    def project(self) -> None:
        """Replace the velocities by the nearest consistent ones; fixed dofs keep theirs."""
        self.take_given()
        self._newton.solve()
        for name, unknown in self.functions.items():
            dofs = self._kinematic[name]
            self.levels[name].rates["v"].x.array[dofs] = unknown.x.array[dofs]

    def nearest(self, rate: Callable[[FixedDofs], Floats]) -> dict[str, Floats]:
        """The nearest consistent velocities by body, in arrays of their own.

        Args:
            rate: Gives the velocities of dofs whose motion is prescribed.
        """
        self.take_given()
        self.hold(rate)
        self._newton.solve()
        found = {}
        for body, (name, unknown) in zip(self.model.bodies, self.functions.items(), strict=True):
            # places of joints, too, which have no velocities of their own; velocities without
            # equations are those that nothing ties: they stay
            idle = np.concatenate([NONE, *without_jump(body)])
            dofs = np.setdiff1d(dofs_of(body, body.mixed.dofs.keys() - {*FORCES}), idle)
            found[name] = self.levels[name].rates["v"].x.array.copy()
            found[name][dofs] = unknown.x.array[dofs]
        return found


class Arrays:
    """Arrays of a body's functions, which DOLFINx looks up anew whenever it is asked.

    Args:
        levels: The functions.
    """

    def __init__(self, levels: Levels) -> None:
        self.q = levels.q.x.array
        self.rates, self.unknown, self.scaled = (
            {key: f.x.array for key, f in functions.items()}
            for functions in (levels.rates, levels.unknown, levels.scaled)
        )


class ScaledRates:
    """Fills `scaled` of all levels, that of nodes which are linked to other bodies, too.

    Joints and force elements have no velocities of their own: those of their nodes are the bodies'.
    Schemes that do not scale their rates keep these, and only what is linked is filled.

    Args:
        system: The block system.
        fields: Body, functions and stage of each of its fields.
        rate: One of the rates, of which what is linked is filled; None: `scaled` is.
    """

    def __init__(self, system: BlockSystem, fields: Sequence[Staged], rate: str | None) -> None:
        self._system = system
        # rates and what they fill; of these, where they are unknowns of this rank, and where others
        # link them
        self._filled, self._own, self._linked = list[Pair](), list[Pairs](), list[Pairs]()
        for k, (body, levels, stage) in enumerate(fields):
            if stage not in levels.scaled if rate is None else stage != END:
                continue
            scaled = (levels.scaled[stage] if rate is None else levels.rates[rate]).x.array
            linked = np.concatenate([*(link.dofs for link in body.links), np.zeros(0, np.int32)])
            if len(linked):
                places = int(system.numbering.offsets[k]) + linked
                self._linked.append((scaled, linked, places))
            if not body.kinematic:
                # multipliers have no rates
                continue
            if rate is None:
                self._filled.append((levels.rates[stage].x.array, scaled))
            dofs, numbers = system.owned(k)
            own = ~np.isin(dofs, linked)
            self._own.append((scaled, dofs[own], numbers[own]))
        self._any = bool(system.comm.allreduce(len(self._linked)))

    def take(self, dt: float) -> None:
        """Take the velocities of the bodies; collective.

        Args:
            dt: Length of the step, s.
        """
        for rates, scaled in self._filled:
            np.multiply(rates, dt, out=scaled)
        if not self._any:
            return
        unknowns = np.zeros(self._system.numbering.owned)
        for scaled, dofs, numbers in self._own:
            unknowns[numbers] = scaled[dofs]
        local = self._system.exchange.seen(unknowns)
        for scaled, dofs, places in self._linked:
            scaled[dofs] = local[places]


def flight(bodies: Sequence[Body], levels: Mapping[str, Levels], dt: float) -> float:
    """A distance that no body moves in a step, by its speed at the start, m; collective.

    Args:
        bodies: The bodies.
        levels: Their functions.
        dt: Length of the step, s.
    """
    moving = [b for b in bodies if "u" in b.kinematic]
    speeds = [levels[b.name].rates["v"].x.array[b.mixed.dofs["u"]] for b in moving]
    here = max((float(np.abs(v).max(initial=0.0)) for v in speeds), default=0.0)
    return FLOWN * dt * float(bodies[0].mixed.space.mesh.comm.allreduce(here, op=MPI.MAX))


# equilibrium: least and largest number of steps, growth of tau, and motion in a step at its end
GROWTH, STEPS, AT_REST = 4.0, 60, 1e-10
# Forces hold bodies, and not their masses, where `moved/tau^2` is this part of the largest one, or
# where `tau` is as long as the run, and so many times as long as at first
HELD, LONG = 1e-6, 1e3


class Frame(Protocol):
    """A frame in which a body comes to rest."""

    def rates(self, q: Expr) -> Rates:
        """Absolute velocities at a state at rest in the frame."""
        ...

    def carried(self, q: Expr, dq: Expr) -> Form | None:
        """Virtual work of the inertia forces there; None without any."""
        ...


class Relaxation(Instant):
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
        super().__init__(model, levels, "relaxed")
        self.tau, self.time = tau, time
        self._weights: list[fem.Constant] = []
        self._loads: list[LoadFactors] = []
        self.fields = []
        followers: list[DependentFunctions] = []
        for body in model.bodies:
            space, q = body.mixed.space, levels[body.name].q
            unknown = self.functions[body.name]
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
            field = body_field(body, unknown, forms, self.numbers, parts)
            field = replace(field, terms=residual_terms(terms, [self.numbers[body.name]]))
            self.fields.append(field)
            if sub.states is not None:
                followers.append(DependentFunctions(**vars(sub.states)))
        self.system = BlockSystem(model.comm, self.fields, followers)
        self._newton = newton_alone(self, self.system, 50)

    def step(self, tau: float, factor: float) -> float:
        """One step with a given `tau` and factor of loads; returns the largest motion, relative."""
        for weight in self._weights:
            weight.value = 1 / tau**2  # type: ignore[assignment]

        def average(function: TimeFunction | None) -> float:
            return factor * (1.0 if function is None else float(function(self.time)))

        for loads in self._loads:
            loads.update(average)
        for body, field in zip(self.model.bodies, self.fields, strict=True):
            self.functions[body.name].x.array[:] = self.levels[body.name].q.x.array
            if body.fixed:
                field.values[:] = np.concatenate([f.value(self.time) for f in body.fixed])
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
        tau, fastest, long = self.tau, 0.0, max(self.model.scene.t_end, LONG * self.tau)
        for _ in range(STEPS):
            try:
                moved = self.step(tau, 1.0)
            except ConvergenceError:
                tau /= GROWTH**2
                continue
            fastest = max(fastest, moved / tau**2)
            if moved < AT_REST and (moved <= HELD * fastest * tau**2 or tau >= long):
                return
            tau *= GROWTH
        raise ConvergenceError(
            f"no static equilibrium was reached in {STEPS} steps; something can still move, or "
            "loads are too large; start='given' begins without one"
        )
