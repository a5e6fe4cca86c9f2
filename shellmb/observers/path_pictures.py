"""Picture of a static path: load factor over what the probes show, with its special points."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from shellmb.observers.curves import legend
from shellmb.observers.drawing import STYLE, figure
from shellmb.observers.probes import UNITS
from shellmb.scene import Probe
from shellmb.simulate.branches import PointOnPath

MARKS = {"limit point": "o", "bifurcation": "D"}


def draw_path(
    path: Path, history: pd.DataFrame, probes: Sequence[Probe], points: Sequence[PointOnPath]
) -> None:
    """Draw the load factor over each kind of probe; on rank 0.

    Args:
        path: The picture.
        history: The history.
        probes: What to draw it over; of none there is no picture.
        points: Limit points and bifurcations.
    """
    if not probes or len(history) < 2:
        return
    # on a stack of its own, as the other pictures (`pictures.draw` says why)
    with ThreadPoolExecutor(1) as thread:
        thread.submit(_draw, path, history, list(probes), list(points)).result()


def _draw(
    path: Path, history: pd.DataFrame, probes: list[Probe], points: list[PointOnPath]
) -> None:
    kinds = list(dict.fromkeys(p.quantity for p in probes))
    with mpl.rc_context(STYLE):
        made = figure(6.4, 0.6 + 3.6 * len(kinds))
        every = made.subplots(len(kinds), 1, squeeze=False)[:, 0]
        for kind, axes in zip(kinds, every, strict=True):
            for probe in probes:
                if probe.quantity == kind:
                    _curve(axes, history, probe.name, points)
            axes.set(xlabel=f"{kind.replace('_', ' ')} [{UNITS[kind]}]", ylabel="load factor [-]")
            axes.axhline(0.0, color="0.8", linewidth=0.8, zorder=0)
            for name, mark in MARKS.items():
                if any(p.kind == name for p in points):
                    axes.plot([], [], mark, color="black", markerfacecolor="white", label=name)
            legend(axes)
        made.savefig(path)


def _curve(axes: Axes, history: pd.DataFrame, name: str, points: list[PointOnPath]) -> None:
    t, values, load = (history[c].to_numpy(float) for c in ("t", name, "load_factor"))
    (line,) = axes.plot(values, load, ".-", linewidth=1.0, markersize=3, label=name)
    for point in points:
        at = float(np.interp(point.t, t, values))
        axes.plot(at, point.load_factor, MARKS[point.kind], color=line.get_color(), mfc="white")
