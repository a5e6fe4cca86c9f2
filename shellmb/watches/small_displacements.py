"""Displacements that are taken as small are not."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from mpi4py import MPI

import numpy as np

from shellmb.model.frames.rigid import RigidBodies
from shellmb.observers.fields.nodal import nodal_bodies
from shellmb.observers.summary import Sources
from shellmb.scene.checks.linear import SMALL_ANGLE
from shellmb.simulate.simulation import Silent, Simulation
from shellmb.watches.base import Caution, said_of


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
