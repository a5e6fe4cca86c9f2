"""Grids of bodies, gathered on rank 0, and their files (`.vtu`) over time.

Files are `NAME_0000.vtu` and so on, `NAME.vtu.series`, and `all.pvd`.

Unstructured grids as VTK's XML files (`.vtu`): a head of text, and behind it arrays as bytes.

VTK's own writer makes these, too, but its modules take 45 MB of memory in every run. Here is what a
run needs of the format; VTK and ParaView read it.
"""

import json
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple
from xml.sax.saxutils import quoteattr

from mpi4py import MPI

import dolfinx.plot
import numpy as np
import numpy.typing as npt

from shellmb.arrays import Floats, Int32s, Ints
from shellmb.errors import SceneError
from shellmb.files.reading import read_bytes
from shellmb.files.writing import checksum, rewrite_text, seal_grid, write_bytes
from shellmb.model.locations.nodes import Meshed

# list of the files of all grids
COLLECTION = (
    '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n'
    "<Collection>\n{}\n</Collection>\n</VTKFile>\n"
)

HEAD = (
    '<?xml version="1.0"?>\n'
    '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64"'
    ' compressor="vtkZLibDataCompressor">\n<UnstructuredGrid>\n'
)
TYPES = {"f": "Float", "i": "Int", "u": "UInt"}

# names of the components of fields; none
type Named = Mapping[str, Sequence[str]]
NONE: Named = {}


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


def _grid_file(
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


class Grid(NamedTuple):
    """All nodes and cells of a body; of shells and beams, of the degree of their displacement.

    Args:
        name: Name of the body, or of what is shown as one.
        nodes: Reference positions of the nodes, shape (n, 3), m.
        vtk_cells: Cells as VTK wants them: the number of nodes before the nodes of each.
        vtk_types: VTK's type of each cell.
        labels: Name of the body or joint of each node, or none.
    """

    name: str
    nodes: Floats
    vtk_cells: Ints
    vtk_types: npt.NDArray[np.uint8]
    labels: tuple[str, ...] = ()


class Gatherer:
    """Brings nodal values of a body with a mesh to rank 0.

    Args:
        body: The body; the call is collective.

    Attributes:
        grid: The whole grid on rank 0, None elsewhere; its nodes and cells are in the order in
            which the mesh was made, on any number of ranks.
    """

    def __init__(self, body: Meshed) -> None:
        space = body.mixed.subspaces["u"]
        index_map = space.dofmap.index_map
        self._comm: MPI.Comm = space.mesh.comm
        self._owned = int(index_map.size_local)
        cells, types, _ = dolfinx.plot.vtk_mesh(space)  # type: ignore[arg-type]
        width = space.dofmap.list.shape[1] + 1
        vtk = cells.reshape(-1, width).astype(np.int64)
        vtk[:, 1:] = _numbers(index_map, vtk[:, 1:])
        dim = space.mesh.topology.dim
        local = space.mesh.topology.index_map(dim).size_local
        own = _numbers(index_map, space.dofmap.list[:local])
        made = np.asarray(space.mesh.topology.original_cell_index[:local], dtype=np.int64)
        gathered = self._comm.gather((vtk, types, own, made))
        # of the nodes of all ranks in a row those that come first when the mesh is made, and so on
        self._order: Ints | None = None
        nodes = self.gather(body.mixed.nodes("u"))
        self.grid: Grid | None = None
        if gathered is None or nodes is None:
            return
        vtk, types, own, made = (np.concatenate([part[k] for part in gathered]) for k in range(4))
        cells = np.argsort(made)
        vtk, types, own = vtk[cells], types[cells], own[cells]
        there, first = np.unique(own, return_index=True)
        self._order = there[np.argsort(first)]
        number = np.empty(len(nodes), dtype=np.int64)
        number[self._order] = np.arange(len(nodes))
        nodes, vtk[:, 1:] = nodes[self._order], number[vtk[:, 1:]]
        self.grid = Grid(body.name, nodes, vtk.ravel(), types.astype(np.uint8))

    def gather(self, values: Floats) -> Floats | None:
        """Values at all nodes on rank 0, None elsewhere.

        Args:
            values: Values at the nodes of this rank (owned and ghost), shape (n, k).
        """
        mine = np.asarray(values[: self._owned])
        # the numbers of the nodes go from rank to rank, so the parts only have to be put in a row
        gathered = self._comm.gather(mine) if self._comm.size > 1 else [mine]
        if gathered is None:
            return None
        found = np.concatenate(gathered)
        return found if self._order is None else found[self._order]


def _numbers(index_map, local: Int32s) -> Ints:  # type: ignore[no-untyped-def]
    """Global numbers of nodes, in the shape of the local ones."""
    flat = index_map.local_to_global(np.ascontiguousarray(local, dtype=np.int32).ravel())
    return np.asarray(flat, dtype=np.int64).reshape(local.shape)


class GridFiles:
    """Writes states of a grid; what stays the same from one to the next is made once.

    Args:
        folder: Where the files go.
        grid: The grid.
        cell_data: Values of its cells, which do not change.
        components: Names of the components of fields.
    """

    def __init__(
        self, folder: Path, grid: Grid, cell_data: Mapping[str, Floats], components: Named = NONE
    ) -> None:
        self._folder, self._grid, self._components = folder, grid, components
        self._stem = grid.name.replace(" ", "_")
        self._cells = _cells(grid)
        self._cell_data = [Packed(name, values) for name, values in cell_data.items()]
        self._reference = Packed("reference", grid.nodes)
        self._labels = [Packed("name", grid.labels)] if grid.labels else []
        self._sums: dict[int, str] = {}
        # states as the list has them, and how many have been there: it is written whole each time,
        # which takes no time beside making the text of all of them anew
        self._entries, self._listed = list[str](), 0

    def name(self, number: int) -> str:
        """Name of the file of one state."""
        return f"{self._stem}_{number:04d}.vtu"

    def file(self, number: int) -> Path:
        """File of one state."""
        return self._folder / self.name(number)

    def write(self, number: int, fields: Mapping[str, Floats]) -> None:
        """Write a state.

        Args:
            number: Its number.
            fields: Values at the nodes, "displacement" among them; the same names at all times.
        """
        components = self._components
        points = [Packed(name, of, components.get(name, ())) for name, of in fields.items()]
        sections = {
            "PointData": [self._reference, *points, *self._labels],
            "CellData": self._cell_data,
            "Points": [Packed("Points", self._grid.nodes + fields["displacement"])],
            "Cells": self._cells,
        }
        counts = len(self._grid.nodes), len(self._grid.vtk_types)
        content = seal_grid(_grid_file(sections, counts, shown="displacement"))
        write_bytes(self.file(number), content)
        self._sums[number] = checksum(content)

    def list(self, times: Sequence[float]) -> None:
        """List the states for ParaView; the file is complete at all times.

        Args:
            times: Times of all states so far, s; of lost ones, too. Those of the last time come
                first.
        """
        for k in range(self._listed, len(times)):
            if k in self._sums:
                self._entries.append(json.dumps({"name": self.name(k), "time": times[k]}))
        self._listed = len(times)
        if self._entries:
            text = f'{{"file-series-version": "1.0", "files": [{", ".join(self._entries)}]}}\n'
            rewrite_text(self._folder / f"{self._stem}.vtu.series", text)

    def checksums(self, count: int) -> dict[str, str]:
        """Checksums of the first states, by the names of their files.

        Args:
            count: How many.
        """
        return {self.name(k): s for k, s in self._sums.items() if k < count}

    def find(self, number: int, sums: Mapping[str, str]) -> bool:
        """Take up a state that was written; whether its file is there as it was.

        Args:
            number: Its number.
            sums: Checksums by the names of files.
        """
        file = self.file(number)
        try:
            found = checksum(read_bytes(file))
        except SceneError:
            return False
        if found == sums.get(file.name):
            self._sums[number] = found
        return number in self._sums

    def has(self, number: int) -> bool:
        """Decide whether a state was written and is not lost."""
        return number in self._sums


def _cells(grid: Grid) -> list[Packed]:
    """Nodes of all cells, the end of each cell among them, and types."""
    starts, place = [], 0
    for _ in grid.vtk_types:
        starts.append(place)
        place += 1 + int(grid.vtk_cells[place])
    return [
        Packed("connectivity", np.delete(grid.vtk_cells, starts)),
        Packed("offsets", np.cumsum(grid.vtk_cells[starts])),
        Packed("types", grid.vtk_types),
    ]


class Lists:
    """Lists of the states of all parts, and of those that all have in `all.pvd`, for ParaView.

    VTK has a reader for that file and no writer.

    Args:
        folder: Where the files are.
        files: Files of each part by its name.
    """

    def __init__(self, folder: Path, files: Mapping[str, GridFiles]) -> None:
        self._folder, self._files = folder, files
        self._items, self._listed = list[str](), 0

    def write(self, times: Sequence[float]) -> None:
        """List all states; the files are complete at all times.

        Args:
            times: As of `GridFiles.list`.
        """
        for part in self._files.values():
            part.list(times)
        self._items += [
            f'<DataSet timestep="{times[k]!r}" part="{number}" name={quoteattr(name)} '
            f"file={quoteattr(part.name(k))}/>"
            for k in range(self._listed, len(times))
            if all(part.has(k) for part in self._files.values())
            for number, (name, part) in enumerate(self._files.items())
        ]
        self._listed = len(times)
        if self._items:
            rewrite_text(self._folder / "all.pvd", COLLECTION.format("\n".join(self._items)))
