"""Rotations and translations of joints that nothing acts on and no sensor reads.

Those that something acts on are unknowns (`model.joints.coordinates`). All others follow from the
places of their joints, without an unknown and a compiled form.
"""

from __future__ import annotations

import math
from typing import Any

from mpi4py import MPI

import numpy as np
import numpy.typing as npt

from shellmb.model.joints.columns import COLUMN
from shellmb.model.joints.joints import BoundJoint, JointGroup
from shellmb.model.places.ends import End, EndGroup
from shellmb.simulate.simulation import Simulation

Floats = npt.NDArray[np.float64]


class Freedoms:
    """Reads them between two steps.

    Attributes:
        values: Rotations [rad], which count whole turns as long as no step is half a turn, and
            translations [m], by column.
    """

    def __init__(self) -> None:
        self.values: dict[str, float] = {}
        self._read: list[tuple[int, str, JointGroup, BoundJoint, int]] = []

    def start(self, simulation: Simulation) -> None:
        """Find the joints and take the values."""
        mechanism = simulation.model.mechanism
        names = {
            (joint.joint.name, kind): f"{joint.joint.name}.{COLUMN[kind]}"
            for joint in mechanism.joints.values()
            for kind in joint.joint.freedoms
            if (joint.joint.name, kind) not in mechanism.table
        }
        number = {key: k for k, key in enumerate(names)}
        for name in names.values():
            self.values.setdefault(name, 0.0)
        self._comm, self._linear = simulation.model.comm, simulation.scheme.linear
        self._read = []
        for group in mechanism.groups if names else []:
            mine = group.nodes.mesh.topology.index_map(1).size_local
            for row, item in enumerate(group.nodes.item[:mine]):
                joint = group.joints[item]
                for kind in joint.joint.freedoms:
                    if (key := (joint.joint.name, kind)) in number:
                        self._read.append((number[key], kind, group, joint, row))
        self.measure(simulation)

    def measure(self, simulation: Simulation) -> dict[str, float]:
        """Take the values; collective.

        Args:
            simulation: The simulation.
        """
        if not self.values:
            return self.values
        found = np.zeros(len(self.values))
        for number, kind, group, joint, row in self._read:
            q = simulation.problem.state(group.name).x.array
            (x, first), (y, second) = (_place(group, joint, k, row, q) for k in range(2))
            if kind == "translation":
                ends = joint.ends
                start = joint.axes[0][2] @ (ends[1].point - ends[0].point)
                found[number] = first[2] @ (y - x) - start
            else:
                cosine, sine = first[:2] @ second[0]
                found[number] = sine if self._linear else math.atan2(sine, cosine)
        if self._comm.size > 1:
            self._comm.Allreduce(MPI.IN_PLACE, found)
        for (name, before), value in zip(list(self.values.items()), found.tolist(), strict=True):
            counts = name.endswith(f".{COLUMN['rotation']}") and not self._linear
            turned = math.remainder(value - before, 2 * math.pi)
            self.values[name] = before + turned if counts else value
        return self.values

    def state(self) -> dict[str, Any]:
        """The values, whose turns count."""
        return dict(self.values)

    def restore(self, state: dict[str, Any]) -> None:
        """Take them up."""
        self.values = {name: float(value) for name, value in state.items()}


def _place(
    group: JointGroup, joint: BoundJoint, which: int, row: int, q: Floats
) -> tuple[Floats, Floats]:
    """Point and axes of a place at a state, shapes (3,) and (3, 3)."""
    end: End = joint.ends[which]
    place = group.ends[which]

    d = end.directors + q[rows(group, place, "w", row)].reshape(-1, 3)
    x = end.node + q[rows(group, place, "u", row)]
    return x + end.offset @ d, joint.axes[which] @ end.directors.T @ d


def rows(group: JointGroup, place: EndGroup, part: str, row: int) -> npt.NDArray[np.int32]:
    """Local dofs of a part ("u" or "w") of one end of a joint.

    Args:
        group: Group of the joint.
        place: Its end.
        part: Name of the part.
        row: Local cell of the joint.
    """
    name = f"{part}{place.tag}"
    return group.mixed.dofs[name].reshape(-1, group.mixed.parts[name][1])[row]
