"""Resultants of shells and beams that are reduced to modes: those of the modes, by amplitude.

Strains of a body in modes are linear in the amplitudes, and resultants follow by its own section:
what the full body has in each mode is looked at once.
"""

from __future__ import annotations

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem
from ufl.algorithms.ad import expand_derivatives
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.model.frames.beam import BeamModel
from shellmb.model.reduced.data import amplitudes
from shellmb.model.shells.shell import ShellModel
from shellmb.native.expressions import compiled_expression
from shellmb.observers.fields.modal import ModalState, modal_members
from shellmb.observers.fields.resultants import Resultants
from shellmb.simulate.simulation import Simulation


class MeanAmplitudes:
    """Amplitudes that the elastic forces of a step belong to; of a state in statics.

    Args:
        simulation: The simulation.
        name: Name of a shell or beam in modes.
    """

    def __init__(self, simulation: Simulation, name: str) -> None:
        self._simulation, problem = simulation, simulation.problem
        self._state = ModalState(simulation.model, modal_members(simulation.model)[name])
        self._values: Floats | None = None
        self._read: fem.Expression | None = None
        modes = self._state.modes
        self._mesh = modes.mixed.space.mesh
        if not simulation.scheme.dynamic:
            return
        mean = problem.steps[modes.name].mean_state()
        middle = np.full((1, 1), 0.5)
        self._read = compiled_expression(ufl.as_vector(amplitudes(modes.layout, mean)), middle)

    def solved(self) -> None:
        """Take them while the start of the step is at hand; collective."""
        if self._read is None:
            return
        comm, found = self._mesh.comm, np.zeros(self._state.modes.data.count)
        # on the rank that has them
        if self._mesh.topology.index_map(1).size_local:
            found += np.ravel(self._read.eval(self._mesh, np.zeros(1, np.int32)))
        comm.Allreduce(MPI.IN_PLACE, found)
        self._values = found

    def now(self) -> Floats:
        """Resultants of the step solved last; before the first, and in statics, of the state."""
        if self._values is not None and self._simulation.last is not None:
            return self._values
        return self._state.now(self._simulation)[1]


class ModalResultants(Resultants):
    """Resultants of a shell or beam in modes, as `Resultants` of an exact one.

    Args:
        simulation: The simulation.
        name: Name of the shell or beam.
    """

    def __init__(self, simulation: Simulation, name: str) -> None:
        self._mean = MeanAmplitudes(simulation, name)
        member = modal_members(simulation.model)[name].members[name]
        # at rest
        q, along = (fem.Function(member.body.mixed.space) for _ in range(2))
        vector = self._vector(member.body, q)
        self._prepare(member.body, [expand_derivatives(ufl.derivative(vector, q, along))])
        found = []
        for state in member.states.T:
            along.x.array[:] = state
            found.append(self.at_nodes(self._expressions[0]))
        # of each mode in each element at its nodes, shape (elements, nodes, size, K)
        self._table: Floats = np.stack(found, axis=-1)

    def _vector(self, body: ShellModel | BeamModel, q: fem.Function) -> Expr:
        """Vector that is read of a state."""
        return body.resultants(q)

    def solved(self) -> None:
        """Take the amplitudes of the step."""
        self._mean.solved()

    def elements(self) -> Floats:
        """Values of each element of this rank at its nodes, shape (elements, nodes, size)."""
        return np.asarray(self._table @ self._mean.now())


def resultants_of(simulation: Simulation, body: ShellModel | BeamModel) -> Resultants:
    """Reader of the resultants of a shell or beam, also in modes; making it is collective.

    Args:
        simulation: The simulation.
        body: The shell or beam.
    """
    if body.name in modal_members(simulation.model):
        return ModalResultants(simulation, body.name)
    return Resultants(simulation, body)


class ModalStrained(ModalResultants):
    """Strains of a shell in modes with a nonlinear section, and its energy per area, shape (9,).

    Args:
        simulation: The simulation.
        name: Name of the shell.
    """

    def _vector(self, body: ShellModel | BeamModel, q: fem.Function) -> Expr:
        """Strains, and resultants for the energy."""
        assert isinstance(body, ShellModel)
        e, R = body.strains(q), super()._vector(body, q)
        return ufl.as_vector([*e.eps, *e.kap, *e.gam, *(R[k] for k in range(8))])

    def solved(self) -> None:
        """Strains are those of the state, as `Strained` has them."""

    def elements(self) -> Floats:
        """Values of each element of this rank at its nodes, shape (elements, nodes, 9)."""
        values = super().elements()
        strains, energy = values[..., :8], (values[..., :8] * values[..., 8:]).sum(axis=-1) / 2
        return np.concatenate([strains, energy[..., None]], axis=-1)
