"""Files of one grid over time: `NAME_0000.vtu` and so on, and `NAME.vtu.series`."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import IO

import numpy as np
import numpy.typing as npt
import pyvista
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

from shellmb.observers.grid import Grid

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
        data = pyvista.UnstructuredGrid(grid.vtk_cells, grid.vtk_types, grid.nodes.copy())
        self._data, self._cell_data = data, dict(cell_data)
        self._writer = vtkXMLUnstructuredGridWriter()
        self._writer.SetInputDataObject(data)
        self._writer.SetDataModeToAppended()
        # raw numbers, lightly compressed: half the time of pyvista's `save`
        self._writer.EncodeAppendedDataOff()
        self._writer.SetCompressorTypeToLZ4()
        self._series: IO[str] | None = None

    def file(self, number: int) -> Path:
        """File of one state."""
        return self._folder / f"{self._stem}_{number:04d}.vtu"

    def write(self, times: list[float], fields: Mapping[str, Floats]) -> None:
        """Write the last state.

        Args:
            times: Times of all states so far, s.
            fields: Values at the nodes, "displacement" among them; the same names at all times.
        """
        number = len(times) - 1
        # new arrays each time: VTK remembers the ranges of old ones, and writes them
        self._data.points = self._grid.nodes + fields["displacement"]
        for key, values in {"reference": self._grid.nodes, **fields}.items():
            self._data.point_data[key] = values
        for key, values in self._cell_data.items():
            self._data.cell_data[key] = values
        self._writer.SetFileName(str(self.file(number)))
        if not self._writer.Write():
            raise OSError(f"{self.file(number)} cannot be written")
        self._list(times)

    def _list(self, times: list[float]) -> None:
        """Add the last state to the list that ParaView opens; the file is complete at all times."""
        if self._series is None:
            self._series = (self._folder / f"{self._stem}.vtu.series").open("w")
            self._series.write('{"file-series-version": "1.0", "files": [\n')
            entries = [self._entry(k, t) for k, t in enumerate(times)]
            self._series.write(",\n".join(entries) + END)
        else:
            # over what ends the file: writing it anew takes longer than writing a state
            self._series.seek(self._series.tell() - len(END))
            self._series.write(",\n" + self._entry(len(times) - 1, times[-1]) + END)
        self._series.flush()

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
