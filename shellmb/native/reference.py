"""The reference: compiled forms by DOLFINx, and sizes of parts of vectors by NumPy.

Nothing here is of the room around it: no C of ours, no language of FFCx's, no vectors.
"""

import fcntl
import itertools
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

from petsc4py import PETSc

import numpy as np
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr
from ufl.domain import extract_domains

from shellmb.arrays import Floats, Ints
from shellmb.native.compiling.folder import cache_folder
from shellmb.native.derivatives import expanded

# the plain code of FFCx, in a reasonable time
FLAGS = ["-O1", "-g0"]


@contextmanager
def _compiling(value: Form | Expr) -> Iterator[dict[str, Any]]:
    """Let one process compile at a time; FFCx would wait for ever for one that was killed.

    Args:
        value: What is compiled.

    Yields:
        Options for DOLFINx.
    """
    folder = cache_folder() / "reference"
    folder.mkdir(exist_ok=True)
    options = {"cffi_extra_compile_args": FLAGS, "cache_dir": folder}
    domain: Any = extract_domains(value)[0]
    if domain.ufl_cargo().comm.rank > 0:
        # the first rank compiles while others wait for it
        yield options
        return
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        for source in folder.glob("*.c"):
            if not source.with_suffix(".c.cached").exists():
                source.unlink()
        yield options


def compiled_form(form: Form) -> fem.Form | None:
    """A form compiled by DOLFINx; None for one that is empty.

    Args:
        form: The form.
    """
    form = expanded(form)
    if form.empty():
        return None
    with _compiling(form) as options:
        return fem.form(form, jit_options=options)


def compiled_expression(value: Expr, points: Floats) -> fem.Expression:
    """An expression compiled by DOLFINx.

    Args:
        value: The expression.
        points: Where on the reference element it is wanted, shape (n, dimension).
    """
    with _compiling(value) as options:
        return fem.Expression(value, points, jit_options=options)


class ComparedParts(NamedTuple):
    """Parts of unknowns, and what changes of these are compared with.

    That is their size, or their scale times `least`, or times the largest size by `moves` if that
    is more.

    Args:
        ends: Where each part begins and the last one ends among `entries`.
        entries: Unknowns of all parts.
        scales: Scale of each part.
        bounds: Change of each part that is too large.
        weights: What relative changes of each part count.
        moves: Weights of sizes.
        least: Share of the scales that changes are compared with at least.
    """

    ends: Ints
    entries: Ints
    scales: Floats
    bounds: Floats
    weights: Floats
    moves: Floats
    least: float


class ReferencePartSizes:
    """Sizes by NumPy; arguments as of `operations.LoopPartSizes`."""

    struct = None

    def __init__(self, parts: ComparedParts) -> None:
        ends, entries, self._scales, self._bounds, self._weights, self._moves, self._least = parts
        self._parts = [entries[a:b] for a, b in itertools.pairwise(ends)]
        self.table, self.found = np.zeros((2, len(parts.scales))), np.zeros(4)

    def largest(self, values: Floats, out: Floats) -> None:
        """Largest absolute value of each part, infinite if one is no number."""
        for k, part in enumerate(self._parts):
            size = np.abs(values[..., part]).max(axis=-1, initial=0.0)
            out[..., k] = np.where(np.isnan(size), np.inf, size)

    def fill(self, x: PETSc.Vec, dx: PETSc.Vec) -> None:
        """Fill the table."""
        self.largest(np.stack([dx.array_r, x.array_r]), self.table)

    def _relative(self, sizes: Floats, changes: Floats) -> Floats:
        finite, found = np.isfinite(changes + sizes), np.full(len(changes), np.inf)
        moves = self._moves > 0
        largest = np.max(self._moves[moves] * sizes[moves], initial=self._least)
        scales = self._scales * largest
        found[finite] = changes[finite] / np.maximum(sizes, scales)[finite]
        return found

    def relate(self) -> None:
        """Fill `found` from the table."""
        changes, sizes = self.table
        sizes[:] = self._relative(sizes, changes)
        bounded = np.isfinite(self._bounds)
        moved = (changes[bounded] / self._scales[bounded]).max(initial=0.0)
        shares = np.multiply(self._weights, sizes, where=sizes < np.inf, out=sizes.copy())
        most, weighted = (rows.max(initial=0.0) for rows in (sizes, shares))
        self.found[:] = most, moved, np.any(~(changes < self._bounds)), weighted

    def relative(self, sizes: Floats, changes: Floats) -> Floats:
        """Largest relative changes of bounded parts and of others for each row."""
        rows = np.array([self._relative(sizes, row) for row in changes])
        bounded = np.isfinite(self._bounds)
        return np.stack([rows[:, b].max(axis=1, initial=0.0) for b in (bounded, ~bounded)], axis=1)
