"""Pictures of a run: deformed shape, histories, joints, energy account, steps, an animation."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from mpl_toolkits.mplot3d.axes3d import Axes3D
from PIL import Image

from shellmb.observers.curves import joint_plots, legend, line
from shellmb.observers.drawing import (
    STYLE,
    bodies,
    colour_bar,
    enlargement,
    figure,
    key,
    space,
    title,
    view_of,
)
from shellmb.observers.frames import Frame
from shellmb.observers.pictures import Shown
from shellmb.observers.probes import UNITS
from shellmb.observers.resultants import RESULTANTS

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

# light enough in all channels to be meant white
NEARLY_WHITE = 250


def draw_run(directory: Path, run: Shown) -> None:
    """Draw all pictures that make sense for a run.

    Args:
        directory: Where they go.
        run: What they show.
    """
    with mpl.rc_context(STYLE):
        _shape(directory / "shape.png", run)
        if run.scene.probes:
            _probes(directory / "probes.png", run)
        if run.dynamic:
            _energies(directory / "energy.png", run)
            _animation(directory / "animation.gif", run)
        # of one step there is no history
        if len(run.history) > 2:
            _joints(directory / "joints.png", run)
            _steps(directory / "steps.png", run)


def _shape(path: Path, run: Shown) -> None:
    """The last state, and where the motion is one, the state of the largest displacement."""
    chosen = [run.frames[-1]]
    if run.dynamic and len(run.frames) > 2:
        sizes = [
            max(float(np.max(np.linalg.norm(u, axis=1))) for u in f.displacement.values())
            for f in run.frames
        ]
        largest = run.frames[int(np.argmax(sizes))]
        if largest is not chosen[0]:
            chosen.insert(0, largest)
    shown = max(chosen, key=lambda f: max(float(np.abs(u).max()) for u in f.displacement.values()))
    factor = enlargement(run.grids, shown.displacement)
    view = view_of(run.grids, [f.displacement for f in chosen], factor)
    made = figure(5.8 * len(chosen) + 0.8, 4.8)
    places = []
    for k, frame in enumerate(chosen):
        axes = space(made, (1, len(chosen), k + 1), view)
        bodies(axes, run.grids, frame.displacement, view, factor)
        unit = "t = {:.4g} s" if run.dynamic else run.time_label.partition(" [")[0] + " {:.4g}"
        times = "" if factor == 1 else f", displacements x {factor:g}"
        title(axes, f"{run.scene.name}: {unit.format(frame.t)}{times}", view)
        places.append(axes)
    key(made, run.grids)
    colour_bar(made, places, view)
    made.savefig(path, bbox_inches="tight")


def _probes(path: Path, run: Shown) -> None:
    """One plot for each quantity that is probed."""
    probes, t = run.scene.probes, run.history["t"]
    kinds = list(dict.fromkeys(p.quantity for p in probes))
    made = figure(7.0, 0.6 + 2.8 * len(kinds))
    every = made.subplots(len(kinds), 1, sharex=True, squeeze=False)[:, 0]
    for kind, axes in zip(kinds, every, strict=True):
        for probe in probes:
            if probe.quantity == kind:
                line(axes, t, run.history[probe.name], probe.name)
        mean = "mean " if run.dynamic and kind in RESULTANTS else ""
        axes.set_ylabel(f"{mean}{kind.replace('_', ' ')} [{UNITS[kind]}]")
        legend(axes)
    every[-1].set_xlabel(run.time_label)
    made.savefig(path)


def _joints(path: Path, run: Shown) -> None:
    """Coordinates of joints, what acts on them, and what joints carry."""
    plots = joint_plots(run.history, run.scene, run.size)
    if not plots:
        return
    made = figure(7.0, 0.6 + 2.3 * len(plots))
    every = made.subplots(len(plots), 1, sharex=True, squeeze=False)[:, 0]
    for plot, axes in zip(plots, every, strict=True):
        for name, values in plot.curves.items():
            line(axes, run.history["t"], values, name)
        axes.set_ylabel(plot.label)
        total = len(plot.curves) + plot.hidden
        legend(axes, title=f"the largest of {total}" if plot.hidden else None)
    every[-1].set_xlabel(run.time_label)
    made.savefig(path)


def _energies(path: Path, run: Shown) -> None:
    """Energies and work, and below them how well the account closes."""
    history, made = run.history, figure(7.0, 6.0)
    above, below = made.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    for name, label in ENERGIES.items():
        if name in history and np.any(history[name]):
            drivers = ", drivers" if name == "work_supports" and run.scene.drivers else ""
            _energy(above, history, name, label + drivers)
    above.set_ylabel("energy, work [J]")
    legend(above, 3)
    scale = float(history["total_energy"].abs().max())
    error = history["energy_balance"].abs() / (scale or 1.0)
    # zeros have no place on a logarithmic axis: they are drawn where round-off ends
    floor = float(np.finfo(float).eps) / 10
    below.semilogy(history["t"], np.maximum(error, floor), linewidth=0.9)
    below.set(xlabel="time [s]", ylabel="error of the account\n/ largest energy [-]")
    made.savefig(path)


def _energy(axes: Axes, history: pd.DataFrame, name: str, label: str) -> None:
    """One energy; those that are often equal are both seen."""
    t = history["t"]
    if name == "total_energy":
        axes.plot(t, history[name], color="0.75", linewidth=4.0, label=label, zorder=1.5)
    else:
        line(axes, t, history[name], label, "--" if name.startswith("work") else "-")


def _steps(path: Path, run: Shown) -> None:
    """Iterations and step sizes."""
    history, made = run.history, figure(7.0, 4.5)
    above, below = made.subplots(2, 1, sharex=True)
    t = history["t"][1:]
    marker = "." if len(t) < 30 else None
    above.step(t, history["iterations"][1:], where="pre", linewidth=1.0, marker=marker)
    above.set_ylabel("Newton iterations")
    above.yaxis.set_major_locator(mpl.ticker.MaxNLocator(integer=True))
    above.set_ylim(0, 1.1 * float(history["iterations"].max()) or 1.0)
    below.step(t, history["dt"][1:], where="pre", linewidth=1.0, marker=marker)
    unit = "[s]" if run.dynamic else "[-]"
    below.set(xlabel=run.time_label, ylabel=f"step {unit}")
    below.set_ylim(0, 1.1 * float(history["dt"][1:].max()) or 1.0)
    made.savefig(path)


def _animation(path: Path, run: Shown) -> None:
    """All frames, in true size."""
    if len(run.frames) < 2:
        return
    states = [f.displacement for f in run.frames]
    shown = max(states, key=lambda s: max(float(np.abs(u).max()) for u in s.values()))
    factor = enlargement(run.grids, shown)
    view = view_of(run.grids, states, factor)
    made = figure(6.4, 4.8)
    made.set_dpi(100)
    axes = space(made, (1, 1, 1), view)
    colour_bar(made, [axes], view)
    times = "" if factor == 1 else f", displacements x {factor:g}"

    def show(frame: Frame) -> None:
        bodies(axes, run.grids, frame.displacement, view, factor)
        title(axes, f"t = {frame.t:.4f} s{times}", view)

    # once with all of it for the places, then what stays the same, kept for all frames
    show(run.frames[0])
    canvas: Any = made.canvas
    canvas.draw()
    made.set_layout_engine("none")
    _clear(axes)
    canvas.draw()
    background = canvas.copy_from_bbox(made.bbox)
    images = []
    for frame in run.frames:
        show(frame)
        canvas.restore_region(background)
        for part in sorted(axes.collections, key=lambda part: part.get_zorder()):
            part.do_3d_projection()
            axes.draw_artist(part)
        axes.draw_artist(axes.title)
        images.append(Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3].copy()))
        _clear(axes)
    # finding colours is most of the work: those of two frames serve for all
    largest = int(np.argmax([max(np.abs(u).max() for u in s.values()) for s in states]))
    pair = np.concatenate([np.asarray(images[k]) for k in (0, largest)])
    colours = Image.fromarray(pair).quantize(256)
    table = np.array(colours.getpalette()).reshape(-1, 3)
    # means of nearly white are a grey background
    table[table.min(axis=1) >= NEARLY_WHITE] = 255
    colours.putpalette(table.ravel().tolist())
    first, *rest = (i.quantize(palette=colours, dither=Image.Dither.NONE) for i in images)
    delay = 1000 * max(0.05, DURATION / len(images))
    first.save(path, save_all=True, append_images=rest, duration=delay, loop=0)


def _clear(axes: Axes3D) -> None:
    """Take bodies and title away."""
    while axes.collections:
        axes.collections[0].remove()
    axes.set_title("")
