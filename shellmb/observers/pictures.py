"""Pictures of a run: deformed shape, histories, energy account, steps, and an animation."""

from __future__ import annotations

from pathlib import Path

import imageio.v3 as imageio
import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from shellmb.observers.drawing import (
    STYLE,
    TITLE,
    bodies,
    colour_bar,
    enlargement,
    figure,
    space,
    view_of,
)
from shellmb.observers.frames import Frames
from shellmb.observers.probes import UNITS
from shellmb.simulate.simulation import Simulation

ENERGIES = {
    "kinetic_energy": "kinetic",
    "strain_energy": "strain",
    "total_energy": "total",
    "work_loads": "work of loads",
    "work_terms": "work of added terms",
    "work_supports": "work of supports",
    "dissipation": "dissipated",
}

# an animation takes about this long [s]
DURATION = 5.0


def draw(directory: Path, history: pd.DataFrame, frames: Frames, simulation: Simulation) -> None:
    """Draw all pictures that make sense for a run; on rank 0.

    Args:
        directory: Where they go.
        history: The history.
        frames: The frames.
        simulation: The simulation.
    """
    with mpl.rc_context(STYLE):
        _shape(directory / "shape.png", frames, simulation)
        if simulation.scene.probes:
            _probes(directory / "probes.png", history, simulation)
        if simulation.scheme.dynamic:
            _energies(directory / "energy.png", history)
            _animation(directory / "animation.gif", frames)
        _steps(directory / "steps.png", history, simulation)


def _time_label(simulation: Simulation) -> str:
    return "time [s]" if simulation.scheme.dynamic else "load parameter [-]"


def _shape(path: Path, frames: Frames, simulation: Simulation) -> None:
    """The last state, and where the motion is one, the state of the largest displacement."""
    chosen = [frames.frames[-1]]
    if simulation.scheme.dynamic and len(frames.frames) > 2:
        sizes = [
            max(float(np.max(np.linalg.norm(u, axis=1))) for u in f.displacement.values())
            for f in frames.frames
        ]
        largest = frames.frames[int(np.argmax(sizes))]
        if largest is not chosen[0]:
            chosen.insert(0, largest)
    shown = max(chosen, key=lambda f: max(float(np.abs(u).max()) for u in f.displacement.values()))
    factor = enlargement(frames.grids, shown.displacement)
    view = view_of(frames.grids, [f.displacement for f in chosen], factor)
    made = figure(6.6 * len(chosen) + 0.6, 5.0)
    places = []
    for k, frame in enumerate(chosen):
        axes = space(made, (1, len(chosen), k + 1), view)
        bodies(axes, frames.grids, frame.displacement, view, factor)
        unit = "t = {:.4g} s" if simulation.scheme.dynamic else "load parameter {:.4g}"
        times = "" if factor == 1 else f", displacements x {factor:g}"
        title = f"{simulation.scene.name}: {unit.format(frame.t)}{times}"
        axes.set_title(title, fontsize=10, y=TITLE)
        places.append(axes)
    colour_bar(made, places, view)
    made.savefig(path, bbox_inches="tight")


def _line(axes: Axes, history: pd.DataFrame, name: str, label: str) -> None:
    t = history["t"]
    # work is dashed: where it equals the energy, both are seen
    style = "--" if name.startswith("work") else "-"
    marker = "." if len(t) < 30 else None
    axes.plot(t, history[name], style, label=label, linewidth=1.2, marker=marker)


def _probes(path: Path, history: pd.DataFrame, simulation: Simulation) -> None:
    """One plot for each quantity that is probed."""
    probes = simulation.scene.probes
    kinds = list(dict.fromkeys(p.quantity for p in probes))
    made = figure(7.0, 0.6 + 2.8 * len(kinds))
    every = made.subplots(len(kinds), 1, sharex=True, squeeze=False)[:, 0]
    for kind, axes in zip(kinds, every, strict=True):
        for probe in probes:
            if probe.quantity == kind:
                _line(axes, history, probe.name, probe.name)
        axes.set_ylabel(f"{kind} [{UNITS[kind]}]")
        axes.legend()
    every[-1].set_xlabel(_time_label(simulation))
    made.savefig(path)


def _energies(path: Path, history: pd.DataFrame) -> None:
    """Energies and work, and below them how well the account closes."""
    made = figure(7.0, 6.0)
    above, below = made.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    for name, label in ENERGIES.items():
        if name in history and np.any(history[name]):
            _line(above, history, name, label)
    above.set_ylabel("energy, work [J]")
    if above.lines:
        above.legend(ncols=2)
    scale = float(history["total_energy"].abs().max())
    error = history["energy_balance"].abs() / (scale or 1.0)
    # zeros have no place on a logarithmic axis: they are drawn where round-off ends
    floor = float(np.finfo(float).eps) / 10
    below.semilogy(history["t"], np.maximum(error, floor), linewidth=0.9)
    below.set(xlabel="time [s]", ylabel="error of the account\n/ largest energy [-]")
    made.savefig(path)


def _steps(path: Path, history: pd.DataFrame, simulation: Simulation) -> None:
    """Iterations and step sizes."""
    made = figure(7.0, 4.5)
    above, below = made.subplots(2, 1, sharex=True)
    t = history["t"][1:]
    marker = "." if len(t) < 30 else None
    above.step(t, history["iterations"][1:], where="pre", linewidth=1.0, marker=marker)
    above.set_ylabel("Newton iterations")
    above.yaxis.set_major_locator(mpl.ticker.MaxNLocator(integer=True))
    above.set_ylim(bottom=0)
    below.step(t, history["dt"][1:], where="pre", linewidth=1.0, marker=marker)
    unit = "[s]" if simulation.scheme.dynamic else "[-]"
    below.set(xlabel=_time_label(simulation), ylabel=f"step {unit}")
    below.set_ylim(bottom=0)
    made.savefig(path)


def _animation(path: Path, frames: Frames) -> None:
    """All frames, in true size."""
    if len(frames.frames) < 2:
        return
    states = [f.displacement for f in frames.frames]
    shown = max(states, key=lambda s: max(float(np.abs(u).max()) for u in s.values()))
    factor = enlargement(frames.grids, shown)
    view = view_of(frames.grids, states, factor)
    images = []
    made = figure(6.4, 4.8)
    made.set_dpi(100)
    axes = space(made, (1, 1, 1), view)
    colour_bar(made, [axes], view)
    times = "" if factor == 1 else f", displacements x {factor:g}"
    for frame in frames.frames:
        while axes.collections:
            axes.collections[0].remove()
        bodies(axes, frames.grids, frame.displacement, view, factor)
        axes.set_title(f"t = {frame.t:.4f} s{times}", fontsize=10, y=TITLE)
        made.canvas.draw()
        # once is enough, and most of the work otherwise
        made.set_layout_engine("none")
        images.append(np.asarray(made.canvas.buffer_rgba())[..., :3].copy())  # type: ignore[attr-defined]
    delay = 1000 * max(0.05, DURATION / len(images))
    imageio.imwrite(path, np.stack(images), duration=delay, loop=0)
