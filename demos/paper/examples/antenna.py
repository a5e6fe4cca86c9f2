"""Section 6.3 of the paper: deployment of a space antenna, its runs and figures 16 to 21."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import matplotlib.figure
from matplotlib.axes import Axes

from demos.paper.example import Example, Figure, FinishedRun, Results, Run
from demos.paper.examples.antenna_statements import SCHEMES, STATEMENTS
from demos.paper.pictures import shapes
from shellmb.demos.antenna import LAWS, PANELS, moments, opening, rocking

DEMO = "antenna"
TIMES = (0.0, 20.0, 40.0, 60.0, 72.0, 84.0, 96.0, 108.0, 120.0)
SHELL, BEAM = {"color": "C0", "linestyle": "-"}, {"color": "C3", "linestyle": "--"}
OFF = {"color": "C2", "linestyle": ":"}

RUNS = (
    Run("shell-ed", DEMO, {"model": "shell"}, {"scheme": "ed"}),
    Run("beam-ed", DEMO, {"model": "beam"}, {"scheme": "ed"}),
    Run("shell-off", DEMO, {"coupling": False}, {"scheme": "ed"}),
    Run("shell-ep", DEMO, {"model": "shell"}, {"scheme": "ep"}),
    # beyond the paper: the schemes that are quadratic in time
    Run("shell-ep4", DEMO, {"model": "shell"}, {"scheme": "ep4"}),
    Run("shell-ed3", DEMO, {"model": "shell"}, {"scheme": "ed3"}),
    Run("fine-time", DEMO, {"dt": 0.1}, {"scheme": "ed"}),
    Run("fine-mesh", DEMO, {"nx": 10, "ny": 4}, {"scheme": "ed"}),
    # other readings of what the text says of the geometry
    Run("in-plane", DEMO, {"connector_direction": "panel"}, {"scheme": "ed"}),
    Run("square-2", DEMO, {"length": 2.0, "nx": 4, "ny": 4}, {"scheme": "ed", "t_end": 60.0}),
    Run("square-5", DEMO, {"width": 5.0, "nx": 4, "ny": 4}, {"scheme": "ed", "t_end": 140.0}),
)

type Curve = Callable[[FinishedRun, int], Any]


def _four(made: matplotlib.figure.Figure, titles: list[str], label: str) -> list[Axes]:
    """Four plots over time in the paper's arrangement."""
    made.set_size_inches(9.0, 6.0)
    grid = made.subplots(2, 2, sharex=True)
    for axes, title in zip(grid.flat, titles, strict=True):
        axes.set_title(title, fontsize=10)
    for axes in grid[:, 0]:
        axes.set_ylabel(label)
    for axes in grid[1]:
        axes.set_xlabel("time [s]")
    return list(grid.flat)


def _panels(made: matplotlib.figure.Figure, label: str) -> list[Axes]:
    return _four(made, [f"panel {i}" for i in range(1, PANELS + 1)], label)


def _line(axes: Axes, run: FinishedRun, values: Any, label: str, **style: Any) -> None:
    axes.plot(run.history["t"], values, label=label, **({"linewidth": 1.1} | style))


def _legend(made: matplotlib.figure.Figure, axes: Axes) -> None:
    handles, labels = axes.get_legend_handles_labels()
    made.legend(handles, labels, loc="outside lower center", ncols=len(labels), fontsize=9)


def _configurations(made: matplotlib.figure.Figure, results: Results) -> None:
    shapes(made, results["shell-ed"].states, TIMES)


def _rotations(made: matplotlib.figure.Figure, results: Results) -> None:
    hinges = ("B1", "D1", "D2", "D3")
    every = _four(made, [f"hinge {h}" for h in hinges], "rotation [rad]")
    for axes, hinge in zip(every, hinges, strict=True):
        law = LAWS[hinge.replace("B", "A").replace("D", "C")]
        axes.axhline(law[1], color="0.6", linewidth=0.8)
        for name, style, label in (("shell-ed", SHELL, "shell"), ("beam-ed", BEAM, "beam")):
            _line(
                axes, results[name], law[1] * opening(results[name].history, hinge), label, **style
            )
    _legend(made, every[0])


def _rockings(made: matplotlib.figure.Figure, results: Results) -> None:
    every = _panels(made, "rotation about $i_1$ [degrees]")
    for i, axes in enumerate(every, 1):
        for line, style in (("AB", "-"), ("CD", "--")):
            run = results["shell-ed"]
            label = f"$\\mathrm{{{line[0]}_i {line[1]}_i}}$, shell"
            values = rocking(run.history, f"{line}{i}")
            _line(axes, run, values, label, color="C0" if line == "AB" else "C1", linestyle=style)
        for name, style_, label in (("shell-off", OFF, "no $D_{16}$"), ("beam-ed", BEAM, "beam")):
            _line(axes, results[name], rocking(results[name].history, f"CD{i}"), label, **style_)
    _legend(made, every[0])


def _shears(made: matplotlib.figure.Figure, results: Results) -> None:
    made.set_size_inches(7.0, 6.0)
    every = made.subplots(2, 2, sharex=True)
    for k, name, text in ((0, "shell-ed", "shell"), (1, "beam-ed", "beam")):
        h = results[name].history
        for row, part, label in ((0, 2, "in the plane of motion"), (1, 3, "along the hinges")):
            axes = every[row, k]
            for beam, style in (("C1A2", "-"), ("D1B2", "--")):
                axes.plot(h["t"], h[f"{beam}_F{part}"], style, label=beam, linewidth=1.1)
            axes.set_title(f"{text} model, {label}", fontsize=10)
    for axes in every[:, 0]:
        axes.set_ylabel("shear force [N]")
    for axes in every[1]:
        axes.set_xlabel("time [s]")
    _legend(made, every[0, 0])


def _bending(made: matplotlib.figure.Figure, results: Results) -> None:
    every = _panels(made, "$M_{11}$ [N]")
    for i, axes in enumerate(every, 1):
        for name, style, label in (("shell-ed", SHELL, "shell"), ("beam-ed", BEAM, "beam")):
            _line(axes, results[name], moments(results[name], i)["11"], label, **style)
    _legend(made, every[0])


def _twisting(made: matplotlib.figure.Figure, results: Results) -> None:
    every = _panels(made, "moment [N]")
    run = results["shell-ed"]
    for i, axes in enumerate(every, 1):
        found = moments(run, i)
        _line(axes, run, found["22"], "$M_{22}$", color="C0")
        _line(axes, run, found["12"], "$M_{12}$", color="C3", linestyle="--")
    _legend(made, every[0])


def _comparison(names: dict[str, str], curve: Curve, label: str) -> Any:
    """Draw the same curve of several runs in each panel."""

    def draw(made: matplotlib.figure.Figure, results: Results) -> None:
        every = _panels(made, label)
        for i, axes in enumerate(every, 1):
            for k, (name, text) in enumerate(names.items()):
                style = {"color": f"C{k}", "linestyle": ("-", "--", ":", "-.")[k % 4]}
                _line(axes, results[name], curve(results[name], i), text, **style)
        _legend(made, every[0])

    return draw


def _last_edge(run: FinishedRun, i: int) -> Any:
    return rocking(run.history, f"CD{i}")


REFINED = {
    "shell-ed": "ED",
    "fine-time": "half the step",
    "fine-mesh": "finer mesh",
    "shell-ep": "EP",
}
LAYOUTS = {
    "shell-ed": "5 m x 2 m",
    "in-plane": "connectors in the panels' planes",
    "square-2": "2 m x 2 m",
    "square-5": "5 m x 5 m",
}
BOTH = ("shell-ed", "beam-ed")
EXAMPLE = Example(
    "6.3",
    "Deployment of a space antenna",
    RUNS,
    (
        Figure("16", "The antenna at various times (shell model).", ("shell-ed",), _configurations),
        Figure(
            "17",
            "Relative rotations at the hinges B1, D1, D2, D3. The paper: both models in fair "
            "agreement.",
            BOTH,
            _rotations,
        ),
        Figure(
            "18",
            "Rotations of the reinforcing beams about i_1. The paper: rocking of up to 7 degrees, "
            "none in the beam model.",
            ("shell-ed", "shell-off", "beam-ed"),
            _rockings,
        ),
        Figure(
            "19",
            "Transverse shear forces at the middle of the connector beams between panels 1 and 2. "
            "The paper: large, by the rocking.",
            BOTH,
            _shears,
        ),
        Figure(
            "20",
            "Bending moments M11 at the centres of the panels. The paper: the beam model differs, "
            "the shell model shows much higher frequencies.",
            BOTH,
            _bending,
        ),
        Figure(
            "21",
            "Twisting moments M12 and transverse bending moments M22 at the centres of the panels. "
            "The paper: significant; M22 of the order of M11.",
            ("shell-ed",),
            _twisting,
        ),
        Figure(
            "21b",
            "Ours: rocking of the outer edges with a finer mesh, a smaller step, and EP.",
            tuple(REFINED),
            _comparison(REFINED, _last_edge, "rotation about $i_1$ [degrees]"),
        ),
        Figure(
            "21d",
            "Ours: rocking of the outer edges with ED, ED3, EP and EP4.",
            tuple(SCHEMES),
            _comparison(SCHEMES, _last_edge, "rotation about $i_1$ [degrees]"),
        ),
        Figure(
            "21c",
            "Ours: rocking of the outer edges with other readings of the geometry.",
            tuple(LAYOUTS),
            _comparison(LAYOUTS, _last_edge, "rotation about $i_1$ [degrees]"),
        ),
    ),
    STATEMENTS,
    animation="shell-ed",
)
