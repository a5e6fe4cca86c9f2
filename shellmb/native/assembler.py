"""Choice of the assembler: the loops in C, or the reference in plain DOLFINx and NumPy."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import wraps
from typing import Any, Literal, NamedTuple, Protocol

from mpi4py import MPI as _MPI  # noqa: F401  (before petsc4py)
from petsc4py import PETSc

from shellmb.arrays import Floats, Ints

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


class NodeSums(Protocol):
    """Sums over the nodes of a body: positions first, then directors and what turns like them."""

    def resultants(self, q: Floats, whole: float, forces: Floats, counted: Floats) -> Floats:
        """Force, moment about the origin and sum of the sizes of forces at nodes, shape (k, 7).

        Args:
            q: Dofs of states, or changes of them, shape (k, dofs).
            whole: One for states, zero for changes.
            forces: Forces at all dofs of the body, shape (k, dofs).
            counted: One at dofs that count, zero at others.
        """
        ...

    def rotation_sums(self, directors: int, start: Floats, end: Floats, sums: Floats) -> float:
        """Largest square of the changes of a node's directors in a step; fills the sums.

        Args:
            directors: Number of directors of a node.
            start: Dofs of the body at the start of the step.
            end: Those at its end.
            sums: Number of positions, their sum in the middle of the step, that of their changes,
                and the sums of `x x, x dx, d d, d dd` of positions and directors, shape (43,).
        """
        ...


class Pairs(NamedTuple):
    """Unknowns of which some tell the slope in time of others.

    Args:
        values: These others, by their places.
        slopes: Unknowns that tell their slopes.
        times: Change in a step at that slope over the unknown that tells it.
    """

    values: Ints
    slopes: Ints
    times: Floats


class Operations(Protocol):
    """Operations on arrays that have a loop in C, beside assembly and elimination."""

    def turn(self, d: Floats, change: Floats, most: float) -> int:
        """Turn directors by a change of them, as `directors.rotated` says, in place."""
        ...

    def normalise(self, d: Floats) -> None:
        """Bring nearly orthonormal directors to length one and right angles, in place."""
        ...

    def part_sizes(
        self, ends: Ints, entries: Ints, scales: Floats, bounds: Floats, weights: Floats
    ) -> PartSizes:
        """Sizes of parts of unknowns.

        Args:
            ends: Where each part begins and the last one ends among `entries`.
            entries: Unknowns of all parts.
            scales: Scale of each part.
            bounds: Change of each part that is too large.
            weights: What relative changes of each part count.
        """
        ...

    def shares(
        self, ends: Ints, entries: Ints, weights: tuple[Floats, Floats, Floats], little: float
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
        ...

    def foresee(self, weights: Floats, past: Floats, to: Floats) -> None:
        """Extrapolate states by polynomials of all degrees that they allow.

        Args:
            weights: Of each state for the polynomials of degree 0, 1, ..., lower triangular.
            past: The states, shape (k, n).
            to: Gets them, shape (k, n).
        """
        ...

    def foresee_pairs(
        self, weights: tuple[Floats, Floats], past: Floats, pairs: Pairs, dt: float, to: Floats
    ) -> None:
        """Extrapolate values and slopes by polynomials through both.

        Args:
            weights: Of values and of slopes a step ahead: of the values of all states, then of
                their slopes times the step, shape (p, 2 k) each.
            past: The states, shape (k, n), slopes over the lengths of their steps.
            pairs: Unknowns that are values, and those that are their slopes.
            dt: Length of the step, s.
            to: Gets them, shape (p, n); what is in no pair stays.
        """
        ...

    def node_sums(self, dofs: Ints, reference: Floats, positions: int) -> NodeSums:
        """Sums over nodes.

        Args:
            dofs: Of vectors of three: positions and what turns with the body, shape (n, 3).
            reference: Their values where the dofs are zero, shape (n, 3).
            positions: How many of them are positions.
        """
        ...

    def centring(
        self, own: Sequence[Floats], above: Sequence[Floats], below: Sequence[Floats]
    ) -> Callable[[], None]:
        """Make what moves two lists of arrays so that their mean is a third one.

        Args:
            own: Arrays, whose numbers stay where they are.
            above: As many others.
            below: And others.

        Returns:
            Does so; differences of the latter two stay.
        """
        ...

    def rotation(self, sums: Floats, tiny: float) -> tuple[float, float]:
        """Find the rotation that fits the sums of `NodeSums.rotation_sums` best.

        Args:
            sums: Of all nodes of a body, shape (43,).
            tiny: Of the diagonal, so that what does not turn at all has a fit, too.

        Returns:
            Twice the tangent of half the angle, and the radius of gyration of the positions about
            the axis, m.
        """
        ...
