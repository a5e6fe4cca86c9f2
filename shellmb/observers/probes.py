"""Probes: one number each at a node over time."""

from __future__ import annotations

from mpi4py import MPI

import numpy as np
import numpy.typing as npt

from shellmb.model.places import local_nodes
from shellmb.observers.nodal import nodal_values
from shellmb.scene import Probe
from shellmb.simulate.simulation import Silent, Simulation

UNITS = {"displacement": "m", "position": "m", "velocity": "m/s", "director": "-"}


class Probes(Silent):
    """Records the probes of the scene, the same on all ranks.

    Attributes:
        values: Value of each probe at the current time, by its name.
    """

    def __init__(self) -> None:
        self.values: dict[str, float] = {}

    def start(self, simulation: Simulation) -> None:
        """Find the nodes and take the values at the start.

        Raises:
            SceneError: If there is no node at a probe's point.
        """
        self._probes: list[tuple[Probe, str, npt.NDArray[np.int32]]] = []
        counts = []
        for probe in simulation.scene.probes:
            (shell,) = simulation.scene.shells_of(probe)
            body = simulation.model.shells[shell.name]
            nodes = local_nodes(body, probe.point, f"probe '{probe.name}'")
            # each node counts once, on the rank that owns it
            nodes = nodes[nodes < body.mixed.subspaces["u"].dofmap.index_map.size_local]
            self._probes.append((probe, shell.name, nodes))
            counts.append(len(nodes))
        self._counts = np.array(counts, dtype=float)
        simulation.model.comm.Allreduce(MPI.IN_PLACE, self._counts)
        self._measure(simulation)

    def accepted(self, simulation: Simulation) -> None:
        """Take the values."""
        self._measure(simulation)

    def _measure(self, simulation: Simulation) -> None:
        if not self._probes:
            return
        shells = {
            shell: nodal_values(simulation, shell)
            for shell in dict.fromkeys(shell for _, shell, _ in self._probes)
        }
        vectors = np.array(
            [
                getattr(shells[shell], probe.quantity)[nodes].sum(axis=0)
                for probe, shell, nodes in self._probes
            ]
        )
        simulation.model.comm.Allreduce(MPI.IN_PLACE, vectors)
        vectors /= self._counts[:, None]
        for (probe, _, _), vector in zip(self._probes, vectors, strict=True):
            value = np.linalg.norm(vector) if probe.component == "norm" else vector[probe.component]
            self.values[probe.name] = float(value)

    def measure(self) -> dict[str, float]:
        """Columns of the history."""
        return dict(self.values)
