"""Displacements that are taken as small are not: of all bodies, or of some about their frames."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from mpi4py import MPI

import numpy as np

from shellmb.model.frames.rigid import RigidBodies
from shellmb.observers.fields.modal import ModalState
from shellmb.observers.fields.nodal import nodal_bodies
from shellmb.observers.summary import Sources
from shellmb.scene.checks.linear import SMALL_ANGLE
from shellmb.simulate.reduction.lowest import lowest_frequency
from shellmb.simulate.reduction.tangent import bending_scale
from shellmb.simulate.simulation import Silent, Simulation
from shellmb.watches.base import Caution, said_of

# of the stiffness: frequencies are off by half of that
STIFFENED = 1e-2
# lowest frequency of a beam with one end clamped, over sqrt(D/(m L^4))
CANTILEVER = 3.516


class SmallDisplacements(Silent):
    """Watches the directors of all bodies where forms are linearised.

    Args:
        sources: The observers of the run.
    """

    name = "small displacements"

    def __init__(self, sources: Sources) -> None:
        # by body of the system the largest change of a director on this rank, and when
        self._largest: dict[str, tuple[float, float]] = {}

    def accepted(self, simulation: Simulation) -> None:
        """Take the rotations of the step."""
        if not simulation.scheme.linear:
            return
        for body in nodal_bodies(simulation.model).values():
            change = simulation.problem.state(body.name).x.array[body.mixed.dofs["w"]]
            size = float(np.sqrt(np.max(np.sum(change.reshape(-1, 3) ** 2, axis=1), initial=0.0)))
            if size > self._largest.get(body.name, (0.0, 0.0))[0]:
                self._largest[body.name] = size, simulation.t

    def cautions(self, simulation: Simulation) -> Iterator[Caution]:
        """A sentence for each body that turns too far; collective."""
        if not simulation.scheme.linear:
            return
        for body in nodal_bodies(simulation.model).values():
            here = self._largest.get(body.name, (0.0, 0.0))
            largest, when = simulation.model.comm.allreduce(here, op=MPI.MAX)
            if largest > SMALL_ANGLE:
                rigid = isinstance(body, RigidBodies)
                name = None if rigid else body.name
                yield Caution(
                    self.name,
                    name,
                    largest,
                    SMALL_ANGLE,
                    f"{said_of(simulation, body.name)} {'turn' if rigid else 'turns'} by "
                    f"{largest:.2g} rad, at t = {when:g}; with scheme "
                    f"'{simulation.scheme.name}' displacements are small, up to {SMALL_ANGLE:g} "
                    "rad: its results are of the size of the square of that off; use --scheme "
                    f"{'ep' if simulation.scheme.dynamic else 'static'}",
                )

    def state(self) -> dict[str, Any]:
        """The largest so far."""
        return {"largest": {name: list(found) for name, found in self._largest.items()}}

    def restore(self, state: dict[str, Any]) -> None:
        """Take them up."""
        self._largest = {name: (size, t) for name, (size, t) in state["largest"].items()}


class ReducedBodies(Silent):
    """Watches bodies in modes: what they turn relative to their frame, and how fast they spin.

    Modes know no stiffness by forces that act already. In a body that spins at a rate `w` fibres
    under tension are stiffer, and what is off the axis is drawn outwards: by about `m w^2` either
    way, beside the stiffness `m w_1^2` of the lowest mode.

    Args:
        sources: The observers of the run.
    """

    name = "reduced bodies"

    def __init__(self, sources: Sources) -> None:
        # by name of the body: largest elastic rotation on this rank, largest spin, and when
        self._turns: dict[str, tuple[float, float]] = {}
        self._spins: dict[str, tuple[float, float]] = {}

    def start(self, simulation: Simulation) -> None:
        """Find the bodies, and how much each mode turns their directors at most."""
        model = simulation.model
        self._bodies = [(data, ModalState(model, data)) for data in model.modal]
        self._most = {
            data.name: np.sqrt(np.max(np.sum(data.slopes**2, axis=1), axis=0, initial=0.0))
            for data in model.modal
        }

    def accepted(self, simulation: Simulation) -> None:
        """Take the step."""
        for data, state in self._bodies:
            frame, eta = state.now(simulation)
            largest = self._turns.get(data.name, (0.0, 0.0))[0]
            # only what may be larger is looked at node by node
            if float(np.abs(eta) @ self._most[data.name]) > max(largest, SMALL_ANGLE):
                turned = np.sum((data.slopes @ eta) ** 2, axis=1)
                size = float(np.sqrt(np.max(turned, initial=0.0)))
                if size > largest:
                    self._turns[data.name] = size, simulation.t
            if "v" in simulation.scheme.rates:
                d = np.eye(3) + frame[3:].reshape(3, 3)
                rates = state.now(simulation, "v")[0][3:].reshape(3, 3)
                spin = float(np.linalg.norm(np.cross(d, rates).sum(axis=0) / 2))
                if spin > self._spins.get(data.name, (0.0, 0.0))[0]:
                    self._spins[data.name] = spin, simulation.t

    def cautions(self, simulation: Simulation) -> Iterator[Caution]:
        """A sentence for each body that bends or spins too much; collective."""
        for data in simulation.model.modal:
            here = self._turns.get(data.name, (0.0, 0.0))
            turn, when = simulation.model.comm.allreduce(here, op=MPI.MAX)
            who = said_of(simulation, data.name)
            if turn > SMALL_ANGLE:
                yield Caution(
                    self.name,
                    data.name,
                    turn,
                    SMALL_ANGLE,
                    f"{who} is reduced to modes and turns by {turn:.2g} rad relative to its frame, "
                    f"at t = {when:g}; rotations there are small, up to {SMALL_ANGLE:g} rad: its "
                    "results are of the size of the square of that off; use model='exact'",
                )
            spin, when = self._spins.get(data.name, (0.0, 0.0))
            share = (spin / data.clamped) ** 2
            if share > STIFFENED:
                yield Caution(
                    self.name,
                    data.name,
                    share,
                    STIFFENED,
                    f"{who} is reduced to modes and spins at {spin:.3g} rad/s, at t = {when:g}, "
                    f"{spin / data.clamped:.2g} of its lowest frequency with one joint held, "
                    f"{data.clamped:.3g} rad/s: centrifugal forces would change its stiffness by "
                    f"about {share:.0%}, and its modes do not know that; use model='exact'",
                )

    def state(self) -> dict[str, Any]:
        """The largest so far."""
        return {"turns": dict(self._turns), "spins": dict(self._spins)}

    def restore(self, state: dict[str, Any]) -> None:
        """Take them up."""
        self._turns = {name: (size, t) for name, (size, t) in state["turns"].items()}
        self._spins = {name: (size, t) for name, (size, t) in state["spins"].items()}


class LinearBodies(Silent):
    """Watches bodies with linear strains: what they turn relative to their frame, and their spin.

    They know no more of forces that act already than modes do (`ReducedBodies`).

    Args:
        sources: The observers of the run.
    """

    name = "linear bodies"

    def __init__(self, sources: Sources) -> None:
        # by name of the body: largest rotation about its frame on this rank, largest spin, and when
        self._turns: dict[str, tuple[float, float]] = {}
        self._spins: dict[str, tuple[float, float]] = {}

    def start(self, simulation: Simulation) -> None:
        """Find the bodies and their directors."""
        meshed = simulation.model.meshed.values()
        self._bodies = [(body, body.node_directors()) for body in meshed if body.ties]

    def accepted(self, simulation: Simulation) -> None:
        """Take the step."""
        for body, D in self._bodies:
            levels, (tie,) = simulation.problem.levels[body.name], body.ties
            q = levels.q.x.array
            frame = tie.changes(q)
            lean = q[body.mixed.dofs["w"]].reshape(D.shape) - D @ frame
            size = float(np.sqrt(np.max(np.sum(lean**2, axis=2), initial=0.0)))
            _note(self._turns, body.name, size, simulation.t)
            if "v" in levels.rates:
                rates = tie.changes(levels.rates["v"].x.array)
                spin = np.cross(np.eye(3) + frame, rates).sum(axis=0) / 2
                _note(self._spins, body.name, float(np.linalg.norm(spin)), simulation.t)

    def cautions(self, simulation: Simulation) -> Iterator[Caution]:
        """A sentence for each body that bends or spins too much; collective."""
        comm = simulation.model.comm
        for body, _ in self._bodies:
            name, who = body.name, said_of(simulation, body.name)
            turn, when = comm.allreduce(self._turns.get(name, (0.0, 0.0)), op=MPI.MAX)
            if turn > SMALL_ANGLE:
                yield Caution(
                    self.name,
                    name,
                    turn,
                    SMALL_ANGLE,
                    f"{who} has linear strains and turns by {turn:.2g} rad relative to its frame, "
                    f"at t = {when:g}; rotations there are small, up to {SMALL_ANGLE:g} rad: its "
                    "results are of the size of the square of that off; use model='exact'",
                )
            spin, when = comm.allreduce(self._spins.get(name, (0.0, 0.0)), op=MPI.MAX)
            # a cantilever of its length is softer than it is
            slow = CANTILEVER * np.sqrt(bending_scale(body))
            if (spin / slow) ** 2 <= STIFFENED:
                continue
            lowest = lowest_frequency(simulation.model, name)
            share = (spin / lowest) ** 2
            if share > STIFFENED:
                yield Caution(
                    self.name,
                    name,
                    share,
                    STIFFENED,
                    f"{who} has linear strains and spins at {spin:.3g} rad/s, at t = {when:g}, "
                    f"{spin / lowest:.2g} of its lowest frequency by itself, {lowest:.3g} rad/s: "
                    f"centrifugal forces would change its stiffness by about {share:.0%}, and "
                    "linear strains do not know that; use model='exact'",
                )

    def state(self) -> dict[str, Any]:
        """The largest so far."""
        return {"turns": dict(self._turns), "spins": dict(self._spins)}

    def restore(self, state: dict[str, Any]) -> None:
        """Take them up."""
        self._turns = {name: (size, t) for name, (size, t) in state["turns"].items()}
        self._spins = {name: (size, t) for name, (size, t) in state["spins"].items()}


def _note(largest: dict[str, tuple[float, float]], name: str, size: float, t: float) -> None:
    """Keep the largest size with its time."""
    if size > largest.get(name, (0.0, 0.0))[0]:
        largest[name] = size, t
