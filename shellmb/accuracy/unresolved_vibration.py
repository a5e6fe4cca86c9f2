"""Vibrations that steps are too large for, which no larger step tells of.

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

from math import isfinite, sqrt
from typing import TYPE_CHECKING

import numpy as np
from scipy.interpolate import CubicSpline

from shellmb.arrays import Floats

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
