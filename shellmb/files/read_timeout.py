"""Time limit of readers of others, which wait for ever for what a cut file does not have."""

import ctypes
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

# time that any file may take [s], and what a reader in Python takes per byte, several times
LEAST, PER_BYTE = 20.0, 2e-5


class ReadTimeout(Exception):
    """A reader that does not come to an end."""

    def __str__(self) -> str:
        return "it is not read to its end in a long time, as if it were cut off"


@contextmanager
def reading(file: Path) -> Iterator[None]:
    """Raise an error in this thread if a file takes far too long; for readers that are in Python.

    Args:
        file: The file, whose size says how long it may take.

    Raises:
        ReadTimeout: If it does.
    """
    thread = ctypes.c_ulong(threading.get_ident())
    ended = threading.Lock()

    def stop() -> None:
        with ended:
            if not done:
                ctypes.pythonapi.PyThreadState_SetAsyncExc(thread, ctypes.py_object(ReadTimeout))

    done = False
    timer = threading.Timer(LEAST + PER_BYTE * file.stat().st_size, stop)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        with ended:
            done = True
        timer.cancel()
