"""Factors of small matrices whose entries are near the diagonal once unknowns are reordered.

Mechanisms are chains and loops of few bodies: in a suitable order of their unknowns all entries are
in a narrow band, which is factorised with partial pivoting. Multipliers of joints have zeros on the
diagonal, so that factors without pivots do not exist.
"""

from typing import Any

from petsc4py import PETSc

import numpy as np

from shellmb.arrays import Floats, Int32s, Ints
from shellmb.native import library as native
from shellmb.native.compiling.flags import LANES

# multiplications beyond which other factors take less time: of a matrix, and of each unknown of a
# matrix of any size. Chains of 100 and 200 links in EP4 have 4186, and their steps take 0.92 and
# 0.94 times as long as with MUMPS.
OPERATIONS, EACH = 4e6, 5e3
# multiplications of each unknown up to which a band is narrow: rows of a few vectors each. Number
# of moves of all unknowns in the search for such a band
NARROW, SWEEPS = 1e3, 50
# a search takes off half of the multiplications at most: from so many times too many it is vain
VAIN = 4


class BandedFactors:
    """Factors of one matrix in one process, made anew as often as its values change.

    Args:
        A: The matrix.
        values: Its entries, which it works with.

    Attributes:
        pays: Whether these factors take less time than others.
    """

    def __init__(self, A: PETSc.Mat, values: Floats) -> None:
        starts, columns, _ = A.getValuesCSR()
        size = len(starts) - 1
        rows = np.repeat(np.arange(size, dtype=np.int32), np.diff(starts))
        first = np.empty(size, dtype=np.int32)
        first[A.getOrdering(PETSc.Mat.OrderingType.RCM)[0].getIndices()] = np.arange(size)
        each, order = narrowed(first, rows, columns)
        i, j = order[rows].astype(np.int64), order[columns].astype(np.int64)
        below, above = _reach(i, j)
        self.pays = size * each <= OPERATIONS or each <= EACH
        if not self.pays:
            return
        self._lib, pointer = native.cells().lib, native.CArrays()
        # with room for zeros that make whole vectors of a row or a column
        width, height = 2 * below + above + 1 + LANES, below + LANES
        place = below + j - i + i * width
        members: dict[str, Any] = {
            "size": size,
            "below": below,
            "above": above,
            "entries": len(values),
            "width": width,
            "height": height,
            "row": pointer(rows),
            "column": pointer(columns.astype(np.int32)),
            "place": pointer(place.astype(np.int32)),
            "order": pointer(order),
            "factors": pointer(np.zeros(size * width)),
            "lower": pointer(np.zeros(size * height)),
            **{n: pointer(np.zeros(size, dtype=np.int32)) for n in ("pivots", "counts")},
            "work": pointer(np.zeros(size + width)),
            **{n: pointer(np.zeros(size)) for n in ("row_scale", "column_scale")},
        }
        self._kept, self.struct = (pointer, values), pointer.many("Band", [members])
        self._values = native.doubles(values)

    def factorise(self) -> bool:
        """Factorise the matrix as it is; whether it has factors."""
        return self._lib.band_factorise(self.struct, self._values) == 0

    def solve(self, b: PETSc.Vec, x: PETSc.Vec, transposed: bool = False) -> None:
        """Solve with the last factors, of the matrix or its transpose."""
        vectors = native.doubles(b.array_r), native.doubles(x.array)
        self._lib.band_solve(self.struct, transposed, *vectors)


def narrowed(order: Int32s, rows: Int32s, columns: Int32s) -> tuple[int, Int32s]:
    """Find an order of unknowns with fewer multiplications than a given one.

    Each unknown moves to the middle of what it is coupled with, again and again. The best order on
    the way counts: chains by reverse Cuthill-McKee have two bodies and two joints in their band,
    and a joint less by this.

    Args:
        order: Place of each unknown.
        rows: Row of each entry.
        columns: Its column.

    Returns:
        Multiplications for each unknown, and the places.
    """
    best = _multiplications(order, rows, columns), order
    size = len(order)
    vain = best[0] > VAIN * max(EACH, OPERATIONS / size)
    for _ in range(SWEEPS if best[0] > NARROW and not vain else 0):
        low, high = order.copy(), order.copy()
        for a, b in ((rows, columns), (columns, rows)):
            np.minimum.at(low, a, order[b])
            np.maximum.at(high, a, order[b])
        moved = np.empty(size, dtype=np.int32)
        # where two are alike the one that was first stays so
        moved[np.lexsort((order, low + high))] = np.arange(size)
        if np.array_equal(moved, order):
            break
        order = moved
        found = _multiplications(order, rows, columns)
        if found < best[0]:
            best = found, order
    return best


def _reach(i: Ints, j: Ints) -> tuple[int, int]:
    """Diagonals below and above the main one that entries are on."""
    return int(np.max(i - j, initial=0)), int(np.max(j - i, initial=0))


def _multiplications(order: Int32s, rows: Int32s, columns: Int32s) -> int:
    """Multiplications for each unknown in an order."""
    below, above = _reach(order[rows].astype(np.int64), order[columns].astype(np.int64))
    return (below + 1) * (below + above + 1)
