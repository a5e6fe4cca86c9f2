"""Sizes of parts of vectors: by loops in C, or by NumPy where the reference works."""

from __future__ import annotations

from petsc4py import PETSc

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.native import library as native
from shellmb.native.assembler import is_native
from shellmb.native.reference import ReferencePartSizes, ReferenceShares


class LoopShares:
    """Largest share of changes of parts of unknowns in their sizes; arguments as of `shares`.

    Attributes:
        table: Changes and sizes of all parts, shape (2, parts).
        struct: For C, what it knows; of no use to others.
    """

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
        """Fill the table from unknowns and their changes."""
        self._lib.fill_shares(self.struct, native.doubles(change), native.doubles(whole))

    def largest(self) -> float:
        """Largest share of what the table holds; infinite if something in it is no number."""
        return float(self._lib.largest_share(self.struct))


class LoopPartSizes:
    """Sizes of the parts of all unknowns, and changes relative to them; as of `part_sizes`.

    Attributes:
        table: Changes of all parts, and their sizes, which give way to relative changes; shape
            (2, parts).
        found: Largest relative change, how far the largest motion went relative to its scale,
            whether one reached its bound, and the largest relative change by its weight.
    """

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
        """Largest absolute value of each part of vectors, infinite if one is no number.

        Args:
            values: The vectors, shape (k, n) or (n,).
            out: Gets them, shape (k, parts) or (parts,).
        """
        count, size = (1, len(values)) if values.ndim == 1 else values.shape
        pointers = native.doubles(values), native.doubles(out)
        self._lib.largest(count, size, *self._where, *pointers)

    def fill(self, x: PETSc.Vec, dx: PETSc.Vec) -> None:
        """Fill the table from unknowns of this rank and their changes."""
        self._lib.fill_sizes(*self._where, self._relate[4], x.handle, dx.handle)

    def relate(self) -> None:
        """Fill `found` from the table, whose sizes become relative changes."""
        self._lib.relate(*self._relate)

    def relative(self, sizes: Floats, changes: Floats) -> Floats:
        """Largest relative changes of bounded parts and of others for rows of `changes`, (k, 2)."""
        found = np.empty((len(changes), 2))
        pointers = map(native.doubles, (sizes, changes, found))
        self._lib.relate_each(len(changes), *self._relate[:3], *pointers)
        return found


PartSizes = LoopPartSizes | ReferencePartSizes
Shares = LoopShares | ReferenceShares


def part_sizes(
    ends: Ints, entries: Ints, scales: Floats, bounds: Floats, weights: Floats
) -> PartSizes:
    """Sizes of parts of unknowns.

    Args:
        ends: Where each part begins and the last one ends among `entries`.
        entries: Unknowns of all parts.
        scales: Scale of each part.
        bounds: Change of each part that is too large.
        weights: What relative changes of each part count.
    """
    kind = LoopPartSizes if is_native() else ReferencePartSizes
    return kind(ends, entries, scales, bounds, weights)


def shares(
    ends: Ints, entries: Ints, weights: tuple[Floats, Floats, Floats], little: float
) -> Shares:
    """Shares of changes of parts of unknowns in their sizes.

    A change times a weight is compared with the size times its unit, or with the largest size
    times its other weight, whichever is larger.

    Args:
        ends: Where each part begins and the last one ends among `entries`.
        entries: Unknowns of all parts.
        weights: Units, weights of changes, and those other ones, of each part.
        little: What changes are compared with at least.
    """
    return (LoopShares if is_native() else ReferenceShares)(ends, entries, weights, little)
