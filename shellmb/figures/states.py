"""Frames of a finished run, read back from the files that it wrote for ParaView."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pyvista

from shellmb.observers.files.drawn import LINE, VERTEX
from shellmb.observers.files.frames import Frame
from shellmb.observers.files.grid import Grid, lattice
from shellmb.run.standard import FIELDS

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

# VTK's Lagrange cells: curve, quadrilateral
CURVE, QUADRILATERAL = 68, 70


@dataclass(frozen=True)
class States:
    """States of a run at the times of its frames.

    Args:
        grids: What is shown, by the name of its files: that of the body, `_` for spaces.
        frames: The states, in the order of time.
    """

    grids: dict[str, Grid]
    frames: list[Frame]

    def at(self, t: float) -> Frame:
        """The frame nearest to a time.

        Args:
            t: Time [s].
        """
        return min(self.frames, key=lambda frame: abs(frame.t - t))

    def only(self, names: Sequence[str]) -> States:
        """The states of some of what is shown.

        Args:
            names: Names of the bodies.
        """
        frames = [Frame(f.t, {n: f.displacement[n] for n in names}) for f in self.frames]
        return States({n: self.grids[n] for n in names}, frames)


def read_states(directory: Path) -> States:
    """All frames of a run.

    Args:
        directory: The run directory.
    """
    grids: dict[str, Grid] = {}
    displacement: dict[float, dict[str, Floats]] = {}
    for series in sorted((directory / FIELDS).glob("*.vtu.series")):
        name = series.name.removesuffix(".vtu.series")
        for file in json.loads(series.read_text())["files"]:
            data = pyvista.read(series.parent / file["name"])
            assert isinstance(data, pyvista.UnstructuredGrid)
            if name not in grids:
                grids[name] = _grid(name, data)
            moved = np.asarray(data.point_data["displacement"], dtype=float)
            displacement.setdefault(float(file["time"]), {})[name] = moved
    return States(grids, [Frame(t, displacement[t]) for t in sorted(displacement)])


def _grid(name: str, data: pyvista.UnstructuredGrid) -> Grid:
    nodes = np.asarray(data.point_data["reference"], dtype=float)
    types = np.asarray(data.celltypes)
    vtk = np.asarray(data.cells, dtype=np.int64)
    cells = list(_split(vtk))
    if types[0] == QUADRILATERAL:
        every = np.array(cells)
        pieces, around = lattice(_vtk_points(round(every.shape[1] ** 0.5) - 1))
        return Grid(name, nodes, vtk, types, every[:, pieces].reshape(-1, 4), every[:, around])
    if types[0] == CURVE:
        every = np.array(cells)
        # the ends come first
        along = every[:, [0, *range(2, every.shape[1]), 1]]
        pairs = np.stack([along[:, :-1], along[:, 1:]], axis=-1).reshape(-1, 2)
        return Grid(name, nodes, vtk, types, lines=pairs)
    dots = [int(c[0]) for c, kind in zip(cells, types, strict=True) if kind == VERTEX]
    lines = [c for c, kind in zip(cells, types, strict=True) if kind == LINE]
    return Grid(
        name,
        nodes,
        vtk,
        types,
        lines=np.array(lines, dtype=np.int64).reshape(-1, 2),
        dots=np.array(dots, dtype=np.int64),
    )


def _split(vtk: Ints) -> Iterator[Ints]:
    """Nodes of each cell, from a row of counts and nodes."""
    first = 0
    while first < len(vtk):
        behind = first + 1 + int(vtk[first])
        yield vtk[first + 1 : behind]
        first = behind


def _vtk_points(k: int) -> Floats:
    """Reference positions of the nodes of VTK's Lagrange quadrilateral of degree k.

    They are: the corners; those inside its sides, along bottom, right, top, left as the coordinates
    grow; those inside, row by row.
    """
    inner = range(1, k)
    order = [(0, 0), (k, 0), (k, k), (0, k)]
    order += [(i, 0) for i in inner] + [(k, j) for j in inner]
    order += [(i, k) for i in inner] + [(0, j) for j in inner]
    order += [(i, j) for j in inner for i in inner]
    return np.array(order) / k
