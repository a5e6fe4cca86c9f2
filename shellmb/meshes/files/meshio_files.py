"""Meshes in the formats of meshio: VTK, STL, gmsh's, and others."""

import ctypes
import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.errors import SceneError
from shellmb.meshes.files.kinds import CELLS, FileContent
from shellmb.meshes.raw import vertex_count
from shellmb.scene.values.validate import in_words

# cells of shells, as meshio calls them
SHELLS = ("triangle", "triangle6", "quad", "quad8", "quad9")
LINES = ("line", "line3")
# formats in which lines and points name groups
NAMING = {".msh"}

# time that any file may take [s], and what a reader in Python takes per byte, several times
LEAST, PER_BYTE = 20.0, 2e-5


def read_meshio(path: Path, who: str) -> FileContent:
    """Read a mesh.

    Args:
        path: The file.
        who: Whose mesh it is, for errors.

    Raises:
        SceneError: If meshio cannot read it.
    """
    import meshio

    try:
        with reading(path), warnings.catch_warnings():
            # it finds out whether STL is text by an overflow
            warnings.simplefilter("ignore", RuntimeWarning)
            mesh = meshio.read(path)
    except SystemExit as error:  # it knows no reader
        raise SceneError(
            f"{who}: {path} is not read; it must be a mesh in a format that meshio knows by its "
            "ending"
        ) from error
    except ImportError as error:
        raise SceneError(
            f"{who}: {path} is not read, because meshio needs the package {error.name} for it; "
            f"install it (pip install {error.name}), or save the mesh as .vtu or .msh"
        ) from error
    except Exception as error:
        raise SceneError(
            f"{who}: {path} is not read ({in_words(error)}); it must be a mesh in a format of "
            "meshio"
        ) from error
    found, naming = FileContent(_spatial(mesh.points, path, who)), path.suffix.lower() in NAMING
    # the type of each block, its nodes, and how many cells there are before it
    blocks: list[tuple[str, Ints, int]] = []
    for block in mesh.cells:
        rows = _nodes_of(block, len(found.x), path, who)
        blocks.append((block.type, rows, len(found.cells)))
        if block.type in SHELLS:
            found.cells += list(rows)
    for name, own_of in _named(mesh).items():
        for (kind, rows, begin), own in zip(blocks, own_of, strict=True):
            if not len(own):
                continue
            if kind in SHELLS:
                found.groups.setdefault(name, []).extend((begin + own).tolist())
            elif kind in LINES and naming:
                before = found.lines.get(name, np.zeros((0, 2), dtype=np.int64))
                found.lines[name] = np.concatenate([before, rows[own][:, :2]])
            elif kind == "vertex" and len(own) == 1:
                found.points[name] = int(rows[own[0], 0])
    sides = _sides([rows for kind, rows, _ in blocks if kind in SHELLS], len(found.x))
    for kind, rows, _ in blocks:
        if kind in SHELLS or (kind == "vertex" and naming):
            continue
        if kind in LINES and naming:
            ends = np.sort(rows[:, :2], axis=1)
            rows = rows[~np.isin(ends @ [len(found.x), 1], sides)]
        if len(rows):
            found.left_out[f"cells '{kind}'"] += len(rows)
    return found


def _sides(cells: list[Ints], count: int) -> Ints:
    """Ends of the sides of all cells, each pair as one number."""
    pairs = [np.zeros((0, 2), dtype=np.int64)]
    for rows in cells:
        corners = rows[:, : vertex_count(CELLS[rows.shape[1]])]
        pairs.append(np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2))
    return np.asarray(np.sort(np.concatenate(pairs), axis=1) @ [count, 1])


def _named(mesh: Any) -> dict[str, list[Ints]]:
    """Rows of each block in each named set; gmsh's physical groups, and by number those without."""
    named: dict[str, list[Ints]] = {}
    for name, rows in mesh.cell_sets.items():
        if not name.startswith("gmsh:"):
            named[name] = [np.asarray([] if r is None else r, dtype=np.int64) for r in rows]
    tags = mesh.cell_data.get("gmsh:physical")
    if tags is None:
        return named
    dims = {"vertex": 0, "line": 1, "line3": 1}
    names = {(int(dim), int(tag)): name for name, (tag, dim) in mesh.field_data.items()}
    for k, (block, tag) in enumerate(zip(mesh.cells, tags, strict=True)):
        dim = dims.get(block.type, 2)
        for each in np.unique(tag[tag > 0]):
            name = names.get((dim, int(each)), f"physical {each}")
            if name not in named:
                named[name] = [np.zeros(0, dtype=np.int64) for _ in mesh.cells]
            named[name][k] = np.flatnonzero(tag == each)
    return named


def _spatial(points: Any, path: Path, who: str) -> Floats:
    """Points of a plane mesh lie in z = 0."""
    x = np.asarray(points, dtype=float)
    if x.ndim != 2 or not len(x) or x.shape[1] not in (2, 3):
        raise SceneError(f"{who}: {path} has no nodes in a plane or in space; it must be a mesh")
    return np.pad(x, ((0, 0), (0, 3 - x.shape[1])))


def _nodes_of(block: Any, count: int, path: Path, who: str) -> Ints:
    """Nodes of the cells of a block; what is read from a damaged file may name others."""
    rows = np.asarray(block.data, dtype=np.int64)
    wrong = rows[(rows < 0) | (rows >= count)]
    if len(wrong):
        raise SceneError(
            f"{who}: {path} has cells '{block.type}' with node {wrong[0]}, counted from 0; there "
            f"are {count} nodes, and cells must have no others"
        )
    return rows


class ReadTimeout(Exception):
    """A reader that does not come to an end."""

    def __str__(self) -> str:
        return "it is not read to its end in a long time, as if it were cut off"


@contextmanager
def reading(file: Path) -> Iterator[None]:
    """Raise an error in this thread if a file takes far too long; for readers that are in Python.

    Args:
        file: The file, whose size says how long it may take.

    Raises:
        ReadTimeout: If it does.
    """
    thread = ctypes.c_ulong(threading.get_ident())
    ended = threading.Lock()

    def stop() -> None:
        with ended:
            if not done:
                ctypes.pythonapi.PyThreadState_SetAsyncExc(thread, ctypes.py_object(ReadTimeout))

    done = False
    timer = threading.Timer(LEAST + PER_BYTE * file.stat().st_size, stop)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        with ended:
            done = True
        timer.cancel()
