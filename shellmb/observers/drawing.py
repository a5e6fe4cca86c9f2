"""How curves are drawn with matplotlib: their style, and figures that need no display."""

from __future__ import annotations

from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

STYLE: dict[Any, Any] = {
    "font.size": 10,
    "axes.grid": True,
    "grid.alpha": 0.3,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "figure.dpi": 150,
    "savefig.dpi": 150,
    # small and large numbers share one power of ten at the end of their axis
    "axes.formatter.limits": (-3, 5),
}


def figure(width: float, height: float) -> Figure:
    """A figure that is drawn into memory only.

    Args:
        width: Width, inches.
        height: Height, inches.
    """
    made = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(made)
    return made
