"""Signals that end a process, and native code in which their handlers must not raise."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

# Ctrl-C, batch systems, a terminal that is closed, Ctrl-\\, a pipe that nobody reads any more
NAMES = ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGPIPE", "SIGXCPU", "SIGUSR1", "SIGUSR2")
SIGNALS: tuple[int, ...] = tuple(getattr(signal, n) for n in NAMES if hasattr(signal, n))


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
