"""The errors shellmb raises on purpose; everything else is a bug."""

from __future__ import annotations

import contextlib
import os
import warnings
from collections.abc import Callable, Iterator
from typing import Any


class ShellmbError(Exception):
    """Base of every error that a user of shellmb can cause and mend."""


class SceneError(ShellmbError):
    """A scene that describes something impossible; the text says what would be right.

    It is deliberately no :class:`ValueError`: pydantic would catch that inside a validator and
    wrap it, while this one reaches the user as it was raised.
    """


class UnheldError(SceneError):
    """Motions of a static scene that no support, joint or spring holds; its loads may."""


class ShellmbWarning(UserWarning):
    """Warning about a choice that is hardly meant or an unreliable result, in one sentence.

    Emitted by :func:`warn`; the commands show it as a line of its own.
    """


def warn(sentence: str, category: type[Warning] = ShellmbWarning) -> None:
    """Warn at the line of the user's that led here, however deep this is.

    Args:
        sentence: What to say.
        category: What kind of warning it is.
    """
    import functools

    import pydantic

    # what stands between a user's line and ours: checks of dataclasses, and decorators; a whole
    # path is no prefix of itself to Python 3.12
    folders = (os.path.join(os.path.dirname(f), "") for f in (__file__, pydantic.__file__))
    files = (str(module.__file__).removesuffix(".py") for module in (functools, contextlib))
    warnings.warn(sentence, category, skip_file_prefixes=(*folders, *files))


@contextlib.contextmanager
def unsaid() -> Iterator[None]:
    """Context in which the project warns of nothing, as of a scene beside the one that has."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ShellmbWarning)
        yield


class ConvergenceError(ShellmbError):
    """A nonlinear solve that did not converge; the text says which field, where, what to try.

    Args:
        message: What happened and what to try.
        field: Name of the field that did not converge, if known.
        norms: Last relative update of each field.
    """

    def __init__(
        self, message: str, field: str | None = None, norms: dict[str, float] | None = None
    ) -> None:
        super().__init__(message)
        self.field = field
        self.norms = norms or {}

    def reworded(self, message: str) -> ConvergenceError:
        """Error of the same field with another text.

        Args:
            message: The text.
        """
        return ConvergenceError(message, self.field, self.norms)


class TooFewModesError(ConvergenceError):
    """There are fewer modes than were requested.

    Args:
        message: What happened and what to try; none: one with the number of modes.
        count: Number of modes that were requested.
        there: Number of modes that there are.
    """

    # a message alone is enough, as other ranks make the error anew
    def __init__(self, message: str = "", *, count: int = 0, there: int = 0) -> None:
        known = f"modes: count is {count}; there are {there or 'no'} modes"
        super().__init__(message or known + (", request no more" if there else ""))
        self.there = there


class RunError(ShellmbError):
    """Something outside the mechanics ended a run: a full disk, or a user's function that raises.

    Args:
        message: What happened, and what is left.
        alone: Whether other ranks may not know and go on.
    """

    def __init__(self, message: str, alone: bool = False) -> None:
        super().__init__(message)
        self.alone = alone


class ControlError(RunError):
    """A controller or an event that fails in a run, on all ranks alike; the text names it."""


class Stopped(KeyboardInterrupt):
    """Ctrl-C, or SIGTERM; all ranks together where a run was stopped between two steps.

    Args:
        signal: Number of the signal.
        message: What is left, and how to go on.
    """

    def __init__(self, signal: int, message: str = "nothing is left of it") -> None:
        super().__init__(message)
        self.signal = signal


@contextlib.contextmanager
def petsc_in_words() -> Iterator[None]:
    """Turn what PETSc and SLEPc raise into a sentence, with their own text at its end.

    Raises:
        ConvergenceError: In place of such an error.
    """
    try:
        yield
    except Exception as error:
        said = str(error).splitlines()
        bound = type(error).__module__.partition(".")[0] in ("petsc4py", "slepc4py")
        if not bound and not (isinstance(error, RuntimeError) and "PETSc" in str(error)):
            raise
        # between the first line, which has the code, and the last one, which has the reason, are
        # places in PETSc
        text = " ... ".join(dict.fromkeys(line.strip() for line in (said[0], said[-1])))
        raise ConvergenceError(
            "a linear system could not be solved; look for bodies that nothing holds, elements "
            "without area, and stiffness, mass or directions that are zero or not finite "
            f"(PETSc: {text})"
        ) from error


@contextlib.contextmanager
def alike(comm: Any) -> Iterator[None]:
    """Context in which what fails on one rank fails on all of them; collective.

    Args:
        comm: The ranks.

    Raises:
        SceneError: On all ranks, that of the first one that fails; and so are others.
    """
    wrong: Exception | None = None
    try:
        yield
    except Exception as error:
        if comm.size == 1:
            raise
        # not every error can be sent: those of user code go as text
        wrong = error if isinstance(error, ShellmbError) else RuntimeError(repr(error))
    wrong = next((each for each in comm.allgather(wrong) if each is not None), None)
    if wrong is not None:
        raise wrong


def of_first[T](comm: Any, read: Callable[[], T]) -> T:
    """Result that a function has on the first rank, on all ranks; collective.

    Args:
        comm: The ranks.
        read: The function, which reads files.

    Raises:
        SceneError: On all ranks, if it does on the first one; and so are others.
    """
    found: T | None = None
    with alike(comm):
        if comm.rank == 0:
            found = read()
    every: T = comm.bcast(found)
    return every
