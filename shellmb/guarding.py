"""Surroundings of a process: signals, and standard streams."""

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

# Ctrl-C, batch systems, a terminal that is closed, Ctrl-\\, a pipe that nobody reads any more
NAMES = ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGPIPE", "SIGXCPU", "SIGUSR1", "SIGUSR2")
SIGNALS: tuple[int, ...] = tuple(getattr(signal, n) for n in NAMES if hasattr(signal, n))

STREAMS = ("stdin", "stdout", "stderr")


@contextmanager
def held() -> Iterator[None]:
    """Signals come behind this, whoever handles them.

    A handler that raises inside native code that is being loaded ends the process by a segmentation
    fault: the initialisation of nanobind's modules calls Python and does not expect an exception.
    """
    came: list[int] = []
    before: dict[int, Any] = {}
    if threading.current_thread() is threading.main_thread():
        handlers = {number: signal.getsignal(number) for number in SIGNALS}
        before = {number: handler for number, handler in handlers.items() if callable(handler)}
        for number in before:
            signal.signal(number, lambda number, frame: came.append(number))
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        for number in came[:1]:
            signal.raise_signal(number)


def open_closed() -> None:
    """Let closed streams lead nowhere: the next file of a run would get their numbers.

    What libraries write to "stderr" would then stand in that file.
    """
    for number, name in enumerate(STREAMS):
        try:
            os.fstat(number)
        except OSError:
            silence(number)
        if getattr(sys, name) is None:
            mode = "w" if number else "r"
            setattr(sys, name, open(os.devnull, mode))


def silence(number: int) -> None:
    """Let a stream lead nowhere.

    Args:
        number: Of its descriptor.
    """
    nowhere = os.open(os.devnull, os.O_RDWR)
    if nowhere != number:
        os.dup2(nowhere, number)
        os.close(nowhere)


@contextmanager
def silenced(number: int) -> Iterator[None]:
    """A stream leads nowhere meanwhile: messages of C++ that nobody can switch off.

    Args:
        number: Of its descriptor.
    """
    kept = os.dup(number)
    silence(number)
    try:
        yield
    finally:
        os.dup2(kept, number)
        os.close(kept)


class Unprinted(Exception):
    """Output of a command that cannot be written.

    Args:
        why: What the system says.
    """

    def __init__(self, why: OSError) -> None:
        super().__init__(why.strerror)
        self.broken = isinstance(why, BrokenPipeError)


class Stream:
    """A standard stream that leads nowhere once it cannot be written.

    Args:
        stream: The stream.
        number: Of its descriptor.
        forgiving: Whether failures are silent, as on the stream for messages.
    """

    def __init__(self, stream: Any, number: int, forgiving: bool) -> None:
        self._stream, self._number, self._forgiving = stream, number, forgiving

    def write(self, text: str) -> int:
        """Write a text.

        Raises:
            Unprinted: If it cannot be, and that matters.
        """
        self._try(self._stream.write, text)
        return len(text)

    def flush(self) -> None:
        """Write what is left.

        Raises:
            Unprinted: If it cannot be, and that matters.
        """
        self._try(self._stream.flush)

    def _try(self, act: Callable[..., Any], *args: str) -> None:
        try:
            act(*args)
        except OSError as error:
            silence(self._number)
            if not self._forgiving:
                raise Unprinted(error) from None

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)
