"""Groups of a cell's unknowns that are eliminated together, with their couplings.

Of a shell with a linear section, say, membrane forces see displacements only and shear forces do
not see membrane forces, and own strains see forces only: eliminating them one after the other takes
a third of the work and two thirds of the memory of eliminating them at once.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from shellmb.arrays import Bools, Floats, Ints
from shellmb.native.library import CArrays
from shellmb.system.assembly.loops import FormLoop, MeshCells, PlacedForm

# condition beyond which a matrix whose diagonal is one has no inverse: of strains of a thin shell's
# section it is below 1e3
SINGULAR = 1e10


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
