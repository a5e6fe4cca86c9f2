"""Snapshots of everything that moves at equally spaced times, for ParaView and for pictures."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyvista

from shellmb.errors import ConvergenceError
from shellmb.observers.drawn import drawn_parts
from shellmb.observers.grid import Grid
from shellmb.simulate.simulation import Silent, Simulation

Floats = npt.NDArray[np.float64]

# a time this fraction of the interval before that of a frame is the frame's
EARLY = 1e-6


@dataclass(frozen=True)
class Frame:
    """Displacements at one time, on rank 0.

    Args:
        t: Time, s.
        displacement: By the name of the grid, shape (n, 3), m.
    """

    t: float
    displacement: dict[str, Floats]


class Frames(Silent):
    """Takes snapshots, the first and the last state included.

    Each shell and each beam gets files `NAME_0000.vtu` with displacement, director or directors,
    velocity, and thickness or size of the section on Lagrange cells of its own degree, and
    `NAME.vtu.series`, which ParaView opens as one thing in time. All rigid bodies are in
    `rigid_bodies_0000.vtu`, lines from their centres to their points, and all joints in
    `joints_0000.vtu`.

    Args:
        folder: Where the files go; None: frames are kept in memory only.

    Attributes:
        frames: The frames so far, on rank 0.
        grids: What the frames show, by name, on rank 0.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = folder
        self.frames: list[Frame] = []
        self.grids: dict[str, Grid] = {}
        self._kept: list[float] = []

    def start(self, simulation: Simulation) -> None:
        """Gather the grids and take the first frame, or read those of the earlier run."""
        self._parts = drawn_parts(simulation.model)
        self.grids = {n: g.grid for n, g in self._parts.items() if g.grid is not None}
        count = max(simulation.scene.output.frames - 1, 1)
        self._interval = simulation.t_end / count
        self._times = list(self._kept)
        if self._kept:
            self._read_back()
        else:
            if self.folder is not None and simulation.model.comm.rank == 0:
                self.folder.mkdir(parents=True, exist_ok=True)
            self._take(simulation)

    def accepted(self, simulation: Simulation) -> None:
        """Take a frame if it is time, and at the end."""
        # by the number of the interval, not by adding intervals up: no drift
        due = self._times[-1] // self._interval + 1
        if (due - EARLY) * self._interval <= self._times[-1]:
            due += 1
        if simulation.t >= (due - EARLY) * self._interval or simulation.t >= simulation.t_end:
            self._take(simulation)

    def finish(self, simulation: Simulation, error: Exception | None) -> None:
        """After a step that did not converge add the last good state."""
        if isinstance(error, ConvergenceError) and not simulation.scheme.linear:
            if simulation.t > self._times[-1]:
                self._take(simulation)

    def _take(self, simulation: Simulation) -> None:
        number = len(self._times)
        self._times.append(simulation.t)
        displacement = {}
        for name, part in self._parts.items():
            fields = part.fields(simulation)
            if part.grid is None:
                continue
            displacement[name] = fields["displacement"]
            if self.folder is not None:
                self._write(part.grid, number, fields, part.cell_data())
        if displacement:
            self.frames.append(Frame(simulation.t, displacement))

    def _file(self, name: str, number: int) -> Path:
        assert self.folder is not None
        return self.folder / f"{_stem(name)}_{number:04d}.vtu"

    def _write(
        self, grid: Grid, number: int, fields: dict[str, Floats], cell_data: dict[str, Floats]
    ) -> None:
        assert self.folder is not None
        points = grid.nodes + fields["displacement"]
        data = pyvista.UnstructuredGrid(grid.vtk_cells, grid.vtk_types, points)
        data.point_data["reference"] = grid.nodes
        for key, values in fields.items():
            data.point_data[key] = values
        for key, values in cell_data.items():
            data.cell_data[key] = values
        data.save(self._file(grid.name, number))
        listed = [
            {"name": self._file(grid.name, k).name, "time": t} for k, t in enumerate(self._times)
        ]
        series = {"file-series-version": "1.0", "files": listed}
        (self.folder / f"{_stem(grid.name)}.vtu.series").write_text(json.dumps(series, indent=1))

    def _read_back(self) -> None:
        """Frames of the earlier run, for the pictures."""
        if not self.grids:
            return
        for number, t in enumerate(self._times):
            displacement = {
                name: np.asarray(
                    pyvista.read(self._file(name, number)).point_data["displacement"], dtype=float
                )
                for name in self.grids
            }
            self.frames.append(Frame(t, displacement))

    def state(self) -> dict[str, Any]:
        """Times of the frames."""
        return {"times": list(self._times)}

    def restore(self, state: dict[str, Any]) -> None:
        """Go on behind so many frames."""
        self._kept = [float(t) for t in state["times"]]


def _stem(name: str) -> str:
    """Name of a file for something of that name."""
    return name.replace(" ", "_")
