"""Snapshots of the shells at equally spaced times, for ParaView and for pictures."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyvista

from shellmb.errors import ConvergenceError
from shellmb.observers.grid import Gatherer, Grid
from shellmb.observers.nodal import nodal_values
from shellmb.simulate.simulation import Silent, Simulation

Floats = npt.NDArray[np.float64]

# a time this fraction of the interval before that of a frame is the frame's
EARLY = 1e-6


@dataclass(frozen=True)
class Frame:
    """Displacements of the shells at one time, on rank 0.

    Args:
        t: Time, s.
        displacement: By shell, shape (n, 3), m.
    """

    t: float
    displacement: dict[str, Floats]


class Frames(Silent):
    """Takes snapshots, the first and the last state included.

    Each shell gets files `NAME_0000.vtu` with displacement, director, velocity and thickness on
    Lagrange cells of its own degree, and `NAME.vtu.series`, which ParaView opens as one thing in
    time.

    Args:
        folder: Where the files go; None: frames are kept in memory only.

    Attributes:
        frames: The frames so far, on rank 0.
        grids: The shells' grids, on rank 0.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = folder
        self.frames: list[Frame] = []
        self.grids: dict[str, Grid] = {}
        self._kept: list[float] = []

    def start(self, simulation: Simulation) -> None:
        """Gather the grids and take the first frame, or read those of the earlier run."""
        self._gatherers = {name: Gatherer(body) for name, body in simulation.model.shells.items()}
        self.grids = {n: g.grid for n, g in self._gatherers.items() if g.grid is not None}
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
        for name, gatherer in self._gatherers.items():
            values = nodal_values(simulation, name)
            fields = {
                "displacement": gatherer.gather(values.displacement),
                "director": gatherer.gather(values.director),
            }
            if simulation.scheme.dynamic:
                fields["velocity"] = gatherer.gather(values.velocity)
            if gatherer.grid is None:
                continue
            here = {key: value for key, value in fields.items() if value is not None}
            displacement[name] = here["displacement"]
            if self.folder is not None:
                thickness = simulation.scene.shell(name).section.thickness
                self._write(gatherer.grid, number, here, thickness)
        if displacement:
            self.frames.append(Frame(simulation.t, displacement))

    def _file(self, name: str, number: int) -> Path:
        assert self.folder is not None
        return self.folder / f"{name}_{number:04d}.vtu"

    def _write(self, grid: Grid, number: int, fields: dict[str, Floats], thickness: float) -> None:
        assert self.folder is not None
        points = grid.nodes + fields["displacement"]
        data = pyvista.UnstructuredGrid(grid.vtk_cells, grid.vtk_types, points)
        data.point_data["reference"] = grid.nodes
        for key, values in fields.items():
            data.point_data[key] = values
        data.cell_data["thickness"] = np.full(data.n_cells, thickness)
        data.save(self._file(grid.name, number))
        listed = [
            {"name": self._file(grid.name, k).name, "time": t} for k, t in enumerate(self._times)
        ]
        series = {"file-series-version": "1.0", "files": listed}
        (self.folder / f"{grid.name}.vtu.series").write_text(json.dumps(series, indent=1))

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
