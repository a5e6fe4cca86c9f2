"""Jumps at the starts of the steps of an energy-decaying run, as a measure of its accuracy.

ED lets the state jump from i to j at the start of a step (eqs. 28-31). In the exact motion there is
no jump; what is left of it, `q_j - q_i = -dt (a - alpha b)/6` with the differences `a`, `b` of
velocities of eq. (31), is of second order in the step where the motion is resolved. Measured: of
second order in a rigid mechanism, of about first order where a sudden load excites all frequencies
(`shellmb study`, column "jump"). The step control rejects and chooses steps by it
(`StepControl.jump_tolerance`, `simulate.control`).

It is an indicator of the error of one step and no bound on that of the state, which is of another
order and adds up over the steps. What it is good for: to see *when* a run is least accurate, and
whether a run with half the step is better there, as it should be.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

# points of the series that is kept
POINTS = 50
UNIT = "1: jump of positions over the size of the body, jump of directors (unit vectors)"


def jump_error(rows: Sequence[Mapping[str, float]], points: int = POINTS) -> dict[str, Any] | None:
    """The jumps of a run over time.

    Args:
        rows: Rows of the history.
        points: Largest number of points of the series.

    Returns:
        `max` and `time_of_max` [s], `mean` over time, and a series: `t` [s] are the ends of the
        steps with the largest jumps of as many equal parts of the run, `largest` these jumps; and
        the `unit`. All jumps are those of the part of the unknowns where they are largest, relative
        to its scale. None where the scheme has no jumps.
    """
    steps = [row for row in rows if not math.isnan(row["jump"])]
    if not steps:
        return None
    worst = max(steps, key=lambda row: row["jump"])
    span = sum(row["dt"] for row in steps)
    count = min(points, len(steps))
    bounds = [round(k * len(steps) / count) for k in range(count + 1)]
    series = [max(steps[a:b], key=lambda row: row["jump"]) for a, b in pairwise(bounds)]
    return {
        "unit": UNIT,
        "max": worst["jump"],
        "time_of_max": worst["t"],
        "mean": sum(row["jump"] * row["dt"] for row in steps) / span,
        "t": [row["t"] for row in series],
        "largest": [row["jump"] for row in series],
    }
