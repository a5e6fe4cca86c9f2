"""Standard streams of a command that are closed, full, or read by nobody any more."""

import os
import sys
from collections.abc import Callable
from typing import Any

NAMES = ("stdin", "stdout", "stderr")


def open_closed() -> None:
    """Let closed streams lead nowhere: the next file of a run would get their numbers.

    What libraries write to "stderr" would then stand in that file.
    """
    for number, name in enumerate(NAMES):
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
