"""Compiled expressions: values at points of cells, as DOLFINx compiles them, by one at a time."""

import logging
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from mpi4py import MPI  # before dolfinx

import numpy as np
import numpy.typing as npt
from dolfinx import fem
from ufl.core.expr import Expr

from shellmb.compiling.compiler import locked
from shellmb.kernels import JIT_OPTIONS, cache_folder, comm_of, module_name

_log = logging.getLogger(__name__)


def compiled_expression(value: Expr, points: npt.NDArray[np.float64]) -> fem.Expression:
    """An expression compiled, or found in the cache.

    Args:
        value: The expression.
        points: Where on the reference element it is wanted, shape (n, dimension).
    """
    name = module_name((value, np.reshape(points, (len(points), -1))))
    # FFCx lists all files beside them
    folder = cache_folder() / "expressions"
    with _alone(comm_of(value), folder / f"{name}.c"):
        return fem.Expression(value, points, jit_options=JIT_OPTIONS | {"cache_dir": str(folder)})


@contextmanager
def _alone(comm: MPI.Comm, source: Path) -> Iterator[None]:
    """Only one process compiles an expression; what a killed one has left of it is removed.

    DOLFINx takes one whose file exists and is not compiled for one that another process is
    compiling, and waits for it without a word. A process that was killed leaves such a file: who
    holds the lock and finds one knows that nobody is compiling it.
    """
    ready = source.with_suffix(".c.cached")
    # one rank compiles, the others load
    if comm.rank != 0 or ready.exists():
        yield
        return
    source.parent.mkdir(parents=True, exist_ok=True)
    with ExitStack() as locks:
        locked(source.with_suffix(".lock"), locks, wait=True)
        if source.exists() and not ready.exists():
            _log.warning("a kernel that a killed process left unfinished is compiled anew")
            source.unlink()
        try:
            yield
        finally:
            # Ctrl-C
            if not ready.exists():
                source.unlink(missing_ok=True)
