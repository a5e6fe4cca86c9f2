"""Groups of a cell's unknowns that are eliminated together, and their data as C reads them.

Of a shell with a linear section, say, membrane forces see displacements only and shear forces do
not see membrane forces, and own strains see forces only: eliminating them one after the other takes
a third of the work and two thirds of the memory of eliminating them at once.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from shellmb.arrays import Bools, Floats, Int32s, Ints
from shellmb.native.compiling.flags import LANES
from shellmb.native.library import CArrays, side_by_side, whole_lines
from shellmb.system.assembly.loops import FormLoop, MeshCells, PlacedForm

# condition beyond which a matrix whose diagonal is one has no inverse: of strains of a thin shell's
# section it is below 1e3
SINGULAR = 1e10

# cells at a time when the pattern is looked for: their matrices are kept meanwhile
CHUNK = 64


@dataclass(frozen=True)
class EliminationBlocks:
    """Element-wise unknowns of a cell in the order of their elimination.

    Args:
        order: Place of each unknown of a cell in the order before.
        widths: Number of unknowns of each chunk; chunks are the last unknowns of a cell.
        pattern: Which entries of a cell's matrix are not always zero, in the new order.
    """

    order: Ints
    widths: list[int]
    pattern: Bools


def find_blocks(cells: MeshCells, jacobian: list[PlacedForm]) -> EliminationBlocks:
    """Groups of unknowns of the cells of one mesh, at a state in general position.

    Args:
        cells: The cells.
        jacobian: Compiled bilinear forms as `FormLoop` takes them.
    """
    (matrix, pattern), n, fields = _matrix(cells, jacobian), cells.size, len(cells.places)
    chunks: list[Ints] = []
    for first, width in zip(cells.starts[fields:], cells.widths[fields:], strict=True):
        here = np.arange(first, first + width)
        others = np.setdiff1d(np.arange(n), here)
        block = pattern[np.ix_(here, here)]
        # those that see the same of the others are eliminated at once: fewer, larger products;
        # those without pivots, forces that tie strains, behind those that give them some; of an
        # energy that leaves out a strain they do not, and all are eliminated at once
        alike: tuple[dict[bytes, list[Ints]], ...] = {}, {}
        for part in _connected(block):
            every = here[part]
            pivots = pattern[every, every]
            pivots &= _is_regular(matrix[np.ix_(every[pivots], every[pivots])])
            for some, own in zip(alike, (every[pivots], every[~pivots]), strict=True):
                seen = pattern[np.ix_(own, others)].any(axis=0)
                seen |= pattern[np.ix_(others, own)].any(axis=1)
                if len(own):
                    some.setdefault(seen.tobytes(), []).append(own)
        groups = [own for some in alike for own in some.values()]
        chunks += [np.sort(np.concatenate(own)) for own in groups]
    shared = np.arange(cells.shared)
    if chunks:
        seen = np.stack([pattern[c].any(axis=0) | pattern[:, c].any(axis=1) for c in chunks])
        # what many chunks see comes first, so that what each of them sees is in one piece
        keys = [*seen[:, shared], seen[:, shared].sum(axis=0)]
        shared = np.lexsort([shared, *(-key.astype(int) for key in keys)])
    order = np.concatenate([shared, *chunks]).astype(np.int64)
    return EliminationBlocks(order, [len(c) for c in chunks], pattern[np.ix_(order, order)])


def _connected(block: Bools) -> list[Bools]:
    """Mark each connected part of a block's unknowns; SciPy's function loads too much."""
    parts: list[Bools] = []
    both, left = block | block.T, np.ones(len(block), dtype=bool)
    while left.any():
        part = np.zeros(len(block), dtype=bool)
        part[np.argmax(left)] = True
        while not np.array_equal(grown := part | both[part].any(axis=0), part):
            part = grown
        parts.append(part)
        left &= ~part
    return parts


def _is_regular(A: Floats) -> bool:
    """Decide whether a matrix without zeros on its diagonal has an inverse beyond round-off."""
    size = np.sqrt(np.abs(np.diag(A)))
    return not len(A) or bool(np.linalg.cond(A / np.outer(size, size)) < SINGULAR)


def _matrix(cells: MeshCells, jacobian: list[PlacedForm]) -> tuple[Floats, Bools]:
    """The matrix of one cell, and which entries are not zero in that of some cell."""
    loop = FormLoop(cells, jacobian)
    loop.bind(cells)
    one = largest = np.zeros((cells.size, cells.size))
    for _, found in loop.matrices(cells):
        one, largest = found[0].copy(), np.fmax(largest, np.fmax.reduce(np.abs(found)))
    return one, largest != 0.0


def elimination(chunks: EliminationBlocks, pointer: CArrays) -> tuple[dict[str, Any], int]:
    """The chunks as C wants them.

    Args:
        chunks: The chunks.
        pointer: Makes pointers.

    Returns:
        Members of `Cells`, and how many numbers are kept of a cell.
    """
    full, n = chunks.pattern.copy(), len(chunks.order)
    starts = n - sum(chunks.widths) + np.cumsum([0, *chunks.widths])
    inverses, blocks, size, block_size = [], [], 0, 0
    runs: dict[str, list[tuple[int, int, int]]] = {"right": [], "left": []}
    ends: dict[str, list[int]] = {"right": [0], "left": [0]}
    for first, width in zip(starts, chunks.widths, strict=False):
        here = slice(first, first + width)
        behind = np.arange(n) >= first + width
        behind[: starts[0]] = True
        inverses.append(size)
        size += width**2
        blocks.append(block_size)
        block_size += width**2
        seen = {
            "right": full[here].any(axis=0) & behind,
            "left": full[:, here].any(axis=1) & behind,
        }
        for side, mask in seen.items():
            for begin, count in _runs(mask):
                runs[side].append((begin, count, size))
                size += width * count
            ends[side].append(len(runs[side]))
        full[np.ix_(seen["left"], seen["right"])] = True
    members: dict[str, Any] = {"chunks": len(chunks.widths), "block_size": block_size}
    tables: dict[str, Iterable[int]] = {
        "chunk_start": starts.tolist(),
        "chunk_width": chunks.widths,
        "inverse_place": inverses,
        "block_place": blocks,
    }
    members |= _pointers(pointer, tables)
    for side in runs:
        begins, counts, places = zip(*runs[side] or [(0, 0, 0)], strict=True)
        tables = {"first": ends[side], "start": begins, "width": counts, "place": places}
        members[side] = _pointers(pointer, tables)
    return members, size


def _pointers(pointer: CArrays, tables: dict[str, Iterable[int]]) -> dict[str, Any]:
    return {name: pointer(np.array([*t, 0], dtype=np.int32)) for name, t in tables.items()}


def _runs(mask: Bools) -> list[tuple[int, int]]:
    """Begin and length of each piece of a mask that is true."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(int), [0]])))
    return [(int(a), int(b - a)) for a, b in edges.reshape(-1, 2)]


class Lists:
    """Entries of the matrices of cells that are not always zero; cells may have the same.

    Attributes:
        of_cell: Number of the list of each cell so far.
        entries: The lists.
    """

    def __init__(self) -> None:
        self.of_cell: list[int] = []
        self.entries: list[Int32s] = []
        self._known: dict[bytes, int] = {}

    def add(self, found: Bools) -> None:
        """Add cells.

        Args:
            found: Whether each entry of each cell is one, shape (cells, n).
        """
        for row in found:
            number = self._known.setdefault(np.packbits(row).tobytes(), len(self.entries))
            if number == len(self.entries):
                self.entries.append(np.flatnonzero(row).astype(np.int32))
            self.of_cell.append(number)

    def of(self, first: int, last: int) -> list[Int32s]:
        """Lists of some cells, one after the other."""
        return [self.entries[k] for k in self.of_cell[first:last]]


def find_runs(lists: Lists, places: Int32s, first: Bools) -> tuple[Int32s, Int32s]:
    """Entries that follow one another both in a cell's matrix and in the whole one.

    One number for many entries takes less memory than one for each, and a loop over neighbours
    less time. Nor does the whole matrix have to be set to zero before entries are added: what is
    the first to come to its place is put there.

    Args:
        lists: Entries of all cells.
        places: Place of each in the whole matrix.
        first: Whether it is the first that comes there.

    Returns:
        Runs (place in the cell's matrix, place in the whole one, length), shape (r, 3): of each
        cell those that are first, then the others. And where each of these two begins, and the
        last one ends, shape (2 cells + 1,).
    """
    runs, counts, begin = [np.zeros((0, 3), dtype=np.int32)], [np.zeros(1, dtype=np.int64)], 0
    for cell in range(0, len(lists.of_cell), CHUNK):
        entries = lists.of(cell, cell + CHUNK)
        sizes = [len(e) for e in entries]
        end = begin + sum(sizes)
        group = 2 * np.repeat(np.arange(len(entries)), sizes) + ~first[begin:end]
        order = np.argsort(group, kind="stable")
        found = np.stack([np.concatenate(entries), places[begin:end], group], axis=1)[order]
        new = np.ones(len(found), dtype=bool)
        new[1:] = np.any(np.diff(found, axis=0) != (1, 1, 0), axis=1)
        starts = np.flatnonzero(new)
        lengths = np.diff(starts, append=len(found))
        runs.append(np.column_stack([found[starts, :2], lengths]).astype(np.int32))
        counts.append(np.bincount(found[starts, 2], minlength=2 * len(entries)))
        begin = end
    offsets = np.cumsum(np.concatenate(counts))
    return np.ascontiguousarray(np.concatenate(runs)), offsets.astype(np.int32)


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
