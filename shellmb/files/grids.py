"""Files of states (`.vtu`) read back, if they are as the run wrote them.

VTK believes sizes and offsets, and a file that was cut or spoilt ends the process. So each file has
a checksum of itself, in a comment behind its first line, and what VTK gets is compared with it.
"""

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkUnstructuredGrid
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.files.reading import read_bytes
from shellmb.files.writing import seal_grid


def read_grid(file: Path, only: str | None = None) -> vtkUnstructuredGrid:
    """The grid of a state.

    Args:
        file: Its file.
        only: Name of the one array at its nodes that is read; None: all, with those of its cells.

    Raises:
        SceneError: If it is damaged.
    """
    check_grid(file)
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(file))
    reader.UpdateInformation()
    if only is not None:
        for arrays in (reader.GetCellDataArraySelection(), reader.GetPointDataArraySelection()):
            arrays.DisableAllArrays()
        reader.GetPointDataArraySelection().EnableArray(only)
    reader.Update()
    return reader.GetOutput()


def numbers(array: Any) -> npt.NDArray[Any]:
    """The numbers of one of VTK's arrays, where they are."""
    return np.asarray(vtk_to_numpy(array))  # type: ignore[no-untyped-call]


def components(array: Any) -> tuple[str, ...]:
    """Names of the components of one of VTK's arrays, or their numbers; none of a scalar."""
    count = array.GetNumberOfComponents()
    return tuple(array.GetComponentName(k) or str(k + 1) for k in range(count if count > 1 else 0))


def check_grid(file: Path) -> None:
    """Check a file before VTK reads it.

    Args:
        file: The file.

    Raises:
        SceneError: If it is not as it was written.
    """
    content = read_bytes(file)
    first, _, rest = content.partition(b"\n")
    if seal_grid(first + b"\n" + rest.partition(b"\n")[2]) != content:
        raise SceneError(
            f"{file} is damaged (it does not have its checksum); it must be as the run wrote it"
        )


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
