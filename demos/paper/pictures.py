"""Figures as PNG, animations as GIF, and what figures of several examples draw alike."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import matplotlib.figure
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from PIL import Image, ImageChops, ImageDraw, ImageFont

from demos.paper.example import Figure, Results
from shellmb.files.writing import drafted
from shellmb.observers.drawing import picture
from shellmb.observers.files.described import read_described
from shellmb.show.fields import Fields
from shellmb.show.space.animation import write
from shellmb.show.space.scenery import Showing, images, showing

__all__ = ["draw_animation", "draw_figure", "shapes", "without_margins"]

RESOLUTION = 110
# colours of the palette of a picture: files of a third of the size, and no difference to be seen
COLOURS = 200
# an animation has at most so many pictures and bytes, and takes about so long [s]
PICTURES, BYTES, DURATION = 64, 1_500_000, 4.0
# width of an animation, what is left white around it, and room for the time, pixels
WIDTH, MARGIN, TITLE = 560, 12, 28
# light where displacements are small, so that the shape is seen by its shading
LIGHT = ListedColormap(mpl.colormaps["GnBu"](np.linspace(0.2, 1.0, 256)))


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
    drawn = without_margins(list(images(what, width, marks=False)))
    for axes, t, image in zip(every, times, drawn, strict=False):
        axes.imshow(np.asarray(image))
        axes.set_title(f"t = {states.nearest(t):.3g} s", fontsize=10)
    colours = ScalarMappable(Normalize(*what.limits), what.colours)
    made.colorbar(colours, ax=list(every), label=what.shown.label, shrink=0.65, pad=0.03)


def _showing(states: Fields, times: Iterable[float]) -> Showing:
    """Part of a run that is shown, without the forces of its joints."""
    described = read_described(states.folder.parent)
    what = showing(states, described, times, "displacement", factor=1.0)
    return replace(what, force=0.0, colours=LIGHT)


def without_margins(drawn: Sequence[Image.Image]) -> list[Image.Image]:
    """Images without what is white in all of them, but for a small margin."""
    white = Image.new("RGB", drawn[0].size, "white")
    boxes = [ImageChops.difference(each.convert("RGB"), white).getbbox() for each in drawn]
    every = np.array([box for box in boxes if box])
    low = np.maximum(every[:, :2].min(axis=0) - MARGIN, 0)
    high = np.minimum(every[:, 2:].max(axis=0) + MARGIN, drawn[0].size)
    left, top, right, bottom = map(int, (*low, *high))
    return [each.crop((left, top, right, bottom)) for each in drawn]


def _small(image: Image.Image, text: str) -> Image.Image:
    """A frame of an animation: smaller by half, which smooths it, with the time above."""
    height = round(image.height * WIDTH / image.width)
    made = Image.new("RGB", (WIDTH, height + TITLE), "white")
    made.paste(image.convert("RGB").resize((WIDTH, height), Image.Resampling.LANCZOS), (0, TITLE))
    ImageDraw.Draw(made).text((10, 6), text, "black", ImageFont.load_default(16))
    return made


def draw_animation(states: Fields, path: Path) -> None:
    """The deformed system over time, small enough for a page."""
    count, times = PICTURES, states.times
    while True:
        every = np.linspace(0, len(times) - 1, min(count, len(times)))
        what = _showing(states, times[np.round(every).astype(int)])
        drawn = without_margins(list(images(what, 2 * WIDTH, marks=False)))
        texts = [what.title(each) for each in what.states]
        write([_small(*pair) for pair in zip(drawn, texts, strict=True)], path, DURATION)
        if path.stat().st_size <= BYTES or count < 8:
            return
        count = count * 3 // 4
