"""Modes of a scene with their files and pictures; those of vibration and of linear buckling."""

import time as clock
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from mpi4py import MPI

import numpy as np

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
from shellmb.running.natural_modes.vibration import natural_modes
from shellmb.running.results import Results, add_results
from shellmb.running.standard import FIELDS, SUMMARY
from shellmb.scene import Scene
from shellmb.simulate.buckling import linear_buckling
from shellmb.stopping import STOPPING

# columns of a table, in their order
Columns = Mapping[str, Any]


class Found(NamedTuple):
    """Modes that were found, and what is written of them.

    Args:
        computed: The modes, which have `warnings`.
        model: The model.
        unknowns: Number of unknowns of the eigenproblem.
        entries: Entries of the summary beside those that all modes have.
        write: Writes the modes into a directory with their summary; collective.
    """

    computed: Any
    model: Model
    unknowns: int
    entries: Mapping[str, Any]
    write: Callable[[Path, dict[str, Any]], None]


def write_found(
    find: Callable[[Scene, MPI.Comm], Found],
    scene: Scene,
    out: Path | str,
    *,
    results: Results | None = None,
    comm: MPI.Comm = MPI.COMM_WORLD,
    pictures: bool = True,
) -> tuple[Any, dict[str, Any]]:
    """Find modes and write tables, `summary.json`, their shapes and pictures; collective.

    Args:
        find: Finds them.
        scene: The scene.
        out: Directory to write, of these modes alone.
        results: Gives the `results` of the summary.
        comm: Communicator.
        pictures: Whether they are drawn.

    Returns:
        The modes and their summary.

    Raises:
        SceneError: If a body has no mass, or `out` is not empty or cannot be written.
        ConvergenceError: If a state or the modes do not converge.
        RunError: If the function `results` raises, or the disk is full.
    """
    directory, begin = Path(out), clock.perf_counter()
    with claimed(directory, comm, new=True), written(directory, comm):
        check_memory(scene, comm)
        STOPPING.renew()
        found = find(scene, comm)
        summary = {
            "scene": scene.name,
            "unknowns": found.unknowns,
            "ranks": comm.size,
            "wall_s": clock.perf_counter() - begin,
            "versions": versions(),
            "results": {},
            "warnings": found.computed.warnings,
            "elements": found.model.elements,
            **found.entries,
        }
        found.write(directory, summary)
        if pictures and comm.rank == 0:
            from shellmb.show.pictures import draw_directory

            draw_directory(directory)
        arrive(comm)
        add_results(summary, directory, results, found.computed, comm, "mode_results")
    return found.computed, summary


def find_modes(scene: Scene, comm: MPI.Comm, count: int = 6, loaded: bool = False) -> Found:
    """Natural modes; arguments as of `natural_modes`."""
    modes = natural_modes(scene, comm, count, loaded)
    table = {
        "mode": range(1, len(modes.omega) + 1),
        "frequency_hz": modes.frequencies,
        "omega_rad_per_s": modes.omega,
        "growth_per_s": modes.growth,
        "stable": np.asarray(modes.growth <= 0, dtype=int),
    }
    entries = {
        "loaded": loaded,
        "frequencies_hz": modes.frequencies,
        "omega_rad_per_s": modes.omega,
        "growth_per_s": modes.growth,
        "rigid_modes": modes.rigid,
    }
    write = partial(write_shapes, modes.model, modes.fields, table)
    return Found(modes, modes.model, modes.unknowns, entries, write)


def csv(table: Columns) -> str:
    """A table with a line for each row, numbers with all their digits."""
    rows = zip(*(np.asarray(column).tolist() for column in table.values()), strict=True)
    return "".join(",".join(map(str, row)) + "\n" for row in (tuple(table), *rows))


def write_shapes(
    model: Model,
    modes: Sequence[Mapping[str, Shape]],
    table: Columns,
    directory: Path,
    summary: dict[str, Any],
) -> None:
    """Write modes into a directory, which `show.modes` and `api.modeshapes` read; collective.

    Args:
        model: The model.
        modes: Fields of each mode by name, as shapes of `vibration.Modes`.
        table: Columns of `modes.csv`.
        directory: The directory.
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
    write_text(directory / "modes.csv", csv(table))
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
def find_buckling(scene: Scene, comm: MPI.Comm, count: int = 6) -> Found:
    """Load factors of linear buckling.

    Args:
        scene: The scene.
        comm: Communicator.
        count: Number of load factors.

    Raises:
        SceneError: If the scene has no load.
        ConvergenceError: If there are fewer load factors.
    """
    found = linear_buckling(scene, comm, count)
    model, system = found.model, found.system
    shapes = [mode_shape(system, model, vector) for vector in found.vectors]
    pairs = enumerate(zip(found.energies, found.vectors, strict=True), start=1)
    modes = [Motion(k, energy, (parts_of(system, v),)) for k, (energy, v) in pairs]

    def better(finer: Scene) -> Floats:
        return linear_buckling(finer, comm, count).factors

    warnings = wrinkled_modes(model, None, modes)
    warnings += beside_better(model, modes, system.size, found.factors, better, "load factor")
    entries = {"load_factors": found.factors, "negative_load_factor": found.negative}
    table = {"mode": range(1, len(shapes) + 1), "load_factor": found.factors}
    write = partial(write_shapes, model, [{"displacement": shape} for shape in shapes], table)
    computed = BucklingModes(found.factors, found.negative, shapes, warnings)
    return Found(computed, model, system.size, entries, write)
