"""Numbers of one state of a body, from its file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.files.grids import numbers, read_grid

# name of the positions, which are the points of the grid
POSITION = "position"


def read_values(file: Path, name: str) -> Floats:
    """One array at the nodes of a state, and no other one.

    Args:
        file: File of the state.
        name: Name of the array, or `POSITION`.

    Raises:
        SceneError: If the file is damaged.
    """
    grid = read_grid(file, name)
    array = grid.GetPoints().GetData() if name == POSITION else grid.GetPointData().GetArray(name)
    if array is None:
        raise SceneError(f"{file} is damaged (it has no {name})")
    return numbers(array).astype(np.float64)
