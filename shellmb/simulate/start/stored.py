"""Parts of another run to start from: its last state, memories of its controllers, its frames.

States go from rank to rank by values of functions cell by cell, in the order of the mesh as it was
made: ranks number cells and dofs as they like, but what a cell was when the mesh was made, and the
order of dofs within it, are the same on any number of them.
"""

import csv
import math
from collections import deque
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from mpi4py import MPI

import numpy as np
import numpy.typing as npt
from dolfinx import fem

from shellmb.arrays import Floats, Ints
from shellmb.errors import SceneError, alike, warn
from shellmb.files.reading import Damaged, read_bytes, read_json, read_series, unpacked
from shellmb.files.writing import checksum, is_intact
from shellmb.model.signals import Signals, Way
from shellmb.restart import below
from shellmb.scene import Scene
from shellmb.scene.fingerprint import fingerprint
from shellmb.scene.lookup import listed, said
from shellmb.scene.schemes import is_static

Arrays = dict[str, Floats]

# where a run saves its state
STATE, STATE_FILE = "state", "state.json"
# its numbers over time, and how columns of joints' coordinates end there
HISTORY, COUNTED = "history.csv", (".rotation", ".translation")

# what of a controller says what its memory is: its class, and what it gives by which law; gains,
# targets and periods may be others
MEMORY = ("'].law", "'].outputs", "'].sensors")
FOLDER, SERIES, RIGID = "fields", ".vtu.series", "rigid_bodies"
# a frame is at a time, and a node is at a position, that differs by less than this part of both
SAME = 1e-9


class Stored(NamedTuple):
    """The last state of a run.

    Args:
        arrays: This rank's values, by body and function, as of `Simulation.arrays`.
        scene: Fingerprint of the run's scene.
        dynamic: Whether the run has velocities.
        t: Time of the state, s.
        control: Its controllers and events, as of `Control.state`; None: there are none, or the
            state is not read.
    """

    arrays: Arrays
    scene: dict[str, Any]
    dynamic: bool
    t: float = 0.0
    control: dict[str, Any] | None = None

    def names(self, kind: str) -> list[str]:
        """Names of the scene's items of a kind, in their order.

        Args:
            kind: Field of the scene.
        """
        # of what an item has by name, as points of a body, entries begin like its own
        return list(dict.fromkeys(key.split("'")[0] for key in below(self.scene, f"{kind}['")))


def read_stored(directory: Path, comm: MPI.Comm, whole: bool = True) -> Stored:
    """Read the last state of a run; collective.

    Args:
        directory: The run directory.
        comm: Communicator, of as many ranks as the run's if the whole state is read.
        whole: Whether the arrays are read, too.

    Raises:
        SceneError: If there is no such state, or it is damaged, or of another number of ranks.
    """
    with alike(comm):
        found = _read(directory, comm, whole)
    return found


def counted(directory: Path, comm: MPI.Comm, at: float | None) -> dict[str, float] | None:
    """Coordinates of joints as a run has counted them, by column of its history; collective.

    Args:
        directory: The run directory.
        comm: Communicator.
        at: Time of the row [s]; None: the last one.

    Returns:
        None if there is no such history.
    """
    found: dict[str, float] | None = None
    if comm.rank == 0:
        wrong = OSError, ValueError, TypeError, KeyError, IndexError, AttributeError, csv.Error
        with suppress(*wrong), (directory / HISTORY).open(newline="") as file:
            rows = csv.DictReader(file)
            row = (
                deque(rows, 1)[0]
                if at is None
                else min(rows, key=lambda row: abs(float(row["t"]) - at))
            )
            values = {key: float(row[key]) for key in row if key.endswith(COUNTED)}
            found = values if all(map(math.isfinite, values.values())) else None
    return comm.bcast(found)


def _read(directory: Path, comm: MPI.Comm, whole: bool) -> Stored:
    file = directory / STATE / STATE_FILE
    if not file.is_file():
        raise SceneError(
            f"start from a run: there is no state {file}; give the directory of a run that has "
            "made a step"
        )
    values = read_json(file)
    try:
        name, sums = str(values["arrays"]), values["arrays_sha256"]
        ranks, scene = values["ranks"], dict(values["scene"])
        t, control = float(values["simulation"]["t"]), values["simulation"].get("control")
        sealed = is_intact(values) and math.isfinite(t)
    except (KeyError, TypeError, ValueError):
        sealed = False
    if not sealed:
        raise SceneError(f"start from a run: {file} is damaged or was edited; run it again")
    if control is not None and "samplers" not in control:
        raise SceneError(
            f"start from a run: the controllers in {directory} were saved by an older version of "
            "shellmb; run it again"
        )
    dynamic = not is_static(scene.get("scheme"))
    if not whole:
        return Stored({}, scene, dynamic)
    if ranks != comm.size:
        raise SceneError(
            f"start from a run: the run in {directory} was made on {ranks} ranks, not {comm.size}; "
            f"start from it with `mpiexec -n {ranks}`"
        )
    try:
        arrays = read_arrays(file.parent / f"{name}-rank{comm.rank}.npz", sums[comm.rank])
    except SceneError as error:
        raise SceneError(f"start from a run: {error}; run it again") from None
    return Stored(arrays, scene, dynamic, t, control)


def read_arrays(file: Path, expected: str) -> Arrays:
    """The arrays that a rank has saved.

    Args:
        file: Their file.
        expected: Its checksum.

    Raises:
        Damaged: If it is not as it was written.
    """
    content = read_bytes(file)
    if checksum(content) != expected:
        raise Damaged(f"{file} is damaged (its checksum differs)")
    return unpacked(file, content)


def taken_up(signals: Signals, scene: Scene, stored: Stored, who: str) -> dict[str, dict[str, Any]]:
    """States of samplers that go on in a scene, whose time begins at zero, by controller.

    Coordinates that controllers accelerate go on, too, by whatever law.

    Args:
        signals: The signals of the scene.
        scene: The scene.
        stored: The last state of the other run; without its values those of a frame are taken.
        who: Name of the start in messages.
    """
    names = stored.names("controllers")
    both = [c.name for c in scene.controllers if c.name in names]
    now, control = fingerprint(scene), stored.control
    same = [name for name in both if _memory(now, name) == _memory(stored.scene, name)]
    anew = both if control is None else [name for name in both if name not in same]
    if anew:
        why = "frames do not have their memories" if control is None else "their laws are others"
        warn(f"{who}: controllers {listed(anew)} begin with empty memories, because {why}")
    if control is None:
        return {}
    saved = dict(zip(names, control["samplers"], strict=True))
    for key, way in zip(control.get("accelerated", ()), control["ways"], strict=False):
        if tuple(key) in signals.ways:
            begin, *rest = way
            signals.ways[key[0], key[1]] = Way(begin - stored.t, *rest)
    return {name: _since(saved[name], stored.t) for name in same}


def _memory(scene: dict[str, Any], name: str) -> dict[str, Any]:
    found = below(scene, f"controllers['{name}")
    return {k: v for k, v in found.items() if k == "']" or k.startswith(MEMORY)}


def _since(state: dict[str, Any], t: float) -> dict[str, Any]:
    """A state of a sampler as it is where a time is zero: the next sample is the first one."""
    last = state["last"]
    return state | {"count": 0, "last": None if last is None else last - t}


class Snapshot:
    """A frame of a run.

    Args:
        directory: The run directory.
        at: Its time, s; of a path its arc length.
        who: Who asks, for messages.

    Raises:
        SceneError: If there is no frame at that time.
    """

    def __init__(self, directory: Path, at: float, who: str) -> None:
        self._folder, self._at, self._who = directory / FOLDER, at, who
        if not self._folder.is_dir():
            raise SceneError(f"{who}: it has no frames; run it with a directory, or leave out at")

    def nodes(
        self, scene: Scene, name: str, X: Floats, count: int, moving: bool
    ) -> list[tuple[Floats, Floats]]:
        """Displacements (n, 3) and directors (n, count, 3) of a body's nodes, then their rates.

        Args:
            scene: The scene, which has the body.
            name: Name of the body.
            X: Reference positions of the nodes, shape (n, 3).
            count: Number of directors of each.
            moving: Whether rates are read, too.

        Raises:
            SceneError: If the frame has no such body, other nodes, or fields are missing.
        """
        body = scene.body(name)
        rigid = body in scene.rigid_bodies
        grid, file = self._grid(RIGID if rigid else name.replace(" ", "_"), said(body))
        keys = ["director"] if count == 1 else ["d1", "d2", "d3"]
        rates = [f"{key}_velocity" for key in keys]
        pairs = [("displacement", keys)] + [("velocity", rates)] * moving
        fields = dict.fromkeys(("reference", "displacement", *keys), "director")
        if moving:
            fields |= {"velocity": "velocity", **dict.fromkeys(rates, "director_velocity")}
        for key, field in fields.items():
            if key not in grid:
                right = f"the run's output must have the field '{field}'"
                more = ", or velocities must be False" if "velocity" in field else ""
                raise SceneError(
                    f"{self._who}: its frames have no {key} of {said(body)}; {right}{more}"
                )
            if not np.isfinite(grid[key]).all():
                raise SceneError(
                    f"{self._who}: {file} is damaged (its array '{key}' has a value that is not "
                    "finite); run it again"
                )
        rows = np.arange(len(grid["reference"]))
        if rigid:
            # the first point of each body is its centre
            rows = rows[grid["name"].astype(str) == name][:1]
        found = rows[self._matched(grid["reference"][rows], X, said(body))]
        return [
            (grid[points][found], np.stack([grid[key] for key in vectors], axis=1)[found])
            for points, vectors in pairs
        ]

    def _matched(self, known: Floats, X: Floats, body: str) -> npt.NDArray[np.intp]:
        """Find which of the known positions each node has."""
        # a run without such a start does not load it
        from scipy.spatial import cKDTree

        if not len(X):
            return np.zeros(0, dtype=np.intp)
        length = max(float(np.max(np.ptp(X, axis=0))), SAME)
        if known.shape == X.shape and np.max(np.abs(known - X)) < SAME * length:
            return np.arange(len(X))
        away, found = cKDTree(known).query(X, k=min(2, len(known)))
        nearest = np.reshape(away, (len(X), -1))
        if np.max(nearest[:, 0]) > SAME * length:
            raise SceneError(
                f"{self._who}: {body} has other nodes there (one is {np.max(nearest[:, 0]):.3g} "
                "away from the next); both must have the same mesh and degree"
            )
        if nearest.shape[1] > 1 and np.min(nearest[:, 1]) < SAME * length:
            raise SceneError(
                f"{self._who}: {body} has two nodes at one place, in another order; leave out at, "
                "or run both on as many ranks"
            )
        return np.asarray(np.reshape(found, (len(X), -1))[:, 0])

    def _grid(self, stem: str, body: str) -> tuple[dict[str, npt.NDArray[Any]], Path]:
        """The arrays of a body's file at that time, and the file."""
        from shellmb.files.grids import numbers, read_grid

        series = self._folder / f"{stem}{SERIES}"
        if not series.is_file():
            raise SceneError(
                f"{self._who}: it has no {body}; it must have all bodies of this scene"
            )
        found = {t: file for file, t in read_series(series).items()}
        times = np.array(sorted(found))
        nearest = float(times[np.argmin(np.abs(times - self._at))])
        if not abs(nearest - self._at) <= SAME * max(1.0, float(times[-1])):
            near = sorted(times[np.argsort(np.abs(times - self._at))[:2]].tolist())
            raise SceneError(
                f"{self._who}: at is {self._at:g}, and there is no frame; it must be one of the "
                f"frames' times, the nearest of which are {' and '.join(map(repr, near))}"
            )
        file = found[nearest]
        points = read_grid(file).GetPointData()
        arrays = {}
        for k in range(points.GetNumberOfArrays()):
            array = points.GetAbstractArray(k)
            if points.GetArray(k):
                arrays[array.GetName()] = numbers(array)
            else:
                texts = map(array.GetValue, range(array.GetNumberOfValues()))
                arrays[array.GetName()] = np.array([*texts])
        return arrays, file


CELLS, DOFS, ORIENTATION = "cells", "dofs", "orientation"


def numbering(space: fem.FunctionSpace) -> dict[str, Ints]:
    """Find where the cells that this rank owns have their dofs.

    Args:
        space: The space.

    Returns:
        Numbers of the cells in the mesh as it was made, shape (n,); their local dofs, shape (n, k);
        and how their edges are oriented, shape (n,), where the element asks for it.
    """
    topology = space.mesh.topology
    return _of_cells(space, topology.index_map(topology.dim).size_local)


def spread(
    parts: Sequence[tuple[Mapping[str, Ints], Floats]], space: fem.FunctionSpace
) -> Floats | None:
    """Values at the dofs of this rank, owned and ghost, from those of other ranks.

    Args:
        parts: Of each of those ranks its `numbering`, and its values.
        space: The space on the ranks of today.

    Returns:
        The values; None if they are of another mesh or element.
    """
    topology = space.mesh.topology
    here = _of_cells(space, len(topology.original_cell_index))
    mine = here[DOFS]
    count = int(topology.index_map(topology.dim).size_global)
    if sum(len(there[CELLS]) for there, _ in parts) != count:
        return None
    whole = np.empty((count, mine.shape[1]))
    for there, values in parts:
        if there[DOFS].shape[1:] != mine.shape[1:]:
            return None
        found = values[there[DOFS]]
        if ORIENTATION in there:
            # as the reference element has them
            _turn(space.element.Tt_apply, found, there[ORIENTATION])
        whole[there[CELLS]] = found
    wanted = whole[here[CELLS]]
    if ORIENTATION in here:
        _turn(space.element.Tt_inv_apply, wanted, here[ORIENTATION])
    index_map = space.dofmap.index_map
    to = np.zeros((index_map.size_local + index_map.num_ghosts) * space.dofmap.index_map_bs)
    to[mine] = wanted
    return to


def _of_cells(space: fem.FunctionSpace, count: int) -> dict[str, Ints]:
    topology, size = space.mesh.topology, space.dofmap.index_map_bs
    dofs = np.asarray(space.dofmap.list[:count], dtype=np.int64)
    unrolled = (size * dofs[:, :, None] + np.arange(size)).reshape(count, size * dofs.shape[1])
    found = {CELLS: np.asarray(topology.original_cell_index[:count], dtype=np.int64)}
    found[DOFS] = unrolled
    if space.element.needs_dof_transformations:
        topology.create_entity_permutations()
        found[ORIENTATION] = np.asarray(topology.get_cell_permutation_info()[:count], np.int64)
    return found


def _turn(apply, values: Floats, orientation: Ints) -> None:  # type: ignore[no-untyped-def]
    """Let an element's transformation act on rows of dofs, in place."""
    flat = values.reshape(-1)
    apply(flat, orientation.astype(np.uint32), 1)
    values[:] = flat.reshape(values.shape)
