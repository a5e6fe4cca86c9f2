"""Forces of potentials and contacts on bodies, and penetrations of points into obstacles."""

from collections.abc import Sequence
from typing import Any

from mpi4py import MPI

import numpy as np

from shellmb.observers.columns import KeptColumns
from shellmb.observers.forces.impulse import last_middle
from shellmb.observers.forces.reactions import resistance
from shellmb.simulate.simulation import Simulation

AXES = ("Fx", "Fy", "Fz")
CONTACT = ("normal", "friction")
MOMENTS = ("Mx", "My", "Mz")


class ContactForces(KeptColumns):
    """Forces [N] of potentials and contacts on their bodies, as means over the step.

    Columns are `NAME.Fx` to `NAME.Fz`, NaN before the first step; of contacts also `NAME.normal`,
    `NAME.friction`, sums over the points of what pushes along their normals, and size of the sum of
    what acts across them; `NAME.penetration`, that of the deepest point at the end of the step, m;
    where the obstacle moves with a body `NAME.Mx` to `NAME.Mz`, moment on that body about its
    centre of mass, N m.
    """

    def start(self, simulation: Simulation) -> None:
        """Prepare the loops that assemble the forces, and list the columns."""
        problem = simulation.problem
        groups = simulation.model.potentials
        self._groups = [(g, resistance(problem, [(g.name, problem.last)])) for g in groups]
        for group, _ in self._groups:
            names = (*AXES, *(CONTACT if group in simulation.model.contacts else ()))
            names += () if group.seen is None else MOMENTS
            self.values.update({f"{group.item.name}.{name}": float("nan") for name in names})
        self._faces = problem.couplings
        for faces in self._faces:
            names = (*AXES, *CONTACT)
            self.values.update({f"{faces.name}.{name}": float("nan") for name in names})
        self.idle = not self._groups and not self._faces
        self._depths(simulation)

    def solved(self, simulation: Simulation) -> None:
        """Take the forces of the step."""
        for group, works in self._groups:
            middle, work = last_middle(simulation, group.name), works()
            forces = -work[group.mixed.dofs["u1"]].reshape(-1, 3)
            sums = np.zeros(10)
            sums[:3] = forces.sum(axis=0)
            normal, across = group.by_normals(middle, forces)
            sums[3], sums[4:7] = normal.sum(), across.sum(axis=0)
            if group.seen is not None:
                sums[7:] = group.seen.moments(middle, -work, group.mixed).sum(axis=0)
            simulation.model.comm.Allreduce(MPI.IN_PLACE, sums)
            self._put(group.item.name, [*sums[:4], np.linalg.norm(sums[4:7]), *sums[7:]])
        for faces in self._faces:
            normal, friction = faces.forces()
            across = friction.sum(axis=0)
            whole = [*(normal.sum(axis=0) + across), np.linalg.norm(normal, axis=1).sum()]
            whole.append(np.linalg.norm(across))
            self._put(faces.name, whole)

    def _put(self, who: str, found: Sequence[Any]) -> None:
        """Put those numbers into their columns that there are columns of."""
        for name, value in zip((*AXES, *CONTACT, *MOMENTS), found, strict=False):
            if f"{who}.{name}" in self.values:
                self.values[f"{who}.{name}"] = float(value)

    def accepted(self, simulation: Simulation) -> None:
        """Take the penetrations."""
        self._depths(simulation)

    def _depths(self, simulation: Simulation) -> None:
        for group in simulation.model.contacts:
            x = group.seen_positions(simulation.problem.levels[group.name].q.x.array)
            depth = float(np.max(group.penetrations(x), initial=0.0))
            depth = simulation.model.comm.allreduce(depth, op=MPI.MAX)
            self.values[f"{group.item.name}.penetration"] = depth
        for faces in self._faces:
            self.values[f"{faces.name}.penetration"] = faces.depth()
