"""Measures of motions: schemes and their orders, slopes of errors, drifts of momenta."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from shellmb.arrays import Floats
from shellmb.scene.schemes import DISSIPATIVE

PAPER = (("ep", 0.0), ("ed", 0.0), ("ed", 0.5), ("ed", 1.0))
QUADRATIC = (("ep4", 0.0), ("ed3", 1.0))
SCHEMES = (*PAPER, *QUADRATIC)
# in large rotations, whatever the dissipation
LARGE = {"ep": 2, "ed": 2, "ep4": 4, "ed3": 3}
# of the energy law, relative: what Newton's method leaves
ENERGY = 1e-9


def title(scheme: str, alpha: float) -> str:
    """A scheme in words."""
    return scheme.upper() + (f" alpha={alpha:g}" if scheme in DISSIPATIVE else "")


def order(error: Callable[[int], float | np.floating], counts: Sequence[int]) -> float:
    """Slope of an error over the step size, by regression.

    Args:
        error: The error with so many steps.
        counts: Numbers of steps.
    """
    errors = [float(error(n)) for n in counts]
    return float(-np.polyfit(np.log(counts), np.log(errors), 1)[0])


def drift(rows: Sequence[Mapping[str, float]], momentum: str, begin: float) -> float:
    """Largest change of a momentum in free flight, relative to its size.

    Args:
        rows: Rows of the history.
        momentum: "momentum" or "angular_momentum".
        begin: Time from which the body flies freely, s.
    """
    flight = [row for row in rows if row["t"] >= begin]
    table: Floats
    table = np.array([[row[f"{momentum}_{axis}"] for axis in "xyz"] for row in flight])
    change = np.linalg.norm(table - table[0], axis=1)
    return float(np.max(change) / np.max(np.linalg.norm(table, axis=1)))
