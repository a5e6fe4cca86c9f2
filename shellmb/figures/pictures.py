"""Figures as PNG, animations as GIF, and what figures of several examples draw alike."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import matplotlib.figure
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from PIL import Image

from shellmb.figures.example import Figure, Results
from shellmb.figures.states import States
from shellmb.observers.drawing import STYLE, figure
from shellmb.observers.files.described import Described
from shellmb.observers.files.frames import Frame
from shellmb.show.space.animation import write
from shellmb.show.space.colours import Colouring
from shellmb.show.space.scenery import COLOURS as COLOUR_MAP
from shellmb.show.space.scenery import Showing, images
from shellmb.show.space.shapes import Shape, State
from shellmb.show.space.views import view_of

__all__ = ["draw_animation", "draw_figure", "shapes"]

RESOLUTION = 110
# colours of the palette of a picture: files of a third of the size, and no difference to be seen
COLOURS = 200
# an animation has at most so many pictures and bytes, and takes about so long [s]
PICTURES, BYTES, DURATION = 64, 1_500_000, 6.0
# width of an animation, pixels
WIDTH = 500


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
) -> None:
    """The deformed system at several times, in true size and one view.

    Args:
        made: The figure, empty; it gets a size.
        states: States of the run.
        times: Times [s]; of each the nearest frame is shown.
        columns: Pictures in a row.
        only: Names of the bodies that are shown; None: everything.
        panel: Width and height of one picture, inches.
    """
    states = states if only is None else states.only(only)
    what = _showing(states, [states.at(t) for t in times])
    rows = -(-len(what.states) // columns)
    made.set_size_inches(panel[0] * columns + 0.8, panel[1] * rows)
    every = made.subplots(rows, columns, squeeze=False).ravel()
    for axes in every:
        axes.set_axis_off()
    width = round(panel[0] * 2 * RESOLUTION)
    for axes, frame, image in zip(every, times, images(what, width, marks=False), strict=False):
        axes.imshow(np.asarray(image))
        axes.set_title(f"t = {states.at(frame).t:.3g} s", fontsize=10)
    colours = ScalarMappable(Normalize(*what.limits), COLOUR_MAP)
    made.colorbar(colours, ax=list(every), label="displacement [m]", shrink=0.65, pad=0.03)


def _showing(states: States, frames: Sequence[Frame]) -> Showing:
    """What is shown of a run: as any run's pictures show it."""
    parts = {
        name: Shape(name, grid.nodes, grid.faces, grid.outlines, grid.lines, grid.dots)
        for name, grid in states.grids.items()
    }
    found = [
        {
            name: State(f.t, parts[name].reference + u, {"displacement": u}, {})
            for name, u in f.displacement.items()
        }
        for f in frames
    ]
    points = [s.position for state in found for s in state.values()]
    view = view_of(np.concatenate([*(p.reference for p in parts.values()), *points]))
    scene = Described("", "", True, False, "m, kg, s", {}, (), (), (), ())
    shown = Colouring("displacement", None, "displacement [m]")
    return Showing(scene, parts, found, shown, (0.0, _largest(states)), view, 1.0, 0.0)


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
        every = np.linspace(0, len(states.frames) - 1, min(count, len(states.frames)))
        what = _showing(states, [states.frames[round(k)] for k in every])
        write(list(images(what, WIDTH)), path, DURATION)
        if path.stat().st_size <= BYTES or count < 8:
            return
        count = count * 3 // 4


def wrapped(text: str, width: int = 100) -> str:
    """A text in lines, as for the title of a figure.

    Args:
        text: The text.
        width: Letters in a line.
    """
    return "\n".join(textwrap.wrap(text, width))
