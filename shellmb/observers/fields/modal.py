"""Nodal values of shells and beams that are reduced to modes, found from frame and amplitudes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from mpi4py import MPI

import numpy as np

from shellmb.arrays import Floats, Int32s
from shellmb.model.model import Model
from shellmb.model.reduced.data import ModalBody
from shellmb.model.reduced.floating_body import Modes
from shellmb.observers.fields.nodal import NodalValues
from shellmb.simulate.simulation import Simulation

# displacement of a frame, changes of its directors
FRAME = 12
# what of the nodal values takes rates
RATES = {"velocity", "director_velocity", "angular_velocity"}


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
        every = (body for body in model.bodies if isinstance(body, Modes))
        self.modes = next(modes for modes in every if modes.data is data)
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
        if self._comm.size > 1:
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
    """Nodes of a shell or beam in modes whose values are requested again and again.

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
        self._X, self._D = member.body.mixed.nodes("u")[here], member.body.node_directors()[here]
        self._arms, self._u, self._w = self._X - center, member.u[here], member.w[here]

    @property
    def count(self) -> int:
        """Their number."""
        return len(self._X)

    def shape(self, frame: Floats, eta: Floats) -> Floats:
        """Small displacements of the nodes, shape (n, 3), m.

        Args:
            frame: Displacement and changes of the directors of the frame, (12,).
            eta: Amplitudes, (K,).
        """
        return np.asarray(frame[:3] + self._arms @ frame[3:].reshape(3, 3) + self._u @ eta)

    def now(self, simulation: Simulation, name: str = "", moving: bool = True) -> NodalValues:
        """Values at the nodes, between two steps of a simulation; collective.

        Args:
            simulation: The simulation.
            name: Not used: these nodes know their body.
            moving: Whether velocities are wanted; they are zero else.
        """
        frame, eta = self.state.now(simulation)
        moved = moving and simulation.scheme.dynamic and "v" in simulation.scheme.rates
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

    def reader(
        self, simulation: Simulation, name: str, quantity: str, offsets: Floats | None = None
    ) -> Callable[[], Floats]:
        """Reads one quantity between two steps, shape (n, 3); collective.

        Args:
            simulation: The simulation.
            name: Not used.
            quantity: Name of one of the `NodalValues`.
            offsets: Components along the directors of points fixed to the nodes, m; None: none.
        """
        moving = quantity in RATES

        def read() -> Floats:
            values = self.now(simulation, moving=moving)
            return np.asarray(getattr(values if offsets is None else values.at(offsets), quantity))

        return read
