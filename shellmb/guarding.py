"""Surroundings of a process: the user's own options of libraries, signals, and standard streams.

PETSc, DOLFINx and FFCx read options from the current folder, which may hold somebody else's run: a
cache of code, which is executed, libraries to be loaded, files to be written. They get what
is in the user's home, and in variables of the environment. matplotlib's file of the current folder
changes pictures only, and is left out where we draw (`shellmb.observers.drawing`).
"""

import importlib.abc
import importlib.machinery
import importlib.util
import json
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType
from typing import Any

# longer files are no options [bytes]
LONGEST = 1_000_000

# Ctrl-C, batch systems, a terminal that is closed, Ctrl-\\, a pipe that nobody reads any more
NAMES = ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGPIPE", "SIGXCPU", "SIGUSR1", "SIGUSR2")
SIGNALS: tuple[int, ...] = tuple(getattr(signal, n) for n in NAMES if hasattr(signal, n))

STREAMS = ("stdin", "stdout", "stderr")


def isolate() -> None:
    """See to it for libraries that are imported from now on, and for those that were before."""
    if not any(isinstance(finder, _Finder) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Finder())
    for name, after in _AFTER.items():
        if name in sys.modules:
            after(sys.modules[name])


def petsc_options() -> list[str]:
    """Arguments of PETSc: no files but the user's, signals are ours (`guarding.stopping`)."""
    options = ["shellmb", "-skip_petscrc", "-no_signal_handler"]
    home = Path(os.path.expanduser("~"), ".petscrc")
    return [*options, "-options_file", str(home)] if home.is_file() else options


def cache_root() -> Path:
    """Folder of the user's caches: `$XDG_CACHE_HOME`, if that is a full path, or `~/.cache`."""
    return _home("XDG_CACHE_HOME", ".cache")


def _home(variable: str, otherwise: str) -> Path:
    given = os.environ.get(variable, "")
    # relative ones mean nothing, says the XDG Base Directory Specification
    return Path(given) if os.path.isabs(given) else Path(os.path.expanduser("~"), otherwise)


def user_options(library: str, name: str) -> dict[str, Any]:
    """Options of a library of FEniCS from the user's file.

    Args:
        library: The library.
        name: Name of the file.
    """
    file = _home("XDG_CONFIG_HOME", ".config") / library / name
    if not file.is_file() or file.stat().st_size > LONGEST:
        return {}
    found = json.loads(file.read_text())
    return found if isinstance(found, dict) else {}


@contextmanager
def _elsewhere() -> Iterator[None]:
    """The current folder is one where only the system's owner writes."""
    here = os.open(".", os.O_PATH | os.O_DIRECTORY | os.O_CLOEXEC)
    os.chdir("/")
    try:
        yield
    finally:
        os.fchdir(here)
        os.close(here)


def _read_options(module: Any) -> None:
    """Let a library of FEniCS read its files of options: it reads them once and remembers them."""
    with _elsewhere():
        try:
            module.get_options()
        except OSError:
            # a home that is no folder, or that is closed to us, holds no options
            given = os.environ.get("XDG_CONFIG_HOME")
            os.environ["XDG_CONFIG_HOME"] = "/"
            try:
                module.get_options()
            finally:
                del os.environ["XDG_CONFIG_HOME"]
                if given is not None:
                    os.environ["XDG_CONFIG_HOME"] = given


def _initialise(module: ModuleType) -> None:
    """Start PETSc with our arguments, before its module does so without any."""
    import petsc4py

    petsc4py.init(petsc_options())


_BEFORE: dict[str, Callable[[ModuleType], None]] = {"petsc4py.PETSc": _initialise}
_AFTER: dict[str, Callable[[ModuleType], None]] = {
    "dolfinx.jit": _read_options,
    "ffcx.options": _read_options,
}

# an exception of a signal's handler within the native modules of these packages, or between their
# creation and their initialisation, is a segmentation fault; their Python modules load them
_NATIVE = ("basix", "dolfinx", "mpi4py", "petsc4py")


class _Finder(importlib.abc.MetaPathFinder):
    """Finds the modules above where all are found, and sees to them when they are executed."""

    def find_spec(self, fullname: str, path: Any, target: Any = None) -> ModuleSpec | None:
        """The specification of one of them."""
        named = fullname in _BEFORE or fullname in _AFTER
        if not named and fullname.partition(".")[0] not in _NATIVE:
            return None
        spec = importlib.machinery.PathFinder.find_spec(fullname, path, target)
        if spec is not None and spec.loader is not None:
            loader: Any = spec.loader
            loader.exec_module = partial(_execute, loader.exec_module)
        return spec


def _execute(own: Callable[[ModuleType], None], module: ModuleType) -> None:
    """Execute a module, and what comes before and behind it; signals come when it is there."""
    with held():
        _BEFORE.get(module.__name__, _nothing)(module)
        own(module)
        _AFTER.get(module.__name__, _nothing)(module)


def _nothing(module: ModuleType) -> None:
    pass


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
