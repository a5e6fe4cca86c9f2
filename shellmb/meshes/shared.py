"""Meshes and numberings that a simulation shares with scenes beside it.

A scene beside a run has its cells. To distribute and to number them again takes time, and MPI has
about 2000 communicators for a process: without sharing a mechanism with six joints uses ninety, of
which two are left here. Lines are meshed here, and what cells have at a node is added up.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Any
from weakref import WeakKeyDictionary

from mpi4py import MPI

import dolfinx.mesh
import numpy as np
import ufl
from dolfinx import cpp, fem, la  # type: ignore[attr-defined]

from shellmb.arrays import Floats, Ints
from shellmb.meshes.lifetime import count_in
from shellmb.native.shared_layout import Layout, moved_mesh


@dataclass(frozen=True, eq=False)
class Described:
    """Cells and nodes of a whole mesh, the same on all ranks.

    Args:
        comm: Communicator.
        element: Element of the coordinates.
        cells: What tells which nodes each cell has.
        x: Positions of the nodes, shape (n, 3), m.
    """

    comm: MPI.Comm
    element: Any
    cells: Ints
    x: Floats

    def has_cells_of(self, other: Described) -> bool:
        """Decide whether only positions of nodes may differ from those of another mesh."""
        return (
            self.comm == other.comm
            and self.element == other.element
            and self.x.shape == other.x.shape
            and np.array_equal(self.cells, other.cells)
        )


@dataclass
class Meshes:
    """Meshes of a simulation.

    Args:
        made: They, each with what it was made of.
    """

    made: list[tuple[Described, dolfinx.mesh.Mesh]] = field(default_factory=list)

    @contextmanager
    def used(self, others: Meshes | None = None) -> Iterator[None]:
        """Meshes made in here are kept here, and are those of another simulation where they can.

        Args:
            others: Meshes of the other one.
        """
        before = _BUILT.set((self, Meshes([] if others is None else list(others.made))))
        try:
            yield
        finally:
            _BUILT.reset(before)


# meshes of the model that is being built, and those of another one that it may use, each once
_BUILT: ContextVar[tuple[Meshes, Meshes]] = ContextVar("built")
# layouts of spaces on each mesh; those on a mesh and on its twins are the same
_LAYOUTS: WeakKeyDictionary[dolfinx.mesh.Mesh, dict[Any, Any]] = WeakKeyDictionary()


def shared_mesh(
    described: Described, make: Callable[[ufl.Mesh], dolfinx.mesh.Mesh]
) -> dolfinx.mesh.Mesh:
    """A mesh, that of the other simulation if it has one with these cells; collective.

    Args:
        described: Its cells and nodes.
        make: Makes it.
    """
    own, others = _BUILT.get((Meshes(), Meshes()))
    known = (k for k, (of, _) in enumerate(others.made) if described.has_cells_of(of))
    number = next(known, None)
    if number is None:
        mesh = make(ufl.Mesh(described.element))
        _LAYOUTS[mesh] = {}
        count_in(mesh)
    else:
        of, mesh = others.made.pop(number)
        if not np.array_equal(of.x, described.x):
            layouts = _LAYOUTS[mesh]
            mesh = moved_mesh(mesh, described.element, described.x)
            _LAYOUTS[mesh] = layouts
    own.made.append((described, mesh))
    return mesh


def line_mesh(comm: MPI.Comm, element: Any, cells: Ints, x: Floats) -> dolfinx.mesh.Mesh:
    """Mesh of intervals, shared out over the ranks in their order; some ranks may get none.

    Args:
        comm: Communicator.
        element: Element of the coordinates.
        cells: Nodes of all intervals.
        x: Positions of all nodes, shape (n, 3), m.
    """
    mine = np.array_split(cells, comm.size)[comm.rank]

    def stay(comm: Any, nparts: Any, cell_types: Any, cells_in: Any) -> Any:
        own = np.full(len(mine), comm.rank, dtype=np.int32)
        return cpp.graph.AdjacencyList_int32(own, np.arange(len(mine) + 1, dtype=np.int32))

    return shared_mesh(
        Described(comm, element, cells, x),
        lambda e: dolfinx.mesh.create_mesh(
            comm, mine, e, x if comm.rank == 0 else x[:0], partitioner=stay
        ),
    )


def space_on(mesh: dolfinx.mesh.Mesh, element: Any) -> fem.FunctionSpace:
    """A function space whose unknowns are numbered once for all meshes with these cells.

    Args:
        mesh: The mesh.
        element: Its element, as `dolfinx.fem.functionspace` takes it.
    """
    layouts = _LAYOUTS.setdefault(mesh, {})
    if element in layouts:
        return layouts[element].on(mesh)
    space = fem.functionspace(mesh, element)
    layouts[element] = Layout.of(space)
    return space


def sums_at_nodes(space: fem.FunctionSpace, values: Floats) -> Floats:
    """Sums at the nodes of what the cells around them have there, shape (nodes, size); collective.

    Args:
        space: A space with these nodes.
        values: Values of this rank's cells at their nodes, shape (cells, nodes or 1, size).
    """
    total = la.vector(space.dofmap.index_map, values.shape[-1])
    sums = total.array.reshape(-1, values.shape[-1])
    np.add.at(sums, space.dofmap.list[: len(values)], values)
    # cells of other ranks add to nodes of this one
    total.scatter_reverse(la.InsertMode.add)
    total.scatter_forward()
    return sums


def collapsed(space: fem.FunctionSpace, part: int) -> tuple[fem.FunctionSpace, Any]:
    """A part of a space as a space of its own, and where its unknowns are in the whole.

    Args:
        space: The whole.
        part: Number of the part.
    """
    layouts, key = _LAYOUTS.setdefault(space.mesh, {}), (space.ufl_element(), part)
    if key not in layouts:
        layouts[key] = Layout.of_part(space, part)
    layout, places = layouts[key]
    return layout.on(space.mesh), places
