"""Histories of a tip, and how far they are from one another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from shellmb.arrays import Floats


@dataclass(frozen=True)
class TipHistory:
    """Deflection of the tip over time, and what it cost.

    Args:
        t: Times at the ends of the steps, and the start, s.
        u: Deflections, m.
        cpu_s: Processor time of the steps, s.
        wall_s: Wall time of the steps, s.
        iterations: Newton iterations per step.
        factorisations: Factorisations per step.
        failed: Why it ended early; "" if it did not.
    """

    t: Floats
    u: Floats
    cpu_s: float
    wall_s: float
    iterations: float
    factorisations: float
    failed: str = ""

    @property
    def peak(self) -> float:
        """Largest deflection at the end of a step, m."""
        return float(self.u.max())

    def at(self, times: Floats) -> Floats:
        """Deflection at any times, by a cubic spline through the ends of the steps, m."""
        # it starts from rest
        spline = CubicSpline(self.t, self.u, bc_type=((1, 0.0), "not-a-knot"))
        return np.asarray(spline(times))

    def apart(self, reference: TipHistory) -> tuple[Floats, Floats]:
        """Difference from a reference at all of its times, and the reference."""
        return self.at(reference.t) - reference.u, reference.u


def difference(history: TipHistory, reference: TipHistory) -> tuple[float, float]:
    """Error of a history over that time, at all times of the reference.

    So what a large step leaves out between its ends counts as an error.

    Returns:
        Relative error in the L2 norm over time, and the largest error over the largest deflection.
        Infinite for a history that ended early.
    """
    if history.failed:
        return np.inf, np.inf
    wrong, truth = history.apart(reference)
    l2 = np.linalg.norm(wrong) / np.linalg.norm(truth)
    return float(l2), float(np.abs(wrong).max() / np.abs(truth).max())
