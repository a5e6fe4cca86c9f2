"""Messages of C++ that nobody can switch off, left out without touching the process's streams."""

import ctypes
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache

# state of a stream of C++ in which it drops what is written to it, `std::ios::failbit`
FAILED = 4
CLEAR = "_ZNSt9basic_iosIcSt11char_traitsIcEE5clearESt12_Ios_Iostate"


@contextmanager
def without_messages() -> Iterator[None]:
    """Let `std::cerr` drop what C++ writes to it, where GNU's library of C++ is in use.

    The file descriptor is left alone: Python, C and other processes write to it as before.
    """
    clear = _clear()
    clear(FAILED)
    try:
        yield
    finally:
        clear(0)


@cache
def _clear() -> Callable[[int], object]:
    """`std::cerr.clear(state)`, by the names and tables that the ABI of C++ prescribes."""
    word, table = ctypes.sizeof(ctypes.c_void_p), 0
    with suppress(OSError, AttributeError, ValueError):
        library = ctypes.CDLL("libstdc++.so.6")
        stream = ctypes.addressof(ctypes.c_char.in_dll(library, "_ZSt4cerr"))
        function = getattr(library, CLEAR)
        table = ctypes.c_ssize_t.from_address(stream).value
    if not table:
        # another library of C++, or another stream in use: messages are seen
        return lambda state: None
    # the offset of the virtual base class `std::ios` is the third entry before the table
    base = stream + ctypes.c_ssize_t.from_address(table - 3 * word).value
    function.argtypes, function.restype = [ctypes.c_void_p, ctypes.c_int], None
    return lambda state: function(base, state)
