"""The reference: compiled forms by DOLFINx, and sizes of parts of vectors by NumPy.

Nothing here is of the room around it: no C of ours, no language of FFCx's, no vectors.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from petsc4py import PETSc

import filelock
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
    with filelock.FileLock(folder / "lock"):
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


def _parts(ends: Ints, entries: Ints) -> list[Ints]:
    return [entries[a:b] for a, b in itertools.pairwise(ends)]


def _largest(parts: Sequence[Ints], values: Floats, out: Floats) -> None:
    """Largest absolute value of each part, infinite if one is no number."""
    for k, part in enumerate(parts):
        size = np.abs(values[..., part]).max(axis=-1, initial=0.0)
        out[..., k] = np.where(np.isnan(size), np.inf, size)


class ReferenceShares:
    """Shares by NumPy; arguments as of `operations.shares`."""

    struct = None

    def __init__(
        self, ends: Ints, entries: Ints, weights: tuple[Floats, Floats, Floats], little: float
    ) -> None:
        self._parts = _parts(ends, entries)
        self._weights, self._little = weights, little
        self.table = np.zeros((2, len(weights[0])))

    def fill(self, change: Floats, whole: Floats) -> None:
        """Fill the table."""
        _largest(self._parts, np.stack([change, whole]), self.table)

    def largest(self) -> float:
        """Largest share of what the table holds."""
        if not self.table.sum() < np.inf:
            return np.inf
        (changes, sizes), (units, shares, moves) = self.table, self._weights
        least = np.max(moves * sizes, initial=self._little)
        return float(np.max(shares * changes / np.maximum(units * sizes, least), initial=0.0))


class ReferencePartSizes:
    """Sizes by NumPy; arguments as of `operations.part_sizes`."""

    def __init__(
        self, ends: Ints, entries: Ints, scales: Floats, bounds: Floats, weights: Floats
    ) -> None:
        self._parts = _parts(ends, entries)
        self._scales, self._bounds, self._weights = scales, bounds, weights
        self.table, self.found = np.zeros((2, len(scales))), np.zeros(4)

    def largest(self, values: Floats, out: Floats) -> None:
        """Largest absolute value of each part."""
        _largest(self._parts, values, out)

    def fill(self, x: PETSc.Vec, dx: PETSc.Vec) -> None:
        """Fill the table."""
        self.largest(np.stack([dx.array_r, x.array_r]), self.table)

    def _relative(self, sizes: Floats, changes: Floats) -> Floats:
        finite = np.where(np.isfinite(changes), changes, 0.0)
        ratio = finite / np.maximum(sizes, self._scales)
        return np.where(np.isfinite(changes), ratio, np.inf)

    def relate(self) -> None:
        """Fill `found` from the table."""
        changes, sizes = self.table
        sizes[:] = self._relative(sizes, changes)
        bounded = np.isfinite(self._bounds)
        moved = (changes[bounded] / self._scales[bounded]).max(initial=0.0)
        most, weighted = (rows.max(initial=0.0) for rows in (sizes, self._weights * sizes))
        self.found[:] = most, moved, np.any(~(changes < self._bounds)), weighted

    def relative(self, sizes: Floats, changes: Floats) -> Floats:
        """Largest relative changes of bounded parts and of others for each row."""
        rows = np.array([self._relative(sizes, row) for row in changes])
        bounded = np.isfinite(self._bounds)
        return np.stack([rows[:, b].max(axis=1, initial=0.0) for b in (bounded, ~bounded)], axis=1)
