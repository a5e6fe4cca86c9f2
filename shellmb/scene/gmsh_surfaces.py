"""Mid-surfaces that gmsh meshes: a file, or a geometry built in the script."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from shellmb.errors import SceneError
from shellmb.scene.surfaces import Surface
from shellmb.scene.validate import Name, described

__all__ = ["GmshFile", "GmshModel"]


@described("gmsh file")
class GmshFile(Surface):
    """The cells of one physical surface group of a gmsh file.

    Physical curve groups are the edges, physical point groups the named points. A mesh (``.msh``)
    is taken as it is; a geometry (``.geo``, ``.brep``, ``.step``) is meshed by gmsh first.

    Args:
        path: The file.
        group: Name of the physical surface; None where there is one only.
    """

    path: Annotated[Path, Field(strict=False)]  # a text names a file, too
    group: Name | None = None

    edges = None
    points = None

    def __post_init__(self) -> None:
        """Check that the file is there.

        Raises:
            SceneError: If it is not.
        """
        if not self.path.is_file():
            raise SceneError(f"gmsh file: path is '{self.path}'; there is no such file")


@described("gmsh model")
class GmshModel(Surface):
    """A geometry built with gmsh's Python interface.

    ``build(gmsh, mesh)`` runs on one MPI rank in an empty model; it adds the geometry and names the
    physical groups: surfaces, curves (edges) and points. It may mesh it too; otherwise shellmb
    does, with the cells the shell asks for.

    Args:
        build: The function; ``mesh`` is the pair of counts of the shell.
        group: Name of the physical surface; None where there is one only.
    """

    build: Callable[[Any, tuple[int, int]], None]
    group: Name | None = None

    edges = None
    points = None
