"""Figures as PNG, animations as GIF, and what figures of several examples draw alike."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import matplotlib.figure
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from PIL import Image

from demos.paper.example import Figure, Results
from shellmb.guarding.writing import drafted
from shellmb.measuring.pictures import picture
from shellmb.observers.files.described import read_described
from shellmb.show.fields import Fields
from shellmb.show.space.animation import write
from shellmb.show.space.scenery import COLOURS as COLOUR_MAP
from shellmb.show.space.scenery import Showing, images, showing

__all__ = ["draw_animation", "draw_figure", "shapes"]

RESOLUTION = 110
# colours of the palette of a picture: files of a third of the size, and no difference to be seen
COLOURS = 200
# an animation has at most so many pictures and bytes, and takes about so long [s]
PICTURES, BYTES, DURATION = 64, 1_500_000, 6.0
# width of an animation, pixels
WIDTH = 500


def draw_figure(wanted: Figure, results: Results, path: Path) -> None:
    """Draw a figure; it begins 7 x 5 inches large, `draw` may change that."""
    with picture(path, 7.0, 5.0, {"savefig.dpi": RESOLUTION}) as made:
        wanted.draw(made, results)
    with Image.open(path) as image:
        few = image.convert("RGB").quantize(COLOURS)
    with drafted(path) as draft:
        few.save(draft, optimize=True)


def shapes(
    made: matplotlib.figure.Figure,
    states: Fields,
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
    what = _showing(states if only is None else states.only(only), times)
    rows = -(-len(what.states) // columns)
    made.set_size_inches(panel[0] * columns + 0.8, panel[1] * rows)
    every = made.subplots(rows, columns, squeeze=False).ravel()
    for axes in every:
        axes.set_axis_off()
    width = round(panel[0] * 2 * RESOLUTION)
    for axes, t, image in zip(every, times, images(what, width, marks=False), strict=False):
        axes.imshow(np.asarray(image))
        axes.set_title(f"t = {states.nearest(t):.3g} s", fontsize=10)
    colours = ScalarMappable(Normalize(*what.limits), COLOUR_MAP)
    made.colorbar(colours, ax=list(every), label=what.shown.label, shrink=0.65, pad=0.03)


def _showing(states: Fields, times: Iterable[float]) -> Showing:
    """What is shown of a run, without the forces of its joints."""
    described = read_described(states.folder.parent)
    return replace(showing(states, described, times, "displacement", factor=1.0), force=0.0)


def draw_animation(states: Fields, path: Path) -> None:
    """The deformed system over time, small enough for a page."""
    count, times = PICTURES, states.times
    while True:
        every = np.linspace(0, len(times) - 1, min(count, len(times)))
        what = _showing(states, times[np.round(every).astype(int)])
        write(list(images(what, WIDTH)), path, DURATION)
        if path.stat().st_size <= BYTES or count < 8:
            return
        count = count * 3 // 4
