"""Enclosed volumes and their pressures."""

from __future__ import annotations

from shellmb.simulate.simulation import BaseObserver, Simulation


class Volumes(BaseObserver):
    """Enclosed volumes [m^3] at the end of a step, and their pressures [Pa] over that outside.

    Attributes:
        values: Columns of the history: `NAME.volume` and `NAME.pressure`. The pressure of a gas is
            that at the end of the step; of a given volume it is a mean over the step, NaN before
            the first one.
    """

    def __init__(self) -> None:
        self.values: dict[str, float] = {}

    def start(self, simulation: Simulation) -> None:
        """Take the volumes at the start."""
        self.idle = not simulation.model.volumes
        self.accepted(simulation)
        for volume in simulation.model.volumes:
            if volume.item.gas is None and simulation.last is None:
                self.values[f"{volume.item.name}.pressure"] = float("nan")

    def accepted(self, simulation: Simulation) -> None:
        """Take volumes and pressures."""
        for volume in simulation.model.volumes:
            levels = simulation.problem.levels[volume.filling.name]
            step = levels.unknown[simulation.problem.last]
            found = volume.filling.values(levels.q.x.array, step.x.array)
            for what, value in zip(("volume", "pressure"), found, strict=True):
                self.values[f"{volume.item.name}.{what}"] = value

    def measure(self) -> dict[str, float]:
        """Columns of the history."""
        return dict(self.values)
