"""The clock that parts of a run are timed by: wall time, or a benchmark's choice."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

_CHOSEN: ContextVar[Callable[[], float]] = ContextVar("clock", default=time.perf_counter)


def now() -> float:
    """Time on that clock, s."""
    return _CHOSEN.get()()


@contextmanager
def timed_by(clock: Callable[[], float]) -> Iterator[None]:
    """Time by another clock meanwhile.

    Args:
        clock: Returns a time, s.
    """
    token = _CHOSEN.set(clock)
    try:
        yield
    finally:
        _CHOSEN.reset(token)
