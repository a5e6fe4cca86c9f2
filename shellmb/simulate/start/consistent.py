"""Velocities made consistent with the constraints: at the start, and where a joint begins to act.

Of all velocities that violate no constraint the nearest one in the metric of the kinetic energy is
taken: `M (v - v0) + Dg^T mu = 0`, `Dg v = 0`. Mechanically that is an impact without restitution,
whose impulses are the multipliers. Schemes whose rows take rates have
them, too, where bodies are linked.
"""

from collections.abc import Callable, Mapping, Sequence

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem

from shellmb.arrays import Floats, Ints
from shellmb.model.body import Body, FixedDofs, added
from shellmb.model.model import Model
from shellmb.preprocessing.bodyfields import (
    NONE,
    body_field,
    dofs_of,
    kinematic_dofs,
    parts_of,
    without_jump,
)
from shellmb.schemes.base import END, Levels
from shellmb.schemes.residuals.residual import velocity_constraint
from shellmb.system.assembly.blocks import BlockSystem
from shellmb.system.direct.linear import Unreduced
from shellmb.system.direct.mumps import ALIKE, new_prefix
from shellmb.system.newton.iteration import Iteration, NewtonSettings
from shellmb.system.newton.solver import NEWTON
from shellmb.system.nullspace.nodes import SystemNodes

# parts that are no motion: multipliers, resultants and assumed strains
FORCES = ("mu", "lam", "hold", "N", "S")

type Pair = tuple[Floats, Floats]
# times the way that a speed at the start carries a body in a step it is no motion of it
FLOWN = 10.0
# an array, some of its places, and what belongs to them
type Pairs = tuple[Floats, Ints, Ints]


def _alike(nodes: SystemNodes, prefix: str) -> Unreduced:
    """Masses beside forces of multipliers: all unknowns, scaled until they are alike."""
    return Unreduced(nodes.system, prefix, ALIKE)


class VelocityProjection:
    """Projects velocities on those that the constraints allow.

    Args:
        model: The bodies.
        levels: Their functions: `q` the state, `rates["v"]` the velocities.
    """

    def __init__(self, model: Model, levels: dict[str, Levels]) -> None:
        self._levels = levels
        self.functions: dict[str, fem.Function] = {}
        numbers = {body.name: k for k, body in enumerate(model.bodies)}
        fields = []
        for body in model.bodies:
            space = body.mixed.space
            unknown = fem.Function(space, name=f"v_{body.name}")
            self.functions[body.name] = unknown
            test = ufl.TestFunction(space)
            at, v = levels[body.name].reference or levels[body.name], levels[body.name].rates["v"]
            rows = (body.inertia(unknown - v, test), velocity_constraint(body, unknown, at.q, test))
            parts, without = parts_of(body, "velocity of {}", ()), without_jump(body)
            row = [added(rows)]
            fields.append(body_field(body, unknown, row, numbers, parts, without=without))
        self._bodies = {b.name: b for b in model.bodies}
        self._held = {b.name: sum(len(f.dofs) for f in b.fixed) for b in model.bodies}
        self._kinematic = {b.name: kinematic_dofs(b) for b in model.bodies}
        self.fields = {f.name: f for f in fields}
        self.system = BlockSystem(model.comm, fields)
        settings, prefix = NewtonSettings(1e-9, 5), new_prefix(self)
        self._newton = NEWTON["newton"](Iteration(self.system, settings, prefix, _alike))

    def take_given(self) -> None:
        """Take velocities from the bodies' functions, those of fixed dofs as given."""
        for name, unknown in self.functions.items():
            v, field = self._levels[name].rates["v"].x.array, self.fields[name]
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
            self._levels[name].rates["v"].x.array[dofs] = unknown.x.array[dofs]

    def nearest(self, rate: Callable[[FixedDofs], Floats]) -> dict[str, Floats]:
        """The nearest consistent velocities by body, in arrays of their own.

        Args:
            rate: Gives the velocities of dofs whose motion is prescribed.
        """
        self.take_given()
        for name, field in self.fields.items():
            held = self._bodies[name].fixed
            given = [rate(f) if f.moving else np.zeros(len(f.dofs)) for f in held]
            field.values[: self._held[name]] = np.concatenate([*given, np.zeros(0)])
        self._newton.solve()
        found = {}
        for name, unknown in self.functions.items():
            body = self._bodies[name]
            # places of joints, too, which have no velocities of their own; velocities without
            # equations are those that nothing ties: they stay
            idle = np.concatenate([NONE, *without_jump(body)])
            dofs = np.setdiff1d(dofs_of(body, body.mixed.dofs.keys() - {*FORCES}), idle)
            found[name] = self._levels[name].rates["v"].x.array.copy()
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

    def __init__(
        self,
        system: BlockSystem,
        fields: Sequence[tuple[Body, Levels, str]],
        rate: str | None = None,
    ) -> None:
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
