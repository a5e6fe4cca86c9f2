"""One picture with all modes."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np
import numpy.typing as npt

from shellmb.observers.drawing import SHOWN, STYLE, bodies, figure, space, title, view_of
from shellmb.observers.grid import Grid

COLUMNS = 3


def draw_modes(
    path: Path,
    grids: dict[str, Grid],
    shapes: list[dict[str, npt.NDArray[np.float64]]],
    frequencies: list[float],
    rigid: int,
) -> None:
    """Draw the shapes of modes, all with the same largest displacement.

    Args:
        path: File to write.
        grids: Grids by name.
        shapes: Displacements by name, of each mode.
        frequencies: Their frequencies, Hz.
        rigid: Number of rigid-body modes, which are the first ones.
    """
    nodes = np.concatenate([g.nodes for g in grids.values()])
    size = SHOWN * float(np.linalg.norm(np.ptp(nodes, axis=0)))
    scaled = []
    for shape in shapes:
        largest = max(float(np.max(np.linalg.norm(u, axis=1))) for u in shape.values())
        scaled.append({name: u * (size / (largest or 1.0)) for name, u in shape.items()})
    columns = min(COLUMNS, len(shapes))
    rows = -(-len(shapes) // columns)
    with mpl.rc_context(STYLE):
        made = figure(4.4 * columns, 3.6 * rows)
        view = view_of(grids, scaled)
        for k, (shape, frequency) in enumerate(zip(scaled, frequencies, strict=True), start=1):
            axes = space(made, (rows, columns, k), view)
            bodies(axes, grids, shape, view)
            label = "rigid" if k <= rigid else f"{frequency:.4g} Hz"
            title(axes, f"mode {k}: {label}", view)
        made.savefig(path)
