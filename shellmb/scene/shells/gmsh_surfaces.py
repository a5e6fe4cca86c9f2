"""Mid-surfaces whose mesh is read, or made by gmsh: files, or a geometry built in the script.

Physical curve groups (of gmsh) are the edges, physical point groups the named points. Further edges
are named by where they lie: ``edges_where={"root": lambda x: x[0] < 1e-6}`` takes the facets on the
boundary for which a vectorised function of positions (3, n) is true at both ends and in the middle.
"""

import os
from collections.abc import Callable, Mapping
from dataclasses import field
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from shellmb.errors import SceneError
from shellmb.scene.shells.surfaces import Surface
from shellmb.scene.types import Edge, Held, Name, Positive, PositiveInt
from shellmb.scene.values.validate import described, extended

# part of a side below which nodes are one: gaps of CAD and of single precision are 1e-4 of it at
# most, the smallest sides that are meant as such a tenth
MERGE = 1e-3
Fraction = Annotated[float, Field(ge=0, lt=0.5, allow_inf_nan=False)]
Group = Edge | None
# what gmsh reads as the ending says; anything else it takes for a program
READ = (".msh", ".geo", ".step", ".stp", ".brep", ".iges", ".igs", ".med", ".unv")
# of these CAD, which says nothing of the size of elements
CAD = (".step", ".stp", ".brep", ".iges", ".igs")
# how a mesh of gmsh begins, in all versions
MSH = (b"$MeshFormat", b"$Comments", b"$NOD")
# names of edges with functions of positions (3, n) that say whether they are on it
EdgesWhere = Mapping[Name, Callable[[Any], Any]]


class Meshed(Surface):
    """A surface without a map: what only its mesh tells is None.

    Attributes:
        group: Group or groups of its cells.
        where: Which of these cells, by where they lie.
        edges_where: Edges by where they lie.
        merge: How near to one another nodes become one.
        gaps: What to do where it touches itself without being joined.
        flip: Whether its positive side is the other one.
        scale: Factor on positions.
        refine: Elements along each side of one that is read.
    """

    edges = None
    points = None
    group: Group
    where: Callable[[Any], Any] | None
    edges_where: EdgesWhere
    merge: float
    gaps: Literal["refuse", "keep"]
    flip: bool
    scale: float
    refine: int


@described("file")
class OfFile(Meshed):
    """A surface whose mesh, or geometry, is in a file."""

    label: ClassVar[str]
    path: Annotated[Held[Path, Path | str], Field(strict=False)]  # a text names a file, too
    group: Group = None
    edges_where: EdgesWhere = field(default_factory=dict)
    where: Callable[[Any], Any] | None = None
    merge: Fraction = MERGE
    gaps: Literal["refuse", "keep"] = "refuse"
    flip: bool = False
    scale: Positive = 1.0
    refine: PositiveInt = 1

    of_file = True

    @property
    def refined(self) -> int | None:
        """Elements along a side of each one of the mesh's file; None of CAD."""
        return None if self.path.suffix.lower() in CAD else self.refine

    def __post_init__(self) -> None:
        """Check that the file is there.

        Raises:
            SceneError: If it is not.
        """
        # a name may be too long for a file, or have letters that none has
        if not os.path.isfile(self.path):
            raise SceneError(f"{self.label}: path is '{self.path}'; there is no such file")


@extended("gmsh file")
class GmshFile(OfFile):
    """The cells of physical surface groups of a file that gmsh reads.

    A mesh (``.msh``, ``.med``, ``.unv``) is taken as it is; CAD (``.step``, ``.brep``, ``.iges``)
    is meshed by gmsh first, with as many elements along the longest side of its box as ``mesh``
    says; its faces are joined where they touch. A ``.geo`` is a program, which gmsh runs: it may do
    on this machine what any program may.

    Args:
        path: The file.
        group: Name of the physical surface, or names of several, which make one shell; None where
            there is one only.
        edges_where: Edges by where they lie.
        where: Vectorised function of positions (3, n) that is true in the middle of the elements to
            take, for files without groups; None: all.
        merge: Nodes become one that are closer than this part of the shortest side of the elements
            around them; 0: all stay.
        gaps: Where sides and nodes lie on others without being joined: ``"refuse"`` the mesh, and
            list them, or ``"keep"`` them open with a warning.
        flip: Whether the positive side is the other one than that of most elements as they come.
        scale: Factor on positions, to metres for instance.
        refine: Elements along each side of one of the file's, whose shape and groups stay.
    """

    def __post_init__(self) -> None:
        """Check that the file is there, and is what its ending says.

        Raises:
            SceneError: If it is not.
        """
        super().__post_init__()
        ending = self.path.suffix.lower()
        if ending == ".geo_unrolled":
            raise SceneError(
                f"gmsh file: '{self.path}' is a program for gmsh, which may do anything on this "
                "machine; if you trust it, name it .geo"
            )
        if ending not in READ:
            raise SceneError(
                f"gmsh file: path is '{self.path}'; it must end in one of {', '.join(READ)}, or be "
                "a MeshFile"
            )
        with self.path.open("rb") as file:
            # gmsh itself goes by the first bytes: a line before them makes a program of it
            begin = file.read(16)
        if ending == ".msh" and not begin.startswith(MSH):
            raise SceneError(
                f"gmsh file: '{self.path}' does not begin as a mesh of gmsh ($MeshFormat); a "
                "program for gmsh must be named .geo"
            )
        # by these words gmsh takes anything for its own
        if ending != ".msh" and begin.startswith(b"$MeshFormat"):
            raise SceneError(f"gmsh file: '{self.path}' is a mesh of gmsh; it must be named .msh")


@described("gmsh model")
class GmshModel(Meshed):
    """A geometry built with gmsh's Python interface.

    ``build(gmsh, mesh)`` runs on one MPI rank in an empty model; it adds the geometry and names the
    physical groups: surfaces, curves (edges) and points. It may mesh it too; otherwise shellmb
    does, with the cells the shell asks for.

    Args:
        build: The function; ``mesh`` is the pair of counts of the shell.
        group: Name of the physical surface, or names of several; None where there is one only.
        edges_where: Edges by where they lie.
        where: As of a :class:`GmshFile`.
        merge: As of a :class:`GmshFile`.
        gaps: As of a :class:`GmshFile`.
        flip: Whether the positive side is the other one than that of most elements as they come.
    """

    build: Callable[[Any, tuple[int, int]], None]
    group: Group = None
    edges_where: EdgesWhere = field(default_factory=dict)
    where: Callable[[Any], Any] | None = None
    merge: Fraction = MERGE
    gaps: Literal["refuse", "keep"] = "refuse"
    flip: bool = False

    scale = 1.0
    refine = 1


@extended("mesh file")
class MeshFile(OfFile):
    """Triangles and quadrilaterals of a mesh of other programs.

    Nastran (``.bdf``, ``.nas``, ``.fem``, ``.dat``), Abaqus (``.inp``), and what meshio reads: STL,
    VTK, gmsh's meshes and others. Properties ("PID 7"), element sets and physical groups name
    groups. Sections, loads and supports of such files are not read; elements that are no shells
    are named in a warning.

    Args:
        path: The file.
        group: Name of the set of cells, or names of several, which make one shell; None: all.
        edges_where: Edges by where they lie.
        where: As of a :class:`GmshFile`.
        merge: As of a :class:`GmshFile`.
        gaps: As of a :class:`GmshFile`.
        flip: Whether the positive side is the other one than that of most elements as they come.
        scale: Factor on positions, to metres for instance.
        refine: Elements along each side of one of the file's, whose shape and groups stay.
    """
