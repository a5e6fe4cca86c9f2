"""Reduction of what is assembled over one mesh: the loops of `cells.c` with what they need."""

from __future__ import annotations

from copy import copy
from typing import Any

import numpy as np

from shellmb.arrays import Bools, Floats, Int32s, Ints
from shellmb.native import library as native
from shellmb.native.compiling.flags import LANES
from shellmb.native.library import CArrays
from shellmb.system.assembly.loops import FormLoop, MeshCells, PlacedForm
from shellmb.system.condensation.elimination import (
    CHUNK,
    Lists,
    elimination,
    find_blocks,
    find_runs,
    groups_of,
    inner_kept,
    place_for,
    places_of_groups,
)
from shellmb.system.nullspace.numbers import ReducedNumbers
from shellmb.system.nullspace.prolongation import RowMap

# added to what is to be behind all else
LAST = 1 << 40


class MeshReduction:
    """Reduction of what is assembled over one mesh.

    It is made at a state in general position, at which no entry is zero by chance, and no share of
    an unknown in a reduced one.

    Args:
        cells: Its cells.
        jacobian: Compiled bilinear forms as `FormLoop` takes them.
        numbers: Numbers of the reduced unknowns, updated at that state.

    Attributes:
        part: For C, what solutions with the reduced matrix need, once entries have their places.
    """

    def __init__(
        self, cells: MeshCells, jacobian: list[PlacedForm], numbers: ReducedNumbers
    ) -> None:
        self.chunks = find_blocks(cells, jacobian)
        self.cells, self.numbers = cells.arranged(self.chunks.order), numbers
        cells = self.cells
        self.loop = FormLoop(cells, jacobian)
        self.lib, self.pointer = native.cells().lib, self.loop.pointer
        shared = cells.dofs[:, : cells.shared]
        right, columns = positions(_keys(numbers.right, shared, numbers.inner_columns))
        left, rows = positions(_keys(numbers.left, shared, numbers.inner_rows))
        forces, seen = positions(_keys(numbers.forces, shared))
        self._multipliers, p = seen.shape[1], self.pointer
        self.row_numbers, self.column_numbers = _numbers(rows), _numbers(columns)
        self._multiplier_rows = p(places_of_groups(_numbers(seen)))
        combined = {
            "left": (left, rows, numbers.left),
            "right": (right, columns, numbers.right),
            "multiplier": (forces, seen, numbers.forces),
        }
        self._projection: dict[str, Any] = {
            name: _terms(places, of.shape[1], table.values, shared, p)
            for name, (places, of, table) in combined.items()
        }
        # what is eliminated of each cell after the projection, for C
        self.inner: Any = None
        if np.any(rows >= LAST):
            self._keep_inner(rows, columns)

    def _keep_inner(self, rows: Ints, columns: Ints) -> None:
        """Place for what is eliminated of each cell after the projection."""
        p, sizes = self.pointer, np.sum(rows >= LAST, axis=1)
        outer = np.array([np.sum((a >= 0) & (a < LAST), axis=1) for a in (rows, columns)])
        self.inner = inner_kept(self.row_numbers, self.column_numbers, outer, sizes, p)
        self._projection |= {
            "inner_size": p(sizes.astype(np.int32)),
            "outer_rows": p(outer[0].astype(np.int32)),
            "outer_columns": p(outer[1].astype(np.int32)),
            "inner": self.inner,
        }

    def find_pattern(self) -> tuple[Int32s, Int32s]:
        """Entries that are not always zero, at a state in general position.

        Returns:
            Their rows and columns, in the order in which assemblies give their values.
        """
        self._layout()
        width = self.column_numbers.shape[1]
        size = self.row_numbers.shape[1] * width
        # of some cells after the other all entries
        p, count = CArrays(), self.cells.count
        runs = np.array([(0, cell % CHUNK * size, size) for cell in range(count)], dtype=np.int32)
        ends = np.repeat(np.arange(count + 1, dtype=np.int32), 2)[1:].copy()
        every = {"runs": p(runs.reshape(-1, 3)), "run_offsets": p(ends)}
        projection = p.many("Projection", [self._projection | every])
        loop, doubles, blocks = self.loop, native.doubles, native.doubles(self._blocks)
        # short integers, and one list for cells that have the same entries: of 64x64 elements there
        # are 26 million entries in ED
        none = np.zeros(0, dtype=np.int32)
        rows, columns, lists = [none], [none], Lists()
        row_of = self.numbers.matrix_rows.astype(np.int32)
        column_of = self.numbers.matrix_columns.astype(np.int32)
        for first in range(0, self.cells.count, CHUNK):
            last = min(first + CHUNK, self.cells.count)
            values = np.empty((last - first) * size)
            where = projection, first, last, blocks, doubles(values), doubles(None), doubles(None)
            check(self.lib.jacobian(self.struct, loop.kernels, loop.count, *where))
            found = (values != 0.0).reshape(last - first, size)
            cell, entry = np.nonzero(found)
            lists.add(found)
            rows.append(row_of[self.row_numbers[first + cell, entry // width]])
            columns.append(column_of[self.column_numbers[first + cell, entry % width]])
        self._emitted = lists
        return np.concatenate(rows), np.concatenate(columns)

    def add_at(self, places: Int32s, first: Bools) -> None:
        """From now on assemblies add its entries up.

        Args:
            places: Place of each among the values.
            first: Whether it is the first that comes to that place in an assembly.
        """
        runs, offsets = find_runs(self._emitted, places, first)
        self._projection |= {"runs": self.pointer(runs), "run_offsets": self.pointer(offsets)}
        del self._emitted
        self._projection["kept"] = self._kept
        self.projection = self.pointer.many("Projection", [self._projection])
        self._members = {
            "cells": self.struct,
            "projection": self.projection,
            "dofs": self.pointer(places_of_groups(self.cells.dofs)),
            "multiplier_rows": self._multiplier_rows,
        }
        self._take_part()

    def _layout(self) -> None:
        """Find where what is kept of a cell is."""
        cells = self.cells
        members, size = elimination(self.chunks, self.pointer)
        members |= {"multiplier_place": size, "kept_size": size + self._multipliers * cells.shared}
        self.struct = cells.struct(self.loop, **members)
        self._blocks = np.full(max(1, members["block_size"] * cells.count), np.nan)
        width = groups_of(cells.count) * LANES
        self._kept = place_for(members["kept_size"] * width, self.pointer)
        self._eliminated_size = (cells.size - cells.shared) * width

    def jacobian(self, values: Floats) -> dict[str, Any]:
        """Members for C, which puts entries of the reduced matrix into `values`."""
        loop = self.loop
        return {
            **dict(zip(("pieces", "from", "sizes", "to"), loop.pieces, strict=True)),
            "cells": self.struct,
            "kernels": loop.kernels,
            "count": loop.count,
            "projection": self.projection,
            "blocks": self.pointer(self._blocks),
            "values": self.pointer(values),
        }

    def beside(self) -> MeshReduction:
        """Make one for a solution beside others: what it keeps between passes is its own."""
        found = copy(self)
        found._take_part()
        return found

    def _take_part(self) -> None:
        eliminated = place_for(self._eliminated_size, self.pointer)
        self.part = self.pointer.many("Part", [{**self._members, "eliminated": eliminated}])

    def reduce(self, b: Floats, change: Floats, transposed: bool = False) -> None:
        """Add to `change` what the element-wise equations of `b` do to the others.

        Args:
            b: Right-hand side.
            change: What is added to.
            transposed: Whether it is of the transposed system, as below.
        """
        self.lib.reduce(self.part, transposed, *map(native.doubles, (b, change)))

    def reduce_inner(self, r: Floats, change: Floats, transposed: bool = False) -> None:
        """Reduce what cells do not share after the projection: `r` gets parts of it."""
        if self.inner:
            self.lib.reduce_inner(self.part, transposed, *map(native.doubles, (r, change)))

    def expand_inner(self, r: Floats, x: Floats, transposed: bool = False) -> None:
        """Fill in what cells do not share, from `r` of `reduce_inner`."""
        if self.inner:
            self.lib.expand_inner(self.part, transposed, *map(native.doubles, (r, x)))

    def expand(self, x: Floats, rows: Floats | None) -> None:
        """Fill in the element-wise unknowns of `x`; add the multipliers' rows times `x`.

        Args:
            x: The other unknowns.
            rows: What is added to; None: the system is transposed, which has none of these.
        """
        self.lib.expand(self.part, rows is None, *map(native.doubles, (x, rows)))


class SingularCell(Exception):
    """The element-wise unknowns of a cell cannot be eliminated."""


def check(failed: int) -> None:
    """Raise an error if C failed to eliminate unknowns of a cell.

    Args:
        failed: What C returns: one more than the number of the cell, or zero.

    Raises:
        SingularCell: If it failed.
    """
    if failed:
        raise SingularCell(f"element-wise unknowns of cell {failed - 1} are undetermined")


def positions(keys: Ints) -> tuple[Int32s, Ints]:
    """Places of keys among those of their cell, sorted.

    Args:
        keys: Of every unknown of every cell, -1 where there is none, shape (cells, n, width).

    Returns:
        Places, shape of `keys`, and the keys of each cell, -1 behind its last.
    """
    cells = len(keys)
    flat = keys.reshape(cells, keys.shape[1] * keys.shape[2])
    order = np.argsort(flat, axis=1, kind="stable")
    ordered = np.take_along_axis(flat, order, 1)
    before = np.concatenate([np.full((cells, 1), -1), ordered[:, :-1]], axis=1)
    new = (ordered >= 0) & (ordered != before)
    rank = np.cumsum(new, axis=1) - 1
    places = np.empty_like(rank)
    np.put_along_axis(places, order, rank, 1)
    places[flat < 0] = -1
    lists = np.full((cells, int(new.sum(axis=1).max(initial=0))), -1)
    cell, entry = np.nonzero(new)
    lists[cell, rank[cell, entry]] = ordered[cell, entry]
    return places.reshape(keys.shape).astype(np.int32), lists


def _keys(rows: RowMap, shared: Int32s, inner: Bools | None = None) -> Ints:
    """Keys of what a cell's unknowns depend on here; what it shares with no rank is last."""
    places = rows.places[shared]
    keys = np.where(places < rows.there, places, -1)
    if inner is not None:
        keys = keys + LAST * np.append(inner, False)[places]
    return np.asarray(keys)


def _terms(
    places: Int32s, rows: int, values: Floats, shared: Int32s, pointer: CArrays
) -> dict[str, Any]:
    """Combinations of each cell's unknowns for C, without what is always zero.

    Args:
        places: Rows that each unknown of each cell is in, -1: none, shape (cells, n, width).
        rows: Number of rows of a cell.
        values: Coefficients of the local dofs in general position, shape (local dofs, width).
        shared: Local dofs of each cell, shape (cells, n).
        pointer: Makes pointers.
    """
    cell, own, k = np.nonzero((places >= 0) & (values[shared] != 0.0))
    row = cell * rows + places[cell, own, k]
    # stable: the order of the unknowns stays
    order = np.argsort(row, kind="stable")
    begin = np.cumsum(np.bincount(row + 1, minlength=len(shared) * rows + 1))
    at = shared[cell, own].astype(np.int64) * values.shape[1] + k
    lists = {"begin": begin, "from": own[order], "at": at[order]}
    return {
        "rows": rows,
        "most": int(np.bincount(cell).max(initial=0)),
        "values": pointer(values),
        **{name: pointer(np.append(one, 0).astype(np.int32)) for name, one in lists.items()},
    }


def _numbers(keys: Ints) -> Int32s:
    return np.where(keys >= 0, keys % LAST, -1).astype(np.int32)
