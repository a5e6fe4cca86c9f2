"""Forces of potentials and contacts on bodies, and penetrations of points into obstacles."""

from __future__ import annotations

from typing import NamedTuple

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats
from shellmb.model.potentials.contact import ContactGroup, PotentialGroup
from shellmb.observers.forces.impulse import last_middle
from shellmb.observers.forces.reactions import resistance
from shellmb.simulate.simulation import BaseObserver, Simulation
from shellmb.system.assembly.residuals import Residuals

AXES = ("Fx", "Fy", "Fz")
CONTACT = ("normal", "friction")
MOMENTS = ("Mx", "My", "Mz")


class _Loop(NamedTuple):
    """Assembly of the forces of a group at its points.

    Args:
        group: The group.
        loop: The loop.
        place: Place for what it assembles.
    """

    group: PotentialGroup
    loop: Residuals
    place: Floats


class ContactForces(BaseObserver):
    """Forces [N] of potentials and contacts on their bodies, as means over the step.

    Attributes:
        values: Columns of the history: `NAME.Fx` to `NAME.Fz`, NaN before the first step; of
            contacts also `NAME.normal`, `NAME.friction`, sums over the points of what pushes along
            their normals, and size of the sum of what acts across them; `NAME.penetration`, that
            of the deepest point at the end of the step, m; where the obstacle moves with a body
            `NAME.Mx` to `NAME.Mz`, moment on that body about its centre of mass, N m.
    """

    def __init__(self) -> None:
        self.values: dict[str, float] = {}

    def start(self, simulation: Simulation) -> None:
        """Prepare the loops that assemble the forces, and list the columns."""
        problem = simulation.problem
        self._loops = []
        for group in simulation.model.potentials:
            self._loops.append(_Loop(group, *resistance(problem, group.name)))
            names = (*AXES, *(CONTACT if isinstance(group, ContactGroup) else ()))
            names += () if group.seen is None else MOMENTS
            self.values.update({f"{group.item.name}.{name}": float("nan") for name in names})
        self._faces = problem.couplings
        for faces in self._faces:
            names = (*AXES, *CONTACT)
            self.values.update({f"{faces.name}.{name}": float("nan") for name in names})
        self.idle = not self._loops and not self._faces
        self._depths(simulation)

    def solved(self, simulation: Simulation) -> None:
        """Take the forces of the step."""
        for group, loop, place in self._loops:
            middle = last_middle(simulation, group.name)
            place[:] = 0.0
            loop.refresh()
            loop.add(place)
            forces = -place[group.mixed.dofs["u1"]].reshape(-1, 3)
            sums = np.zeros(10)
            sums[:3] = forces.sum(axis=0)
            if isinstance(group, ContactGroup):
                normal, across = group.by_normals(middle, forces)
                sums[3], sums[4:7] = normal.sum(), across.sum(axis=0)
            if group.seen is not None:
                sums[7:] = group.seen.moments(middle, -place, group.mixed).sum(axis=0)
            simulation.model.comm.Allreduce(MPI.IN_PLACE, sums)
            found = [*sums[:4], float(np.linalg.norm(sums[4:7])), *sums[7:]]
            for name, value in zip((*AXES, *CONTACT, *MOMENTS), found, strict=True):
                if f"{group.item.name}.{name}" in self.values:
                    self.values[f"{group.item.name}.{name}"] = float(value)
        for faces in self._faces:
            normal, friction = faces.forces()
            across = friction.sum(axis=0)
            whole = [*(normal.sum(axis=0) + across), np.linalg.norm(normal, axis=1).sum()]
            whole.append(np.linalg.norm(across))
            for name, value in zip((*AXES, *CONTACT), whole, strict=True):
                self.values[f"{faces.name}.{name}"] = float(value)

    def accepted(self, simulation: Simulation) -> None:
        """Take the penetrations."""
        self._depths(simulation)

    def _depths(self, simulation: Simulation) -> None:
        for group, *_ in self._loops:
            if isinstance(group, ContactGroup):
                x = group.seen_positions(simulation.problem.levels[group.name].q.x.array)
                depth = float(np.max(group.penetrations(x), initial=0.0))
                depth = simulation.model.comm.allreduce(depth, op=MPI.MAX)
                self.values[f"{group.item.name}.penetration"] = depth
        for faces in self._faces:
            self.values[f"{faces.name}.penetration"] = faces.depth()

    def measure(self) -> dict[str, float]:
        """Columns of the history."""
        return dict(self.values)
