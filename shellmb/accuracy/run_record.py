"""Records of a run for comparison with others: results, history, events.

Vibrations that steps are too large for are told from the record alone, as no larger step tells of
them.

*In the curve.* Where a motion is smooth, a cubic spline through every second value misses the
others by far less than one through every fourth, with the fourth power of the spacing, and by a
factor of three at a corner. Vibrations with a few steps to a period are missed by both alike. A
curve with them is off by as much as they are large, and with finer steps they have another phase,
so twice the square: their root mean square times the root of two.

*Not in the curve.* A dissipative scheme takes them out of the run, and out of all comparison runs,
which therefore agree. What tells is the energy `D` that the scheme has taken. In vibrations, that
is a velocity of `v sqrt(D/T)` where the motion has the velocity `v` and the kinetic energy `T`.
What a scheme damps within a run has a few radians to a step, so displacements are this velocity
times a part of the step. Rigid bodies alone have no such vibrations.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, isfinite, isnan, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.interpolate import CubicSpline

from shellmb.accuracy.studies.quantity import Quantity
from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.running.execute import RunResult
from shellmb.running.results import plain_results
from shellmb.scene import Scene
from shellmb.scene.probes import RESULTANTS

if TYPE_CHECKING:
    import pandas as pd

# steps of a curve that tells of vibrations
ENOUGH = 16
# by how much a spline through half as many values misses more, where there are no vibrations
SMOOTH = 2.0
# vibrations below this part of the curve may be round-off, or of Newton's tolerance
LEAST = 1e-7
# inverse of the radians that a damped vibration goes through in a step
RADIANS = 0.3


def alternating(t: Floats, y: Floats) -> float:
    """Error of a curve by vibrations in it that its steps do not follow; 0 if there are none.

    Args:
        t: Times [s].
        y: Values.
    """
    if len(t) < ENOUGH:
        return 0.0
    half, quarter = (_missed(t, y, every) for every in (2, 4))
    there = half > LEAST * _rms(y) and quarter < SMOOTH * half
    return sqrt(2.0) * half if there else 0.0


def damped(history: pd.DataFrame, name: str) -> float:
    """Error of a curve by vibrations that the scheme has taken out of it.

    Args:
        history: The history of a run, with the energies that a scheme without dissipation lacks.
        name: The column.
    """
    if not {"dissipation", "kinetic_energy"} <= set(history.columns) or len(history) < ENOUGH:
        return 0.0
    t, y = (history[column].to_numpy(dtype=float) for column in ("t", name))
    taken = float(np.abs(history["dissipation"]).max())
    moving = _rms(np.sqrt(np.abs(history["kinetic_energy"].to_numpy(dtype=float)))) ** 2
    if not (np.isfinite(y).all() and isfinite(taken) and moving > 0):
        return 0.0
    size = float(np.diff(t).max())
    return RADIANS * size * _rms(np.gradient(y, t)) * sqrt(taken / moving)


def _missed(t: Floats, y: Floats, every: int) -> float:
    """Root mean square of what a spline through some of the values misses of all."""
    chosen = np.unique(np.append(np.arange(0, len(t), every), len(t) - 1))
    return _rms(CubicSpline(t[chosen], y[chosen])(t) - y)


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))


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
        plain_results(run.summary), run.history, events, means, seconds, run.simulation.step, cpu
    )


def means_of(result: RunResult) -> set[str]:
    """Names of columns that are means over a step: those of sections, and all without a start.

    Args:
        result: A run.
    """
    forms = result.simulation.problem.forms.values()
    stages = [made.stage for rows in forms for made in rows.values()]
    # schemes with a single state have forces at the ends of steps, and no means
    if all(stage is not None and stage.single for stage in stages):
        return set()
    history, scene = result.history, result.simulation.scene
    sections = {probe.name for probe in scene.probes if probe.quantity in RESULTANTS}
    sections |= {reserve.name for reserve in scene.reserves}
    return sections | {str(name) for name in history if isnan(history[name].iloc[0])}


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
