"""Tangent spaces of the nodes of a field, by loops in C over all that are not given."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from shellmb.arrays import Bools, Floats, Int32s
from shellmb.native import library as native


class Bases(NamedTuple):
    """Tangent spaces of nodes; vectors of nodes that have fewer than others are zero.

    Args:
        right: Increments, shape (n, 3 k, m).
        left: Test vectors, shape (n, 3 k, m).
        forces: What makes multipliers of forces, `(C^T)^+`, shape (n, 3 k, c).
        right_other: Of rates, their change with the increments of the state, shape (n, 3 k, m).
        left_other: Over a path, tests of the field in the equations of the other one.
        forces_other: Over a path, what makes multipliers of the other field of forces.
    """

    right: Floats
    left: Floats
    forces: Floats
    right_other: Floats | None = None
    left_other: Floats | None = None
    forces_other: Floats | None = None


class NodeBases:
    """Bases of nodes in a step, by a loop of `bases.c`.

    Args:
        loop: Its name.
        counts: Numbers of tangent spaces, and of what makes multipliers of forces.
        held: Nodes whose directors are given, shape (n,): they have none.
        dofs: Local dofs of the nodes, shape (n, 3 k).
        reference: Directors where the values are zero, shape (n, 3 k).
        values: Numbers of all local dofs: directors at the start and their velocities there times
            the step, directors at the end and their velocities there.
        weights: Weights of these in the states that the loop takes, shape (states, 4).

    Attributes:
        found: The bases, shape (n, 3 k, vectors) each.
    """

    def __init__(
        self,
        loop: str,
        counts: tuple[int, int],
        held: Bools,
        dofs: Int32s,
        reference: Floats,
        values: Sequence[Floats],
        weights: Sequence[Floats],
    ) -> None:
        pointer, (nodes, size) = native.CArrays(), dofs.shape
        widths = np.repeat((2, 1) if size == 3 else (3, 6), counts)
        self.found = [np.zeros((nodes, size, width)) for width in widths]
        given = {
            "dofs": pointer(dofs.astype(np.int64)),
            "reference": pointer(np.array(reference, dtype=float)),
            "values": [pointer(one) for one in values],
            "weights": pointer(np.array(weights, dtype=float)),
        }
        marks = held.astype(np.uint8)
        self._kept = pointer, marks
        where = pointer.many("PathNodes", [given]), native.bytes_of(marks)
        out = pointer.many("double *", [pointer(values) for values in self.found])
        self._loop = getattr(native.cells().lib, loop)
        self._arguments = nodes, size // 3, *where, out

    def __call__(self) -> None:
        """Find them at the current state."""
        self._loop(*self._arguments)
