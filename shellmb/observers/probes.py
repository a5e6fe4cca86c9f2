"""Probes: one number each at a node, or a point of a rigid body, over time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, cast

from mpi4py import MPI

import numpy as np
import numpy.typing as npt

from shellmb.model.places.nodes import local_nodes
from shellmb.observers.fields.nodal import Nodes
from shellmb.observers.fields.resultants import Resultants, has_resultants
from shellmb.scene import Probe, RigidBody
from shellmb.simulate.simulation import Silent, Simulation

Floats = npt.NDArray[np.float64]


# sum of a probe's quantity over its nodes on this rank, shape (3,), and their number
type Sum = Callable[[], tuple[Floats, int]]


@dataclass(frozen=True)
class _Spot:
    """A probe where it is.

    Args:
        probe: The probe.
        sum: What it reads, between two steps.
    """

    probe: Probe
    sum: Sum


class Probes(Silent):
    """Records the probes of the scene, the same on all ranks.

    Motions are those at the end of a step. Forces, moments and other resultants are means over it,
    in statics the values (`Resultants`).

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
        self._comm = simulation.model.comm
        self._resultants: dict[str, Resultants] = {}
        self._spots = [_Spot(p, self._sum(simulation, p)) for p in simulation.scene.probes]
        self._measure()

    def _sum(self, simulation: Simulation, probe: Probe) -> Sum:
        model = simulation.model
        (described,) = model.scene.bodies_of(probe)
        if described.name not in model.meshed:
            rigid = model.rigid
            assert rigid is not None and isinstance(described, RigidBody)
            number = rigid.index[described.name]
            node = rigid.bodies[number]
            offset = node.directors @ (described.place(cast(Any, probe.point)) - node.center)
            here = np.flatnonzero(rigid.node_mesh.item == number).astype(np.int32)
            offsets = np.tile(offset, (len(here), 1))
            return _total(Nodes(rigid, here), simulation, rigid.name, probe.quantity, offsets)
        body = model.meshed[described.name]
        nodes = local_nodes(body, probe.point, f"probe '{probe.name}'")
        if has_resultants(body, probe.quantity):
            if body.name not in self._resultants:
                self._resultants[body.name] = Resultants(simulation, body)
            return partial(self._resultants[body.name].sums, nodes, probe.quantity)
        # each node counts once, on the rank that owns it
        nodes = nodes[nodes < body.mixed.subspaces["u"].dofmap.index_map.size_local]
        return _total(Nodes(body, nodes), simulation, body.name, probe.quantity)

    def solved(self, simulation: Simulation) -> None:
        """Means over a step need its start, too."""
        for resultants in self._resultants.values():
            resultants.solved()

    def accepted(self, simulation: Simulation) -> None:
        """Take the values."""
        self._measure()

    def _measure(self) -> None:
        sums = [spot.sum() for spot in self._spots]
        if self._comm.size > 1 and sums:
            table = np.array([[*total, count] for total, count in sums])
            self._comm.Allreduce(MPI.IN_PLACE, table)
            sums = [(row[:3], row[3]) for row in table]
        for spot, (total, count) in zip(self._spots, sums, strict=True):
            part = spot.probe.component
            size = np.linalg.norm(total) if part == "norm" else total[part]
            self.values[spot.probe.name] = float(size) / count

    def measure(self) -> dict[str, float]:
        """Columns of the history."""
        return dict(self.values)


def _total(
    nodes: Nodes, simulation: Simulation, body: str, quantity: str, offsets: Floats | None = None
) -> Sum:
    """Sum over nodes, or over points that are fixed to them at `offsets`."""
    read = nodes.reader(simulation, body, quantity, offsets)
    count = nodes.count
    return lambda: (np.add.reduce(read()), count)
