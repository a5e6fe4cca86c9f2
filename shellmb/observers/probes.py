"""Probes: one number each at a node, or a point of a rigid body, over time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

from mpi4py import MPI

import numpy as np
import numpy.typing as npt

from shellmb.model.places import local_nodes
from shellmb.observers.nodal import Nodes
from shellmb.observers.resultants import RESULTANTS, Resultants, has_resultants
from shellmb.scene import Probe, RigidBody
from shellmb.simulate.simulation import Silent, Simulation

Floats = npt.NDArray[np.float64]

UNITS = {
    "displacement": "m",
    "position": "m",
    "velocity": "m/s",
    "director": "-",
    "rotation": "rad",
    "angular_velocity": "rad/s",
    "force": "N",
    "moment": "N m",
    "membrane": "N/m",
    "bending": "N",
    "shear": "N/m",
}


@dataclass(frozen=True)
class _Spot:
    """Where a probe is.

    Args:
        probe: The probe.
        body: Name of the body in the system.
        nodes: Nodes on this rank, each on one rank only; of resultants, all that this rank knows.
        values: Their values.
        offset: Place of a rigid body's point along its directors, shape (3,), m; None at nodes.
    """

    probe: Probe
    body: str
    nodes: npt.NDArray[np.int32]
    values: Nodes
    offset: Floats | None


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
        self._spots = [self._spot(simulation, probe) for probe in simulation.scene.probes]
        bodies = [s.body for s in self._spots if s.probe.quantity in RESULTANTS]
        self._resultants = {
            name: Resultants(simulation, simulation.model.meshed[name])
            for name in dict.fromkeys(bodies)
        }
        self._measure(simulation)

    @staticmethod
    def _spot(simulation: Simulation, probe: Probe) -> _Spot:
        model = simulation.model
        (described,) = model.scene.bodies_of(probe)
        if described.name not in model.meshed:
            rigid = model.rigid
            assert rigid is not None and isinstance(described, RigidBody)
            number = rigid.index[described.name]
            node = rigid.bodies[number]
            offset = node.directors @ (described.place(cast(Any, probe.point)) - node.center)
            here = np.flatnonzero(rigid.node_mesh.item == number).astype(np.int32)
            return _Spot(probe, rigid.name, here, Nodes(rigid, here), np.asarray(offset))
        body = model.meshed[described.name]
        nodes = local_nodes(body, probe.point, f"probe '{probe.name}'")
        if not has_resultants(body, probe.quantity):
            # each node counts once, on the rank that owns it
            nodes = nodes[nodes < body.mixed.subspaces["u"].dofmap.index_map.size_local]
        return _Spot(probe, body.name, nodes, Nodes(body, nodes), None)

    def accepted(self, simulation: Simulation) -> None:
        """Take the values."""
        self._measure(simulation)

    def _measure(self, simulation: Simulation) -> None:
        if not self._spots:
            return
        # three components and the number of values each
        sums = np.array([self._sum(spot, simulation) for spot in self._spots])
        simulation.model.comm.Allreduce(MPI.IN_PLACE, sums)
        vectors = sums[:, :3] / sums[:, 3:]
        for spot, vector in zip(self._spots, vectors, strict=True):
            part = spot.probe.component
            value = np.linalg.norm(vector) if part == "norm" else vector[part]
            self.values[spot.probe.name] = float(value)

    def _sum(self, spot: _Spot, simulation: Simulation) -> Floats:
        quantity = spot.probe.quantity
        if quantity in RESULTANTS:
            total, count = self._resultants[spot.body].sums(spot.nodes, quantity)
            return np.append(total, count)
        here = spot.values.now(simulation, spot.body)
        if spot.offset is not None:
            here = here.at(np.tile(spot.offset, (len(spot.nodes), 1)))
        return np.append(getattr(here, quantity).sum(axis=0), len(spot.nodes))

    def measure(self) -> dict[str, float]:
        """Columns of the history."""
        return dict(self.values)
