"""Meshes read from files by meshio: triangles or quadrilaterals, of order 1 or 2."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from dolfinx.io.gmsh import cell_perm_array
from dolfinx.mesh import CellType

from shellmb.errors import SceneError
from shellmb.meshes.raw import Cell, Floats, Ints, RawMesh
from shellmb.meshes.surfaces.orient import oriented
from shellmb.scene import MeshFile, Shell
from shellmb.scene.values.validate import in_words

__all__ = ["file_mesh"]

# meshio's cells -> cell, order; both number nodes as gmsh does
CELLS: dict[str, tuple[Cell, int]] = {
    "triangle": ("tri", 1),
    "triangle6": ("tri", 2),
    "quad": ("quad", 1),
    "quad9": ("quad", 2),
}
NAMES = {"quad": "quadrilaterals", "tri": "triangles"}
# points closer than this part of the mesh's size are one
SAME = 1e-9


def file_mesh(shell: Shell) -> RawMesh:
    """Read the shell's mesh.

    Args:
        shell: A shell with a :class:`MeshFile`.

    Raises:
        SceneError: If the file cannot be read, or its cells are others than the shell asks for.
    """
    import meshio

    surface = shell.surface
    assert isinstance(surface, MeshFile)
    try:
        with warnings.catch_warnings():
            # it finds out whether STL is text by an overflow
            warnings.simplefilter("ignore", RuntimeWarning)
            mesh = meshio.read(surface.path)
    except SystemExit as error:  # it knows no reader
        raise SceneError(
            f"shell '{shell.name}': {surface.path} is not read; it must be a mesh in a format that "
            "meshio knows by its ending"
        ) from error
    except Exception as error:
        raise SceneError(
            f"shell '{shell.name}': {surface.path} is not read ({in_words(error)}); it must be a "
            "mesh in a format of meshio"
        ) from error
    blocks = _blocks(mesh, surface, shell.name)
    if len(blocks) != 1:
        found = ", ".join(sorted({block.type for block in mesh.cells})) or "no cells"
        raise SceneError(
            f"shell '{shell.name}': the mesh has {found}; the cells of a shell must be all of one "
            f"of {', '.join(CELLS)}"
        )
    ((kind, nodes),) = blocks.items()
    cell, order = CELLS[kind]
    if cell != shell.cell:
        raise SceneError(
            f"shell '{shell.name}': the mesh has {NAMES[cell]}; "
            f"cell must be '{cell}', not '{shell.cell}'"
        )
    like = CellType.quadrilateral if cell == "quad" else CellType.triangle
    x, cells = _merged(_spatial(mesh.points) * surface.scale, nodes)
    cells = cells[:, cell_perm_array(like, cells.shape[1])]
    normals = oriented(x, cells, cell, shell.name)
    return RawMesh(x, cells, cell, order, normals, edges={}, points={})


def _blocks(mesh: Any, surface: MeshFile, shell: str) -> dict[str, Ints]:
    """Cells of a surface by their kind, of the group if there is one."""
    chosen: Any = None
    if surface.group is not None:
        known = mesh.cell_sets_dict
        if surface.group not in known:
            names = ", ".join(f"'{n}'" for n in known) or "none"
            raise SceneError(
                f"shell '{shell}': the mesh has no set of cells '{surface.group}'; it has {names}"
            )
        chosen = known[surface.group]
    found = {}
    for kind, nodes in mesh.cells_dict.items():
        if kind in CELLS and (chosen is None or kind in chosen):
            found[kind] = np.asarray(nodes if chosen is None else nodes[chosen[kind]], np.int64)
    return found


def _spatial(points: Any) -> Floats:
    """Points of a plane mesh lie in z = 0."""
    x = np.asarray(points, dtype=float)
    return np.pad(x, ((0, 0), (0, 3 - x.shape[1])))


def _merged(x: Floats, cells: Ints) -> tuple[Floats, Ints]:
    """Nodes that some cell uses, each place once."""
    used, cells_flat = np.unique(cells, return_inverse=True)
    x = x[used]
    size = float(np.ptp(x, axis=0).max())
    _, first, number = np.unique(
        np.round(x / (SAME * size)), axis=0, return_index=True, return_inverse=True
    )
    return x[first], number.ravel()[cells_flat].reshape(cells.shape)
