"""Files of one grid over time: `NAME_0000.vtu` and so on, and `NAME.vtu.series`."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from io import BufferedWriter
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pyvista

from shellmb.observers.grid import Grid
from shellmb.observers.vtu import VtuFormat

Floats = npt.NDArray[np.float64]

END = "\n]}\n"


class GridFiles:
    """Writes states of a grid; what stays the same from one to the next is made once.

    Args:
        folder: Where the files go.
        grid: The grid.
        cell_data: Values of its cells, which do not change.
    """

    def __init__(self, folder: Path, grid: Grid, cell_data: Mapping[str, Floats]) -> None:
        self._folder, self._grid = folder, grid
        self._stem = grid.name.replace(" ", "_")
        self._cell_data = dict(cell_data)
        self._format: VtuFormat | None = None
        self._series: BufferedWriter | None = None
        # states in the list, and bytes before its end
        self._listed = (0, 0)

    def file(self, number: int) -> Path:
        """File of one state."""
        return self._folder / f"{self._stem}_{number:04d}.vtu"

    def write(self, number: int, fields: Mapping[str, Floats]) -> None:
        """Write a state.

        Args:
            number: Its number.
            fields: Values at the nodes, "displacement" among them; the same names at all times.
        """
        if self._format is None:
            self._format = VtuFormat(self._grid, self._cell_data, fields)
        self.file(number).write_bytes(self._format.content(fields))

    def list(self, times: Sequence[float]) -> None:
        """List the states for ParaView; the file is complete at all times.

        Args:
            times: Times of all states so far, s.
        """
        if self._series is None:
            self._series = (self._folder / f"{self._stem}.vtu.series").open("wb")
        count, size = self._listed
        text = ",\n" if count else '{"file-series-version": "1.0", "files": [\n'
        text += ",\n".join(self._entry(k, times[k]) for k in range(count, len(times)))
        # over what ends the file: writing it anew takes longer than writing a state
        self._series.seek(size)
        self._series.write((text + END).encode())
        self._series.flush()
        self._listed = (len(times), size + len(text.encode()))

    def _entry(self, number: int, t: float) -> str:
        return json.dumps({"name": self.file(number).name, "time": t})

    def displacement(self, number: int) -> Floats:
        """Displacements of a state that was written, shape (n, 3), m."""
        return np.asarray(pyvista.read(self.file(number)).point_data["displacement"], dtype=float)

    def close(self) -> None:
        """Close the list."""
        if self._series is not None:
            self._series.close()
            self._series = None
