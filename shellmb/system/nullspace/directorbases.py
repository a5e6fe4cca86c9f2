"""Tangent spaces of the nodes of a field, by loops in C where all nodes are alike."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from shellmb.arrays import Bools, Floats, Int32s
from shellmb.native import library as native
from shellmb.system.nullspace.directorpath import Half


class Bases(NamedTuple):
    """Tangent spaces of nodes; vectors of nodes that have fewer than others are zero.

    Args:
        right: Increments, shape (n, 3 k, m).
        left: Test vectors, shape (n, 3 k, m).
        forces: What makes multipliers of forces, `(C^T)^+`, shape (n, 3 k, c).
        state: Of rates, their change with the increments of the state, shape (n, 3 k, m).
        left_other: Over a path, tests of the field in the equations of the other one.
        forces_other: Over a path, what makes multipliers of the other field of forces.
        rates: Over a path, of the states: what the velocities have of the bases of a pair.
    """

    right: Floats
    left: Floats
    forces: Floats
    state: Floats | None
    left_other: Floats | None = None
    forces_other: Floats | None = None
    rates: Half | None = None


class DirectorBases:
    """Bases of nodes with one director each, or three, all free or fixed: one loop of `bases.c`.

    Args:
        dofs: Local dofs of the nodes, shape (n, 3 k).
        held: Which are held, shape (n,).
        reference: Directors where the values are zero, shape (n, 3 k).
        before: Values of all local dofs at the start of the step.
        now: Their values.
    """

    def __init__(
        self, dofs: Int32s, held: Bools, reference: Floats, before: Floats, now: Floats
    ) -> None:
        n, size = dofs.shape
        self._lib = native.cells().lib
        free, rows = (2, 1) if size == 3 else (3, 6)
        right, left, forces = (np.zeros((n, size, width)) for width in (free, free, rows))
        self._bases = Bases(right, left, forces, None)
        places, marks = dofs.astype(np.int64), held.astype(np.uint8)
        given = np.ascontiguousarray(reference, dtype=float), before, now
        self._kept = places, marks, given
        found = map(native.doubles, (left, right, forces))
        pointers = (*map(native.doubles, given), native.bytes_of(marks), *found)
        self._arguments = (n, size // 3, native.longs(places), *pointers)

    def __call__(self) -> Bases:
        """Bases at the current state; overwritten by the next call."""
        self._lib.bases(*self._arguments)
        return self._bases
