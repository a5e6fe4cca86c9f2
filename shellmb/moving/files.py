"""Campbell diagrams in a directory: table, summary, picture, and the shapes at each rate."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from mpi4py import MPI

from shellmb.moving.campbell import Campbell, campbell
from shellmb.moving.modes import TurningModes
from shellmb.observers.summary import versions, write_json
from shellmb.run.directory import claimed, written
from shellmb.run.memory import check_memory
from shellmb.run.modes import write_shapes
from shellmb.run.results import measured
from shellmb.run.standard import SUMMARY
from shellmb.scene import Scene
from shellmb.stopping import STOPPING

TABLE, PICTURE = "campbell.csv", "campbell.png"

HEADER = "mode,frequency_hz,omega_rad_per_s,growth_per_s,damping_ratio,whirl,direction,stable"


def folder(directory: Path, number: int) -> Path:
    """Where the shapes at a rate are, which is a directory of modes itself.

    Args:
        directory: That of the diagram.
        number: Number of the rate, from 1.
    """
    return directory / f"rate_{number}"


def find_campbell(
    scene: Scene,
    out: Path | str,
    rates: Sequence[float],
    count: int = 6,
    loaded: bool = False,
    axis: Sequence[float] | None = None,
    about: Sequence[float] | None = None,
    *,
    results: Callable[[Any], dict[str, float]] | None = None,
    comm: MPI.Comm = MPI.COMM_WORLD,
    pictures: bool = True,
) -> tuple[Campbell, dict[str, float]]:
    """Find modes at several rates of rotation and write them; arguments as of `campbell`.

    Args:
        scene: The scene.
        out: Directory to write.
        rates: Rates of rotation, rad/s.
        count: Number of modes.
        loaded: Whether the loads act.
        axis: Direction of the axis.
        about: A point of it.
        results: Gives the `results` of the summary.
        comm: Communicator.
        pictures: Whether the diagram and the modes are drawn.

    Returns:
        The modes and the results.

    Raises:
        SceneError: If something does not turn along, or `out` is not empty or cannot be written.
        ConvergenceError: If an equilibrium or the modes do not converge.
        RunError: If the function `results` raises, or the disk is full.
    """
    directory, begin = Path(out), clock.perf_counter()
    with claimed(directory, comm, new=True), written(directory, comm):
        check_memory(scene, comm)
        STOPPING.renew()
        found = campbell(scene, rates, comm, count, loaded, axis, about)
        summary: dict[str, Any] = {
            "scene": scene.name,
            "loaded": loaded,
            "axis": list(found.axis.axis),
            "about": list(found.axis.about),
            "rates_rad_per_s": found.rates,
            "stable": not found.unstable,
            "verdict": found.verdict,
            "unknowns": found.modes[0].unknowns,
            "ranks": comm.size,
            "wall_s": clock.perf_counter() - begin,
            "versions": versions(),
            "results": {},
        }
        for number, modes in enumerate(found.modes, start=1):
            _write_rate(folder(directory, number), modes, summary)
        if comm.rank == 0:
            (directory / TABLE).write_text("\n".join(_table(found)) + "\n")
            write_json(directory / SUMMARY, summary)
        if results is not None:
            summary["results"] = measured(results, found, comm, "mode_results")
            if comm.rank == 0:
                write_json(directory / SUMMARY, summary)
        if pictures and comm.rank == 0:
            from shellmb.show.campbell import draw_campbell

            draw_campbell(directory / TABLE, directory / PICTURE)
    return found, summary["results"]


def _rows(modes: TurningModes) -> list[str]:
    """Lines of the table of one rate, without their branches."""
    lines = []
    for k, value in enumerate(modes.values):
        numbers = (modes.frequencies[k], value.imag, value.real, modes.damping[k], modes.whirl[k])
        said = ",".join(repr(float(number) + 0.0) for number in numbers)
        stable = int(k + 1 not in modes.unstable)
        lines.append(f"{k + 1},{said},{modes.directions[k]},{stable}")
    return lines


def _table(found: Campbell) -> list[str]:
    lines = [f"rate_rad_per_s,branch,{HEADER}"]
    for rate, modes, branches in zip(found.rates, found.modes, found.branches, strict=True):
        of = {int(mode): k for k, mode in enumerate(branches, start=1) if mode >= 0}
        for mode, row in enumerate(_rows(modes)):
            if mode in of:
                lines.append(f"{float(rate)!r},{of[mode]},{row}")
    return lines


def _write_rate(directory: Path, modes: TurningModes, whole: dict[str, Any]) -> None:
    fields = [
        {"displacement": real, "displacement_imaginary": imaginary}
        for real, imaginary in modes.shapes
    ]
    kept = ("scene", "loaded", "axis", "about", "unknowns", "ranks", "versions", "results")
    summary = {
        **{key: whole[key] for key in kept},
        "rate_rad_per_s": modes.rate,
        "frequencies_hz": modes.frequencies,
        "omega_rad_per_s": modes.omega,
        "growth_per_s": modes.values.real,
        "damping_ratios": modes.damping,
        "rigid_modes": modes.rigid,
        "elements": modes.model.elements,
    }
    write_shapes(directory, modes.model, fields, [HEADER, *_rows(modes)], summary)
