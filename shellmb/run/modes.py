"""Natural modes of a scene, with their files and pictures."""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mpi4py import MPI

from shellmb.modes import Modes, natural_modes
from shellmb.observers.files.described import describe
from shellmb.observers.files.drawn import drawn_bodies
from shellmb.observers.files.gridfiles import GridFiles
from shellmb.observers.summary import versions, write_json
from shellmb.run.directory import claimed, written
from shellmb.run.memory import check_memory
from shellmb.run.results import measured
from shellmb.run.standard import FIELDS, SUMMARY
from shellmb.scene import Scene
from shellmb.stopping import STOPPING


def find_modes(
    scene: Scene,
    out: Path | str,
    count: int = 6,
    loaded: bool = False,
    *,
    results: Callable[[Modes], dict[str, float]] | None = None,
    comm: MPI.Comm = MPI.COMM_WORLD,
    pictures: bool = True,
) -> tuple[Modes, dict[str, float]]:
    """Find natural modes and write `modes.csv`, `summary.json`, their shapes and `modes.png`.

    Args:
        scene: The scene.
        out: Directory to write.
        count: Number of modes, rigid-body modes included.
        loaded: Whether about the static equilibrium under the scene's loads.
        results: Gives the `results` of the summary.
        comm: Communicator.
        pictures: Whether the modes are drawn.

    Returns:
        The modes and the results.

    Raises:
        SceneError: If a body has no mass, or `out` is not empty or cannot be written.
        ConvergenceError: If the static state or the modes do not converge.
        RunError: If the function `results` raises, or the disk is full.
    """
    directory, begin = Path(out), clock.perf_counter()
    with claimed(directory, comm, new=True), written(directory, comm):
        check_memory(scene, comm)
        STOPPING.renew()
        modes = natural_modes(scene, comm, count, loaded)
        wall = clock.perf_counter() - begin
        summary: dict[str, Any] = {
            "scene": scene.name,
            "loaded": loaded,
            "frequencies_hz": modes.frequencies,
            "omega_rad_per_s": modes.omega,
            "rigid_modes": modes.rigid,
            "unknowns": modes.unknowns,
            "elements": modes.model.elements,
            "ranks": comm.size,
            "wall_s": wall,
            "versions": versions(),
            "results": {},
        }
        _write(directory, modes, summary, pictures, comm)
        if results is not None:
            summary["results"] = measured(results, modes, comm, "mode_results")
            if comm.rank == 0:
                write_json(directory / SUMMARY, summary)
    return modes, summary["results"]


def _write(
    directory: Path, modes: Modes, summary: dict[str, Any], pictures: bool, comm: MPI.Comm
) -> None:
    drawn = drawn_bodies(modes.model)
    shapes = [
        {name: part.shape(shape[name]) for name, part in drawn.items()} for shape in modes.shapes
    ]
    if comm.rank != 0:
        return
    lines = [
        f"{k},{float(f)!r},{float(w)!r}"
        for k, (f, w) in enumerate(zip(modes.frequencies, modes.omega, strict=True), start=1)
    ]
    header = "mode,frequency_hz,omega_rad_per_s"
    (directory / "modes.csv").write_text("\n".join([header, *lines]) + "\n")
    write_json(directory / SUMMARY, summary)
    describe(modes.model.scene).write(directory)
    for name, part in drawn.items():
        if part.grid is not None:
            (directory / FIELDS).mkdir(exist_ok=True)
            files = GridFiles(directory / FIELDS, part.grid, part.cell_data())
            for k, shape in enumerate(shapes):
                displacement = shape[name]
                assert displacement is not None
                files.write(k, {"displacement": displacement})
            files.list([float(k) for k in range(1, len(shapes) + 1)])
            files.close()
    if pictures:
        from shellmb.show.pictures import draw_directory

        draw_directory(directory)
