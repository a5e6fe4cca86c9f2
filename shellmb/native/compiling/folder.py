"""Folder of what is compiled, and failures of the rank that compiles."""

from pathlib import Path

from mpi4py import MPI

from shellmb.barrier import arrive
from shellmb.errors import RunError
from shellmb.guarding import cache_root, user_options
from shellmb.native.compiling.store import usable


def cache_folder() -> Path:
    """Folder in which the library of loops is kept.

    Raises:
        RunError: If there is no place for it.
    """
    given = user_options("dolfinx", "dolfinx_jit_options.json")
    return usable(Path(given.get("cache_dir", cache_root() / "fenics")).expanduser())


def raise_together(failure: Exception | None, what: str, comm: MPI.Comm) -> None:
    """Raise on all ranks what failed on the first one.

    Args:
        failure: On the first rank: a compiler's is told as it is; None elsewhere, or for none.
        what: What could not be done.
        comm: The ranks.

    Raises:
        RunError: If the C compiler failed.
        RuntimeError: If something else did.
    """
    said = failure if failure is None or isinstance(failure, RunError) else RuntimeError(what)
    arrive(comm)
    if (told := comm.bcast(said)) is not None:
        raise told from (None if told is failure else failure)
