"""Meshes in the formats of meshio: VTK, STL, gmsh's, and others."""

from __future__ import annotations

import warnings
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.errors import SceneError
from shellmb.files.read_timeout import reading
from shellmb.meshes.files.file_content import FileContent
from shellmb.scene.values.validate import in_words

__all__ = ["read_meshio"]

# meshio's cells -> kind
CELLS = {
    "triangle": "tri3",
    "triangle6": "tri6",
    "quad": "quad4",
    "quad8": "quad8",
    "quad9": "quad9",
}
LINES = ("line", "line3")
# formats in which lines and points name groups
NAMING = {".msh"}


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
    x = _spatial(mesh.points, path, who)
    blocks: dict[str, list[Ints]] = {}
    left_out: Counter[str] = Counter()
    # where the cells of each block begin among those of their kind
    begins = []
    for block in mesh.cells:
        kind = CELLS.get(block.type, block.type)
        begins.append((kind, sum(len(rows) for rows in blocks.get(kind, []))))
        blocks.setdefault(kind, []).append(_nodes_of(block, len(x), path, who))
    # polygons of several numbers of sides are one kind
    joint = {k: np.concatenate(rows) for k, rows in blocks.items() if k != "polygon"}
    if "polygon" in blocks:
        left_out["cells 'polygon'"] = sum(map(len, blocks["polygon"]))
    found = FileContent(x, {k: joint[k] for k in joint if k in CELLS.values()})
    named = _named(mesh)
    for name, rows_of in named.items():
        for (kind, begin), rows in zip(begins, rows_of, strict=True):
            if not len(rows):
                continue
            if kind in found.cells:
                group = found.groups.setdefault(name, {})
                before = group.get(kind, np.zeros(0, dtype=np.int64))
                group[kind] = np.concatenate([before, begin + rows])
            elif kind in LINES and path.suffix.lower() in NAMING:
                before = found.lines.get(name, np.zeros((0, 2), dtype=np.int64))
                found.lines[name] = np.concatenate([before, joint[kind][begin + rows][:, :2]])
            elif kind == "vertex" and len(rows) == 1:
                found.points[name] = int(joint[kind][begin + rows[0], 0])
    for kind, rows in joint.items():
        if kind in found.cells or (kind == "vertex" and path.suffix.lower() in NAMING):
            continue
        if kind in LINES and path.suffix.lower() in NAMING:
            ends = np.sort(rows[:, :2], axis=1)
            rows = rows[~np.isin(ends @ [len(found.x), 1], _sides(found))]
        if len(rows):
            left_out[f"cells '{kind}'"] += len(rows)
    found.left_out = left_out
    return found


def _sides(found: FileContent) -> Ints:
    """Ends of the sides of all cells, each pair as one number."""
    pairs = [np.zeros((0, 2), dtype=np.int64)]
    for kind, rows in found.cells.items():
        corners = rows[:, : 3 if kind.startswith("tri") else 4]
        pairs.append(np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2))
    return np.asarray(np.sort(np.concatenate(pairs), axis=1) @ [len(found.x), 1])


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
