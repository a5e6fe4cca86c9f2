"""Section 6.1 of the paper: lateral buckling of a thin plate, its runs and figures 4 to 8."""

from __future__ import annotations

from typing import Any

import matplotlib.figure
import numpy as np
from matplotlib.axes import Axes

from demos.paper.ends import as_curve
from demos.paper.example import Example, Figure, FinishedRun, Results, Run
from demos.paper.examples.lateral_growth import GROWTH, growth_figure
from demos.paper.examples.lateral_statements import STATEMENTS
from demos.paper.pictures import shapes
from shellmb.demos.lateral_buckling import lateral, shear_force

DEMO = "lateral_buckling"
# a whole turn takes 6.28 s; what buckling starts is seen in the first of them
ONSET = 0.3
FINE: dict[str, Any] = {"dt": 2.5e-4, "t_end": 0.5}
COLOURS = {
    "shell-ed": "C0",
    "beam-ed": "C1",
    "shell-ep": "C3",
    "beam-ep": "C2",
    "shell-ed0": "C4",
    "shell-ep4": "C3",
    "shell-ed3": "C0",
}
LABELS = {
    "shell-ed": "shell, ED",
    "beam-ed": "beam, ED",
    "shell-ep": "shell, EP",
    "beam-ep": "beam, EP",
    "shell-ed0": "shell, ED with alpha = 0",
    "shell-ep4": "shell, EP4",
    "shell-ed3": "shell, ED3",
}
ALL = ("shell-ed", "beam-ed", "shell-ep", "beam-ep")
ZERO = ("shell-ep", "shell-ed0", "shell-ed")
# the noisier first, as it covers the other
PAPER, OURS = ("shell-ep", "shell-ed"), ("shell-ep4", "shell-ed3")
SHAPES = (0.1, 0.15, 0.5, 1.0, 1.55, 3.15, 3.65, 4.7, 6.3)

RUNS = (
    Run("shell-ed", DEMO, {"model": "shell"}, {"scheme": "ed"}),
    Run("shell-ep", DEMO, {"model": "shell"}, {"scheme": "ep"}),
    Run("beam-ed", DEMO, {"model": "beam"}, {"scheme": "ed"}),
    Run("beam-ep", DEMO, {"model": "beam"}, {"scheme": "ep"}),
    # beyond the paper: the schemes that are quadratic in time
    Run("shell-ep4", DEMO, {"model": "shell"}, {"scheme": "ep4"}),
    Run("shell-ed3", DEMO, {"model": "shell"}, {"scheme": "ed3"}),
    # section 6 of the paper calls alpha = 0 of the ED family EP, section 3 the mid-point scheme
    Run("shell-ed0", DEMO, {"model": "shell"}, {"scheme": "ed", "alpha": 0.0, "t_end": 1.0}),
    Run("fine-time", DEMO, {"model": "shell"}, {"scheme": "ed", **FINE}),
    Run("fine-time-ep", DEMO, {"model": "shell"}, {"scheme": "ep", **FINE}),
    Run("fine-mesh", DEMO, {"model": "shell"}, {"scheme": "ed", "mesh": (12, 4), "t_end": ONSET}),
    *GROWTH,
)


def _aside(run: FinishedRun) -> Any:
    return lateral(run.history)


def _torque(run: FinishedRun) -> Any:
    return run.history["drive.torque"].to_numpy()


def _mean_force(run: FinishedRun) -> Any:
    return shear_force(run.history)


def _force(run: FinishedRun) -> Any:
    return as_curve(run, _mean_force(run))


def _curve(axes: Axes, results: Results, name: str, values: Any, **style: Any) -> None:
    """One curve of a run; those of EP thin, as they cover everything else."""
    thin = not name.endswith(("-ed", "-ed3"))
    settings: dict[str, Any] = {
        "color": COLOURS[name],
        "label": LABELS[name],
        "linewidth": 0.5 if thin else 1.1,
    }
    axes.plot(results[name].history["t"], values(results[name]), **(settings | style))


def _pair(axes: Axes, results: Results, names: tuple[str, ...], values: Any) -> None:
    for name in names:
        _curve(axes, results, name, values)
    axes.legend(loc="best", fontsize=8)


def _shapes(made: matplotlib.figure.Figure, results: Results) -> None:
    states, plate = results["shell-ed"].states, ("plate", "stiffener")
    shapes(made, states, SHAPES, only=plate, panel=(3.5, 1.8))


def _sideways(made: matplotlib.figure.Figure, results: Results) -> None:
    above, below = made.subplots(2, 1, sharex=True)
    _pair(above, results, ("shell-ed", "beam-ed"), _aside)
    for name in ("shell-ep", "beam-ep"):
        _curve(below, results, name, _aside, linewidth=1.1)
    below.legend(loc="best", fontsize=8)
    for axes in (above, below):
        axes.set_ylabel("lateral displacement\nat mid-span [m]")
    below.set_xlabel("time [s]")


def _onset(made: matplotlib.figure.Figure, results: Results) -> None:
    axes = made.subplots()
    for name in ALL:
        _curve(axes, results, name, _aside, linewidth=1.1)
    axes.legend(fontsize=8)
    shown = [lateral(r.history)[r.history["t"] < ONSET] for r in (results[n] for n in ALL)]
    low, high = min(map(np.min, shown)), max(map(np.max, shown))
    axes.set(xlim=(0.08, ONSET), ylim=(low - 0.005, high + 0.005))
    axes.set(xlabel="time [s]", ylabel="lateral displacement at mid-span [m]")


def _forces(values: Any, label: str) -> Any:
    """ED before EP, shell above beam, the whole turn and its beginning."""

    def draw(made: matplotlib.figure.Figure, results: Results) -> None:
        made.set_size_inches(9.0, 5.6)
        rows = made.subplots(2, 2, width_ratios=(3, 2))
        for row, model in zip(rows, ("shell", "beam"), strict=True):
            for axes in row:
                _pair(axes, results, (f"{model}-ep", f"{model}-ed"), values)
            row[0].set_ylabel(label)
            row[1].set_xlim(0, ONSET)
            # of EP as much as fits beside ED
            ed = results[f"{model}-ed"].history
            early = ed["t"].to_numpy() < ONSET
            seen = values(results[f"{model}-ed"])[early]
            low, high = np.nanmin(seen), np.nanmax(seen)
            row[1].set_ylim(low - 0.5 * (high - low), high + 0.3 * (high - low))
        for axes in rows[-1]:
            axes.set_xlabel("time [s]")

    return draw


def _alpha(made: matplotlib.figure.Figure, results: Results) -> None:
    above, below = made.subplots(2, 1, sharex=True)
    for axes, values in ((above, _mean_force), (below, _torque)):
        _pair(axes, results, ZERO, values)
        axes.set_xlim(0, 1)
    above.set(ylabel="shear force at mid-span [N]", ylim=(-700, 500))
    below.set(xlabel="time [s]", ylabel="torque [N m]", ylim=(-40, 65))


def _orders(made: matplotlib.figure.Figure, results: Results) -> None:
    """The paper's schemes, and those that are quadratic in time; means over steps in all."""
    made.set_size_inches(9.0, 5.6)
    rows = made.subplots(2, 2, sharex=True, sharey="row")
    for row, values in zip(rows, (_mean_force, _torque), strict=True):
        for axes, names in zip(row, (PAPER, OURS), strict=True):
            _pair(axes, results, names, values)
            axes.set_xlim(0, 1)
    rows[0, 0].set(ylabel="shear force at mid-span [N]")
    rows[1, 0].set(ylabel="torque [N m]", ylim=(-25, 65))
    for axes in rows[1]:
        axes.set_xlabel("time [s]")


def _fine_mesh(made: matplotlib.figure.Figure, results: Results) -> None:
    above, below = made.subplots(2, 1, sharex=True)
    for k, (name, label) in enumerate({"shell-ed": "6 x 2", "fine-mesh": "12 x 4"}.items()):
        h = results[name].history
        # which side it goes to is for round-off to tell
        above.plot(h["t"], np.abs(lateral(h)), color=f"C{k}", label=label, linewidth=1.1)
        below.plot(h["t"], _torque(results[name]), color=f"C{k}", label=label, linewidth=1.1)
    for axes in (above, below):
        axes.set_xlim(0, ONSET)
        axes.legend(fontsize=8)
    above.set(ylabel="lateral displacement\nat mid-span, magnitude [m]", ylim=(0, 0.08))
    below.set(xlabel="time [s]", ylabel="torque [N m]")


def _fine_time(made: matplotlib.figure.Figure, results: Results) -> None:
    """EP and ED, each with both steps."""
    made.set_size_inches(9.0, 5.6)
    rows = made.subplots(2, 2, sharex=True, sharey="row")
    for row, values in zip(rows, (_force, _torque), strict=True):
        for axes, coarse, fine in (
            (row[0], "shell-ed", "fine-time"),
            (row[1], "shell-ep", "fine-time-ep"),
        ):
            for k, (name, label) in enumerate({fine: "0.25 ms", coarse: "1 ms"}.items()):
                run, label = results[name], f"{LABELS[coarse]}, {label}"
                style = {"color": f"C{1 - k}", "label": label, "linewidth": 0.7}
                axes.plot(run.history["t"], values(run), **style)
            axes.legend(fontsize=8)
            axes.set_xlim(0, FINE["t_end"])
    rows[0, 0].set(ylabel="shear force at mid-span [N]", ylim=(-900, 600))
    rows[1, 0].set(ylabel="torque [N m]", ylim=(-30, 65))
    for axes in rows[1]:
        axes.set_xlabel("time [s]")


EXAMPLE = Example(
    "6.1",
    "Lateral buckling of a thin plate",
    RUNS,
    (
        Figure(
            "4",
            "The plate at various times (shell model, ED). As it snaps sideways it bends and "
            "twists, which the spherical joint at its corner allows.",
            ("shell-ed",),
            _shapes,
        ),
        Figure(
            "5",
            "Lateral displacement at mid-span, ED above, EP below, shell and beam model. The "
            "paper: good agreement between the models and between the schemes; the sign is "
            "immaterial.",
            ALL,
            _sideways,
        ),
        Figure(
            "6",
            "The onset of buckling. The paper: sudden lateral deflection and oscillations, the "
            "models agree qualitatively.",
            ALL,
            _onset,
        ),
        Figure(
            "7",
            "In-plane shear force at mid-span, that of the whole section; of EP at the ends of "
            "steps, of ED means over them. The paper: EP shows oscillations an order of magnitude "
            "larger than ED.",
            ALL,
            _forces(_force, "shear force [N]"),
        ),
        Figure(
            "8",
            "Torque on the crank. The paper: linear up to 60 N.m, an abrupt drop, then the same "
            "noise in EP.",
            ALL,
            _forces(_torque, "torque [N m]"),
        ),
        growth_figure("8b"),
        Figure(
            "8c",
            "Ours: force and torque of the ED family with alpha = 0, which section 6 of the paper "
            "calls EP, beside EP (the mid-point scheme of section 3) and ED; means over steps.",
            ZERO,
            _alpha,
        ),
        Figure(
            "8d",
            "Ours: steps of a quarter. EP's oscillations of F12 shrink, ED's grow: what ED takes "
            "away at 1 ms is partly real, in-plane vibrations of 3 and fewer steps.",
            ("shell-ed", "fine-time", "shell-ep", "fine-time-ep"),
            _fine_time,
        ),
        Figure("8e", "Ours: a finer mesh (ED).", ("shell-ed", "fine-mesh"), _fine_mesh),
        Figure(
            "8f",
            "Ours: the schemes that are quadratic in time, EP4 beside EP, ED3 beside ED.",
            (*PAPER, *OURS),
            _orders,
        ),
    ),
    STATEMENTS,
    animation="shell-ed",
)
