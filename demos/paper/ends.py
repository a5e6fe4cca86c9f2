"""Values at the ends of steps from the means over them, as the paper's curves of EP have them."""

from __future__ import annotations

import numpy as np

from demos.paper.example import FinishedRun
from shellmb.arrays import Floats

__all__ = ["as_curve", "at_the_ends"]


def at_the_ends(means: Floats) -> Floats:
    """Resultants at the ends of EP's steps from their means, beginning without any.

    The averaged stress of the mid-point scheme, `(S_i + S_f)/2`, takes away most of what changes
    from step to step; a curve of values at the ends shows it.

    Args:
        means: Means over the steps, the first one before any step, shape (rows,).
    """
    steps = np.arange(len(means))
    signs = (-1.0) ** steps
    # S_n = 2 m_n - S_(n-1)
    return np.asarray(signs * np.cumsum(np.where(steps, 2 * signs * np.nan_to_num(means), 0.0)))


def as_curve(run: FinishedRun, means: Floats) -> Floats:
    """Resultants of a run as a curve: in EP at the ends of steps, else the means, which are quiet.

    Args:
        run: The run.
        means: Means over its steps, shape (rows,).
    """
    return at_the_ends(means) if run.scene.scheme_name == "ep" else means
