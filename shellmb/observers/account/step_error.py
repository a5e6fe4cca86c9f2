"""Record of step control by error, for the history and the summary."""

from __future__ import annotations

from typing import Any

from shellmb.simulate.simulation import BaseObserver, Simulation
from shellmb.simulate.stepsize.tolerance import ErrorSize

UNIT = "1: error by the time a motion as large as the body has turned by 1 rad, over its size"


class StepError(BaseObserver):
    """The estimated error of each step, for the history of runs that are controlled by it."""

    def __init__(self) -> None:
        self._controlled, self._error = False, float("nan")

    def start(self, simulation: Simulation) -> None:
        """See whether there is one."""
        self._controlled = simulation.scene.step_control.step_error is not None
        self.idle = not self._controlled

    def accepted(self, simulation: Simulation) -> None:
        """Take it."""
        last = simulation.last
        if last is not None and last.error is not None:
            self._error = last.error

    def measure(self) -> dict[str, float]:
        """Error of the step, where there is one."""
        return {"error_estimate": self._error} if self._controlled else {}


def controlled(simulation: Simulation) -> dict[str, Any] | None:
    """Record of step control for `summary.json`; None without one.

    Args:
        simulation: The simulation.
    """
    size = simulation.size
    if not isinstance(size, ErrorSize):
        return None
    return {
        "unit": UNIT,
        "step_error": size.settings.step_error,
        "accepted": simulation.step,
        "rejected": size.rejected,
        "largest_error": size.worst,
        "accumulated_error": size.total,
        "above_step_error": size.coarse,
        "dt_min": size.shortest,
        "dt_max": size.longest,
    }
