"""Compiled forms and the cells of a mesh as arguments of the loops in `cells.c`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from copy import copy
from typing import Any

import numpy as np
import numpy.typing as npt
from dolfinx import cpp, fem  # type: ignore[attr-defined]
from dolfinx.fem import IntegralType

from shellmb.arrays import Bools, Floats, Int32s, Ints
from shellmb.native import library as native
from shellmb.native.compiling.flags import LANES
from shellmb.native.library import CArrays, cell_dofs, side_by_side
from shellmb.system.assembly.fields import Field

# a compiled form with the numbers of its row fields and of its column field, see `FormLoop`
PlacedForm = tuple[fem.Form, tuple[int, ...], int]
# cells at most whose programs keep what seldom changes
MOST_KEPT = 2048
# cells whose matrices are looked at together, a multiple of all lanes
SOME = 64
# the cells of a mesh, and linear forms over them
type Rows = tuple[MeshCells, list[PlacedForm]]


class MeshGeometry:
    """The cells of one mesh.

    Args:
        domain: The mesh, of Python or C++.

    Attributes:
        count: Number of cells that this rank owns.
        places: Of each field, place of its dofs among the unknowns of a cell.
    """

    def __init__(self, domain: Any) -> None:
        self.count = int(domain.topology.index_map(domain.topology.dim).size_local)
        geometry = domain.geometry
        self.geometry = np.ascontiguousarray(geometry.x[geometry.dofmaps[0][: self.count]])
        self._beside: dict[int, Floats] = {}
        self.places: list[Int32s] = []

    @contextmanager
    def of_size_one(self) -> Iterator[None]:
        """For a moment, the mesh is as large as numbers in general position are.

        Of other sizes, ones beside gradients may vanish in round-off, and with them entries.
        """
        kept = self.geometry.copy()
        self.geometry /= float(np.ptp(kept.reshape(-1, 3), axis=0).max()) if kept.size else 1.0
        self._place()
        try:
            yield
        finally:
            self.geometry[...] = kept
            self._place()

    def _place(self) -> None:
        for lanes, beside in self._beside.items():
            beside[...] = side_by_side(self.geometry, lanes)

    def _of_lanes(self, lanes: int) -> Floats:
        if lanes not in self._beside:
            self._beside[lanes] = side_by_side(self.geometry, lanes)
        return self._beside[lanes]

    def struct(self, loop: FormLoop, **more: Any) -> Any:
        """These cells for C, with `more` members."""
        common = {
            "cells": self.count,
            "geometry": loop.pointer(self.geometry),
            "geometry_size": int(np.prod(self.geometry.shape[1:])),
            "coefficient_size": loop.coefficient_size,
            "lanes": loop.lanes,
            "covered": loop.covered,
            "geometry_of_lanes": loop.pointer(self._of_lanes(loop.lanes)),
        }
        return loop.pointer.many("Cells", [{**common, **more}])


class MeshCells(MeshGeometry):
    """The cells of one mesh with the fields on it.

    The unknowns of a cell are of all fields those that cells share, then those that are
    element-wise.

    Args:
        fields: Fields on this mesh.
        offsets: First place of each in the concatenated local arrays.
        held: Which of their local dofs have given values.

    Attributes:
        dofs: Place of each unknown in the concatenated local arrays, shape (cells, size).
        shared: Number of unknowns that are not element-wise.
        starts: First one of each field's shared and of each field's element-wise unknowns,
            shape (2 fields,).
        widths: Their numbers.
    """

    def __init__(
        self, fields: Sequence[Field], offsets: Sequence[int], held: Sequence[npt.NDArray[np.int8]]
    ) -> None:
        super().__init__(fields[0].function.function_space.mesh)
        tables = [cell_dofs(f.function.function_space)[: self.count] for f in fields]
        # the element is the same in all cells: where its element-wise dofs are, too
        local = [self._elementwise(*args) for args in zip(fields, tables, held, strict=True)]
        self.widths = np.array([np.sum(~e) for e in local] + [np.sum(e) for e in local], np.int32)
        starts = np.concatenate([[0], np.cumsum(self.widths)]).astype(np.int32)
        self.starts = starts[:-1].copy()
        self.size, self.shared = int(starts[-1]), int(starts[len(fields)])
        self.dofs = np.zeros((self.count, self.size), dtype=np.int32)
        for k, (table, inner) in enumerate(zip(tables, local, strict=True)):
            place = np.empty(len(inner), dtype=np.int32)
            place[~inner] = starts[k] + np.arange(np.sum(~inner))
            place[inner] = starts[len(fields) + k] + np.arange(np.sum(inner))
            self.places.append(place)
            self.dofs[:, place] = table + offsets[k]

    def arranged(self, order: Ints) -> MeshCells:
        """Make cells with their unknowns in another order.

        Args:
            order: Place of each unknown in the order of these.
        """
        place = np.empty(self.size, dtype=np.int32)
        place[order] = np.arange(self.size)
        found = copy(self)
        found.dofs = np.ascontiguousarray(self.dofs[:, order])
        found.places = [place[own] for own in self.places]
        return found

    def struct(self, loop: FormLoop, **more: Any) -> Any:
        """These cells for C, with `more` members."""
        own = {"size": self.size, "shared": self.shared, "dofs": loop.pointer(self.dofs)}
        return super().struct(loop, **own, **more)

    def _elementwise(self, field: Field, table: Int32s, held: npt.NDArray[np.int8]) -> Bools:
        inner = np.zeros(len(held), dtype=bool)
        inner[field.elementwise] = True
        # what is held has no equations to be eliminated with
        inner &= held == 0
        if not len(table):
            return np.zeros(table.shape[1], dtype=bool)
        return np.asarray(inner[table].all(axis=0))


class FormLoop:
    """Compiled forms over the cells of one mesh, as C wants them.

    Args:
        cells: The cells.
        forms: Forms with the numbers of the fields whose rows they have, and of a bilinear form its
            column field (-1 of another form), among the fields of the mesh. A scalar form has one
            row.

    Attributes:
        count: Number of kernels.
        lanes: How many cells are taken at once.
        pieces: Number of constants, where their values are, their sizes, and where they go, for C.
        mesh: The cells, the kernels and their number, as C takes them, once they are bound.
    """

    mesh: tuple[Any, Any, int]

    def __init__(self, cells: MeshGeometry, forms: Sequence[PlacedForm]) -> None:
        self._forms, self.pointer = [form for form, _, _ in forms], CArrays()
        self.coefficient_size = 1
        self._constants: list[tuple[Any, Floats]] = []
        found = [self._kernels(cells, *form) for form in forms]
        self._lib, self.pieces = native.cells().lib, constant_pieces([self], self.pointer)
        kernels, self.covered = _ordered(found, [form[1:] for form in forms], cells.places)
        self.count = len(kernels)
        self.lanes = max((kernel["lanes"] for kernel in kernels), default=1)
        self.kernels = self.pointer.many("Kernel", kernels)

    def _kernels(
        self, cells: MeshGeometry, form: fem.Form, row: tuple[int, ...], column: int
    ) -> list[Any]:
        bare, ufcx, pointer = form._cpp_object, form.ufcx_form, self.pointer
        values, tables = [], []
        for function in bare.coefficients:
            space = function.function_space
            assert not space.element.needs_dof_transformations
            tables.append(cell_dofs(space)[: cells.count])
            values.append(pointer(function.x.array))
        size = sum(table.shape[1] for table in tables)
        self.coefficient_size = max(self.coefficient_size, size)
        constants = np.asarray(cpp.fem.pack_constants(bare))
        self._constants.append((bare, constants))
        rows = np.concatenate([cells.places[k] for k in row])
        columns = np.zeros(1, dtype=np.int32) if column < 0 else cells.places[column]
        data = {
            "constants": pointer(constants),
            "rows": len(rows),
            "columns": len(columns),
            "row_place": pointer(rows),
            "column_place": pointer(None if column < 0 else columns),
            "coefficients": len(values),
            "values": pointer.many("double *", values),
        }
        found = []
        kinds = (IntegralType.cell, IntegralType.exterior_facet)
        offsets = ufcx.form_integral_offsets
        # these two kinds come first
        assert ufcx.form_integral_offsets[len(IntegralType.__members__)] == offsets[2]
        for kind, first, last in zip(kinds, offsets[0:2], offsets[1:3], strict=True):
            for n in range(first, last):
                entities = np.asarray(bare.domains(kind, n - first))
                where = _entities(entities, cells.count, facets=kind == kinds[1])
                function, lanes = self._function(ufcx.form_integrals[n], cells.count)
                groups = -(-cells.count // lanes) if where[1] is None else len(where[1])
                program = getattr(ufcx.form_integrals[n], "program", None)
                read = program.of_each(tables) if program else tables
                # programs that keep nothing find it again: of many cells it is a tenth of the time
                # to assemble matrices and residuals, and a sixth of the memory of a run
                kept = program.kept * lanes if program and cells.count <= MOST_KEPT else 0
                dofs = [pointer(side_by_side(table, lanes)) for table in read]
                sizes = [table.shape[1] for table in read]
                found.append(
                    {
                        **data,
                        "function": function,
                        "lanes": lanes,
                        "dofs": pointer.many("int *", dofs),
                        "sizes": pointer(np.array([*sizes, 0], dtype=np.int32)),
                        "entity_offsets": pointer(where[0]),
                        "entities": pointer(where[1]),
                        "store": pointer(
                            native.whole_lines(groups * kept, float) if kept else None
                        ),
                        "store_size": kept,
                    }
                )
        return found

    def _function(self, integral: Any, cells: int) -> tuple[Any, int]:
        """The function of an integral, and of how many cells it is: of several, if there are."""
        ffi, many = self.pointer.ffi, cells > 1 and integral.tabulate_tensor_float32
        function = many or integral.tabulate_tensor_float64
        return ffi.cast("void *", int(ffi.cast("uintptr_t", function))), LANES if many else 1

    def constants(self) -> Iterator[tuple[Any, int, Any]]:
        """Of each constant where its values are, their number, and where they go, for C."""
        for form, array in self._constants:
            place = 0
            for constant in form.constants:
                # a view of the constant's own numbers, which keeps it alive
                values = constant.value
                yield self.pointer(values), values.size, self.pointer(array[place:])
                place += values.size
            assert place == len(array)

    def bind(self, cells: MeshGeometry, **more: Any) -> None:
        """Prepare the arguments of calls.

        Args:
            cells: The cells.
            **more: Further members of these in C.
        """
        self.mesh = cells.struct(self, **more), self.kernels, self.count

    def refresh(self) -> None:
        """Take the values of the constants, after they changed."""
        self._lib.copy_pieces(*self.pieces)

    def matrices(self, cells: MeshCells) -> Iterator[tuple[slice, Floats]]:
        """Matrices of some cells after the other, with the numbers of these.

        Args:
            cells: All cells, which are bound.

        Yields:
            Numbers of some, and their matrices, which the next ones take the place of.
        """
        found = np.empty((min(SOME, cells.count), cells.size, cells.size))
        for first in range(0, cells.count, SOME):
            last = min(first + SOME, cells.count)
            self._lib.cell_matrices(*self.mesh, first, last, native.doubles(found))
            yield slice(first, last), found[: last - first]


def constant_pieces(loops: Iterable[FormLoop], pointer: CArrays) -> tuple[Any, ...]:
    """Number of the constants of some loops, where their values are, their sizes, where they go.

    Args:
        loops: The loops.
        pointer: Makes pointers.
    """
    found = [piece for loop in loops for piece in loop.constants()]
    sizes = pointer(np.array([size for _, size, _ in found] or [0], dtype=np.int32))
    start, end = (pointer.many("double *", [piece[k] for piece in found]) for k in (0, 2))
    return len(found), start, sizes, end


def _ordered(
    found: Sequence[Sequence[dict[str, Any]]],
    fields: Sequence[tuple[tuple[int, ...], int]],
    places: Sequence[Int32s],
) -> tuple[list[dict[str, Any]], bool]:
    """Kernels of several cells, which put their matrix where nothing was before, then all others.

    Args:
        found: Kernels of each form.
        fields: Its rows and column.
        places: Of each field, among the unknowns of a cell.

    Returns:
        The kernels; and whether what is put where nothing was before is a cell's whole matrix.
    """
    size = sum(map(len, places))
    there = np.zeros((size, size), dtype=bool)
    kernels = [(k, *field) for some, field in zip(found, fields, strict=True) for k in some]
    kernels.sort(key=lambda item: item[0]["lanes"] == 1)
    for kernel, rows, column in kernels:
        kernel["adds"] = True
        if column >= 0 and kernel["lanes"] > 1:
            block = np.ix_(np.concatenate([places[k] for k in rows]), places[column])
            kernel["adds"] = bool(there[block].any())
            there[block] |= not kernel["adds"]
    return [kernel for kernel, *_ in kernels], bool(there.all())


def _entities(entities: Int32s, count: int, facets: bool) -> tuple[Int32s | None, Int32s | None]:
    """Local facets of every cell as offsets and numbers; (None, None) for all cells themselves."""
    if not facets:
        assert np.array_equal(entities, np.arange(count))
        return None, None
    pairs = entities.reshape(-1, 2)
    pairs = pairs[np.argsort(pairs[:, 0], kind="stable")]
    offsets = np.searchsorted(pairs[:, 0], np.arange(count + 1)).astype(np.int32)
    return offsets, np.ascontiguousarray(pairs[:, 1], dtype=np.int32)


class LoopResiduals:
    """Linear forms in one pass over the cells of each mesh, those of residuals above all.

    Args:
        parts: The cells of each mesh with its forms.

    Attributes:
        loops: The loops over the cells of each mesh.
        struct: For C, all of them.
    """

    def __init__(self, parts: Iterable[Rows]) -> None:
        self._lib, self._pointer = native.cells().lib, CArrays()
        self.loops = []
        for own, forms in parts:
            if forms:
                self.loops.append(loop := FormLoop(own, forms))
                loop.bind(own)
        pointer = self._pointer
        cells, kernels, counts = ([loop.mesh[k] for loop in self.loops] for k in range(3))
        meshes = pointer.many("Cells *", cells), pointer.many("Kernel *", kernels)
        members = len(counts), *meshes, pointer(np.array(counts, dtype=np.int32))
        self.struct = pointer.many("Residuals", [members])
        self._pieces = constant_pieces(self.loops, pointer)

    def add(self, local: Floats) -> None:
        """Add them to the concatenated local arrays."""
        self._lib.residuals(self.struct, native.doubles(local))

    def refresh(self) -> None:
        """Take the values of all constants, after they changed."""
        self._lib.copy_pieces(*self._pieces)
