"""How well constraints hold: those of the directors, and those between bodies, joint by joint."""

from __future__ import annotations

from typing import Any

from mpi4py import MPI

import numpy as np

from shellmb.observers.nodal import nodal_bodies
from shellmb.simulate.simulation import Silent, Simulation


class Constraints(Silent):
    """Largest constraint errors; nothing in linear statics, where constraints are linearised.

    Attributes:
        director_max: Largest deviation so far of a shell's director from unit length, or of a frame
            from orthonormality; None if not measured.
        constraint_max: Largest violation of any constraint so far, that one included.
        joints: Largest violation so far of each joint, relative to the scene's length.
    """

    def __init__(self) -> None:
        self.director_max: float | None = None
        self.constraint_max: float | None = None
        self.joints: dict[str, float] = {}
        self._now: dict[str, float] = {}

    def start(self, simulation: Simulation) -> None:
        """Take the errors at the start."""
        self._nodal = list(nodal_bodies(simulation.model))
        self.accepted(simulation)

    def accepted(self, simulation: Simulation) -> None:
        """Take the errors."""
        if simulation.scheme.linear:
            return
        model, levels = simulation.model, simulation.problem.levels
        errors = {b.name: b.constraint_error(levels[b.name].q) for b in model.bodies}
        worst = np.array([max(errors[name] for name in self._nodal), max(errors.values())])
        model.comm.Allreduce(MPI.IN_PLACE, worst, op=MPI.MAX)
        director, every = worst.tolist()
        self._take_joints(simulation)
        self._now = {"director_error": director, "constraint_error": every}
        self.director_max = max(self.director_max or 0.0, director)
        self.constraint_max = max(self.constraint_max or 0.0, every)

    def _take_joints(self, simulation: Simulation) -> None:
        mechanism, levels = simulation.model.mechanism, simulation.problem.levels
        if not mechanism.joints:
            return
        number = {name: k for k, name in enumerate(mechanism.joints)}
        worst = np.zeros(len(number))
        for group in mechanism.groups:
            found = np.abs(group.violations(levels[group.name].q)).max(axis=1, initial=0.0)
            for item, value in zip(group.nodes.item, found, strict=True):
                k = number[group.joints[item].joint.name]
                worst[k] = max(worst[k], value / group.length)
        simulation.model.comm.Allreduce(MPI.IN_PLACE, worst, op=MPI.MAX)
        for name, value in zip(number, worst, strict=True):
            self.joints[name] = max(self.joints.get(name, 0.0), float(value))

    def measure(self) -> dict[str, float]:
        """Columns of the history."""
        return dict(self._now)

    def state(self) -> dict[str, Any]:
        """The largest errors so far."""
        return {
            "director_max": self.director_max,
            "constraint_max": self.constraint_max,
            "joints": dict(self.joints),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Take up saved errors."""
        self.director_max = state["director_max"]
        self.constraint_max = state["constraint_max"]
        self.joints = dict(state["joints"])
