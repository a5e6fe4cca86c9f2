"""Unknowns of the system and local arrays of the fields: values to the one, sums to the other."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

from mpi4py import MPI as _MPI  # noqa: F401  (before petsc4py)
from petsc4py import PETSc

import numpy as np

from shellmb.arrays import Floats, Ints
from shellmb.native import library as native
from shellmb.native.assembler import is_native
from shellmb.system.assembly.numbering import Numbering


class ParallelExchange:
    """Between a vector of unknowns and what this rank sees of them: PETSc tells the ranks.

    Args:
        numbering: Unknowns of the local dofs.
        arrays: Arrays of the fields.
        x: A vector of unknowns.

    Attributes:
        local: One number for each local dof of all fields, concatenated; to work with.
    """

    def __init__(self, numbering: Numbering, arrays: Sequence[Floats], x: PETSc.Vec) -> None:
        self._arrays, self._offsets = arrays, numbering.offsets
        wanted = numbering.local_to_global.astype(PETSc.IntType)
        self.local = np.zeros(len(wanted))
        self._vector = PETSc.Vec().createWithArray(self.local, comm=PETSc.COMM_SELF)
        places = PETSc.IS().createGeneral(wanted, comm=PETSc.COMM_SELF)
        self._scatter = PETSc.Scatter().create(x, places, self._vector, None)
        self._sums = x.duplicate()

    def look(self, x: PETSc.Vec) -> None:
        """Fill `local` with the values of unknowns, those of ghosts and linked dofs included."""
        forward = PETSc.ScatterMode.FORWARD
        self._scatter.scatter(x, self._vector, PETSc.InsertMode.INSERT, forward)

    def spread(self, x: PETSc.Vec) -> None:
        """Copy values of unknowns into the fields' arrays, ghosts and linked dofs included."""
        self.look(x)
        for array, (first, last) in zip(
            self._arrays, itertools.pairwise(self._offsets), strict=True
        ):
            array[:] = self.local[first:last]

    def collect(self, b: PETSc.Vec) -> None:
        """Sums over all dofs and ranks of what `local` adds to each unknown."""
        b.set(0.0)
        reverse = PETSc.ScatterMode.REVERSE
        self._scatter.scatter(self._vector, b, PETSc.InsertMode.ADD, reverse)

    def shared(self, local: Floats, unknowns: Ints, more: Floats) -> Floats:
        """Sums at each unknown as local dofs see them, of several states, shape (k, local dofs).

        Args:
            local: What local dofs add, shape (k, local dofs).
            unknowns: Some of the unknowns that this rank owns.
            more: What comes on top there, shape (k, n).
        """
        found = np.empty(local.shape)
        for row, values, given in zip(found, local, more, strict=True):
            self.local[:] = values
            self.collect(self._sums)
            self._sums.array[unknowns] += given
            self.look(self._sums)
            row[:] = self.local
        return found


class SerialExchange:
    """Exchange in one process, without messages: one call of `unknowns.c` each.

    Args:
        numbering: Unknowns of the local dofs.
        arrays: Arrays of the fields.

    Attributes:
        members: For C, what it knows of the fields.
    """

    def __init__(self, numbering: Numbering, arrays: Sequence[Floats]) -> None:
        module = native.cells()
        self._lib, self._arrays = module.lib, arrays
        self._wanted = numbering.local_to_global.astype(np.int64)
        self._ends = np.array(numbering.offsets[1:], dtype=np.int64)
        self._owned = numbering.owned
        self.local = np.zeros(len(self._wanted))
        self._places = (len(self._wanted), native.longs(self._wanted))
        self._pointers = module.ffi.new("double *[]", [native.doubles(a) for a in arrays])
        self._fields = (len(arrays), native.longs(self._ends), self._pointers)
        self.members = {
            **dict(zip(("fields", "ends", "arrays"), self._fields, strict=True)),
            **dict(zip(("local", "wanted"), self._places, strict=True)),
        }

    def look(self, x: PETSc.Vec) -> None:
        """Fill `local` with the values of unknowns."""
        self.local[:] = x.array_r[self._wanted]

    def spread(self, x: PETSc.Vec) -> None:
        """Copy values of unknowns into the fields' arrays."""
        self._lib.spread(*self._fields, self._places[1], native.doubles(x.array_r))

    def collect(self, b: PETSc.Vec) -> None:
        """Sums of what `local` adds to each unknown."""
        entries = b.array
        local = native.doubles(self.local)
        self._lib.collect(*self._places, local, len(entries), native.doubles(entries))

    def shared(self, local: Floats, unknowns: Ints, more: Floats) -> Floats:
        """Sums at each unknown as local dofs see them."""
        found = np.empty(local.shape)
        for row, values, given in zip(found, local, more, strict=True):
            sums = np.bincount(self._wanted, values, self._owned)
            sums[unknowns] += given
            row[:] = sums[self._wanted]
        return found


Exchange = SerialExchange | ParallelExchange


def exchange(numbering: Numbering, arrays: Sequence[Floats], x: PETSc.Vec) -> Exchange:
    """Make that of a system: loops in C where one process has all unknowns.

    Args:
        numbering: Unknowns of the local dofs.
        arrays: Arrays of the fields.
        x: A vector of unknowns.
    """
    if is_native() and x.getComm().size == 1:
        return SerialExchange(numbering, arrays)
    return ParallelExchange(numbering, arrays, x)
