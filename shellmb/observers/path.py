"""Columns of the history that only paths have: load factor and stability."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

from shellmb.simulate.simulation import BaseObserver, Simulation


class PathRecord(BaseObserver):
    """Records where on a static path a run is; of other runs nothing.

    Attributes:
        values: `load_factor`, its derivative `load_rate` by the arc length, and `unstable`, the
            number of directions in which the state is unstable: NaN where that is not known.
    """

    def __init__(self) -> None:
        self.values: dict[str, float] = {}

    def start(self, simulation: Simulation) -> None:
        """Take the values at the start."""
        self.idle = simulation.path is None
        self.accepted(simulation)

    def accepted(self, simulation: Simulation) -> None:
        """Take the values."""
        path = simulation.path
        if path is not None:
            unstable = math.nan if path.unstable is None else path.unstable
            self.values = {
                "load_factor": path.factor,
                "load_rate": path.here.rate,
                "unstable": float(unstable),
            }

    def measure(self) -> dict[str, float]:
        """Columns of the history."""
        return dict(self.values)


def path_points(simulation: Simulation) -> dict[str, Any]:
    """Limit points and bifurcations as `path` of the summary; nothing of runs without a path."""
    if simulation.path is None:
        return {}
    return {"path": [asdict(point) for point in simulation.path.points]}
