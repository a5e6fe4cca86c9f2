"""Operations on arrays: by loops in C, or by NumPy where the reference works."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from petsc4py import PETSc

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.native import library as native
from shellmb.native.assembler import Operations, Pairs, is_native
from shellmb.native.reference import Reference


def operations() -> Operations:
    """The operations of the assembler that works."""
    return Loops() if is_native() else Reference()


class _Shares:
    def __init__(
        self, ends: Ints, entries: Ints, weights: tuple[Floats, Floats, Floats], little: float
    ) -> None:
        self._lib, pointer = native.cells().lib, native.CArrays()
        self.table = np.zeros((2, len(weights[0])))
        members = {
            "parts": len(weights[0]),
            "starts": pointer(ends),
            "entries": pointer(entries),
            "table": pointer(self.table),
            **dict(zip(("units", "shares", "moves"), map(pointer, weights), strict=True)),
            "little": little,
        }
        self._kept, self.struct = pointer, pointer.many("Shares", [members])

    def fill(self, change: Floats, whole: Floats) -> None:
        """Fill the table."""
        self._lib.fill_shares(self.struct, native.doubles(change), native.doubles(whole))

    def largest(self) -> float:
        """Largest share of what the table holds."""
        return float(self._lib.largest_share(self.struct))


class _PartSizes:
    def __init__(
        self, ends: Ints, entries: Ints, scales: Floats, bounds: Floats, weights: Floats
    ) -> None:
        count, self._lib = len(scales), native.cells().lib
        self.table, self.found = np.zeros((2, count)), np.zeros(4)
        self._kept = ends, entries, scales, bounds, weights
        self._where = count, native.longs(ends), native.longs(entries)
        tables = map(native.doubles, (scales, bounds, weights, self.table, self.found))
        self._relate = count, *tables

    def largest(self, values: Floats, out: Floats) -> None:
        """Largest absolute value of each part."""
        count, size = (1, len(values)) if values.ndim == 1 else values.shape
        pointers = native.doubles(values), native.doubles(out)
        self._lib.largest_of_each(count, size, *self._where, *pointers)

    def judge(self, x: PETSc.Vec, dx: PETSc.Vec) -> None:
        """Fill table and `found`."""
        self._lib.judge(*self._where, *self._relate[1:], x.handle, dx.handle)

    def relate(self) -> None:
        """Fill `found` from the table."""
        self._lib.relate(*self._relate)

    def relative(self, sizes: Floats, changes: Floats) -> Floats:
        """Largest relative changes of bounded parts and of others for each row."""
        found = np.empty((len(changes), 2))
        pointers = map(native.doubles, (sizes, changes, found))
        self._lib.relate_each(len(changes), *self._relate[:3], *pointers)
        return found


class _NodeSums:
    def __init__(self, dofs: Ints, reference: Floats, positions: int) -> None:
        self._lib, self._pointer = native.cells().lib, native.CArrays()
        p = self._pointer
        members = {
            "dofs": p(dofs.astype(np.int32).ravel()),
            "reference": p(np.ascontiguousarray(reference, dtype=float).ravel()),
            "positions": positions,
            "arms": len(dofs) - positions,
        }
        self._struct = p.many("Nodes", [members])

    def resultants(self, q: Floats, whole: float, forces: Floats, counted: Floats) -> Floats:
        """Force, moment and gross size of forces."""
        found = np.zeros((len(q), 7))
        pointers = map(native.doubles, (np.ascontiguousarray(forces), counted, found))
        self._lib.resultants(self._struct, *q.shape, native.doubles(q), whole, *pointers)
        return found

    def rotation_sums(self, directors: int, start: Floats, end: Floats, sums: Floats) -> float:
        """Sums of a step, and the largest square of changes."""
        pointers = map(native.doubles, (start, end, sums))
        return float(self._lib.rotation_sums(self._struct, directors, *pointers))


class Loops:
    """Operations by the loops of `nodes.c`, `unknowns.c` and `sums.c`."""

    part_sizes, shares, node_sums = _PartSizes, _Shares, _NodeSums

    def __init__(self) -> None:
        self._lib = native.cells().lib

    def turn(self, d: Floats, change: Floats, most: float) -> int:
        """Turn directors by a change of them."""
        pointers = native.doubles(d), native.doubles(change)
        return int(self._lib.turn(len(d), d.shape[1] // 3, *pointers, most))

    def normalise(self, d: Floats) -> None:
        """Bring nearly orthonormal directors to length one and right angles."""
        self._lib.normalise(len(d), d.shape[1] // 3, native.doubles(d))

    def foresee(self, weights: Floats, past: Floats, to: Floats) -> None:
        """Extrapolate states by polynomials."""
        self._lib.foresee(*past.shape, *map(native.doubles, (past, weights, to)))

    def foresee_pairs(
        self, weights: tuple[Floats, Floats], past: Floats, pairs: Pairs, dt: float, to: Floats
    ) -> None:
        """Extrapolate values and slopes by polynomials through both."""
        pointer, (values, slopes, times) = native.doubles, pairs
        known = *map(pointer, (past, *weights)), len(values), *map(native.longs, (values, slopes))
        ends = pointer(times), dt, pointer(to)
        self._lib.foresee_pairs(len(to), *past.shape, *known, *ends)

    def centring(
        self, own: Sequence[Floats], above: Sequence[Floats], below: Sequence[Floats]
    ) -> Callable[[], None]:
        """Make what moves two lists of arrays so that their mean is a third one."""
        pointer, centre = native.CArrays(), self._lib.centre
        sizes = pointer(np.array([*map(len, own), 0], dtype=np.int32))
        lists = (pointer.many("double *", [*map(pointer, each)]) for each in (own, above, below))
        where = len(own), sizes, *lists

        # the pointers live as long as it
        def move(_kept: native.CArrays = pointer) -> None:
            centre(*where)

        return move

    def rotation(self, sums: Floats, tiny: float) -> tuple[float, float]:
        """Twice the tangent of half the angle of a rotation, and the radius about its axis."""
        found = np.zeros(2)
        self._lib.turned(native.doubles(sums), tiny, native.doubles(found))
        tangent, radius = found.tolist()
        return tangent, radius
