"""Sizes of parts of vectors: by loops in C, or by NumPy where the reference works."""

from petsc4py import PETSc

import numpy as np

from shellmb.arrays import Floats
from shellmb.native import library as native
from shellmb.native.assembler import is_native
from shellmb.native.reference import ComparedParts, ReferencePartSizes


class LoopPartSizes:
    """Sizes of the parts of all unknowns, and changes relative to them.

    Args:
        parts: The parts.

    Attributes:
        table: Changes of all parts, and their sizes, which give way to relative changes; shape
            (2, parts).
        found: Largest relative change, how far the largest motion went relative to its scale,
            whether one reached its bound, and the largest relative change by its weight.
        struct: For C, what it knows; of no use to others.
    """

    def __init__(self, parts: ComparedParts) -> None:
        self._lib, pointer = native.cells().lib, native.CArrays()
        count = len(parts.scales)
        self.table, self.found = np.zeros((2, count)), np.zeros(4)
        *arrays, least = parts
        given = count, *map(pointer, (*arrays, self.table, self.found)), least
        self._kept, self.struct = pointer, pointer.many("Parts", [given])

    def largest(self, values: Floats, out: Floats) -> None:
        """Largest absolute value of each part of vectors, infinite if one is no number.

        Args:
            values: The vectors, shape (k, n) or (n,).
            out: Gets them, shape (k, parts) or (parts,).
        """
        count, size = (1, len(values)) if values.ndim == 1 else values.shape
        pointers = native.doubles(values), native.doubles(out)
        self._lib.largest(self.struct, count, size, *pointers)

    def fill(self, x: PETSc.Vec, dx: PETSc.Vec) -> None:
        """Fill the table from unknowns of this rank and their changes."""
        self._lib.fill_sizes(self.struct, x.handle, dx.handle)

    def relate(self) -> None:
        """Fill `found` from the table, whose sizes become relative changes."""
        self._lib.relate(self.struct)

    def relative(self, sizes: Floats, changes: Floats) -> Floats:
        """Largest relative changes of bounded parts and of others for rows of `changes`, (k, 2)."""
        found = np.empty((len(changes), 2))
        pointers = map(native.doubles, (sizes, changes, found))
        self._lib.relate_each(self.struct, len(changes), *pointers)
        return found


PartSizes = LoopPartSizes | ReferencePartSizes


def part_sizes(parts: ComparedParts) -> PartSizes:
    """Sizes of parts of unknowns."""
    return (LoopPartSizes if is_native() else ReferencePartSizes)(parts)
