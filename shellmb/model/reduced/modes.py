"""Amplitudes of the modes of a body, with their stiffness and damping."""

from __future__ import annotations

from functools import cached_property

from mpi4py import MPI

import numpy as np
import ufl
from ufl.core.expr import Expr

from shellmb.arrays import Ints
from shellmb.forms.state import Layout
from shellmb.meshes.nodes import constant_vector, node_mesh, node_space
from shellmb.model.body import Elastic, PartScale
from shellmb.model.elements.springs import LinearSprings
from shellmb.model.massless import Massless
from shellmb.model.reduced.data import ModalBody, amplitudes
from shellmb.model.reduced.viscous import modal_damping

ADVICE = "a smaller step, or fewer modes"


class Modes(Massless):
    """Amplitudes of a body's modes, with their stiffness; their inertia is in `InertiaPoints`.

    Args:
        comm: Communicator.
        data: The body.
    """

    def __init__(self, comm: MPI.Comm, data: ModalBody) -> None:
        self.data, name = data, f"modes of {data.name}"
        nodes = node_mesh(comm, 1)
        mixed = node_space(nodes, {"eta": data.count})
        title = PartScale("eta", f"modes of '{data.name}'", data.length, ADVICE)
        super().__init__(name, mixed, (title,), ())
        self.kinematic = self.jump_parts = frozenset({"eta"})
        self.layout, self._dx = Layout(mixed.parts), ufl.dx(nodes.mesh)
        self._k = constant_vector(nodes, data.stiffness[None], "stiffness")
        self.damping = modal_damping(self.layout, nodes, data.damping)

    def numbers(self) -> Ints:
        """Global dofs of the amplitudes, the same on all ranks; collective."""
        local = self.mixed.dofs["eta"]
        index_map = self.mixed.space.dofmap.index_map
        found = index_map.local_to_global(local[local < index_map.size_local])
        return np.concatenate(self.mixed.space.mesh.comm.allgather(found))

    def amplitudes(self, q: Expr) -> list[Expr]:
        """The amplitudes of a state, m."""
        return amplitudes(self.layout, q)

    def _stiffness(self) -> list[Expr]:
        return [self._k] if self.data.count == 1 else [self._k[k] for k in range(self.data.count)]

    @cached_property
    def elastic(self) -> tuple[Elastic, ...]:
        """Their stiffness."""
        return (LinearSprings(self._stiffness(), self.amplitudes, self.amplitudes, self._dx),)
