"""Meshes made or read by gmsh: one physical surface group becomes the mesh of one shell."""

import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from shellmb.arrays import Ints
from shellmb.errors import SceneError, warn
from shellmb.meshes.files.kinds import FileContent
from shellmb.meshes.files.shellmesh import shell_mesh
from shellmb.meshes.raw import RawMesh
from shellmb.scene import GmshFile, GmshModel, Shell
from shellmb.scene.shells.gmsh_surfaces import CAD, Meshed
from shellmb.scene.values.validate import as_names

# gmsh's element type -> kind
CELLS = {2: "tri3", 9: "tri6", 3: "quad4", 16: "quad8", 10: "quad9"}
# the options shellmb relies on; a session that is open gets its own values back
OPTIONS = {
    "General.Terminal": 0,
    "Mesh.MeshSizeMax": 1e22,
    "Mesh.RecombineAll": 0,
    "Mesh.RecombinationAlgorithm": 1,
    "Mesh.SecondOrderIncomplete": 0,
    "Geometry.ToleranceBoolean": 0,
}
LINES = {1: 2, 8: 3}
# faces of CAD within this part of its size are one: what files are written with, and no feature
SEAM = 2e-6
# the ending of programs, which may read others beside them
PROGRAM = ".geo"


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
        path = Path(surface.path).resolve()
        if path.suffix.lower() == PROGRAM:
            gmsh.merge(str(path))
            return
        # beside FILE it looks for FILE.opt, a program that it runs; it knows not all endings in
        # capitals, and takes the others for programs, too
        with tempfile.TemporaryDirectory() as folder:
            named = Path(folder, path.stem + path.suffix.lower())
            named.symlink_to(path)
            try:
                gmsh.merge(str(named))
            except Exception as error:
                said = str(error).replace(str(named), str(surface.path))
                raise SceneError(f"shell '{shell.name}': gmsh fails: {said}") from error
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
            if shell.surface.merge > 0 and len(model.getEntities(2)) > 1:
                # faces of a file have a border each, also where they touch
                gmsh.option.setNumber("Geometry.ToleranceBoolean", SEAM * longest)
                model.occ.removeAllDuplicates()
                model.occ.synchronize()
            gmsh.option.setNumber("Mesh.MeshSizeMax", longest / max(shell.mesh))
        quads = shell.cell != "tri"
        if quads:
            gmsh.option.setNumber("Mesh.RecombineAll", 1)
        model.mesh.generate(2)
        if quads and {2, 9} & set(model.mesh.getElementTypes(2)):
            # triangles are left where recombination found no partner: subdivide instead
            model.mesh.clear()
            gmsh.option.setNumber("Mesh.RecombinationAlgorithm", 3)
            try:
                model.mesh.generate(2)
            except Exception as error:
                # as of faces that close on themselves
                who = f"shell '{shell.name}': gmsh makes no quadrilaterals on these faces ({error})"
                if shell.cell is not None:
                    raise SceneError(f"{who}; cell must be 'tri'") from error
                model.mesh.clear()
                gmsh.option.setNumber("Mesh.RecombineAll", 0)
                model.mesh.generate(2)
                warn(f"{who}; it has triangles, as with cell='tri'")
    from_file = isinstance(shell.surface, GmshFile)
    order = shell.geometry_order or (None if from_file and meshed else 2)
    if order is not None:
        kinds = map(model.mesh.getElementProperties, model.mesh.getElementTypes(2))
        if any(kind[2] != order for kind in kinds):
            model.mesh.setOrder(order)


def _extract(model: Any, shell: Shell) -> RawMesh:
    tags, coordinates, _ = model.mesh.getNodes()
    place = np.argsort(tags)

    def rows(nodes: Any) -> Ints:
        """Rows of nodes by gmsh's tags."""
        return np.asarray(place[np.searchsorted(tags, nodes, sorter=place)], dtype=np.int64)

    entities = _surface_entities(model, shell)
    found = FileContent(coordinates.reshape(-1, 3))
    owner = _take_cells(found, model, entities, rows)
    if not found.cells and not found.left_out:
        raise SceneError(f"shell '{shell.name}': the gmsh mesh has no cells; mesh its surfaces")
    found.groups = {
        name: np.flatnonzero(np.isin(owner, parts)).tolist()
        for name, parts in _groups(model, 2).items()
        if set(map(int, parts)) <= set(entities)
    }
    found.lines, found.points = _lines(model, rows), _points(model, rows)
    # its cells are those of the groups already
    return shell_mesh(found, shell, None)


def _groups(model: Any, dim: int) -> dict[str, Any]:
    """Physical groups of a dimension by name: the entities of each."""
    return {
        # MED fills names up with blanks
        model.getPhysicalName(dim, tag).strip(): model.getEntitiesForPhysicalGroup(dim, tag)
        for _, tag in model.getPhysicalGroups(dim)
        if model.getPhysicalName(dim, tag)
    }


def _surface_entities(model: Any, shell: Shell) -> list[int]:
    """The entities of the shell's groups; without groups, and none requested, every surface."""
    surface = shell.surface
    assert isinstance(surface, Meshed)
    known = _groups(model, 2)
    if surface.group is None and len(known) <= 1:
        every = next(iter(known.values()), [tag for _, tag in model.getEntities(2)])
        return [int(tag) for tag in every]
    names = ", ".join(f"'{n}'" for n in known) or "none"
    if surface.group is None:
        raise SceneError(
            f"shell '{shell.name}': the gmsh mesh has several physical surfaces; "
            f"group must be one of {names}, or several"
        )
    entities = []
    for group in as_names(surface.group):
        if group not in known:
            raise SceneError(
                f"shell '{shell.name}': the gmsh mesh has no physical surface '{group}'; it has "
                f"{names}"
            )
        entities += [int(tag) for tag in known[group]]
    return list(dict.fromkeys(entities))


def _take_cells(
    found: FileContent, model: Any, entities: list[int], rows: Callable[[Any], Ints]
) -> list[int]:
    """Take the cells of entities, and count others; the entity of each cell that is taken."""
    owner: list[int] = []
    for entity in entities:
        kinds, tags, nodes = model.mesh.getElements(2, entity)
        for number, own, flat in zip(kinds, tags, nodes, strict=True):
            if int(number) not in CELLS:
                name = f"cells '{model.mesh.getElementProperties(number)[0]}'"
                found.left_out[name] += len(own)
                continue
            of_cells = rows(flat).reshape(len(own), -1)
            found.cells += [(CELLS[int(number)], of_cell) for of_cell in of_cells]
            owner += [entity] * len(own)
    return owner


def _lines(model: Any, rows: Callable[[Any], Ints]) -> dict[str, Ints]:
    """Ends of the elements on each physical curve, shape (m, 2)."""
    lines = {}
    for name, entities in _groups(model, 1).items():
        pairs = []
        for entity in entities:
            kinds, _, nodes = model.mesh.getElements(1, entity)
            for kind, flat in zip(kinds, nodes, strict=True):
                pairs.append(rows(flat).reshape(-1, LINES[int(kind)])[:, :2])
        if pairs:
            lines[name] = np.concatenate(pairs)
    return lines


def _points(model: Any, rows: Callable[[Any], Ints]) -> dict[str, int]:
    """The node of each physical point; a group with several is left out."""
    points = {}
    for name, entities in _groups(model, 0).items():
        nodes = [int(t) for e in entities for t in model.mesh.getNodes(0, e)[0]]
        if len(nodes) == 1:
            points[name] = int(rows(nodes)[0])
    return points
