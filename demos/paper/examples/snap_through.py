"""Section 6.2 of the paper: snap-through of a cylindrical shell, its runs and figures 10 to 14."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import matplotlib.figure
import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from demos.paper.ends import as_curve
from demos.paper.example import Example, Figure, Results, Run
from demos.paper.examples.snap_statements import SCHEMES, STATEMENTS
from demos.paper.pictures import shapes
from shellmb.demos.snap_through import follows, kinematic, strip_width

DEMO = "snap_through"
RUNS = (
    Run("shell-ed", DEMO, {"model": "shell"}, {"scheme": "ed"}),
    Run("shell-ep", DEMO, {"model": "shell"}, {"scheme": "ep"}),
    # beyond the paper: the schemes that are quadratic in time
    Run("shell-ep4", DEMO, {"model": "shell"}, {"scheme": "ep4"}),
    Run("shell-ed3", DEMO, {"model": "shell"}, {"scheme": "ed3"}),
    # section 6 of the paper calls alpha = 0 of the ED family EP, section 3 the mid-point scheme
    Run("shell-ed0", DEMO, {"model": "shell"}, {"scheme": "ed", "alpha": 0.0}),
    Run("beam-ed", DEMO, {"model": "beam"}, {"scheme": "ed"}),
    Run("beam-ep", DEMO, {"model": "beam"}, {"scheme": "ep"}),
    Run("inward-ed", DEMO, {"begin": "inward"}, {"scheme": "ed"}),
    Run("across-ed", DEMO, {"plane": "across"}, {"scheme": "ed"}),
    Run("wavy-ed", DEMO, {"imperfection": 1e-3}, {"scheme": "ed"}),
    Run("fine-time", DEMO, {"model": "shell"}, {"scheme": "ed", "dt": 1.25e-3}),
    Run("fine-mesh", DEMO, {"mesh": (16, 8)}, {"scheme": "ed"}),
)
LABELS = {
    "shell-ed": "ED",
    "shell-ep": "EP",
    "shell-ed0": "ED with alpha = 0",
    "beam-ed": "arches, ED",
    "beam-ep": "arches, EP",
    "inward-ed": "crank inward first",
    "across-ed": "crank across the crown",
    "wavy-ed": "imperfection of 1 mm",
    "fine-time": "steps of 1.25 ms",
    "fine-mesh": "16 x 8 elements",
}
SHAPES = (0.0, 0.4, 0.65, 0.8, 1.05, 1.2, 1.35, 1.425, 1.6)
# shift of EP in figure 12 [N m/m]
SHIFT = -6000.0
POINTS = (("B", "o", "C0"), ("M", "^", "C1"), ("E", "+", "C2"))
MOMENTS = (("M11", "o", "C0"), ("M22", "^", "C1"))


def _shapes(made: matplotlib.figure.Figure, results: Results) -> None:
    shapes(made, results["shell-ed"].states, SHAPES)
    # a high box: room for the labels below it
    made.set_size_inches(9.8, 9.8)


def _shell_alone(made: matplotlib.figure.Figure, results: Results) -> None:
    shapes(made, results["shell-ed"].states, SHAPES, only=("shell", "stiffener"))


def _curve(axes: Axes, history: pd.DataFrame, values: Any, **style: Any) -> None:
    """A curve with marks about every 0.1 s."""
    marks = np.searchsorted(history["t"], np.arange(0.05, history["t"].iloc[-1], 0.1))
    settings: dict[str, Any] = {"linewidth": 0.9, "markersize": 4, "markerfacecolor": "none"}
    axes.plot(history["t"], values, markevery=marks.tolist(), **(settings | style))


def _displacements(ed: str, ep: str) -> Callable[[matplotlib.figure.Figure, Results], None]:
    def draw(made: matplotlib.figure.Figure, results: Results) -> None:
        made.set_size_inches(8.0, 5.0)
        axes = made.subplots()
        for point, mark, colour in POINTS:
            for name, line in ((ed, "-"), (ep, "--")):
                history = results[name].history
                label = f"{point}, {LABELS[name]}"
                style = {"linestyle": line, "marker": mark, "color": colour, "label": label}
                _curve(axes, history, history[point], **style)
        t = np.linspace(0, 2, 201)
        axes.plot(t, kinematic(t), color="0.6", linewidth=2.5, zorder=0, label="E, rigid lever")
        axes.set(xlabel="time [s]", ylabel="vertical displacement [m]")
        axes.legend(fontsize=8, ncols=2)

    return draw


def _moments(made: matplotlib.figure.Figure, results: Results) -> None:
    made.set_size_inches(8.0, 5.0)
    axes = made.subplots()
    for name, line, shift in (("shell-ed", "-", 0.0), ("shell-ep", "--", SHIFT)):
        history = results[name].history
        for moment, mark, colour in MOMENTS:
            label = f"{moment}, {LABELS[name]}" + (f" {shift:+.0f}" if shift else "")
            style = {"linestyle": line, "marker": mark, "color": colour, "label": label}
            values = as_curve(results[name], history[moment].to_numpy())
            _curve(axes, history, values + shift, **(style | {"linewidth": 0.7}))
    axes.set(xlabel="time [s]", ylabel="bending moments at E [N m/m]")
    axes.legend(fontsize=8, loc="lower left")


def _lever(column: str, label: str) -> Callable[[matplotlib.figure.Figure, Results], None]:
    def draw(made: matplotlib.figure.Figure, results: Results) -> None:
        pair = made.subplots(2, 1, sharex=True)
        for axes, name, colour in zip(pair, ("shell-ed", "shell-ep"), ("C0", "C3"), strict=True):
            history = results[name].history
            values = as_curve(results[name], history[column].to_numpy())
            axes.plot(history["t"], values, color=colour, linewidth=0.7)
            axes.set(ylabel=label, title=LABELS[name])
        pair[1].set_xlabel("time [s]")

    return draw


def _four(made: matplotlib.figure.Figure, results: Results) -> None:
    """The paper's schemes, and those that are quadratic in time; means over steps in all."""
    made.set_size_inches(9.0, 5.6)
    rows = made.subplots(2, 2, sharex=True, sharey="row")
    for row, column in zip(rows, ("M22", "lever_moment"), strict=True):
        # the noisier first, as it covers the other
        for axes, names in zip(
            row, (("shell-ep", "shell-ed"), ("shell-ep4", "shell-ed3")), strict=True
        ):
            for name, colour in zip(names, ("C3", "C0"), strict=True):
                h = results[name].history
                style = {"color": colour, "label": SCHEMES[name], "linewidth": 0.7}
                axes.plot(h["t"], h[column], **style)
            axes.legend(fontsize=8, loc="upper left")
    rows[0, 0].set(ylabel="M22 at E [N m/m]")
    rows[1, 0].set(ylabel="moment of the lever\nat mid-span [N m]")
    for axes in rows[1]:
        axes.set_xlabel("time [s]")


def _follows(made: matplotlib.figure.Figure, results: Results) -> None:
    axes = made.subplots()
    for name, colour in (("shell-ed", "C0"), ("shell-ep", "C3"), ("inward-ed", "C2")):
        history = results[name].history
        rigid = kinematic(history["t"])
        label = LABELS[name]
        axes.plot(history["t"], history["E"] - rigid, color=colour, linewidth=1, label=label)
        explained = follows(history) - rigid
        axes.plot(history["t"], explained, color="black", linewidth=0.8, linestyle=":")
    axes.plot([], [], color="black", linestyle=":", label="of the bent lever and E's own motion")
    axes.set(xlabel="time [s]", ylabel="E minus the curve of a rigid lever [m]")
    axes.legend(fontsize=8)


def _arches(made: matplotlib.figure.Figure, results: Results) -> None:
    """Shell and arches: displacements and the moment along the arc."""
    made.set_size_inches(8.0, 6.5)
    above, below = made.subplots(2, 1, sharex=True)
    shell, beam = (results[n].history for n in ("shell-ed", "beam-ed"))
    for point, mark, colour in POINTS:
        for history, line, label in ((shell, "-", "shell"), (beam, "-.", "arches")):
            style = {"linestyle": line, "marker": mark, "color": colour}
            _curve(above, history, history[point], label=f"{point}, {label}", **style)
    above.set_ylabel("vertical displacement [m]")
    # the last arch has half the width
    width = strip_width(len(results["beam-ed"].scene.beams) - 2) / 2
    below.plot(shell["t"], shell["M11"], linewidth=0.8, label="shell, M11 at E")
    below.plot(beam["t"], beam["arch_moment"] / width, "-.", linewidth=0.8, label="arch at E")
    below.set(xlabel="time [s]", ylabel="bending moment [N m/m]")
    for axes in (above, below):
        axes.legend(fontsize=8, ncols=3)


def _variants(names: tuple[str, ...]) -> Callable[[matplotlib.figure.Figure, Results], None]:
    """The free edge, the moment at E and the lever's moment in several runs."""

    def draw(made: matplotlib.figure.Figure, results: Results) -> None:
        made.set_size_inches(8.0, 8.0)
        columns = {
            "B": "vertical displacement\nof B [m]",
            "M11": "M11 at E [N m/m]",
            "lever_moment": "moment of the lever\nat mid-span [N m]",
        }
        every = made.subplots(3, 1, sharex=True)
        for axes, (column, label) in zip(every, columns.items(), strict=True):
            for k, name in enumerate(names):
                history = results[name].history
                text = "as in figures 10 to 14" if name == "shell-ed" else LABELS[name]
                axes.plot(history["t"], history[column], f"C{k}", linewidth=0.8, label=text)
            axes.set_ylabel(label)
        every[0].legend(fontsize=8, ncols=2)
        every[2].set_xlabel("time [s]")

    return draw


def _steps(made: matplotlib.figure.Figure, results: Results) -> None:
    made.set_size_inches(7.0, 7.0)
    above, middle, below = made.subplots(3, 1, sharex=True)
    for name, colour in (("shell-ed", "C0"), ("shell-ep", "C3"), ("shell-ed0", "C4")):
        history = results[name].history.iloc[1:]
        above.step(history["t"], 1e3 * history["dt"], color=colour, linewidth=0.8)
        middle.plot(history["t"], history["iterations"], ".", color=colour, markersize=2)
        below.plot(
            history["t"], history["total_energy"], color=colour, linewidth=1, label=LABELS[name]
        )
    above.set(ylabel="accepted step [ms]", ylim=(0, None))
    middle.set(ylabel="iterations of the step")
    below.set(xlabel="time [s]", ylabel="energy [J]")
    below.legend(fontsize=8)


PAIR = ("shell-ed", "shell-ep")
LAYOUTS = ("shell-ed", "inward-ed", "across-ed", "wavy-ed")
REFINED = ("shell-ed", "fine-time", "fine-mesh")
EXAMPLE = Example(
    "6.2",
    "Snap-through of a cylindrical shell",
    RUNS,
    (
        Figure(
            "10",
            "The system at various times (ED): pulled down at E, inverted first there, snapped "
            "through, pushed back up, snapping back, and vibrating about the original shape.",
            ("shell-ed",),
            _shapes,
        ),
        Figure(
            "11",
            "Vertical displacements of B, M and E. The paper: E closely follows the crank, B and M "
            "show elastic vibrations too; ED and EP agree well except in the oscillations.",
            PAIR,
            _displacements(*PAIR),
        ),
        Figure(
            "12",
            "Bending moments at E (1 along the arc), EP 6 kN lower. The paper: the snaps are "
            "clearly seen; from 0.835 s on violent numerical oscillations in EP.",
            PAIR,
            _moments,
        ),
        Figure(
            "13",
            "Axial force in the lever at mid-span; the scales differ.",
            PAIR,
            _lever("lever_force", "axial force [N]"),
        ),
        Figure(
            "14",
            "Bending moment of the lever at mid-span; the scales differ. The paper: its lowest two "
            "modes in ED, completely obscured by noise in EP.",
            PAIR,
            _lever("lever_moment", "bending moment [N m]"),
        ),
        Figure("10b", "The shell alone at the same times.", ("shell-ed",), _shell_alone),
        Figure(
            "11b",
            "Ours: how far E leaves the curve of a rigid lever. Dotted: the same from the lever's "
            "measured bow and force and from E's horizontal motion.",
            (*PAIR, "inward-ed"),
            _follows,
        ),
        Figure(
            "11c",
            "Ours (the paper has none): arches, strips of the shell side by side, in its place.",
            ("shell-ed", "beam-ed"),
            _arches,
        ),
        Figure(
            "12b",
            "Ours: accepted steps, their iterations, energy; alpha = 0 of the ED family is what "
            "section 6 of the paper calls EP, EP here the mid-point scheme of its section 3.",
            (*PAIR, "shell-ed0"),
            _steps,
        ),
        Figure(
            "14d",
            "Ours: the schemes that are quadratic in time, EP4 beside EP, ED3 beside ED; means "
            "over steps.",
            tuple(SCHEMES),
            _four,
        ),
        Figure("14b", "Ours: layouts that the text leaves open (ED).", LAYOUTS, _variants(LAYOUTS)),
        Figure("14c", "Ours: a finer mesh and finer steps (ED).", REFINED, _variants(REFINED)),
    ),
    STATEMENTS,
    "shell-ed",
)
