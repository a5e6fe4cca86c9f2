"""Curves over time drawn with matplotlib, and which columns of the history belong to joints."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from shellmb.arrays import Floats
from shellmb.observers.files.described import Described

# columns of a history by name: a DataFrame, or arrays
Table = Mapping[str, Any]

# more curves in one plot cannot be told apart
MANY = 8

# curves nearer than this part of their size are one to the eye
SAME = 5e-3

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
    curves: dict[str, Floats]
    hidden: int = 0


def draw_curves(axes: Axes, t: Floats, curves: Mapping[str, Floats]) -> None:
    """Curves with their points where they are few; what lies on another one is seen all the same.

    A curve that later ones coincide with is drawn so much wider, they are dashed on top of it.

    Args:
        axes: Where.
        t: Times.
        curves: Values by their names in the legend, NaN where there is none.
    """
    marker = "." if len(t) < 30 else None
    names = list(curves)
    reach = max((_largest({n: v}) for n, v in curves.items()), default=0.0)
    for k, name in enumerate(names):
        y = np.asarray(curves[name], dtype=float)
        before = sum(_coincide(y, curves[n], reach) for n in names[:k])
        behind = sum(_coincide(y, curves[n], reach) for n in names[k + 1 :])
        axes.plot(
            t,
            y,
            DASHES[min(before, len(DASHES) - 1)],
            label=name,
            linewidth=1.2 + 2.2 * behind,
            alpha=0.45 if behind else 1.0,
            marker=marker,
        )


# of curves on top of one another
DASHES = ("-", "--", ":")


def _coincide(a: Floats, b: Floats, reach: float) -> bool:
    both = np.isfinite(a) & np.isfinite(b)
    apart = np.abs(a - np.asarray(b, dtype=float))[both]
    return bool(len(apart)) and float(apart.max()) <= SAME * reach


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


def joint_plots(history: Table, scene: Described, size: float) -> list[Plot]:
    """Plots of joints: coordinates, what acts on them, sizes of forces and moments.

    In motion forces are means over a step, those of springs, dampers and motors values at its end.
    Curves that are nothing but round-off are left out.

    Args:
        history: The history.
        scene: The scene.
        size: Its size; a force is compared with moments by it.
    """
    joints, acting = list(scene.joints), [*scene.drivers, *scene.elements]

    def columns(owners: list[str], endings: Iterable[str]) -> dict[str, Floats]:
        names = (f"{owner}.{ending}" for ending in endings for owner in owners)
        return {name: np.asarray(history[name], float) for name in names if name in history}

    def sizes(letter: str) -> dict[str, Floats]:
        found = {}
        for name in joints:
            parts = [f"{name}.{letter}{k}" for k in (1, 2, 3)]
            if all(part in history for part in parts):
                # NaN before the first step stays
                found[name] = np.sqrt(sum(np.asarray(history[p], float) ** 2 for p in parts))
        return found

    label = scene.labels.label
    torques = columns(acting, ["torque"]) | columns(joints, ["lock_torque"])
    forces = columns(acting, ["force"]) | columns(joints, ["lock_force"])
    carried, couples = sizes("F"), sizes("M")
    effort = max(_largest(forces), _largest(carried), _largest(torques | couples) / size)
    mean = "mean " if scene.dynamic else ""
    plots = [
        _plot(label("rotation", "angle"), columns(joints, ["rotation"]), 1.0),
        _plot(label("translation", "length"), columns(joints, ["translation"]), size),
        _plot(label("length", "length"), columns(acting, ["length"]), size),
        _plot(label("torque", "moment"), torques, effort * size),
        _plot(label("force", "force"), forces, effort),
        _plot(label(f"|{mean}force in joint|", "force"), carried, effort),
        _plot(label(f"|{mean}moment in joint|", "moment"), couples, effort * size),
    ]
    return [plot for plot in plots if plot.curves]


def _largest(curves: Mapping[str, Floats]) -> float:
    return max((float(np.nanmax(np.abs(v), initial=0.0)) for v in curves.values()), default=0.0)


def _plot(label: str, curves: dict[str, Floats], large: float) -> Plot:
    """The largest curves of one kind in their order, without those that are nothing."""
    size = {name: _largest({name: values}) for name, values in curves.items()}
    something = [name for name in curves if size[name] > NOTHING * large]
    kept = sorted(something, key=lambda name: -size[name])[:MANY]
    shown = {name: curves[name] for name in something if name in kept}
    return Plot(label, shown, len(something) - len(shown))
