"""Files of one grid over time: `NAME_0000.vtu` and so on, and `NAME.vtu.series`."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from shellmb.observers import vtufile
from shellmb.observers.grid import Grid
from shellmb.observers.growingfile import GrowingFile

Floats = npt.NDArray[np.float64]

# what stands around the states in their list
HEAD, END = '{"file-series-version": "1.0", "files": [\n', "\n]}\n"


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
        self._content = bytearray()
        self._arrays: dict[str, Floats] = {}
        self._series: GrowingFile | None = None

    def file(self, number: int) -> Path:
        """File of one state."""
        return self._folder / f"{self._stem}_{number:04d}.vtu"

    def write(self, number: int, fields: Mapping[str, Floats]) -> None:
        """Write a state.

        Args:
            number: Its number.
            fields: Values at the nodes, "displacement" among them; the same names at all times.
        """
        if not self._arrays:
            fixed = {"reference": self._grid.nodes}
            self._content, self._arrays = vtufile.block(
                self._grid.nodes, self._cells(), fixed | dict(fields), self._cell_data
            )
        np.add(self._grid.nodes, fields["displacement"], out=self._arrays["Points"])
        for key, values in fields.items():
            self._arrays[key][...] = values
        self.file(number).write_bytes(self._content)

    def _cells(self) -> dict[str, npt.NDArray[Any]]:
        """The nodes of all cells in a row, where those of each end, and what they are."""
        row, types = self._grid.vtk_cells, self._grid.vtk_types
        counts, ends = np.zeros(len(row), dtype=bool), np.zeros(len(types), dtype=np.int64)
        place = 0
        for k in range(len(types)):
            counts[place] = True
            place += 1 + int(row[place])
            # without the counts so far
            ends[k] = place - k - 1
        return {"connectivity": row[~counts], "offsets": ends, "types": types}

    def list(self, times: Sequence[float]) -> None:
        """List the states for ParaView; the file is complete at all times.

        Args:
            times: Times of all states so far, s.
        """
        if self._series is None:
            # added to: writing it anew takes longer than writing a state
            path = self._folder / f"{self._stem}.vtu.series"
            self._series = GrowingFile(path, HEAD, ",\n", END)
        new = range(self._series.count, len(times))
        self._series.add([self._entry(k, times[k]) for k in new])

    def _entry(self, number: int, t: float) -> str:
        return json.dumps({"name": self.file(number).name, "time": t})

    def displacement(self, number: int) -> Floats:
        """Displacements of a state that was written, shape (n, 3), m."""
        return vtufile.read(self.file(number))["displacement"]

    def close(self) -> None:
        """Close the list."""
        if self._series is not None:
            self._series.close()
            self._series = None
