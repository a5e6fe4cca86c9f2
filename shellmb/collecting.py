"""Python's garbage collector, where objects are made by the million and few of them in circles."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager

# new objects between two looks
SELDOM = 100_000


@contextmanager
def seldom() -> Iterator[None]:
    """The collector looks at new objects, and at old ones with them, less often meanwhile."""
    before = gc.get_threshold()
    gc.set_threshold(SELDOM, *before[1:])
    try:
        yield
    finally:
        gc.set_threshold(*before)
