"""Natural modes of a scene, with their files and pictures."""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from pathlib import Path

from mpi4py import MPI

from shellmb.modes import Modes, natural_modes
from shellmb.observers.drawn import drawn_bodies
from shellmb.observers.summary import versions, write_json
from shellmb.run.directory import refuse_used
from shellmb.scene import Scene


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
    """Find natural modes and write `modes.csv`, `summary.json` and `modes.png`.

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
        SceneError: If a body has no mass, or `out` is not empty.
        ConvergenceError: If the static state or the modes do not converge.
    """
    directory, begin = Path(out), clock.perf_counter()
    refuse_used(directory, comm)
    modes = natural_modes(scene, comm, count, loaded)
    measured = {k: float(v) for k, v in results(modes).items()} if results is not None else {}
    wall = clock.perf_counter() - begin
    drawn = drawn_bodies(modes.model)
    shapes = [
        {name: part.shape(shape[name]) for name, part in drawn.items()} for shape in modes.shapes
    ]
    if comm.rank != 0:
        return modes, measured
    directory.mkdir(parents=True, exist_ok=True)
    lines = [
        f"{k},{float(f)!r},{float(w)!r}"
        for k, (f, w) in enumerate(zip(modes.frequencies, modes.omega, strict=True), start=1)
    ]
    header = "mode,frequency_hz,omega_rad_per_s"
    (directory / "modes.csv").write_text("\n".join([header, *lines]) + "\n")
    summary = {
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
        "results": measured,
    }
    write_json(directory / "summary.json", summary)
    if pictures:
        from shellmb.observers.mode_pictures import draw_modes

        grids = {name: g.grid for name, g in drawn.items() if g.grid is not None}
        full = [{n: v for n, v in shape.items() if v is not None} for shape in shapes]
        draw_modes(directory / "modes.png", grids, full, list(modes.frequencies), modes.rigid)
    return modes, measured
