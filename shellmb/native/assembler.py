"""Choice of the assembler: the loops in C, or the reference in plain DOLFINx and NumPy."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import wraps
from typing import Any, Literal, Protocol

from mpi4py import MPI as _MPI  # noqa: F401  (before petsc4py)
from petsc4py import PETSc

from shellmb.arrays import Floats

Assembler = Literal["native", "reference"]

_CHOSEN: ContextVar[Assembler] = ContextVar("assembler", default="native")


def is_native() -> bool:
    """Decide whether what is made now is to be the loops in C."""
    return _CHOSEN.get() != "reference"


@contextmanager
def assembled_by(assembler: Assembler) -> Iterator[None]:
    """Make all that is built meanwhile with an assembler.

    Args:
        assembler: Its name.
    """
    token = _CHOSEN.set(assembler)
    try:
        yield
    finally:
        _CHOSEN.reset(token)


def assembled_as[**P, R](
    solver: Callable[..., Any],
) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Decorate a function such that it works with the assembler of a scene.

    Args:
        solver: Finds the scene's solver settings among the function's arguments.
    """

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        @wraps(function)
        def call(*args: P.args, **kwargs: P.kwargs) -> R:
            # as `assembled_by`, without a context that is made anew for each step
            token = _CHOSEN.set(solver(*args, **kwargs).assembler)
            try:
                return function(*args, **kwargs)
            finally:
                _CHOSEN.reset(token)

        return call

    return decorate


class PartSizes(Protocol):
    """Sizes of the parts of all unknowns, and changes relative to them.

    Attributes:
        table: Changes of all parts, and their sizes, which give way to relative changes; shape
            (2, parts).
        found: Largest relative change, how far the largest motion went relative to its scale,
            whether one reached its bound, and the largest relative change by its weight.
    """

    table: Floats
    found: Floats

    def largest(self, values: Floats, out: Floats) -> None:
        """Largest absolute value of each part of vectors, infinite if one is no number.

        Args:
            values: The vectors, shape (k, n) or (n,).
            out: Gets them, shape (k, parts) or (parts,).
        """
        ...

    def judge(self, x: PETSc.Vec, dx: PETSc.Vec) -> None:
        """Fill table and `found` from unknowns and their changes, all in one process."""
        ...

    def relate(self) -> None:
        """Fill `found` from the table."""
        ...

    def relative(self, sizes: Floats, changes: Floats) -> Floats:
        """Largest relative changes of bounded parts and of others for rows of `changes`, (k, 2)."""
        ...


class Shares(Protocol):
    """Largest share of changes of parts of unknowns in their sizes.

    Attributes:
        table: Changes and sizes of all parts, shape (2, parts).
        struct: For C, what it knows; of no use to others.
    """

    table: Floats
    struct: Any

    def fill(self, change: Floats, whole: Floats) -> None:
        """Fill the table from unknowns and their changes."""
        ...

    def largest(self) -> float:
        """Largest share of what the table holds; infinite if something in it is no number."""
        ...
