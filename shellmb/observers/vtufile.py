"""One grid in a file of VTK's XML format, its numbers raw behind the head, uncompressed.

The head says where which numbers stand, and is the same for all states of a grid: a state is
written by copying its numbers into one block of bytes. It needs no VTK, which takes longer to
import than a small scene to run.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from shellmb.errors import SceneError

Array = npt.NDArray[Any]

KINDS = {"Float64": np.float64, "Int64": np.int64, "UInt8": np.uint8}
NAMES = {np.dtype(kind): name for name, kind in KINDS.items()}
# before the numbers of each array stands their size in bytes
SIZE = 8
BEGIN, END = b'<AppendedData encoding="raw">_', b"\n</AppendedData></VTKFile>\n"


def block(
    points: Array,
    cells: Mapping[str, Array],
    point_data: Mapping[str, Array],
    cell_data: Mapping[str, Array],
) -> tuple[bytearray, dict[str, Array]]:
    """All bytes of a file, and the arrays in it by name: what is put into them is in the bytes.

    Args:
        points: Positions of the nodes, shape (n, 3); named "Points".
        cells: "connectivity", "offsets" and "types" of the cells.
        point_data: Values at the nodes, shape (n,) or (n, k).
        cell_data: Values of the cells.
    """
    sections = {"PointData": point_data, "CellData": cell_data, "Points": {"Points": points}}
    sections["Cells"] = cells
    arrays: dict[str, Array] = {}
    places: dict[str, int] = {}
    head, offset = "", 0
    for section, some in sections.items():
        head += f"<{section}>\n"
        for name, given in some.items():
            values = arrays[name] = np.ascontiguousarray(given)
            places[name] = offset
            width = values.shape[1] if values.ndim > 1 else 1
            head += (
                f'<DataArray type="{NAMES[values.dtype]}" Name="{name}" '
                f'NumberOfComponents="{width}" format="appended" offset="{offset}"/>\n'
            )
            # each begins at a multiple of eight
            offset += SIZE + -(-values.nbytes // 8) * 8
        head += f"</{section}>\n"
    order = "LittleEndian" if sys.byteorder == "little" else "BigEndian"
    begin = (
        '<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="1.0" '
        f'byte_order="{order}" header_type="UInt64">\n<UnstructuredGrid>\n'
        f'<Piece NumberOfPoints="{len(points)}" NumberOfCells="{len(cells["types"])}">\n'
        f"{head}</Piece>\n</UnstructuredGrid>\n"
    ).encode()
    begin += b" " * (-(len(begin) + len(BEGIN)) % 8) + BEGIN
    made = bytearray(len(begin) + offset) + END
    made[: len(begin)] = begin
    views = {}
    for name, values in arrays.items():
        at = len(begin) + places[name]
        np.frombuffer(made, np.uint64, 1, at)[0] = values.nbytes
        view = np.frombuffer(made, values.dtype, values.size, at + SIZE).reshape(values.shape)
        view[...] = values
        views[name] = view
    return made, views


def read(path: Path) -> dict[str, Array]:
    """The arrays of a file that was written here, by name.

    Args:
        path: The file.

    Raises:
        SceneError: If it was written by another program.
    """
    content = path.read_bytes()
    begin = content.find(BEGIN) + len(BEGIN)
    head = content[:begin].decode(errors="replace")
    if begin < len(BEGIN) or "compressor" in head or 'header_type="UInt64"' not in head:
        raise SceneError(f"{path} is of another program, or version; run the scene anew")
    found: dict[str, Array] = {}
    pattern = r'<DataArray type="(\w+)" Name="([^"]*)" NumberOfComponents="(\d+)".*offset="(\d+)"/>'
    for kind, name, width, offset in re.findall(pattern, head):
        at, dtype = begin + int(offset), np.dtype(KINDS[kind])
        count = int(np.frombuffer(content, np.uint64, 1, at)[0]) // dtype.itemsize
        values = np.frombuffer(content, dtype, count, at + SIZE)
        found[name] = values.reshape(-1, int(width)) if int(width) > 1 else values
    return found
