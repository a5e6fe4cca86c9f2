"""States of a grid as VTK's files `.vtu`: some XML, and behind it the numbers as they are."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from shellmb.observers.grid import Grid

Floats = npt.NDArray[np.float64]
Array = npt.NDArray[Any]

KINDS = {"float64": "Float64", "int64": "Int64", "uint8": "UInt8"}
END = b"\n</AppendedData>\n</VTKFile>\n"


class VtuFormat:
    """Files of one grid; what they have in common is made once.

    VTK's own writer looks for the ranges of all numbers before it writes them, and takes twenty
    times as long on small grids.

    Args:
        grid: The grid.
        cell_data: Values of its cells, which do not change.
        fields: Names of the values at the nodes, each with three components.
    """

    def __init__(self, grid: Grid, cell_data: Mapping[str, Floats], fields: Iterable[str]) -> None:
        cells, ends = _cells(grid.vtk_cells)
        steady: list[tuple[str, str, Array]] = [
            ("PointData", "reference", grid.nodes),
            *(("CellData", name, values) for name, values in cell_data.items()),
            ("Cells", "connectivity", cells),
            ("Cells", "offsets", ends),
            ("Cells", "types", grid.vtk_types),
        ]
        # behind what stays the same, in the order in which `content` takes them
        changing: list[tuple[str, str, Array]] = [
            ("PointData", name, grid.nodes) for name in fields
        ]
        changing.append(("Points", "Points", grid.nodes))
        sections = dict.fromkeys(("PointData", "CellData", "Points", "Cells"), "")
        offset = 0
        for section, name, values in [*steady, *changing]:
            components = "" if values.ndim == 1 else f' NumberOfComponents="{values.shape[1]}"'
            sections[section] += (
                f'<DataArray type="{KINDS[values.dtype.name]}" Name="{name}"{components} '
                f'format="appended" offset="{offset}"/>\n'
            )
            offset += len(_block(values))
        self._nodes = grid.nodes
        numbers = [_block(values) for _, _, values in steady]
        self._head = b"".join([_header(grid, sections).encode(), *numbers])

    def content(self, fields: Mapping[str, Floats]) -> bytes:
        """The file of a state.

        Args:
            fields: Values at the nodes, "displacement" among them, shape (n, 3) each; in the order
                of their names.
        """
        numbers = [*fields.values(), self._nodes + fields["displacement"]]
        return b"".join([self._head, *map(_block, numbers), END])


def _header(grid: Grid, sections: Mapping[str, str]) -> str:
    body = "".join(f"<{name}>\n{arrays}</{name}>\n" for name, arrays in sections.items())
    # what is shown first
    body = body.replace("<PointData>", '<PointData Scalars="reference">')
    return (
        '<VTKFile type="UnstructuredGrid" version="1.0" '
        f'byte_order="{sys.byteorder.capitalize()}Endian" header_type="UInt64">\n'
        "<UnstructuredGrid>\n"
        f'<Piece NumberOfPoints="{len(grid.nodes)}" NumberOfCells="{len(grid.vtk_types)}">\n'
        f"{body}</Piece>\n</UnstructuredGrid>\n"
        '<AppendedData encoding="raw">\n_'
    )


def _block(values: Array) -> bytes:
    """Numbers behind the number of their bytes."""
    return values.nbytes.to_bytes(8, sys.byteorder) + values.tobytes()


def _cells(vtk_cells: npt.NDArray[np.int64]) -> tuple[npt.NDArray[np.int64], ...]:
    """Nodes of all cells in a row, and where those of each end."""
    ends, place = [], 0
    while place < len(vtk_cells):
        place += int(vtk_cells[place]) + 1
        ends.append(place)
    last = np.array(ends, dtype=np.int64)
    counts = np.diff(last, prepend=0)
    return np.delete(vtk_cells, last - counts), last - np.arange(1, len(last) + 1)
