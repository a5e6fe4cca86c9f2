"""Factors of small matrices whose entries are near the diagonal once unknowns are reordered.

Mechanisms are chains and loops of few bodies: by the reverse Cuthill-McKee order of their unknowns
all entries are in a narrow band, which LAPACK factorises with partial pivoting. Multipliers of
joints have zeros on the diagonal, so that factors without pivots do not exist.
"""

from __future__ import annotations

from typing import Any

from petsc4py import PETSc

import numpy as np

from shellmb.arrays import Floats
from shellmb.native import library as native

# multiplications beyond which other factors take less time: of a matrix, and of each unknown of a
# matrix of any size. Chains of 100 and 200 links in EP4 have 4186, and their steps take 0.92 and
# 0.94 times as long as with MUMPS.
OPERATIONS, EACH = 4e6, 5e3


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
        order = np.empty(size, dtype=np.int32)
        order[A.getOrdering(PETSc.Mat.OrderingType.RCM)[0].getIndices()] = np.arange(size)
        rows = np.repeat(np.arange(size, dtype=np.int32), np.diff(starts))
        i, j = order[rows].astype(np.int64), order[columns].astype(np.int64)
        below, above = int(np.max(i - j, initial=0)), int(np.max(j - i, initial=0))
        each = (below + 1) * (below + above + 1)
        self.pays = size * each <= OPERATIONS or each <= EACH
        if not self.pays:
            return
        self._lib, pointer = native.cells().lib, native.CArrays()
        width = 2 * below + above + 1
        place = below + above + i - j + j * width
        members: dict[str, Any] = {
            "size": size,
            "below": below,
            "above": above,
            "entries": len(values),
            "row": pointer(rows),
            "column": pointer(columns.astype(np.int32)),
            "place": pointer(place.astype(np.int32)),
            "order": pointer(order),
            "pivots": pointer(np.zeros(size, dtype=np.int32)),
            "factors": pointer(np.zeros(size * width)),
            **{n: pointer(np.zeros(size)) for n in ("row_scale", "column_scale", "work")},
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
