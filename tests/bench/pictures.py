"""The picture of `python -m tests.bench`: where the time of a step goes, and how it grows."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes

from shellmb.observers.drawing import picture
from tests.bench.bars import exponents
from tests.bench.record import PARTS, Measured


def draw(measured: Sequence[Measured], path: Path) -> None:
    """Step times by part as stacked bars, and the time of a full Newton iteration over elements.

    The latter only where three meshes or more were measured.
    """
    meshes = list(dict.fromkeys((m.record.scene, m.record.mesh) for m in measured))
    columns = min(len(meshes), 4)
    rows = -(-len(meshes) // columns)
    grows = any(exponents(measured, scheme) for scheme in ("ep", "ed"))
    with picture(path, 4.2 * columns, 3.4 * (rows + grows)) as made:
        grid = made.add_gridspec(rows + grows, columns)
        for k, (scene, mesh) in enumerate(meshes):
            some = [m for m in measured if (m.record.scene, m.record.mesh) == (scene, mesh)]
            axes = made.add_subplot(grid[k // columns, k % columns])
            _bars(axes, some)
            axes.set_title(f"{scene}, {mesh}")
            if k == 0:
                axes.legend(fontsize=7)
        if grows:
            _growth(made.add_subplot(grid[rows, :]), measured)


def _bars(axes: Axes, some: Sequence[Measured]) -> None:
    """One stacked bar for each scheme and configuration; what is left of the step in grey."""
    colours = mpl.colormaps["viridis"](np.linspace(0.0, 0.95, len(PARTS)))
    places = np.arange(len(some))
    bottom = np.zeros(len(some))
    for part, colour in zip(PARTS, colours, strict=True):
        values = np.array([1e3 * getattr(m.record, part) for m in some])
        label = part.removesuffix("_s").replace("factor", "factorisation")
        axes.barh(places, values, left=bottom, color=colour, label=label)
        bottom += values
    rest = np.array([1e3 * m.record.step_s for m in some]) - bottom
    axes.barh(places, np.maximum(rest, 0.0), left=bottom, color="0.75", label="other")
    bare = [1e3 * m.record.bare_s for m in some]
    axes.plot(bare, places, "k|", markersize=12, label="bare work")
    names = [f"{m.record.scheme} {m.record.configuration}" for m in some]
    axes.set_yticks(places, names, fontsize=8)
    axes.invert_yaxis()
    axes.set_xlabel("time of a step [ms]")


def _growth(axes: Axes, measured: Sequence[Measured]) -> None:
    for colour, scheme in zip(("C0", "C1"), ("ep", "ed"), strict=True):
        growth = exponents(measured, scheme)
        if growth is None:
            continue
        elements = np.array(growth.elements, dtype=float)
        axes.loglog(elements, 1e3 * np.array(growth.seconds), "o", color=colour)
        law = 1e3 * growth.constant * elements**growth.fit
        label = f"{scheme}: elements^{growth.fit:.2f} (steepest {growth.steepest:.2f})"
        axes.loglog(elements, law, color=colour, label=label)
    axes.legend()
    axes.set_xlabel("elements")
    axes.set_ylabel("full Newton iteration [ms]")
