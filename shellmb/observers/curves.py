"""Curves over time drawn with matplotlib, and which columns of the history belong to joints."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from shellmb.scene import Scene

# more curves in one plot cannot be told apart
MANY = 8

# a quantity below this part of what is large in the scene is round-off
NOTHING = 1e-9


@dataclass(frozen=True)
class Plot:
    """Curves with one unit.

    Args:
        label: What they are, with the unit.
        curves: Values by name, each one per row of the history.
        hidden: How many more there are, all smaller.
    """

    label: str
    curves: dict[str, pd.Series]
    hidden: int = 0


def line(axes: Axes, t: pd.Series, values: pd.Series, label: str, style: str = "-") -> None:
    """One curve, with its points where they are few.

    Args:
        axes: Where.
        t: Times.
        values: Values, NaN where there is none.
        label: Its name in the legend.
        style: Style of the line.
    """
    marker = "." if len(t) < 30 else None
    axes.plot(t, values, style, label=label, linewidth=1.2, marker=marker)


def legend(axes: Axes, columns: int = 4, title: str | None = None) -> None:
    """A legend above the axes, where it hides no curve.

    Args:
        axes: Where, with curves.
        columns: Number of columns at most.
        title: What is written above it.
    """
    if axes.lines:
        axes.legend(
            loc="lower right",
            bbox_to_anchor=(1.0, 1.0),
            ncols=min(columns, len(axes.lines)),
            title=title,
            alignment="left",
            fontsize=9,
            title_fontsize=9,
        )


def joint_plots(history: pd.DataFrame, scene: Scene, size: float) -> list[Plot]:
    """What joints do and carry: coordinates, what acts on them, sizes of forces and moments.

    In motion forces are means over a step, those of springs, dampers and motors values at its end.
    Curves that are nothing but round-off are left out.

    Args:
        history: The history.
        scene: The scene.
        size: Its size, m; a force is compared with moments by it.
    """
    joints = [joint.name for joint in scene.joints]
    acting = [*(d.name for d in scene.drivers), *(e.name for e in scene.elements)]

    def columns(owners: list[str], endings: Iterable[str]) -> dict[str, pd.Series]:
        names = (f"{owner}.{ending}" for ending in endings for owner in owners)
        return {name: history[name] for name in names if name in history}

    def sizes(letter: str) -> dict[str, pd.Series]:
        found = {}
        for name in joints:
            parts = [f"{name}.{letter}{k}" for k in (1, 2, 3)]
            if set(parts) <= set(history):
                # NaN before the first step stays
                found[name] = (history[parts] ** 2).sum(axis=1, skipna=False) ** 0.5
        return found

    torques = columns(acting, ["torque"]) | columns(joints, ["lock_torque"])
    forces = columns(acting, ["force"]) | columns(joints, ["lock_force"])
    carried, couples = sizes("F"), sizes("M")
    effort = max(_largest(forces), _largest(carried), _largest(torques | couples) / size)
    mean = "" if scene.static else "mean "
    plots = [
        _plot("rotation [rad]", columns(joints, ["rotation"]), 1.0),
        _plot("translation [m]", columns(joints, ["translation"]), size),
        _plot("length [m]", columns(acting, ["length"]), size),
        _plot("torque [N m]", torques, effort * size),
        _plot("force [N]", forces, effort),
        _plot(f"|{mean}force in joint| [N]", carried, effort),
        _plot(f"|{mean}moment in joint| [N m]", couples, effort * size),
    ]
    return [plot for plot in plots if plot.curves]


def _largest(curves: dict[str, pd.Series]) -> float:
    return max((float(np.nanmax(np.abs(v), initial=0.0)) for v in curves.values()), default=0.0)


def _plot(label: str, curves: dict[str, pd.Series], large: float) -> Plot:
    """The largest curves of one kind in their order, without those that are nothing."""
    size = {name: _largest({name: values}) for name, values in curves.items()}
    something = [name for name in curves if size[name] > NOTHING * large]
    kept = sorted(something, key=lambda name: -size[name])[:MANY]
    shown = {name: curves[name] for name in something if name in kept}
    return Plot(label, shown, len(something) - len(shown))
