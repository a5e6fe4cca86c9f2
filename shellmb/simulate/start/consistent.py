"""Velocities made consistent with the constraints: at the start, and where a joint begins to act.

Of all velocities that violate no constraint the nearest one in the metric of the kinetic energy is
taken: `M (v - v0) + Dg^T mu = 0`, `Dg v = 0`. Mechanically that is an impact without restitution,
whose impulses are the multipliers.
"""

from collections.abc import Callable

import numpy as np
import ufl
from dolfinx import fem

from shellmb.arrays import Floats
from shellmb.model.body import FixedDofs, added
from shellmb.model.model import Model
from shellmb.preprocessing.bodyfields import (
    NONE,
    body_field,
    dofs_of,
    kinematic_dofs,
    parts_of,
    without_jump,
)
from shellmb.schemes.base import Levels
from shellmb.schemes.residuals.residual import velocity_constraint
from shellmb.system.assembly.blocks import BlockSystem
from shellmb.system.direct.linear import Unreduced
from shellmb.system.direct.mumps import ALIKE, new_prefix
from shellmb.system.newton.iteration import Iteration, NewtonSettings
from shellmb.system.newton.solver import NEWTON
from shellmb.system.nullspace.nodes import SystemNodes

# parts that are no motion: multipliers, resultants and assumed strains
FORCES = ("mu", "lam", "hold", "N", "S")


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
            given = [
                rate(f) if f.moving else np.zeros(len(f.dofs)) for f in self._bodies[name].fixed
            ]
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
