"""Meshes made or read by gmsh: one physical surface group becomes the mesh of one shell."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from dolfinx.io.gmsh import cell_perm_array
from dolfinx.mesh import CellType

from shellmb.errors import SceneError
from shellmb.meshes.raw import Cell, Ints, RawMesh, facets
from shellmb.meshes.surfaces.orient import oriented
from shellmb.scene import GmshFile, GmshModel, Shell

__all__ = ["gmsh_mesh"]

# gmsh's element type -> cell, order, number of nodes
CELLS: dict[int, tuple[Cell, int, int]] = {
    2: ("tri", 1, 3),
    9: ("tri", 2, 6),
    3: ("quad", 1, 4),
    10: ("quad", 2, 9),
}
# the options shellmb relies on; a session that is open gets its own values back
OPTIONS = {
    "General.Terminal": 0,
    "Mesh.MeshSizeMax": 1e22,
    "Mesh.RecombineAll": 0,
    "Mesh.RecombinationAlgorithm": 1,
    "Mesh.SecondOrderIncomplete": 0,
}
LINES = {1: 2, 8: 3}
# formats that say nothing of the size of elements
CAD = {".step", ".stp", ".brep", ".iges", ".igs"}
NAMES = {"quad": "quadrilaterals", "tri": "triangles"}


def gmsh_mesh(shell: Shell) -> RawMesh:
    """Mesh with gmsh, in a model of its own, and take the shell's group out of it.

    Args:
        shell: A shell with a :class:`GmshFile` or :class:`GmshModel`.

    Raises:
        SceneError: If gmsh fails, or the group is missing, mixed, of other cells, or not a surface.
    """
    with _session(shell) as gmsh:
        _load(gmsh, shell)
        _mesh(gmsh, shell)
        return _extract(gmsh.model, shell)


@contextmanager
def _session(shell: Shell) -> Iterator[Any]:
    """Gmsh with an empty silent model; a session the user has open is left as it was."""
    import gmsh

    open_before = bool(gmsh.isInitialized())
    previous = gmsh.model.getCurrent() if open_before else ""
    if not open_before:
        gmsh.initialize(["shellmb"], False, False, False)
    before = {name: gmsh.option.getNumber(name) for name in OPTIONS}
    for name, value in OPTIONS.items():
        gmsh.option.setNumber(name, value)
    gmsh.model.add(f"shellmb {shell.name}")
    try:
        yield gmsh
    except SceneError:
        raise
    except Exception as error:  # gmsh raises plain Exception
        raise SceneError(f"shell '{shell.name}': gmsh fails: {error}") from error
    finally:
        if open_before:
            gmsh.model.remove()
            gmsh.model.setCurrent(previous)
            for name, value in before.items():
                gmsh.option.setNumber(name, value)
        elif gmsh.isInitialized():
            gmsh.finalize()


def _load(gmsh: Any, shell: Shell) -> None:
    surface = shell.surface
    if isinstance(surface, GmshFile):
        gmsh.merge(str(Path(surface.path).resolve()))
    else:
        assert isinstance(surface, GmshModel)
        surface.build(gmsh, shell.mesh)


def _mesh(gmsh: Any, shell: Shell) -> None:
    """Make the mesh where there is none yet, of the cells and the order the shell asks for."""
    model, meshed = gmsh.model, len(gmsh.model.mesh.getElementTypes(2)) > 0
    if not meshed:
        if isinstance(shell.surface, GmshFile) and shell.surface.path.suffix.lower() in CAD:
            box = np.array(model.getBoundingBox(-1, -1))
            longest = float((box[3:] - box[:3]).max())
            gmsh.option.setNumber("Mesh.MeshSizeMax", longest / max(shell.mesh))
        quads = shell.cell == "quad"
        if quads:
            gmsh.option.setNumber("Mesh.RecombineAll", 1)
        model.mesh.generate(2)
        if quads and {2, 9} & set(model.mesh.getElementTypes(2)):
            # triangles are left where recombination found no partner: subdivide instead
            model.mesh.clear()
            gmsh.option.setNumber("Mesh.RecombinationAlgorithm", 3)
            model.mesh.generate(2)
    from_file = isinstance(shell.surface, GmshFile)
    order = shell.geometry_order or (None if from_file and meshed else 2)
    if order is not None:
        if any(_order(model, t) != order for t in model.mesh.getElementTypes(2)):
            model.mesh.setOrder(order)


def _order(model: Any, kind: int) -> int:
    return int(model.mesh.getElementProperties(kind)[2])


def _extract(model: Any, shell: Shell) -> RawMesh:
    tags, coordinates, _ = model.mesh.getNodes()
    coordinates = coordinates.reshape(-1, 3)
    cell, order, raw_cells = _cells(model, shell)
    used, cells = np.unique(raw_cells, return_inverse=True)
    cells = cells.reshape(raw_cells.shape)
    place = np.argsort(tags)
    x = coordinates[place[np.searchsorted(tags, used, sorter=place)]]
    if cell != shell.cell:
        raise SceneError(
            f"shell '{shell.name}': the gmsh mesh has {NAMES[cell]}; "
            f"cell must be '{cell}', not '{shell.cell}'"
        )
    return RawMesh(
        x=x,
        cells=cells,
        cell=cell,
        order=order,
        normals=oriented(x, cells, cell, shell.name),
        edges=_edges(model, used, facets(cells, cell)),
        points=_points(model, used),
    )


def _groups(model: Any, dim: int) -> dict[str, Any]:
    """Physical groups of a dimension by name: the entities of each."""
    return {
        model.getPhysicalName(dim, tag): model.getEntitiesForPhysicalGroup(dim, tag)
        for _, tag in model.getPhysicalGroups(dim)
        if model.getPhysicalName(dim, tag)
    }


def _surface_entities(model: Any, shell: Shell) -> Any:
    """The entities of the shell's group; without groups, and none asked for, every surface."""
    group = getattr(shell.surface, "group", None)
    known = _groups(model, 2)
    if group is None and len(known) <= 1:
        return next(iter(known.values()), [tag for _, tag in model.getEntities(2)])
    names = ", ".join(f"'{n}'" for n in known) or "none"
    if group is None:
        raise SceneError(
            f"shell '{shell.name}': the gmsh mesh has several physical surfaces; "
            f"group must be one of {names}"
        )
    if group not in known:
        raise SceneError(
            f"shell '{shell.name}': the gmsh mesh has no physical surface '{group}'; it has {names}"
        )
    return known[group]


def _cells(model: Any, shell: Shell) -> tuple[Cell, int, Ints]:
    """Cell type, order, and nodes (gmsh's tags) in the order of DOLFINx."""
    found: dict[int, list[Ints]] = {}
    for entity in _surface_entities(model, shell):
        kinds, _, nodes = model.mesh.getElements(2, entity)
        for kind, flat in zip(kinds, nodes, strict=True):
            found.setdefault(int(kind), []).append(np.asarray(flat, dtype=np.int64))
    if not found:
        raise SceneError(f"shell '{shell.name}': the gmsh mesh has no cells; mesh its surfaces")
    other = [k for k in found if k not in CELLS]
    if other or len(found) > 1:
        names = ", ".join(sorted(model.mesh.getElementProperties(k)[0] for k in found))
        raise SceneError(
            f"shell '{shell.name}': the gmsh mesh has the cells {names}; "
            "they must be all triangles or all quadrilaterals, with 3, 6, 4 or 9 nodes"
        )
    ((kind, lists),) = found.items()
    cell, order, count = CELLS[kind]
    nodes = np.concatenate(lists).reshape(-1, count)
    like = CellType.quadrilateral if cell == "quad" else CellType.triangle
    return cell, order, nodes[:, cell_perm_array(like, count)]


def _edges(model: Any, used: Ints, cell_facets: Ints) -> dict[str, Ints]:
    """Facets of each physical curve that belong to the shell; curves without any are left out."""
    own = {(int(a), int(b)) for a, b in cell_facets.reshape(-1, 2)}
    edges = {}
    for name, entities in _groups(model, 1).items():
        pairs = []
        for entity in entities:
            kinds, _, nodes = model.mesh.getElements(1, entity)
            for kind, flat in zip(kinds, nodes, strict=True):
                pairs.append(np.asarray(flat).reshape(-1, LINES[int(kind)])[:, :2])
        if not pairs:
            continue
        lines = np.concatenate(pairs).astype(np.int64)
        lines = lines[np.isin(lines, used).all(axis=1)]
        numbered = np.sort(np.searchsorted(used, lines), axis=1)
        kept = [pair for pair in numbered if (int(pair[0]), int(pair[1])) in own]
        if kept:
            edges[name] = np.array(kept, dtype=np.int64)
    return edges


def _points(model: Any, used: Ints) -> dict[str, int]:
    """Each physical point that is a node of the shell; a group with several is left out."""
    own = {int(tag): number for number, tag in enumerate(used)}
    points = {}
    for name, entities in _groups(model, 0).items():
        nodes = [int(t) for e in entities for t in model.mesh.getNodes(0, e)[0]]
        if len(nodes) == 1 and nodes[0] in own:
            points[name] = own[nodes[0]]
    return points
