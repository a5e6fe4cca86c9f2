"""Impulses of point forces, which act on nodes and so need no forms."""

from __future__ import annotations

from mpi4py import MPI

import numpy as np
import numpy.typing as npt

from shellmb.model.places import local_nodes
from shellmb.scene import PointForce
from shellmb.schemes.base import load_average
from shellmb.simulate.simulation import Simulation

Floats = npt.NDArray[np.float64]


class PointImpulse:
    """Impulse and moment of impulse about the origin of the scene's point forces over a step.

    Args:
        simulation: The simulation.

    Attributes:
        forces: The point forces with the names of their shells and the nodes this rank owns.
    """

    def __init__(self, simulation: Simulation) -> None:
        self.forces: list[tuple[PointForce, str, npt.NDArray[np.int32]]] = []
        for load in simulation.scene.loads:
            if not isinstance(load, PointForce):
                continue
            (shell,) = simulation.scene.shells_of(load)
            body = simulation.model.shells[shell.name]
            nodes = local_nodes(body, load.point, "point force")
            owned = nodes[nodes < body.mixed.subspaces["u"].dofmap.index_map.size_local]
            self.forces.append((load, shell.name, owned))

    def impulse(self, simulation: Simulation) -> dict[str, Floats]:
        """Impulses of the step just solved, by the kind of momentum, each of shape (3,)."""
        problem, step = simulation.problem, simulation.last
        assert step is not None
        total = np.zeros((2, 3))
        for load, shell, nodes in self.forces:
            factor = load_average(
                simulation.scheme,
                problem.last,
                lambda t, function=load.time: problem.start_factor(t, function),  # type: ignore[misc]
                step.t,
                step.dt,
            )
            force = step.dt * factor * np.asarray(load.force)
            for arm in self._mid_positions(simulation, shell, nodes):
                total += np.array([force, np.cross(arm, force)])
        simulation.model.comm.Allreduce(MPI.IN_PLACE, total)
        return {"momentum": total[0], "angular momentum": total[1]}

    def _mid_positions(
        self, simulation: Simulation, shell: str, nodes: npt.NDArray[np.int32]
    ) -> Floats:
        """Mid-point positions of nodes over the last stage of the step, shape (n, 3)."""
        problem, body = simulation.problem, simulation.model.shells[shell]
        levels, stages = problem.levels[shell], simulation.scheme.stages
        before = levels.unknown[stages[-2]] if len(stages) > 1 else levels.q
        mean = (before.x.array + levels.unknown[problem.last].x.array) / 2
        return np.asarray(
            body.mixed.nodes("u")[nodes] + mean[body.mixed.dofs["u"]].reshape(-1, 3)[nodes]
        )
