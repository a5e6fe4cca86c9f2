"""An array over states whose numbers are read from the files of the states when they are used."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader
from xarray.backends import BackendArray
from xarray.core import indexing

Floats = npt.NDArray[np.float64]

# name of the positions, which are the points of the grid
POSITION = "position"


class OnFiles(BackendArray):
    """Values of one array in files of states.

    Args:
        files: A file for each state.
        name: Name of the array, or `POSITION`.
        shape: Of one state.
    """

    def __init__(self, files: Sequence[Path], name: str, shape: tuple[int, ...]) -> None:
        self._files, self._name = list(files), name
        self.shape = (len(self._files), *shape)
        self.dtype = np.dtype(float)

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:
        return indexing.explicit_indexing_adapter(
            key, self.shape, indexing.IndexingSupport.BASIC, self._read
        )

    def _read(self, key: tuple[Any, ...]) -> Any:
        first, *rest = key
        if not isinstance(first, slice):
            return read_values(self._files[first], self._name)[tuple(rest)]
        files = self._files[first]
        empty = np.empty((0, *self.shape[1:]))
        states = np.array([read_values(file, self._name) for file in files]) if files else empty
        return states[(slice(None), *rest)]


def read_values(file: Path, name: str) -> Floats:
    """One array at the nodes of a state, and no other one.

    Args:
        file: File of the state.
        name: Name of the array, or `POSITION`.
    """
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(file))
    reader.UpdateInformation()
    reader.GetCellDataArraySelection().DisableAllArrays()
    chosen = reader.GetPointDataArraySelection()
    chosen.DisableAllArrays()
    if name != POSITION:
        chosen.EnableArray(name)
    reader.Update()
    grid = reader.GetOutput()
    array = grid.GetPoints().GetData() if name == POSITION else grid.GetPointData().GetArray(name)
    found: Floats = vtk_to_numpy(array)  # type: ignore[no-untyped-call]
    return found.astype(np.float64)
