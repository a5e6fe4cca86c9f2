"""Bodies in space drawn with matplotlib: no display and no graphics driver is needed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection
from mpl_toolkits.mplot3d.axes3d import Axes3D

from shellmb.observers.grid import Grid

Floats = npt.NDArray[np.float64]

COLOURS = "viridis"
ELEVATION, AZIMUTH = 24, -58

# height of a title in the axes: those in space leave much room above a flat box
TITLE = 0.93

# a scene thinner than this part of its size along one axis only is planar and seen across it
PLANAR = 1e-6

# room around a planar scene, part of its size
MARGIN = 0.08

# elevation and azimuth that look along x, y, z
ACROSS = ((0, 0), (0, -90), (90, -90))

# a side of the box below this part of the longest one is widened to it, for axes that can be read
FLAT = 0.25

# displacements smaller than this part of the scene are shown larger, up to about that part of it
SMALL, SHOWN = 0.03, 0.12

STYLE: dict[Any, Any] = {
    "font.size": 10,
    "axes.grid": True,
    "grid.alpha": 0.3,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "figure.dpi": 150,
    "savefig.dpi": 150,
    # small and large numbers share one power of ten at the end of their axis
    "axes.formatter.limits": (-3, 5),
}


@dataclass(frozen=True)
class View:
    """A box in space and a range of colours, the same for all pictures of a series.

    Args:
        low: Lower corner of the box, shape (3,), m.
        high: Upper corner, shape (3,), m.
        largest: Value of the last colour, m.
        planar: Axis along which a planar scene has no extent; None: the scene is not planar.
    """

    low: Floats
    high: Floats
    largest: float
    planar: int | None = None


def figure(width: float, height: float) -> Figure:
    """A figure that is drawn into memory only.

    Args:
        width: Width, inches.
        height: Height, inches.
    """
    made = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(made)
    return made


def enlargement(grids: dict[str, Grid], displacement: dict[str, Floats]) -> float:
    """Factor by which displacements are shown: 1; for small ones 1, 2 or 5 times a power of 10."""
    nodes = np.concatenate([g.nodes for g in grids.values()])
    size = float(np.linalg.norm(np.ptp(nodes, axis=0)))
    largest = max(float(np.max(np.linalg.norm(u, axis=1))) for u in displacement.values())
    if largest <= 0 or largest > SMALL * size:
        return 1.0
    wanted = SHOWN * size / largest
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(power * max(step for step in (1, 2, 5) if step * power <= wanted))


def view_of(
    grids: dict[str, Grid], displacements: list[dict[str, Floats]], factor: float = 1.0
) -> View:
    """The view that shows the reference and all given states.

    Args:
        grids: Grids by name.
        displacements: Displacements by name, of each state.
        factor: By which they are shown.
    """
    points = [g.nodes for g in grids.values()]
    points += [grids[n].nodes + factor * u for state in displacements for n, u in state.items()]
    every = np.concatenate(points)
    low, high = every.min(axis=0), every.max(axis=0)
    longest = float(np.max(high - low))
    thin = np.flatnonzero(high - low <= PLANAR * longest)
    least = FLAT * longest
    middle, side = (low + high) / 2, np.maximum(high - low, least)
    sizes = [float(np.max(np.linalg.norm(u, axis=1))) for s in displacements for u in s.values()]
    planar = int(thin[0]) if len(thin) == 1 else None
    if planar is not None:
        # what lies along an axis is told from it
        side = side + MARGIN * longest
    return View(middle - side / 2, middle + side / 2, max([*sizes, 1e-300]), planar)


def space(made: Figure, place: tuple[int, int, int], view: View) -> Axes3D:
    """Axes in space with equal scales.

    Args:
        made: The figure.
        place: Rows, columns, number.
        view: What is seen.
    """
    axes = made.add_subplot(*place, projection="3d", computed_zorder=False)
    # neighbours must not cover one another's labels
    axes.patch.set_visible(False)
    axes.set(xlim=(view.low[0], view.high[0]), ylim=(view.low[1], view.high[1]))
    axes.set_zlim(view.low[2], view.high[2])
    # room for the labels of a box that is as high as wide
    sides = view.high - view.low
    axes.set_box_aspect(sides, zoom=1.0 - 0.25 * float(sides[2] / np.max(sides)))
    if view.planar is None:
        axes.view_init(ELEVATION, AZIMUTH)
    else:
        axes.set_proj_type("ortho")
        axes.view_init(*ACROSS[view.planar])
    axes.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
    for one, k in ((axes.xaxis, 0), (axes.yaxis, 1), (axes.zaxis, 2)):
        share = (view.high - view.low)[k] / float(np.max(view.high - view.low))
        one.set_major_locator(mpl.ticker.MaxNLocator(max(2, round(5 * share))))
        one.set_tick_params(labelsize=8)
        one.labelpad = 4 + 14 * share if view.planar is None else 16
        if k == view.planar:
            one.set_ticks([])
            one.label.set_visible(False)
    return axes


def title(axes: Axes3D, text: str, view: View) -> None:
    """A title above the box.

    Args:
        axes: Axes of `space`.
        text: The title.
        view: Their view.
    """
    # the corner of a box that is as high as wide reaches beyond the axes
    high = (view.high - view.low)[2] / float(np.max(view.high - view.low)) > 0.6
    axes.set_title(text, fontsize=10, y=1.0 if high and view.planar is None else TITLE)


def bodies(
    axes: Axes3D,
    grids: dict[str, Grid],
    displacement: dict[str, Floats],
    view: View,
    factor: float = 1.0,
) -> None:
    """Deformed bodies in colours of the displacement, with their elements and the reference.

    Args:
        axes: Where.
        grids: Grids by name.
        displacement: Displacements by name.
        view: Range of colours.
        factor: By which displacements are shown.
    """
    for name, grid in grids.items():
        u = displacement[name]
        x, size = grid.nodes + factor * u, np.linalg.norm(u, axis=1)
        if len(grid.faces):
            _faces(axes, grid, x, size, view)
        first = {"colors": "0.35", "linewidths": 0.9, "linestyles": "dashed"}
        _lines(axes, grid.nodes[grid.border], first)
        if grid.hollow:
            _lines(axes, x[grid.lines], {"colors": "black", "linewidths": grid.width})
            marks = {"facecolors": "white", "edgecolors": "black", "s": 14, "linewidths": 0.8}
        else:
            colours = _colours(size[grid.lines].mean(axis=1), view)
            # a dark edge: on a shell a beam has the colour of the shell
            _lines(axes, x[grid.lines], {"colors": "black", "linewidths": grid.width + 1.4})
            _lines(axes, x[grid.lines], {"colors": colours, "linewidths": grid.width})
            marks = {"c": _colours(size[grid.dots], view), "s": 30, "edgecolors": "black"}
        if len(grid.dots):
            axes.scatter(*x[grid.dots].T, depthshade=False, **marks)


def _colours(sizes: Floats, view: View) -> Floats:
    return np.asarray(mpl.colormaps[COLOURS](Normalize(0, view.largest)(sizes)))


def _faces(axes: Axes3D, grid: Grid, x: Floats, size: Floats, view: View) -> None:
    """A surface and the outlines of its elements."""
    # pieces of their own colour on their edges leave no gaps
    colours = _colours(size[grid.faces].mean(axis=1), view)
    axes.add_collection3d(
        Poly3DCollection(x[grid.faces], facecolors=colours, edgecolors=colours, linewidths=0.3)
    )
    _lines(axes, x[grid.outlines], {"colors": "black", "linewidths": 0.35, "alpha": 0.45})


def _lines(axes: Axes3D, segments: Floats, style: dict[str, Any]) -> None:
    if len(segments):
        axes.add_collection3d(Line3DCollection(segments, **style))


def colour_bar(made: Figure, axes: list[Axes3D], view: View) -> None:
    """The scale of the colours."""
    colours = ScalarMappable(Normalize(0, view.largest), COLOURS)
    made.colorbar(colours, ax=axes, label="displacement [m]", shrink=0.65, pad=0.08)


def key(made: Figure, grids: dict[str, Grid]) -> None:
    """What the lines and marks of `bodies` mean.

    Args:
        made: The figure.
        grids: What it shows.
    """
    plain: dict[str, Any] = {"linestyle": "none", "marker": "o", "markeredgecolor": "black"}
    shown = [Line2D([], [], color="0.35", linewidth=0.9, linestyle="dashed", label="reference")]
    marked = [grid for grid in grids.values() if len(grid.dots)]
    if any(not grid.hollow for grid in marked):
        centre = Line2D([], [], color="0.6", label="centre of a rigid body", **plain)
        shown.append(centre)
    if any(grid.hollow for grid in marked):
        shown.append(Line2D([], [], color="white", markersize=4, label="joint", **plain))
    made.legend(handles=shown, loc="outside lower center", ncols=len(shown), fontsize=9)
