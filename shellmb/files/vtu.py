"""Unstructured grids as VTK's XML files (`.vtu`): a head of text, and behind it arrays as bytes.

VTK's own writer makes these, too, but its modules take 45 MB of memory in every run. Here is what a
run needs of the format; VTK and ParaView read it.
"""

import zlib
from collections.abc import Mapping, Sequence
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
import numpy.typing as npt

HEAD = (
    '<?xml version="1.0"?>\n'
    '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64"'
    ' compressor="vtkZLibDataCompressor">\n<UnstructuredGrid>\n'
)
TYPES = {"f": "Float", "i": "Int", "u": "UInt"}


class Packed:
    """An array as it stands in a file.

    Args:
        name: Its name.
        values: Numbers, shape (n,) or (n, k), or n texts.
        components: Names of the k components, or none.
    """

    def __init__(
        self, name: str, values: npt.NDArray[Any] | Sequence[str], components: Sequence[str] = ()
    ) -> None:
        found = {"Name": name, "format": "appended"}
        if isinstance(values, np.ndarray):
            found["type"] = TYPES[values.dtype.kind] + str(8 * values.itemsize)
            found["NumberOfComponents"] = str(values.shape[1] if values.ndim > 1 else 1)
            content = np.ascontiguousarray(values, values.dtype.newbyteorder("<")).tobytes()
        else:
            found["type"] = "String"
            content = "".join(f"{text}\0" for text in values).encode()
        found |= {f"ComponentName{k}": component for k, component in enumerate(components)}
        self._attributes = found
        # one block: its number, size, that of a smaller one behind it, and what is left of it
        block = zlib.compress(content, level=1)
        sizes = [1, len(content), 0, len(block)] if content else [0, 0, 0]
        self.content = np.array(sizes, "<u8").tobytes() + (block if content else b"")

    def head(self, offset: int) -> str:
        """The element that describes it.

        Args:
            offset: Where its bytes begin behind those of all that stand before it.
        """
        every = {**self._attributes, "offset": str(offset)}
        return f"<DataArray {_attributes(every)}/>\n"


def grid_file(
    sections: Mapping[str, Sequence[Packed]], counts: tuple[int, int], shown: str
) -> bytes:
    """The content of a file.

    Args:
        sections: Arrays of "PointData", "CellData", "Points" and "Cells"; of these "connectivity",
            "offsets" (ends of the cells among their nodes) and "types".
        counts: Number of points and of cells.
        shown: Name of the array at the points that is shown when the file is opened.
    """
    points, cells = counts
    text = [HEAD, f'<Piece NumberOfPoints="{points}" NumberOfCells="{cells}">\n']
    content: list[bytes] = []
    place = 0
    for section, arrays in sections.items():
        active = _attributes({"Scalars": shown, "Vectors": shown}) if section == "PointData" else ""
        text.append(f"<{section} {active}>\n")
        for array in arrays:
            text.append(array.head(place))
            content.append(array.content)
            place += len(array.content)
        text.append(f"</{section}>\n")
    text.append('</Piece>\n</UnstructuredGrid>\n<AppendedData encoding="raw">\n_')
    return b"".join(["".join(text).encode(), *content, b"\n</AppendedData>\n</VTKFile>\n"])


def _attributes(values: Mapping[str, str]) -> str:
    return " ".join(f"{name}={quoteattr(value)}" for name, value in values.items())
