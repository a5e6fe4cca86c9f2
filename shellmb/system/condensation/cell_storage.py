"""Data of cells kept for solutions, several side by side, as `passes.c` reads them."""

from typing import Any

import numpy as np

from shellmb.arrays import Int32s, Ints
from shellmb.native.compiling.flags import LANES
from shellmb.native.library import CArrays, side_by_side, whole_lines


def groups_of(cells: int) -> int:
    """Number of groups of cells side by side."""
    return -(-cells // LANES)


def places_of_groups(numbers: Int32s) -> Int32s:
    """Places of the numbers of cells, shape (groups, n, LANES), -1 where a cell is missing.

    Args:
        numbers: Of each cell, shape (cells, n).
    """
    missing = -len(numbers) % LANES
    return side_by_side(np.pad(numbers, ((0, missing), (0, 0)), constant_values=-1), LANES)


def place_for(size: int, pointer: CArrays) -> Any:
    """Place for numbers that are kept, for C.

    Args:
        size: How many.
        pointer: Makes pointers.
    """
    return pointer(whole_lines(max(1, size), np.float64))


def inner_kept(rows: Int32s, columns: Int32s, outer: Ints, own: Ints, pointer: CArrays) -> Any:
    """Eliminated unknowns of each cell after the projection, for C.

    Args:
        rows: Places of a cell's rows in what the rank sees, those that no other cell shares behind
            the others and -1 behind these, shape (cells, rows).
        columns: The same of columns.
        outer: Numbers of those that others share, of rows and columns, shape (2, cells).
        own: Number of those that they do not, shape (cells,).
        pointer: Makes pointers.
    """
    p, groups = pointer, groups_of(len(own))
    sizes = np.zeros((3, groups * LANES), dtype=np.int64)
    sizes[:, : len(own)] = *outer, own
    most = sizes.reshape(3, groups, LANES).max(axis=2)
    widths = np.ascontiguousarray(most.T)
    numbers = [
        _of_groups(table, count, own, width)
        for table, count, width in zip(
            (rows, columns), outer, (most[[0, 2]], most[[1, 2]]), strict=True
        )
    ]
    kept = most[2] * most.sum(axis=0)
    members = {
        "groups": groups,
        **dict(zip(("most_rows", "most_columns", "most"), widths.max(axis=0), strict=True)),
        "widths": p(widths.astype(np.int32)),
        "place": p(_begins(kept)),
        "row_numbers": p(numbers[0]),
        "row_place": p(_begins((most[0] + most[2]) * LANES)),
        "column_numbers": p(numbers[1]),
        "column_place": p(_begins((most[1] + most[2]) * LANES)),
        "kept": place_for(int(kept.sum()) * LANES, p),
    }
    return p.many("Inner", [members])


def _begins(sizes: Ints) -> Ints:
    """Find where pieces begin that follow one another."""
    return np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(np.int64)


def _of_groups(table: Int32s, outer: Ints, own: Ints, widths: Ints) -> Int32s:
    """Numbers of all groups, in each those of others and then own ones, as many as any cell has."""
    found = []
    for group, (others, mine) in enumerate(widths.T.tolist()):
        made = np.full((others + mine, LANES), -1, dtype=np.int32)
        cells = range(group * LANES, min((group + 1) * LANES, len(table)))
        for lane, cell in enumerate(cells):
            a, b = int(outer[cell]), int(own[cell])
            made[:a, lane] = table[cell, :a]
            made[others : others + b, lane] = table[cell, a : a + b]
        found.append(made.ravel())
    return np.concatenate(found)
