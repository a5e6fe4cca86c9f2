"""Curves over time of a run: probes, energy balance, joints, steps, a static path."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.observers.drawing import STYLE, figure
from shellmb.observers.files.described import Described, ProbeLine
from shellmb.scene.lookup import listed

# columns of a history by name: a DataFrame, or arrays
Table = Mapping[str, Any]

# more curves in one plot cannot be told apart
MANY = 8

# curves nearer than this part of their size are one to the eye
SAME = 5e-3

# a quantity below this part of what is large in the scene is round-off
NOTHING = 1e-9

# of curves on top of one another
DASHES = ("-", "--", ":")

ENERGIES = {
    "kinetic_energy": "kinetic",
    "strain_energy": "strain",
    "potential_energy": "contact and potentials",
    "total_energy": "total",
    "work_loads": "work of loads",
    "work_terms": "work of terms and dampers",
    "work_supports": "work of supports",
    "dissipation": "dissipated",
}

# what a probe's unit is of
# in motion these are means over a step
RESULTANTS = ("force", "moment", "membrane", "bending", "shear")
QUANTITIES = {
    "displacement": "length",
    "position": "length",
    "velocity": "velocity",
    "director": "number",
    "rotation": "angle",
    "angular_velocity": "angular velocity",
    "force": "force",
    "moment": "moment",
    "membrane": "force per length",
    "bending": "moment per length",
    "shear": "force per length",
}

MARKS = {"limit point": "o", "bifurcation": "D"}


def plot_history(
    history: Table,
    scene: Described,
    columns: str | Sequence[str] | None = None,
    errors: Mapping[str, float] | None = None,
) -> Figure:
    """Columns over time in one figure.

    Args:
        history: The history.
        scene: The scene.
        columns: Names of columns; None: the probes, or the energies where there are none.
        errors: Estimated errors by column, drawn as bands.

    Raises:
        SceneError: If there is no such column.
    """
    with mpl.rc_context(STYLE):
        if columns is None:
            return probes(history, scene, errors) if scene.probes else energies(history, scene)
        names = [columns] if isinstance(columns, str) else list(columns)
        missing = next((n for n in names if n not in history), None)
        if missing is not None:
            raise SceneError(f"plot: there is no column '{missing}'; there are {listed(history)}")
        made = figure(7.0, 3.4)
        axes = made.subplots()
        _over_time(axes, history, names, errors)
        axes.set_xlabel(scene.time_label)
        known = {probe.name: probe.quantity for probe in scene.probes}
        if len(kinds := {known.get(name) for name in names}) == 1 and (kind := kinds.pop()):
            axes.set_ylabel(_label(scene, kind))
        return made


def probes(history: Table, scene: Described, errors: Mapping[str, float] | None = None) -> Figure:
    """One plot for each quantity that is probed.

    Args:
        history: The history.
        scene: The scene.
        errors: Estimated errors by probe, drawn as bands.
    """
    kinds = list(dict.fromkeys(p.quantity for p in scene.probes))
    made, every = _rows(len(kinds), 2.8)
    for kind, axes in zip(kinds, every, strict=True):
        _over_time(axes, history, [p.name for p in scene.probes if p.quantity == kind], errors)
        mean = "mean " if scene.dynamic and kind in RESULTANTS else ""
        axes.set_ylabel(mean + _label(scene, kind))
    every[-1].set_xlabel(scene.time_label)
    return made


def _over_time(
    axes: Axes, history: Table, names: Sequence[str], errors: Mapping[str, float] | None
) -> None:
    """Columns over time, with a band about each curve whose error is known."""
    draw_curves(axes, _column(history, "t"), {name: _column(history, name) for name in names})
    for line in list(axes.lines):
        error = (errors or {}).get(str(line.get_label()))
        if error:
            t, y = (np.asarray(values, dtype=float) for values in line.get_data())
            color, label = line.get_color(), f"{line.get_label()}: error (rms)"
            axes.fill_between(t, y - error, y + error, alpha=0.25, color=color, lw=0, label=label)
    legend(axes)


def joints(history: Table, scene: Described, size: float) -> Figure | None:
    """Coordinates of joints, what acts on them, and what they carry; None without any."""
    if not (plots := joint_plots(history, scene, size)):
        return None
    made, every = _rows(len(plots), 2.3)
    for plot, axes in zip(plots, every, strict=True):
        draw_curves(axes, _column(history, "t"), plot.curves)
        axes.set_ylabel(plot.label)
        total = len(plot.curves) + plot.hidden
        legend(axes, title=f"the largest of {total}" if plot.hidden else None)
    every[-1].set_xlabel(scene.time_label)
    return made


def energies(history: Table, scene: Described) -> Figure:
    """Energies and work, and below them how well the balance closes."""
    made = figure(7.0, 6.0)
    above, below = made.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    shown = {}
    for name, label in ENERGIES.items():
        if name in history and np.any(_column(history, name)):
            drivers = ", drivers" if name == "work_supports" and scene.drivers else ""
            shown[label + drivers] = _column(history, name)
    t = _column(history, "t")
    draw_curves(above, t, shown)
    above.set_ylabel(scene.labels.label("energy, work", "energy"))
    legend(above, 3)
    if "energy_balance" in history:
        scale = float(np.abs(_column(history, "total_energy")).max())
        error = np.abs(_column(history, "energy_balance")) / (scale or 1.0)
        # zeros have no place on a logarithmic axis: they are drawn where round-off ends
        floor = float(np.finfo(float).eps) / 10
        below.semilogy(t, np.maximum(error, floor), linewidth=0.9)
    below.set(xlabel=scene.time_label, ylabel="error of the balance\n/ largest energy [-]")
    return made


def steps(history: Table, scene: Described) -> Figure:
    """Iterations and step sizes."""
    made = figure(7.0, 4.5)
    above, below = made.subplots(2, 1, sharex=True)
    t, dt, iterations = (_column(history, n)[1:] for n in ("t", "dt", "iterations"))
    marker = "." if len(t) < 30 else None
    for axes, values in ((above, iterations), (below, dt)):
        axes.step(t, values, where="pre", linewidth=1.0, marker=marker)
        axes.set_ylim(0, 1.1 * float(values.max()) or 1.0)
    above.set_ylabel("Newton iterations")
    above.yaxis.set_major_locator(mpl.ticker.MaxNLocator(integer=True))
    unit = scene.labels.label("step", "time") if scene.dynamic else "step [-]"
    below.set(xlabel=scene.time_label, ylabel=unit)
    return made


def path(history: Table, scene: Described, points: Sequence[Mapping[str, Any]]) -> Figure:
    """Load factor over what the probes show, with limit points and bifurcations.

    Args:
        history: The history.
        scene: The scene, with probes.
        points: Special points, as the summary has them.
    """
    kinds = list(dict.fromkeys(p.quantity for p in scene.probes))
    made, every = _rows(len(kinds), 3.6, width=6.4, share=False)
    for kind, axes in zip(kinds, every, strict=True):
        for probe in scene.probes:
            if probe.quantity == kind:
                _path_curve(axes, history, probe, points)
        axes.set(xlabel=_label(scene, kind), ylabel="load factor [-]")
        axes.axhline(0.0, color="0.8", linewidth=0.8, zorder=0)
        for name, mark in MARKS.items():
            if any(p["kind"] == name for p in points):
                axes.plot([], [], mark, color="black", markerfacecolor="white", label=name)
        legend(axes)
    return made


def _path_curve(
    axes: Axes, history: Table, probe: ProbeLine, points: Sequence[Mapping[str, Any]]
) -> None:
    t, values, load = (_column(history, c) for c in ("t", probe.name, "load_factor"))
    (line,) = axes.plot(values, load, ".-", linewidth=1.0, markersize=3, label=probe.name)
    for point in points:
        at = float(np.interp(point["t"], t, values))
        mark = MARKS[point["kind"]]
        axes.plot(at, point["load_factor"], mark, color=line.get_color(), mfc="white")


def column_label(scene: Described, name: str) -> str:
    """Label of the axis of a column: its name, with the unit of a probe.

    Args:
        scene: The scene.
        name: The column.
    """
    found = next((p.quantity for p in scene.probes if p.name == name), None)
    return name if found is None else scene.labels.label(name, QUANTITIES[found])


def _label(scene: Described, quantity: str) -> str:
    return scene.labels.label(quantity.replace("_", " "), QUANTITIES[quantity])


def _rows(
    count: int, height: float, width: float = 7.0, share: bool = True
) -> tuple[Figure, list[Axes]]:
    """A figure with plots one below the other."""
    made = figure(width, 0.6 + height * count)
    return made, list(made.subplots(count, 1, sharex=share, squeeze=False)[:, 0])


def _column(history: Table, name: str) -> Floats:
    return np.asarray(history[name], dtype=float)


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
        return {name: _column(history, name) for name in names if name in history}

    def sizes(letter: str) -> dict[str, Floats]:
        # NaN before the first step stays
        return {
            name: np.sqrt(sum(_column(history, f"{name}.{letter}{k}") ** 2 for k in (1, 2, 3)))
            for name in joints
            if f"{name}.{letter}1" in history
        }

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
