"""Linear buckling of a scene, with its files and pictures."""

from __future__ import annotations

import time as clock
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mpi4py import MPI

from shellmb.arrays import Floats
from shellmb.barrier import arrive
from shellmb.errors import petsc_in_words
from shellmb.observers.summary import versions
from shellmb.running.directory import claimed, written
from shellmb.running.memory import check_memory
from shellmb.running.modes import write_shapes
from shellmb.scene import Scene
from shellmb.simulate.buckling import linear_buckling
from shellmb.stopping import STOPPING
from shellmb.vibration import Shape, mode_shape


@dataclass(frozen=True)
class BucklingModes:
    """Modes of linear buckling, the lowest load factor first.

    Args:
        factors: The positive load factors.
        negative: The negative load factor nearest to zero; None if none was found.
        shapes: Shape of each, as of `shellmb.vibration.Modes`.
    """

    factors: Floats
    negative: float | None
    shapes: list[Shape]


@petsc_in_words()
def find_buckling(
    scene: Scene,
    out: Path | str,
    count: int = 6,
    *,
    comm: MPI.Comm = MPI.COMM_WORLD,
    pictures: bool = True,
) -> BucklingModes:
    """Find load factors of linear buckling; write `modes.csv`, `summary.json`, shapes, `modes.png`.

    Args:
        scene: The scene.
        out: Directory to write.
        count: Number of load factors.
        comm: Communicator.
        pictures: Whether the modes are drawn.

    Raises:
        SceneError: If the scene has no load, or `out` is not empty or cannot be written.
        ConvergenceError: If there are fewer load factors.
        RunError: If the disk is full.
    """
    directory, begin = Path(out), clock.perf_counter()
    with claimed(directory, comm, new=True), written(directory, comm):
        check_memory(scene, comm)
        STOPPING.renew()
        found = linear_buckling(scene, comm, count)
        shapes = [mode_shape(found.system, found.model, vector) for vector in found.vectors]
        summary: dict[str, Any] = {
            "scene": scene.name,
            "load_factors": found.factors,
            "negative_load_factor": found.negative,
            "unknowns": found.system.size,
            "elements": found.model.elements,
            "ranks": comm.size,
            "wall_s": clock.perf_counter() - begin,
            "versions": versions(),
            "results": {},
        }
        rows = [f"{k},{float(f)!r}" for k, f in enumerate(found.factors, start=1)]
        fields = [{"displacement": shape} for shape in shapes]
        write_shapes(directory, found.model, fields, ["mode,load_factor", *rows], summary)
        if pictures and comm.rank == 0:
            from shellmb.show.pictures import draw_directory

            draw_directory(directory)
        arrive(comm)
    return BucklingModes(found.factors, found.negative, shapes)
