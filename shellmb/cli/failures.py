"""Errors as one sentence and an exit code; everything printed by one rank only."""

from __future__ import annotations

import functools
import os
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, cast

import typer

from shellmb.errors import SceneError, ShellmbError, ShellmbWarning

RANK_VARIABLES = ("PMI_RANK", "PMIX_RANK", "OMPI_COMM_WORLD_RANK")


def first_rank() -> bool:
    """Whether this is rank 0, told without loading MPI."""
    ranks = [os.environ[name] for name in RANK_VARIABLES if name in os.environ]
    return not ranks or ranks[0] == "0"


def tell(text: str) -> None:
    """Print a line beside what a command prints, on stderr, on the first rank.

    Args:
        text: The line.
    """
    if first_rank():
        print(text, file=sys.stderr, flush=True)


@contextmanager
def warnings_told() -> Iterator[None]:
    """Each of the project's warnings as one line on stderr, and once; others as ever."""
    told: set[str] = set()
    with warnings.catch_warnings():
        usual = warnings.showwarning

        def show(message: Any, category: type[Warning], *place: Any, **more: Any) -> None:
            if not issubclass(category, ShellmbWarning):
                usual(message, category, *place, **more)
            elif str(message) not in told:
                told.add(str(message))
                tell(f"warning: {message}")

        warnings.simplefilter("always", ShellmbWarning)
        warnings.showwarning = show
        yield


def failures_reported[**P, T](command: Callable[P, T]) -> Callable[P, T]:
    """Turn the errors that a user can mend into a sentence on stderr and an exit code.

    2: an impossible scene or option; 1: no convergence, or a failed check. A bug keeps its
    traceback. On several ranks the process ends here (`_end_together`), with what the command
    returns, or its error, still alive.
    """

    @functools.wraps(command)
    def wrapped(*args: P.args, **kwargs: P.kwargs) -> T:
        made: T | None = None
        failure: Exception | None = None
        code = 0
        try:
            with warnings_told():
                made = command(*args, **kwargs)
        except typer.Exit as exit_:
            failure, code = exit_, exit_.exit_code
        except ShellmbError as error:
            tell(f"error: {error}")
            failure, code = error, 2 if isinstance(error, SceneError) else 1
        except AssertionError as error:
            if error.__traceback__ is None or not _is_check(error):
                _abort_others()
                raise
            tell(f"check failed: {error or 'a reference value of the scene is not met'}")
            failure, code = error, 1
        except Exception:
            _abort_others()
            raise
        _end_together(code)
        if failure is not None:
            raise typer.Exit(code) from None
        return cast("T", made)

    return wrapped


def _end_together(code: int) -> None:
    """End the process where the others end, on several ranks.

    Meshes, matrices and solvers of the run are not freed: that is collective, and would have to
    come in the same order on all ranks. A cycle of references on one of them, which any library
    may make, changes that order, and the ranks would wait for one another for ever.

    Args:
        code: Exit code.
    """
    if "mpi4py.MPI" not in sys.modules:
        return
    MPI = sys.modules["mpi4py.MPI"]
    if MPI.COMM_WORLD.size == 1:
        return
    sys.stdout.flush()
    sys.stderr.flush()
    MPI.COMM_WORLD.Barrier()
    MPI.Finalize()
    os._exit(code)


def _is_check(error: AssertionError) -> bool:
    """Whether an assertion is one of a scene's `check`, and no bug of ours."""
    frame = error.__traceback__
    names = []
    while frame is not None:
        names.append(frame.tb_frame.f_code.co_name)
        frame = frame.tb_next
    return "check" in names


def _abort_others() -> None:
    """A bug on one rank would let the others wait for ever."""
    if "mpi4py.MPI" not in sys.modules:
        return
    MPI = sys.modules["mpi4py.MPI"]
    if MPI.COMM_WORLD.size > 1:
        import traceback

        traceback.print_exc()
        sys.stderr.flush()
        MPI.COMM_WORLD.Abort(1)
