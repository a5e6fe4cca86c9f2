"""Mid-surfaces whose mesh is read, or made by gmsh: files, or a geometry built in the script.

Physical curve groups (of gmsh) are the edges, physical point groups the named points. Further edges
are named by where they lie: ``edges_where={"root": lambda x: x[0] < 1e-6}`` takes the facets on the
boundary for which a vectorised function of positions (3, n) is true at both ends and in the middle.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from shellmb.errors import SceneError
from shellmb.scene.shells.surfaces import Surface
from shellmb.scene.values.validate import Name, Positive, described

__all__ = ["GmshFile", "GmshModel", "MeshFile", "Meshed"]

# names of edges with functions of positions (3, n) that say whether they are on it
EdgesWhere = Mapping[Name, Callable[[Any], Any]]


class Meshed(Surface):
    """A surface without a map: what only its mesh tells is None.

    Attributes:
        edges_where: Edges by where they lie.
    """

    edges = None
    points = None
    edges_where: EdgesWhere


@described("gmsh file")
class GmshFile(Meshed):
    """The cells of one physical surface group of a gmsh file.

    A mesh (``.msh``) is taken as it is; a geometry (``.geo``, ``.brep``, ``.step``) is meshed by
    gmsh first, CAD with as many elements along the longest side of its box as ``mesh`` says.

    Args:
        path: The file.
        group: Name of the physical surface; None where there is one only.
        edges_where: Edges by where they lie.
    """

    path: Annotated[Path, Field(strict=False)]  # a text names a file, too
    group: Name | None = None
    edges_where: EdgesWhere = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check that the file is there.

        Raises:
            SceneError: If it is not.
        """
        _there(self.path, "gmsh file")


@described("gmsh model")
class GmshModel(Meshed):
    """A geometry built with gmsh's Python interface.

    ``build(gmsh, mesh)`` runs on one MPI rank in an empty model; it adds the geometry and names the
    physical groups: surfaces, curves (edges) and points. It may mesh it too; otherwise shellmb
    does, with the cells the shell asks for.

    Args:
        build: The function; ``mesh`` is the pair of counts of the shell.
        group: Name of the physical surface; None where there is one only.
        edges_where: Edges by where they lie.
    """

    build: Callable[[Any, tuple[int, int]], None]
    group: Name | None = None
    edges_where: EdgesWhere = field(default_factory=dict)


@described("mesh file")
class MeshFile(Meshed):
    """Triangles or quadrilaterals of a mesh in any format that meshio reads.

    Nastran (``.bdf``), Abaqus (``.inp``), STL, VTK, MED and others. Sets of cells name groups;
    points that are written several times (as in STL) become one.

    Args:
        path: The file.
        group: Name of the set of cells; None: all cells of the surface.
        edges_where: Edges by where they lie.
        scale: Factor on positions, to metres for instance.
    """

    path: Annotated[Path, Field(strict=False)]
    group: Name | None = None
    edges_where: EdgesWhere = field(default_factory=dict)
    scale: Positive = 1.0

    def __post_init__(self) -> None:
        """Check that the file is there.

        Raises:
            SceneError: If it is not.
        """
        _there(self.path, "mesh file")


def _there(path: Path, what: str) -> None:
    if not path.is_file():
        raise SceneError(f"{what}: path is '{path}'; there is no such file")
