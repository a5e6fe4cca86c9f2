"""Amplitudes of the modes of a body, with their stiffness and damping."""

from __future__ import annotations

from collections.abc import Sequence

from mpi4py import MPI

import numpy as np
import ufl
from ufl import Form
from ufl.core.expr import Expr

from shellmb.arrays import Ints
from shellmb.forms.constraints.elements import (
    Stretch,
    linear_force,
    linear_forces,
    linear_jump,
    linear_potential,
)
from shellmb.forms.state import Layout
from shellmb.forms.steps.mixed import Interval
from shellmb.forms.steps.path import Step
from shellmb.meshes.nodes import constant_vector, node_mesh, node_space
from shellmb.model.body import PartScale
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

    def _sum(self, terms: Sequence[Expr]) -> Form:
        return sum(terms[1:], terms[0]) * self._dx

    def _stiffness(self) -> list[Expr]:
        return [self._k] if self.data.count == 1 else [self._k[k] for k in range(self.data.count)]

    def internal(self, span: Interval, dq: Expr) -> Form:
        """Average elastic force over the sub-interval."""
        a, b, test = (self.amplitudes(q) for q in (span.a, span.b, dq))
        k = self._stiffness()
        if span.a is span.b:
            return self._sum([k[i] * a[i] * test[i] for i in range(len(k))])
        forces = [linear_force(k[i], a[i], b[i], span.beta) for i in range(len(k))]
        return self._sum([f * t for f, t in zip(forces, test, strict=True)])

    def _stretches(self, step: Step) -> list[Stretch]:
        path = step.path
        parts = (self.amplitudes(q) for q in (path.start, path.chord, path.bow))
        return [Stretch(a, d, 2 * z) for a, d, z in zip(*parts, strict=True)]

    def along(self, step: Step, k: int, dq: Expr) -> Form | None:
        """Elastic force over a step, linear in time."""
        alpha, weight = step.path.alpha, (1, 1 / 3)[k]
        pairs = zip(self._stiffness(), self._stretches(step), strict=True)
        forces = [weight * linear_forces(c, e, alpha)[k] for c, e in pairs]
        test = self.amplitudes(dq)
        return self._sum([f * t for f, t in zip(forces, test, strict=True)])

    def lost(self, step: Step, bow: Expr) -> Form | None:
        """Energy of the bow of the amplitudes, J."""
        pairs = zip(self._stiffness(), self._stretches(step), strict=True)
        return self._sum([c * e.bow**2 / 2 for c, e in pairs])

    def strain_energy(self, q: Expr) -> Form:
        """Strain energy, J."""
        pairs = zip(self._stiffness(), self.amplitudes(q), strict=True)
        return self._sum([linear_potential(c)(e) for c, e in pairs])

    def jump(self, a: Expr, b: Expr) -> Form:
        """Elastic part of eq. (34)."""
        ends = zip(self._stiffness(), self.amplitudes(a), self.amplitudes(b), strict=True)
        return self._sum([linear_jump(c, first, second) for c, first, second in ends])
