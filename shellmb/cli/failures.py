"""Errors as one sentence and an exit code; everything printed by one rank only."""

import functools
import os
import signal
import sys
import time
import traceback
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, cast

import typer

from shellmb import barrier
from shellmb.cli.options import Command
from shellmb.errors import RunError, SceneError, ShellmbError, ShellmbWarning, Stopped
from shellmb.guarding import Stream, Unprinted
from shellmb.running.error_origin import in_words, user_failures, user_frame
from shellmb.stopping import EXIT, STOPPING, several_ranks

# how long a rank that fails waits for the first one to say so [s]
PATIENCE = 2.0
RANK_VARIABLES = ("PMI_RANK", "PMIX_RANK", "OMPI_COMM_WORLD_RANK")
SIZE_VARIABLES = ("PMI_SIZE", "OMPI_COMM_WORLD_SIZE")


def first_rank() -> bool:
    """Decide whether this is rank 0, without loading MPI."""
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


class FailedCheck(ShellmbError):
    """A reference value of a scene that is not met."""


def run_check(check: Callable[[dict[str, float]], None], results: dict[str, float]) -> None:
    """Hold results against the reference values of a scene.

    Args:
        check: The scene's function.
        results: The results.

    Raises:
        FailedCheck: If one is not met.
        RunError: If the function itself fails; what was run is saved.
    """
    saved = "; everything else is finished and saved"
    with user_failures(RunError, "check() of the scene fails", saved):
        try:
            check(results)
        except AssertionError as error:
            frame = user_frame(error)
            place = "" if frame is None else f" ({Path(frame.filename).name}, line {frame.lineno})"
            said = str(error) or f"a reference value of the scene is not met{place}"
            raise FailedCheck(f"check failed: {said}") from error


def failures_reported[**P, T](command: Callable[P, T]) -> Callable[P, T]:
    """Turn the errors that a user can mend into a sentence on stderr and an exit code.

    2: an impossible scene or option; 1: no convergence, a failed check, a full disk, or a user's
    function that raises; 128 and its number: a signal. A bug keeps its traceback. On several ranks
    the process ends here (`_end_together`), with what the command returns, or its error, still
    alive.
    """

    @functools.wraps(command)
    def wrapped(*args: P.args, **kwargs: P.kwargs) -> T:
        made: T | None = None
        failure: BaseException | None = None
        code = 0
        with STOPPING.caught(), warnings_told():
            try:
                _refuse_others(command.__name__, kwargs)
                made = command(*args, **kwargs)
                sys.stdout.flush()
            except typer.Exit as exit_:
                failure, code = exit_, exit_.exit_code
            except BaseException as error:
                sentence, code = _sentence(error)
                if not sentence:
                    if several_ranks():
                        # a bug on one rank would let the others wait for ever
                        _end_alone(traceback.format_exc(), 1)
                    raise
                failure = error
                shared = isinstance(error, ShellmbError | KeyboardInterrupt)
                alone = several_ranks() and (not shared or getattr(error, "alone", False))
                if alone or not met():
                    _end_alone(sentence, code)
                tell(sentence)
                STOPPING.answered()
        _end_together(code)
        if failure is not None:
            raise typer.Exit(code) from None
        return cast("T", made)

    return wrapped


def _refuse_others(command: str, options: Mapping[str, Any]) -> None:
    """Refuse ranks that are asked for different things: they would wait for one another for ever.

    Args:
        command: What this rank is asked for.
        options: With which options.

    Raises:
        SceneError: On all ranks, if they differ; says in what.
    """
    if not _starts_several():
        return
    from mpi4py import MPI

    own = {"command": command} | {name: str(value) for name, value in options.items()}
    first = MPI.COMM_WORLD.bcast(own)
    apart = [name for name in {**first, **own} if first.get(name) != own.get(name)]
    said = [f"{k} is {first.get(k)} on rank 0 and {own.get(k)} on another" for k in apart[:1]]
    said = [text for some in MPI.COMM_WORLD.allgather(said) for text in some]
    if said:
        raise SceneError(f"{said[0]}; all ranks must get the same command with the same options")


def _starts_several() -> bool:
    """Decide whether MPI has started several processes, told without loading it."""
    sizes = [os.environ[name] for name in SIZE_VARIABLES if name in os.environ]
    return several_ranks() or (bool(sizes) and sizes[0] != "1")


def _sentence(error: BaseException) -> tuple[str, int]:
    """Find the message of an error for the user, and the exit code; nothing of a bug."""
    if isinstance(error, Unprinted):
        said = (
            f"error: the output cannot be written ({error}); everything else is finished and saved"
        )
        return said, EXIT + signal.SIGPIPE if error.broken else 1
    if isinstance(error, KeyboardInterrupt) or STOPPING.requested is not None:
        # a compiler that gets the signal, too, fails in its own way
        number = getattr(error, "signal", STOPPING.requested) or signal.SIGINT
        said = str(error) if isinstance(error, Stopped) else "nothing is left of it"
        return f"error: stopped by {signal.Signals(number).name}: {said}", EXIT + number
    if isinstance(error, FailedCheck):
        return str(error), 1
    if isinstance(error, ShellmbError):
        return f"error: {error}", 2 if isinstance(error, SceneError) else 1
    if isinstance(error, MemoryError):
        return f"error: the scene does not fit the memory ({error}); use coarser meshes", 1
    if isinstance(error, Exception) and user_frame(error) is not None:
        notes = "; ".join(["", *getattr(error, "__notes__", [])])
        return f"error: a function of the scene fails: {in_words(error)}{notes}", 1
    return "", 1


def _end_alone(sentence: str, code: int) -> None:
    """End all ranks, of which others may wait for this one; if all come here, the first speaks."""
    MPI = sys.modules["mpi4py.MPI"]
    if not first_rank():
        time.sleep(PATIENCE)
    barrier.end_all(MPI.COMM_WORLD, sentence, code)


def met() -> bool:
    """Decide whether all ranks have come here, where one ends with an error.

    The others, which may have been asked for something else, would wait for it for ever.
    """
    if not several_ranks() and (not _starts_several() or "mpi4py.MPI" in sys.modules):
        return True
    from mpi4py import MPI

    return barrier.met(MPI.COMM_WORLD)


class App(typer.Typer):
    """The commands, started by a user: streams may be full, and ranks asked for other things."""

    def command[F: Callable[..., Any]](
        self, name: str | None = None, **more: Any
    ) -> Callable[[F], F]:
        """Add a command, which knows former names of options."""
        return super().command(name, cls=Command, **more)

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """Run a command and end the process."""
        sys.stdout = Stream(sys.stdout, 1, forgiving=False)
        sys.stderr = Stream(sys.stderr, 2, forgiving=True)
        code: Any = 0
        try:
            try:
                super().__call__(*args, **kwargs)
            except SystemExit as end:
                code = end.code
                if code and not met():
                    barrier.end_all(sys.modules["mpi4py.MPI"].COMM_WORLD, "", int(code))
            sys.stdout.flush()
        except Unprinted as error:
            sentence, failed = _sentence(error)
            tell(sentence)
            code = code or failed
        raise SystemExit(code)


def _end_together(code: int) -> None:
    """End the process where the others end, on several ranks.

    Meshes, matrices and solvers of the run are not freed: that is collective, and would have to
    come in the same order on all ranks. A cycle of references on one of them, which any library
    may make, changes that order, and the ranks would wait for one another for ever.

    Args:
        code: Exit code.
    """
    if not several_ranks():
        return
    MPI = sys.modules["mpi4py.MPI"]
    with suppress(Unprinted):
        sys.stdout.flush()
    sys.stderr.flush()
    MPI.COMM_WORLD.Barrier()
    MPI.Finalize()
    os._exit(code)
