"""Signals that end a process: taken up between two steps where a run goes on, at once elsewhere."""

import os
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any

from shellmb.barrier import end_all, met
from shellmb.errors import ShellmbError, Stopped
from shellmb.guarding import SIGNALS

_PIPE = getattr(signal, "SIGPIPE", None)
# what a shell adds to the number of the signal that ended a process
EXIT = 128


def several_ranks() -> bool:
    """Decide whether this process is one of several of an MPI program, without loading MPI."""
    MPI = sys.modules.get("mpi4py.MPI")
    return MPI is not None and MPI.Is_initialized() and MPI.COMM_WORLD.size > 1


class Stopping:
    """Requests of signals to this process.

    Attributes:
        requested: The signal that has come and is not taken up yet.
    """

    def __init__(self) -> None:
        self.requested: int | None = None
        self._deferred: Callable[[str], None] | None = None
        self._ours: set[int] = set()

    @contextmanager
    def caught(self) -> Iterator[None]:
        """Signals that would end the process raise `Stopped`, or are kept for `take`.

        Handlers of others are left in place, and only the main thread can have any.
        """
        before: dict[int, Any] = {}
        if threading.current_thread() is threading.main_thread():
            for number in SIGNALS:
                # Python ignores SIGPIPE, as nobody asked it to
                usual = [signal.SIG_DFL, signal.default_int_handler]
                usual += [signal.SIG_IGN] if number == _PIPE else []
                if signal.getsignal(number) in usual:
                    before[number] = signal.signal(number, self._come)
        self._ours |= before.keys()
        try:
            yield
        finally:
            self._ours -= before.keys()
            for number, handler in before.items():
                signal.signal(number, handler)
            if before:
                self.requested = None

    def answered(self) -> None:
        """A signal has been taken up, and the user informed."""
        self.requested = None

    def renew(self) -> None:
        """Take the signals back from PETSc, which takes them for itself when it is loaded."""
        for number in self._ours:
            signal.signal(number, self._come)

    @contextmanager
    def deferred(self, tell: Callable[[str], None]) -> Iterator[None]:
        """Signals wait until they are taken up; the second one does not.

        Args:
            tell: Gets a line for the user at the first.
        """
        outer, self._deferred = self._deferred, tell
        try:
            yield
        finally:
            self._deferred = outer

    def _come(self, number: int, frame: FrameType | None) -> None:
        if number == _PIPE and self._deferred is None:
            # whoever writes is told, too
            return
        again, self.requested = self.requested is not None, number
        if self._deferred is not None and not again:
            self._deferred("stopping behind this step; once more stops at once")
        elif several_ranks():
            # one rank alone cannot end in order: mpiexec ends the others
            if sys.modules["mpi4py.MPI"].COMM_WORLD.rank == 0:
                with suppress(OSError):
                    os.write(2, b"error: stopped at once; what was written before is left\n")
            os._exit(EXIT + number)
        else:
            raise Stopped(number)


@contextmanager
def failing_together(comm: Any) -> Iterator[None]:
    """Context in which an error that one rank has alone ends all: the others would wait for ever.

    Our own errors are those of all ranks, if they do not say that they may be of one, and others
    may be.

    Args:
        comm: The ranks.
    """
    try:
        yield
    except Exception as error:
        shared = isinstance(error, ShellmbError) and not getattr(error, "alone", False)
        if comm.size > 1 and not shared and not met(comm):
            if not isinstance(error, ShellmbError | OSError):
                traceback.print_exc()
            why = f"error: rank {comm.rank} fails alone, and all ranks end with it: {error}"
            end_all(comm, why, 1)
        raise


# signals are of the process, and so is this
STOPPING = Stopping()
