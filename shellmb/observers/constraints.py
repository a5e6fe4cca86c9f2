"""How well constraints hold: the length of the directors, and those between bodies."""

from __future__ import annotations

from typing import Any

from mpi4py import MPI

from shellmb.simulate.simulation import Silent, Simulation


class Constraints(Silent):
    """Largest constraint errors; nothing in linear statics, where constraints are linearised.

    Attributes:
        director_max: Largest deviation of a director's length from one so far; None if not
            measured.
        constraint_max: Largest violation of any constraint so far, that one included.
    """

    def __init__(self) -> None:
        self.director_max: float | None = None
        self.constraint_max: float | None = None
        self._now: dict[str, float] = {}

    def start(self, simulation: Simulation) -> None:
        """Take the errors at the start."""
        self.accepted(simulation)

    def accepted(self, simulation: Simulation) -> None:
        """Take the errors."""
        if simulation.scheme.linear:
            return
        model, levels = simulation.model, simulation.problem.levels
        errors = {b.name: b.constraint_error(levels[b.name].q) for b in model.bodies}
        local = max(errors[name] for name in model.shells), max(errors.values())
        director, every = (model.comm.allreduce(value, op=MPI.MAX) for value in local)
        self._now = {"director_error": director, "constraint_error": every}
        self.director_max = max(self.director_max or 0.0, director)
        self.constraint_max = max(self.constraint_max or 0.0, every)

    def measure(self) -> dict[str, float]:
        """Columns of the history."""
        return dict(self._now)

    def state(self) -> dict[str, Any]:
        """The largest errors so far."""
        return {"director_max": self.director_max, "constraint_max": self.constraint_max}

    def restore(self, state: dict[str, Any]) -> None:
        """Take up saved errors."""
        self.director_max = state["director_max"]
        self.constraint_max = state["constraint_max"]
