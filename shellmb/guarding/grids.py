"""Files of states (`.vtu`) read back, after all that they say of themselves is checked.

VTK believes sizes and offsets, and a file that was cut, or lies, ends the process. So what is
handed to VTK was decoded here first, within the sizes that the numbers of points and cells allow.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Collection
from pathlib import Path
from typing import Any

import lz4.block  # type: ignore[import-untyped]
import numpy as np
import numpy.typing as npt
from vtkmodules.vtkCommonDataModel import vtkUnstructuredGrid
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

from shellmb.errors import SceneError
from shellmb.guarding.reading import read_bytes

TYPES = {"Float64": "<f8", "Float32": "<f4", "Int64": "<i8", "Int32": "<i4", "UInt8": "u1"}
TYPES |= {"UInt32": "<u4", "UInt64": "<u8", "Int8": "i1", "Int16": "<i2", "UInt16": "<u2"}
DATA = re.compile(rb'<AppendedData encoding="raw">\s*_')
# the head of a file has a line for each array [bytes], an array so many components
LONGEST, MOST = 1_000_000, 100
# LZ4 makes a number of bytes smaller by less than this
SMALLEST = 255
# points that cells of a type of VTK may have: plain ones, quadratic ones, those of Lagrange
NODES: dict[int, Collection[int]] = {1: (1,), 3: (2,), 5: (3,), 9: (4,), 21: (3,), 22: (6,)}
NODES |= {23: (8,), 28: (9,), 34: (7,), 68: range(2, 12)}
NODES |= {69: [(k + 1) * (k + 2) // 2 for k in range(1, 11)], 70: [k * k for k in range(2, 12)]}
# of solids
NODES |= {10: (4,), 12: (8,), 24: (10,), 25: (20,), 29: (27,)}
NODES |= {71: [(k + 1) * (k + 2) * (k + 3) // 6 for k in range(1, 11)]}
NODES |= {72: [k**3 for k in range(2, 12)]}
AS_WRITTEN = "it must be as the run wrote it"


class _Lie(Exception):
    """Error that says what is wrong with a file."""


def read_grid(file: Path) -> vtkUnstructuredGrid:
    """The grid of a state, with all its arrays.

    Args:
        file: Its file.

    Raises:
        SceneError: If it is damaged.
    """
    sizes = check_grid(file)
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(file))
    reader.Update()
    made = reader.GetOutput()
    if (made.GetNumberOfPoints(), made.GetNumberOfCells()) != sizes:
        raise SceneError(f"{file} is damaged (VTK does not read it); {AS_WRITTEN}")
    return made


def check_grid(file: Path) -> tuple[int, int]:
    """Check a file before VTK reads it.

    Args:
        file: The file.

    Returns:
        How many points and cells it has.

    Raises:
        SceneError: If it is damaged.
    """
    content = read_bytes(file)
    try:
        return _check(content)
    except (_Lie, ValueError, KeyError, OverflowError, lz4.block.LZ4BlockError) as error:
        said = f"it has no {error}" if isinstance(error, KeyError) else str(error)
        raise SceneError(f"{file} is damaged ({said}); {AS_WRITTEN}") from None


def _check(content: bytes) -> tuple[int, int]:
    begin = DATA.search(content, 0, LONGEST)
    if begin is None or b"<!" in content[: begin.start()]:
        raise _Lie("it is no file of a state")
    try:
        root = ET.fromstring(content[: begin.start()] + b"</VTKFile>")
    except ET.ParseError as error:
        raise _Lie(str(error)) from None
    piece = root.find("./UnstructuredGrid/Piece")
    wanted = {"type": "UnstructuredGrid", "compressor": "vtkLZ4DataCompressor"}
    wanted |= {"byte_order": "LittleEndian"}
    if piece is None or any(root.get(k) != v for k, v in wanted.items()):
        raise _Lie("it is no file of a state")
    if len(root.findall(".//Piece")) != 1 or len(root.findall("./*")) != 1:
        raise _Lie("it has several parts")
    points, cells = (int(piece.attrib[f"NumberOf{k}"]) for k in ("Points", "Cells"))
    blocks = _Blocks(content, begin.end(), root.attrib["header_type"])
    if min(points, cells) < 0 or max(points, cells) > SMALLEST * len(content):
        raise _Lie(f"it cannot hold {points} points and {cells} cells")
    if content[-40:].strip()[-10:] != b"</VTKFile>":
        raise _Lie("its end is missing")
    for group, count in (("PointData", points), ("CellData", cells), ("Points", points)):
        for array in piece.findall(f"./{group}/*"):
            if array.get("type") == "String":
                # texts, each with a zero behind it
                if np.count_nonzero(blocks.numbers(array, "u1") == 0) != count:
                    raise _Lie("its texts are not one for each point")
                continue
            if array.tag != "DataArray":
                raise _Lie(f"it has a {array.tag}")
            width = int(array.get("NumberOfComponents", 1))
            if not 1 <= width <= MOST or (group == "Points" and width != 3):
                raise _Lie(f"an array has {width} components")
            blocks.numbers(array, TYPES[array.attrib["type"]], count * width)
    for array in root.findall("./UnstructuredGrid/FieldData/*"):
        blocks.numbers(array, TYPES[array.attrib["type"]])
    _check_cells(piece, blocks, points, cells)
    return points, cells


def _check_cells(piece: Any, blocks: _Blocks, points: int, cells: int) -> None:
    """Cells name points that are there."""
    found: dict[str, npt.NDArray[Any]] = {}
    for array in piece.findall("./Cells/DataArray"):
        name = array.attrib["Name"]
        count = None if name == "connectivity" else cells
        found[name] = blocks.numbers(array, TYPES[array.attrib["type"]], count)
    if set(found) != {"connectivity", "offsets", "types"}:
        raise _Lie("its cells are not complete")
    nodes, ends = found["connectivity"], found["offsets"].astype(np.int64)
    if len(nodes) and not (0 <= nodes.min() and nodes.max() < points):
        raise _Lie("a cell has a point that is none")
    steps = np.diff(ends, prepend=0)
    if (cells and ends[-1] != len(nodes)) or (steps < 1).any():
        raise _Lie("its cells have no points of their own")
    for kind, count in np.unique(np.stack([found["types"], steps], axis=-1), axis=0).tolist():
        if count not in NODES.get(kind, ()):
            raise _Lie(f"a cell of type {kind} has {count} points")


class _Blocks:
    """Arrays behind the head of a file."""

    def __init__(self, content: bytes, begin: int, header: str) -> None:
        self._content, self._begin = content, begin
        self._header = np.dtype(TYPES[header])

    def numbers(self, array: Any, dtype: str, count: int | None = None) -> npt.NDArray[Any]:
        """The numbers of an array, so many if that is known."""
        if array.get("format") != "appended":
            raise _Lie("an array is not where it should be")
        at, width = self._begin + int(array.attrib["offset"]), self._header.itemsize
        if at < self._begin:
            raise _Lie("an array begins before all of them")
        many, size, last = self._read(at, 3)
        if many > len(self._content):
            raise _Lie("an array has more blocks than there are bytes")
        packed = self._read(at + 3 * width, many)
        sizes = [size] * many
        if many and last:
            sizes[-1] = last
        total = sum(sizes)
        wanted = None if count is None else count * np.dtype(dtype).itemsize
        if wanted not in (None, total) or total > SMALLEST * max(len(self._content), 1):
            raise _Lie(f"an array has {total} bytes")
        place, parts = at + (3 + many) * width, []
        for own, whole in zip(packed, sizes, strict=True):
            part = self._content[place : place + own]
            if len(part) != own or whole > SMALLEST * own + 64:
                raise _Lie("an array is cut off")
            parts.append(lz4.block.decompress(part, uncompressed_size=whole))
            if len(parts[-1]) != whole:
                raise _Lie("an array is not as long as it says")
            place += own
        return np.frombuffer(b"".join(parts), dtype)

    def _read(self, at: int, count: int) -> list[int]:
        part = self._content[at : at + count * self._header.itemsize]
        if len(part) != count * self._header.itemsize:
            raise _Lie("an array is cut off")
        found: list[int] = np.frombuffer(part, self._header).tolist()
        return found
