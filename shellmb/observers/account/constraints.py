"""Violation of constraints: those of the directors, and those between bodies, by joint."""

from __future__ import annotations

from typing import Any

from mpi4py import MPI

import numpy as np

from shellmb.model.body import constraint_error
from shellmb.observers.fields.nodal import nodal_bodies
from shellmb.simulate.simulation import Silent, Simulation


class Constraints(Silent):
    """Largest constraint errors; nothing in linear statics, where constraints are linearised.

    Attributes:
        director_max: Largest deviation so far of a shell's director from unit length, or of a frame
            from orthonormality; None if not measured.
        constraint_max: Largest violation of any constraint so far, that one included.
        joints: Largest violation so far of each joint: of positions relative to the scene's
            length, of directions in rad; what was left out as redundant counts.
    """

    def __init__(self) -> None:
        self.director_max: float | None = None
        self.constraint_max: float | None = None
        self.joints: dict[str, float] = {}
        self._now: dict[str, float] = {}

    def start(self, simulation: Simulation) -> None:
        """Take the errors at the start."""
        model = simulation.model
        joints = {id(group) for group in model.mechanism.groups}
        self._bodies = [body for body in model.bodies if id(body) not in joints]
        nodal = nodal_bodies(model)
        self._nodal = [body.name in nodal for body in self._bodies]
        self._number = {name: k for k, name in enumerate(model.mechanism.joints)}
        self.accepted(simulation)

    def accepted(self, simulation: Simulation) -> None:
        """Take the errors."""
        if simulation.scheme.linear:
            return
        levels = simulation.problem.levels
        errors = [constraint_error(body, levels[body.name].q) for body in self._bodies]
        joints = self._of_joints(simulation) if self._number else []
        nodal = [error for error, here in zip(errors, self._nodal, strict=True) if here]
        worst = [max(nodal, default=0.0), max([*errors, *joints], default=0.0), *joints]
        if simulation.model.comm.size > 1:
            numbers = np.array(worst)
            simulation.model.comm.Allreduce(MPI.IN_PLACE, numbers, op=MPI.MAX)
            worst = numbers.tolist()
        director, every, *joints = worst
        self._now = {"director_error": director, "constraint_error": every}
        self.director_max = max(self.director_max or 0.0, director)
        self.constraint_max = max(self.constraint_max or 0.0, every)
        for name, value in zip(self._number, joints, strict=True):
            self.joints[name] = max(self.joints.get(name, 0.0), value)

    def _of_joints(self, simulation: Simulation) -> list[float]:
        """Largest violation of each joint on this rank."""
        worst = [0.0] * len(self._number)
        for group in simulation.model.mechanism.groups:
            q = simulation.problem.levels[group.name].q
            found = group.apart(q).max(axis=1, initial=0.0)
            for item, value in zip(group.nodes.item, found.tolist(), strict=True):
                k = self._number[group.joints[item].joint.name]
                worst[k] = max(worst[k], value)
        return worst

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
