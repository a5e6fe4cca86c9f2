"""Shells and beams that are reduced to modes: nodal values and resultants, by frame and amplitudes.

Strains of a body in modes are linear in the amplitudes, and resultants follow by its own section:
what the full body has in each mode is looked at once.
"""

from collections.abc import Callable
from typing import Any

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem
from ufl.algorithms.ad import expand_derivatives
from ufl.core.expr import Expr

from shellmb.arrays import Floats, Int32s
from shellmb.model.frames.beam import BeamModel
from shellmb.model.model import Model
from shellmb.model.reduced.data import ModalBody, amplitudes
from shellmb.model.reduced.modal import modes_of
from shellmb.model.shells.shell import ShellModel
from shellmb.native.expressions import MIDDLE, values_in_cells
from shellmb.observers.fields.by_section import held_plies
from shellmb.observers.fields.nodal import NodalValues
from shellmb.observers.fields.resultants import LayerResultants, Resultants
from shellmb.simulate.simulation import Simulation

# displacement of a frame, changes of its directors
FRAME = 12


def modal_members(model: Model) -> dict[str, ModalBody]:
    """Reduced bodies by the names of the shells and beams that they consist of."""
    return {name: data for data in model.modal for name in data.members}


def readable(model: Model) -> dict[str, Any]:
    """Shells and beams whose nodes can be read by name, also those that are reduced to modes."""
    members = {name: data.members[name].body for name, data in modal_members(model).items()}
    return {**model.meshed, **members}


class ModalState:
    """Frame and amplitudes of a reduced body, on all ranks.

    Args:
        model: The model.
        data: The reduced body.
    """

    def __init__(self, model: Model, data: ModalBody) -> None:
        rigid = model.rigid
        assert rigid is not None
        self._comm, self.rigid = model.comm, rigid.name
        self.modes = next(modes for modes in modes_of(model.bodies) if modes.data is data)
        index_map = rigid.mixed.space.dofmap.index_map
        frame = np.concatenate([rigid.local(data.name, part) for part in ("u", "w")])
        self._frame = frame[frame < index_map.size_local]
        local = self.modes.mixed.dofs["eta"]
        self._eta = local[local < self.modes.mixed.space.dofmap.index_map.size_local]
        self._count = data.count

    def read(self, frames: Floats, modes: Floats) -> tuple[Floats, Floats]:
        """Displacement and changes of the directors (12,), and amplitudes (K,); collective.

        Args:
            frames: Local array of the rigid bodies.
            modes: Local array of the modes.
        """
        found = np.zeros(FRAME + self._count)
        if len(self._frame):
            found[:FRAME] = frames[self._frame]
        if len(self._eta):
            found[FRAME:] = modes[self._eta]
        self._comm.Allreduce(MPI.IN_PLACE, found)
        return found[:FRAME], found[FRAME:]

    def now(self, simulation: Simulation, rate: str | None = None) -> tuple[Floats, Floats]:
        """Values between two steps of a simulation.

        Args:
            simulation: The simulation.
            rate: Name of a rate; None: the state.
        """
        levels = [simulation.problem.levels[name] for name in (self.rigid, self.modes.name)]
        frames, modes = (k.q if rate is None else k.rates[rate] for k in levels)
        return self.read(frames.x.array, modes.x.array)


class ModalNodes:
    """Nodes of a shell or beam in modes.

    Args:
        model: The model.
        name: Name of the shell or beam.
        which: Numbers of the nodes on this rank; None: all.
    """

    def __init__(self, model: Model, name: str, which: Int32s | None = None) -> None:
        data = modal_members(model)[name]
        assert model.rigid is not None
        here = slice(None) if which is None else which
        member, center = data.members[name], model.rigid.bodies[model.rigid.index[data.name]].center
        self.state = ModalState(model, data)
        X, D = member.body.mixed.nodes("u"), member.body.node_directors()
        self.name, self._X, self._D = name, X[here], D[here]
        self._arms, self._u, self._w = self._X - center, member.u[here], member.w[here]

    def shape(self, frame: Floats, eta: Floats) -> Floats:
        """Small displacements of the nodes, shape (n, 3), m.

        Args:
            frame: Displacement and changes of the directors of the frame, (12,).
            eta: Amplitudes, (K,).
        """
        return np.asarray(frame[:3] + self._arms @ frame[3:].reshape(3, 3) + self._u @ eta)

    def now(self, simulation: Simulation) -> NodalValues:
        """Values at the nodes, between two steps of a simulation; collective."""
        frame, eta = self.state.now(simulation)
        moved = simulation.scheme.dynamic and "v" in simulation.scheme.rates
        rates = self.state.now(simulation, "v") if moved else (0 * frame, 0 * eta)
        change, spin = frame[3:].reshape(3, 3), rates[0][3:].reshape(3, 3)
        d = np.eye(3) + change
        u, w = self._u @ eta, self._w @ eta
        du, dw = self._u @ rates[1], self._w @ rates[1]
        return NodalValues(
            self._X,
            frame[:3] + self._arms @ change + u @ d,
            self._D,
            (self._D + w) @ d,
            rates[0][:3] + (self._arms + u) @ spin + du @ d,
            (self._D + w) @ spin + dw @ d,
        )


class ModalResultants(Resultants):
    """Resultants of a shell or beam in modes, as `Resultants` of an exact one.

    They are those of the amplitudes that the elastic forces of a step belong to; before the first
    step, and in statics, of the amplitudes of the state.

    Args:
        simulation: The simulation.
        name: Name of the shell or beam.
    """

    def __init__(self, simulation: Simulation, name: str) -> None:
        self._simulation, data = simulation, modal_members(simulation.model)[name]
        self._state = ModalState(simulation.model, data)
        self._mean: Floats | None = None
        modes, member = self._state.modes, data.members[name]
        self._read: Callable[[], Floats] | None = None
        if simulation.scheme.dynamic:
            mean = ufl.as_vector(
                amplitudes(modes.layout, simulation.problem.steps[modes.name].mean_state())
            )
            self._read = values_in_cells(mean, MIDDLE, modes.mixed.space.mesh)
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
        """Take the amplitudes of the step while its start is at hand; collective."""
        if self._read is not None:
            # on the rank that has them
            self._mean = self._read()[:1].sum(axis=(0, 1))
            self._simulation.model.comm.Allreduce(MPI.IN_PLACE, self._mean)

    def elements(self) -> Floats:
        """Values of each element of this rank at its nodes, shape (elements, nodes, size)."""
        if self._mean is not None and self._simulation.last is not None:
            return np.asarray(self._table @ self._mean)
        return np.asarray(self._table @ self._state.now(self._simulation)[1])


def resultants_of(
    simulation: Simulation, body: ShellModel | BeamModel, layers: bool = False
) -> Resultants:
    """Reader of the resultants of a shell or beam, also in modes; making it is collective.

    Args:
        simulation: The simulation.
        body: The shell or beam.
        layers: Whether stresses of layers follow from them.
    """
    if body.name in modal_members(simulation.model):
        return ModalResultants(simulation, body.name)
    relaxes = body.name in simulation.problem.branches
    described: Any = body.described
    if layers and described.section.layered and (relaxes or held_plies(described)):
        return LayerResultants(simulation, body)
    return Resultants(simulation, body)


class ModalStrained(ModalResultants):
    """Strains of a shell in modes with a nonlinear section, and its energy per area, shape (9,).

    Args:
        simulation: The simulation.
        name: Name of the shell.
    """

    def _vector(self, body: Any, q: fem.Function) -> Expr:
        """Strains, and resultants for the energy."""
        e, R = body.strains(q), super()._vector(body, q)
        return ufl.as_vector([*e.eps, *e.kap, *e.gam, *(R[k] for k in range(8))])

    def solved(self) -> None:
        """Strains are those of the state, as `Strained` has them."""

    def elements(self) -> Floats:
        """Values of each element of this rank at its nodes, shape (elements, nodes, 9)."""
        values = super().elements()
        strains, energy = values[..., :8], (values[..., :8] * values[..., 8:]).sum(axis=-1) / 2
        return np.concatenate([strains, energy[..., None]], axis=-1)
