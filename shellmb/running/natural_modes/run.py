"""Modes of vibration and of linear buckling of a scene, with their files and pictures."""

import time as clock
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mpi4py import MPI

from shellmb.arrays import Floats
from shellmb.barrier import arrive
from shellmb.diagnostics.base import Motion
from shellmb.diagnostics.elements.wrinkled import wrinkled_modes
from shellmb.diagnostics.modes import beside_better
from shellmb.errors import petsc_in_words
from shellmb.files.writing import make_folder, write_text
from shellmb.model.model import Model
from shellmb.observers.files.described import describe
from shellmb.observers.files.gridfiles import GridFiles
from shellmb.observers.files.output_parts import drawn_bodies
from shellmb.observers.summary import versions, write_json
from shellmb.running.directory import claimed, written
from shellmb.running.memory import check_memory
from shellmb.running.natural_modes.shapes import Shape, mode_shape, parts_of
from shellmb.running.natural_modes.vibration import Modes, natural_modes
from shellmb.running.results import Results, add_results
from shellmb.running.standard import FIELDS, SUMMARY
from shellmb.scene import Scene
from shellmb.simulate.buckling import linear_buckling
from shellmb.stopping import STOPPING


def find_modes(
    scene: Scene,
    out: Path | str,
    count: int = 6,
    loaded: bool = False,
    *,
    results: Results | None = None,
    comm: MPI.Comm = MPI.COMM_WORLD,
    pictures: bool = True,
) -> tuple[Modes, dict[str, Any]]:
    """Find natural modes and write `modes.csv`, `summary.json`, their shapes and `modes.png`.

    Args:
        scene: The scene.
        out: Directory to write.
        count: Number of modes, rigid-body modes included.
        loaded: Whether about the static equilibrium under the scene's loads, with its damping.
        results: Gives the `results` of the summary.
        comm: Communicator.
        pictures: Whether the modes are drawn.

    Returns:
        The modes and their summary.

    Raises:
        SceneError: If a body has no mass, or `out` is not empty or cannot be written.
        ConvergenceError: If the static state or the modes do not converge.
        RunError: If the function `results` raises, or the disk is full.
    """
    with modes_directory(scene, out, comm) as run:
        modes = natural_modes(scene, comm, count, loaded)
        summary = run.summary(modes.model, modes.unknowns) | {
            "loaded": loaded,
            "frequencies_hz": modes.frequencies,
            "omega_rad_per_s": modes.omega,
            "growth_per_s": modes.growth,
            "rigid_modes": modes.rigid,
            "warnings": modes.warnings,
            "elements": modes.model.elements,
        }
        rows = zip(modes.frequencies, modes.omega, modes.growth, modes.growth <= 0, strict=True)
        lines = [
            f"{k},{float(f)!r},{float(w)!r},{float(g)!r},{int(stable)}"
            for k, (f, w, g, stable) in enumerate(rows, start=1)
        ]
        table = ["mode,frequency_hz,omega_rad_per_s,growth_per_s,stable", *lines]
        write_shapes(run.directory, modes.model, modes.fields, table, summary)
        run.draw(pictures)
        add_results(summary, run.directory, results, modes, comm, "mode_results")
    return modes, summary


@dataclass(frozen=True)
class ModesDirectory:
    """A directory into which modes are written.

    Args:
        directory: The directory.
        comm: Communicator.
        begin: When it was begun, s.
    """

    directory: Path
    comm: MPI.Comm
    begin: float

    def summary(self, model: Model, unknowns: int) -> dict[str, Any]:
        """Entries of the summary of all modes.

        Args:
            model: The model.
            unknowns: Number of unknowns of the eigenproblem.
        """
        return {
            "scene": model.scene.name,
            "unknowns": unknowns,
            "ranks": self.comm.size,
            "wall_s": clock.perf_counter() - self.begin,
            "versions": versions(),
            "results": {},
        }

    def draw(self, pictures: bool) -> None:
        """Draw the modes, if pictures are wanted; collective."""
        if pictures and self.comm.rank == 0:
            from shellmb.show.pictures import draw_directory

            draw_directory(self.directory)
        arrive(self.comm)


@contextmanager
def modes_directory(scene: Scene, out: Path | str, comm: MPI.Comm) -> Iterator[ModesDirectory]:
    """Context in which a directory is of the modes of a scene alone; collective.

    Args:
        scene: The scene.
        out: The directory.
        comm: Communicator.

    Raises:
        SceneError: If it is not empty or cannot be written.
        RunError: If the disk is full.
    """
    directory, begin = Path(out), clock.perf_counter()
    with claimed(directory, comm, new=True), written(directory, comm):
        check_memory(scene, comm)
        STOPPING.renew()
        yield ModesDirectory(directory, comm, begin)


def write_shapes(
    directory: Path,
    model: Model,
    modes: Sequence[Mapping[str, Shape]],
    table: Sequence[str],
    summary: dict[str, Any],
) -> None:
    """Write modes into a directory, which `show.modes` and `api.modeshapes` read; collective.

    Args:
        directory: The directory.
        model: The model.
        modes: Fields of each mode by name, as shapes of `vibration.Modes`.
        table: Lines of `modes.csv`.
        summary: The summary.
    """
    drawn = drawn_bodies(model)
    fields = [
        {
            body: {name: part.gather(shape[body]) for name, shape in mode.items()}
            for body, part in drawn.items()
        }
        for mode in modes
    ]
    if model.comm.rank != 0:
        return
    directory.mkdir(exist_ok=True)
    write_text(directory / "modes.csv", "\n".join(table) + "\n")
    write_json(directory / SUMMARY, summary)
    describe(model.scene).write(directory)
    for body, part in drawn.items():
        if part.grid is not None:
            make_folder(directory / FIELDS)
            files = GridFiles(directory / FIELDS, part.grid, part.cells)
            for k, found in enumerate(fields):
                files.write(k, {n: v for n, v in found[body].items() if v is not None})
            files.list([float(k) for k in range(1, len(fields) + 1)])


@dataclass(frozen=True)
class BucklingModes:
    """Modes of linear buckling, the lowest load factor first.

    Args:
        factors: The positive load factors.
        negative: The negative load factor nearest to zero; None if none was found.
        shapes: Shape of each, as of `shellmb.running.natural_modes.vibration.Modes`.
        warnings: Sentences on modes that are none of the structure.
    """

    factors: Floats
    negative: float | None
    shapes: list[Shape]
    warnings: Sequence[str]


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
    with modes_directory(scene, out, comm) as run:
        found = linear_buckling(scene, comm, count)
        shapes = [mode_shape(found.system, found.model, vector) for vector in found.vectors]
        pairs = enumerate(zip(found.energies, found.vectors, strict=True), start=1)
        modes = [Motion(k, energy, (parts_of(found.system, v),)) for k, (energy, v) in pairs]

        def better(finer: Scene) -> Floats:
            return linear_buckling(finer, comm, count).factors

        model, size = found.model, found.system.size
        warnings = wrinkled_modes(model, None, modes)
        warnings += beside_better(model, modes, size, found.factors, better, "load factor")
        summary = run.summary(found.model, found.system.size) | {
            "load_factors": found.factors,
            "negative_load_factor": found.negative,
            "warnings": warnings,
            "elements": found.model.elements,
        }
        rows = [f"{k},{float(f)!r}" for k, f in enumerate(found.factors, start=1)]
        fields = [{"displacement": shape} for shape in shapes]
        write_shapes(run.directory, found.model, fields, ["mode,load_factor", *rows], summary)
        run.draw(pictures)
    return BucklingModes(found.factors, found.negative, shapes, warnings)
