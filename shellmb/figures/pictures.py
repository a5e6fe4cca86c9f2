"""Figures as PNG, animations as GIF, and what figures of several examples draw alike."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import matplotlib.figure
import numpy as np
from PIL import Image

from shellmb.figures.example import Figure, Results
from shellmb.figures.states import States
from shellmb.observers.drawing import (
    STYLE,
    View,
    bodies,
    colour_bar,
    figure,
    space,
    title,
    view_of,
)

__all__ = ["draw_animation", "draw_figure", "shapes"]

RESOLUTION = 110
# colours of the palette of a picture: files of a third of the size, and no difference to be seen
COLOURS = 200
# an animation has at most so many pictures and bytes, and takes about so long [s]
PICTURES, BYTES, DURATION = 64, 1_500_000, 6.0


def draw_figure(wanted: Figure, results: Results, path: Path) -> None:
    """Draw a figure; it begins 7 x 5 inches large, `draw` may change that.

    Args:
        wanted: The figure.
        results: The runs.
        path: The PNG file.
    """
    with mpl.rc_context(STYLE):
        made = figure(7.0, 5.0)
        wanted.draw(made, results)
        drawn = io.BytesIO()
        made.savefig(drawn, dpi=RESOLUTION)
    with Image.open(drawn) as image:
        image.convert("RGB").quantize(COLOURS).save(path, optimize=True)


def shapes(
    made: matplotlib.figure.Figure,
    states: States,
    times: Sequence[float],
    columns: int = 3,
    only: Sequence[str] | None = None,
    panel: tuple[float, float] = (3.6, 3.1),
    zoom: float | None = None,
) -> None:
    """The deformed system at several times, in true size and one view.

    Args:
        made: The figure, empty; it gets a size.
        states: States of the run.
        times: Times [s]; of each the nearest frame is shown.
        columns: Pictures in a row.
        only: Names of the bodies that are shown; None: everything.
        panel: Width and height of one picture, inches.
        zoom: Bodies are so much larger, and have no axes; None: with axes.
    """
    states = states if only is None else states.only(only)
    frames = [states.at(t) for t in times]
    view = view_of(states.grids, [f.displacement for f in states.frames])
    view = View(view.low, view.high, _largest(states), view.planar)
    rows = -(-len(frames) // columns)
    made.set_size_inches(panel[0] * columns + 0.8, panel[1] * rows)
    places = []
    for k, frame in enumerate(frames):
        axes = space(made, (rows, columns, k + 1), view)
        bodies(axes, states.grids, frame.displacement, view)
        if zoom is None:
            title(axes, f"t = {frame.t:.3g} s", view)
        else:
            axes.set_axis_off()
            axes.set_box_aspect(view.high - view.low, zoom=zoom)
            axes.set_title(f"t = {frame.t:.3g} s", fontsize=10, y=0.85)
            for drawn in axes.collections:
                # axes in space are square; beside them is room in a wide panel
                drawn.set_clip_on(False)
        places.append(axes)
    colour_bar(made, places, view)


def _largest(states: States) -> float:
    """Largest displacement of the surfaces and lines, joints and rigid bodies left out, m."""
    names = [n for n, grid in states.grids.items() if not len(grid.dots)] or list(states.grids)
    every = (f.displacement[n] for f in states.frames for n in names)
    return max(float(np.linalg.norm(u, axis=1).max()) for u in every)


def draw_animation(states: States, path: Path) -> None:
    """The deformed system over time, small enough for a page.

    Args:
        states: States of the run.
        path: The GIF file.
    """
    count = PICTURES
    while True:
        _animate(states, path, count)
        if path.stat().st_size <= BYTES or count < 8:
            return
        count = count * 3 // 4


def _animate(states: States, path: Path, count: int) -> None:
    every = np.linspace(0, len(states.frames) - 1, min(count, len(states.frames)))
    frames = [states.frames[round(k)] for k in every]
    view = view_of(states.grids, [f.displacement for f in states.frames])
    view = View(view.low, view.high, _largest(states), view.planar)
    images = []
    with mpl.rc_context(STYLE):
        made = figure(5.6, 4.2)
        made.set_dpi(90)
        axes = space(made, (1, 1, 1), view)
        colour_bar(made, [axes], view)
        # it would lie on that of the colours; the other axes say the unit
        axes.set_zlabel("")
        for frame in frames:
            while axes.collections:
                axes.collections[0].remove()
            bodies(axes, states.grids, frame.displacement, view)
            title(axes, f"t = {frame.t:.2f} s", view)
            made.canvas.draw()
            # once is enough, and most of the work otherwise
            made.set_layout_engine("none")
            images.append(np.asarray(made.canvas.buffer_rgba())[..., :3].copy())  # type: ignore[attr-defined]
    delay = 1000 * max(0.05, DURATION / len(images))
    # one palette for all: only what changes is stored
    palette = Image.fromarray(np.concatenate(images[:: max(1, len(images) // 8)])).quantize(64)
    small = [Image.fromarray(i).quantize(palette=palette, dither=Image.Dither.NONE) for i in images]
    small[0].save(path, save_all=True, append_images=small[1:], duration=delay, loop=0)


def wrapped(text: str, width: int = 100) -> str:
    """A text in lines, as for the title of a figure.

    Args:
        text: The text.
        width: Letters in a line.
    """
    return "\n".join(textwrap.wrap(text, width))
