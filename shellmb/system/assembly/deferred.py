"""Values of compiled forms in many steps: what they are made of is taken, they are found together.

Between two solutions a call from Python takes longer than the kernels of a small mesh.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import chain
from typing import Any, Protocol

import numpy as np
from dolfinx import fem

from shellmb.arrays import Floats
from shellmb.native import library as native
from shellmb.native.operations import operations
from shellmb.system.assembly.loops import FormLoop

# numbers that forms read up to which a copy of them is cheaper than what is made of them
SMALL = 4000


class DeferredValues(Protocol):
    """Numbers of many steps."""

    def take(self, row: int) -> None:
        """Take what they are now; collective.

        Args:
            row: Which of the steps.
        """
        ...

    def of(self, rows: slice) -> Floats:
        """Numbers of some steps that were taken, shape (k, n); not collective."""
        ...


class ImmediateValues:
    """Numbers that are found in each step.

    Args:
        find: Fills them in, into zeros of shape (n,).
        size: How many they are.
        steps: How many steps are kept.
    """

    def __init__(self, find: Callable[[Floats], None], size: int, steps: int) -> None:
        self._find, self._found = find, np.zeros((steps, size))

    def take(self, row: int) -> None:
        """Find them."""
        found = self._found[row]
        found[:] = 0.0
        self._find(found)

    def of(self, rows: slice) -> Floats:
        """Give those of some steps."""
        return self._found[rows]


class Recording:
    """Inputs of compiled forms, kept for many steps, and the place where kernels read them.

    Args:
        forms: The forms of C++.
        arrays: Local arrays of their coefficients, by the addresses of these.
        steps: How many steps are kept.

    Attributes:
        take: Takes what is read now, by the number of the step.
    """

    def __init__(self, forms: Iterable[Any], arrays: Mapping[int, Floats], steps: int) -> None:
        pieces = {key: [array] for key, array in arrays.items()}
        # views of the constants' own numbers, which keep them alive
        pieces |= {id(form): [c.value.reshape(-1) for c in form.constants] for form in forms}
        ends = np.cumsum([0, *(sum(map(len, some)) for some in pieces.values())])
        self._places = dict(zip(pieces, map(slice, ends[:-1], ends[1:]), strict=True))
        self._kept, self._place = np.zeros((steps, ends[-1])), np.zeros(ends[-1])
        self.take = operations().copies([*chain(*pieces.values())], self._kept)
        # programs have their addresses among constants, also in steps that nobody takes
        [*map(self.take, range(steps))]

    def coefficient(self, array: Floats) -> Floats:
        """Place for the local array of a coefficient."""
        return self._place[self._places[array.ctypes.data]]

    def constants(self, form: Any) -> Floats:
        """Place for the constants of a form of C++, one behind the other."""
        return self._place[self._places[id(form)]]

    def states(self, rows: slice) -> tuple[Any, ...]:
        """Number of some steps, size of what is read in one, and where it is kept and read."""
        kept, doubles = self._kept[rows], native.doubles
        return *kept.shape, doubles(kept), doubles(self._place)


class BatchedValues:
    """Numbers that are found for many steps by one call for each mesh.

    Args:
        tape: What they are made of.
        loops: What gives them, of each mesh.
        function: Name of the function of C that adds what these give in some steps.
        size: How many numbers there are.
    """

    def __init__(
        self, tape: Recording, loops: Sequence[FormLoop], function: str, size: int
    ) -> None:
        self.take, self._tape, self._loops, self._size = tape.take, tape, loops, size
        self._function = getattr(native.cells().lib, function)

    def of(self, rows: slice) -> Floats:
        """Find those of some steps."""
        states = self._tape.states(rows)
        found = np.zeros((states[0], self._size))
        for loop in self._loops:
            self._function(*loop.mesh, *states, self._size, native.doubles(found))
        return found


def recording_of(forms: Iterable[fem.Form], steps: int) -> Recording | None:
    """A tape of what forms read, one that is used in one process; None if that is too much.

    Args:
        forms: The forms.
        steps: How many steps are kept.
    """
    every = [form._cpp_object for form in forms]
    read = [function.x.array for form in every for function in form.coefficients]
    arrays = {array.ctypes.data: array for array in read}
    return Recording(every, arrays, steps) if sum(map(len, arrays.values())) <= SMALL else None
