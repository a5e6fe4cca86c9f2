"""Records of a run for comparison with others: results, history, events."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, isfinite, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from shellmb.accuracy.studies.quantity import Quantity
from shellmb.accuracy.studies.runner import means_of
from shellmb.accuracy.unresolved_vibration import alternating
from shellmb.errors import SceneError
from shellmb.running.execute import RunResult
from shellmb.running.results import plain_results
from shellmb.scene import Scene

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class RunRecord:
    """A run without its simulation.

    Args:
        results: Its results.
        history: Its history.
        events: How often each event came.
        means: Columns of the history that are means over a step.
        seconds: Processor time of its steps [s]; 0 where it is not known.
        steps: Their number.
        cpu: Processor time of all of it [s]; 0 where it is not known.
    """

    results: Mapping[str, float]
    history: pd.DataFrame
    events: Mapping[str, int]
    means: frozenset[str]
    seconds: float
    steps: int
    cpu: float = 0.0

    def take(self, quantity: Quantity) -> dict[str, Any]:
        """Values of a quantity that are compared.

        Args:
            quantity: The quantity.

        Raises:
            SceneError: If there is none of that name.
        """
        return quantity.take(self.results, self.history, self.means)

    def size(self, quantity: Quantity) -> float:
        """The number that a quantity is, or the root mean square of a curve.

        Args:
            quantity: The quantity.
        """
        taken = self.take(quantity)
        return rms(taken) if quantity.is_curve else float(taken["value"])

    def extreme(self, name: str) -> Quantity | None:
        """The extreme of a column that a result is the value of at the end of a step; None if none.

        Functions of users may do anything, but mostly look for an extreme.

        Args:
            name: The result.
        """
        size = abs(self.results[name])
        for column in map(str, self.history if size else ()):
            values = self.history[column].to_numpy(dtype=float)
            known = values[np.isfinite(values)]
            ends = {"max": known.max(initial=-inf), "min": known.min(initial=inf)}
            for norm, extreme in ends.items():
                if abs(extreme) == size:
                    return Quantity(column, norm)
        return None

    def alternating(self, name: str) -> float:
        """Error of a curve by vibrations in it that steps do not follow.

        Args:
            name: Its column.
        """
        taken = self.take(Quantity(name, "l2"))
        return alternating(np.array(taken["t"]), np.array(taken["y"]))

    def columns(self, scene: Scene) -> list[str]:
        """Columns of the history that belong to probes.

        Args:
            scene: The scene.
        """
        names = [*(p.name for p in scene.probes), *(r.name for r in scene.reserves)]
        return [
            str(c)
            for c in self.history.columns
            if any(c == n or str(c).startswith(f"{n}.") for n in names)
        ]


def keep(run: RunResult, seconds: float = 0.0, cpu: float = 0.0) -> RunRecord:
    """Record of a run for comparison.

    Args:
        run: The run, at its end.
        seconds: Processor time of its steps [s].
        cpu: Processor time of all of it [s].
    """
    events = {k: len(e["times"]) for k, e in run.summary.get("events", {}).items()}
    means = frozenset(means_of(run))
    return RunRecord(
        plain_results(run.summary),
        run.history,
        events,
        means,
        seconds,
        run.simulation.step,
        cpu,
    )


def difference(fine: RunRecord, coarse: RunRecord, quantity: Quantity) -> float | None:
    """Difference of a run from a finer one, in the unit of the quantity; None if unknown.

    Args:
        fine: The finer one.
        coarse: The other one.
        quantity: What is compared.
    """
    try:
        reference, found = fine.take(quantity), coarse.take(quantity)
        size = abs(fine.size(quantity)) or 1.0
    except SceneError:
        return None
    away = quantity.difference(found, reference) * size
    return away if isfinite(away) else None


def rms(taken: Mapping[str, Any]) -> float:
    """Root mean square of a curve.

    Args:
        taken: Times and values.
    """
    t, y = np.array(taken["t"]), np.array(taken["y"])
    if len(t) < 2 or t[-1] <= t[0]:
        return float(np.abs(y).max(initial=0.0))
    return sqrt(float(np.trapezoid(y**2, t)) / float(t[-1] - t[0]))
