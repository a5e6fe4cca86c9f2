"""The clock that parts of a run are timed by: wall time, or a benchmark's choice."""

import time
from collections.abc import Callable
from contextvars import ContextVar

CHOSEN: ContextVar[Callable[[], float]] = ContextVar("clock", default=time.perf_counter)


def now() -> float:
    """Time on that clock, s."""
    return CHOSEN.get()()
