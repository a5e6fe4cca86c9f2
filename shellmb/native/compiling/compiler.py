"""Kernels of forms and expressions compiled side by side into the cache.

FFCx writes the C code of one form after the other in this process, while C compilers work on the
code of those before: on two cores that halves the wait. No process is forked (MPI and PETSc do not
survive that) and no form is sent anywhere (they do not pickle). What comes out is a library with
nothing but FFCx's code. A module for Python, as DOLFINx makes of it, has ten times the code of a
small kernel: gcc takes twice as long, and it is loaded in 0.7 ms in place of 0.1. Small kernels are
compiled together, into one library that has the names of all.
"""

import logging
import math
import os
import shlex
import shutil
import subprocess
import sysconfig
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path

from mpi4py import MPI as _MPI  # noqa: F401  (before dolfinx)

import ffcx.codegeneration
from ufl import Form

from shellmb.errors import RunError
from shellmb.locks import FileLock
from shellmb.native.compiling.flags import Item
from shellmb.native.compiling.generated import code
from shellmb.native.compiling.store import SAY, is_library, is_whole, seal, writing

Tell = Callable[[int, int], None]
# Forms and expressions by the names of their kernels, with the flags of the C compiler
Wanted = Mapping[str, tuple[Item, Sequence[str]]]

_log = logging.getLogger(__name__)

# Characters of code that a C compiler is worth starting for: it takes 0.03 s to start, link and
# read headers, and 0.3 s for as much
GROUP = 100_000
NAME = "it must name a C compiler, as gcc does"


def compile_new(items: Wanted, folder: Path, tell: Tell) -> None:
    """Compile forms and expressions into the cache; on one rank.

    Args:
        items: Forms that are not empty, and expressions, which are not in the cache.
        folder: The cache.
        tell: Called with the number of a kernel and how many there are, before each.

    Raises:
        RunError: If the C compiler fails, or the cache cannot be written.
    """
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    # the largest first, so that its compiler is not the one that all wait for in the end
    names = sorted(items, key=lambda name: -_size(items[name][0]))
    left = _compile({name: items[name] for name in names}, folder, tell, wait=False)
    # one by one: who waits holds nothing that the other might wait for
    for name in left:
        _compile({name: items[name]}, folder, tell, wait=True)


def _compile(items: Wanted, folder: Path, tell: Tell, wait: bool) -> list[str]:
    """Compile some; or leave those that another process compiles, whose names are returned.

    Args:
        items: As of `compile_new`, as are the others.
        folder: The cache.
        tell: Called before each.
        wait: Whether to wait for the other process.
    """
    cores = len(os.sched_getaffinity(0))
    started: list[Future[None]] = []
    left: list[str] = []
    groups: dict[tuple[str, ...], dict[str, str]] = {}
    with ExitStack() as locks, ThreadPoolExecutor(max_workers=cores) as pool:

        def start(flags: tuple[str, ...]) -> None:
            started.append(pool.submit(_make_libraries, folder, groups.pop(flags), flags))

        try:
            for number, (name, (item, flags)) in enumerate(items.items(), start=1):
                tell(number, len(items))
                if not locked(folder / f"{name}.lock", locks, wait):
                    left.append(name)
                elif not is_whole(library(folder, name)):
                    group = groups.setdefault(tuple(flags), {})
                    group[name] = code(item, name, flags)
                    if sum(map(len, group.values())) > GROUP:
                        start(tuple(flags))
            for alike in list(groups):
                start(alike)
            for future in started:
                future.result()
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    return left


def library(folder: Path, name: str) -> Path:
    """Path of a kernel, which is there as soon as it is complete."""
    return folder / f"{name}.so"


def locked(path: Path, locks: ExitStack, wait: bool) -> bool:
    """Decide whether a lock is ours.

    Args:
        path: Its file.
        locks: Gets it.
        wait: Whether to wait for another process, which is told.
    """
    lock = FileLock(path)
    try:
        if not lock.acquire():
            if not wait:
                return False
            _log.warning("waiting for %s, which compiles the same kernel", lock.owner)
            lock.acquire(wait=True)
    except OSError as error:
        _log.warning("the cache of kernels cannot be locked (%s)", error)
    locks.callback(lock.release)
    return True


def _size(item: Item) -> int:
    """Entries of a cell's tensor: what tells large kernels from small ones."""
    arguments = item.arguments() if isinstance(item, Form) else ()
    elements = (a.ufl_function_space().ufl_element() for a in arguments)
    return math.prod(element.dim for element in elements)


def _make_libraries(folder: Path, codes: Mapping[str, str], flags: Sequence[str]) -> None:
    """Compile the codes of kernels together: one library that is there by the names of all."""
    first = next(iter(codes))
    source, made = folder / f"{first}.c", folder / f"{first}.so.{os.getpid()}"
    include = f"-I{ffcx.codegeneration.get_include_path()}"
    with writing(folder):
        source.write_text("\n".join(codes.values()))
        run_compiler([*flags, include, str(source)], made, codes)
        for name in codes:
            # at once: another process may look for it at any moment
            link = made.with_name(f"{name}.link.{os.getpid()}")
            try:
                link.hardlink_to(made)
            except OSError:
                # a file system that has none
                shutil.copyfile(made, link)
            link.replace(library(folder, name))
        made.unlink()


def run_compiler(arguments: Sequence[str], made: Path, symbols: Iterable[str]) -> None:
    """Make a shared library.

    Args:
        arguments: Of the C compiler, which is `$CC`, or the one of Python.
        made: The library, a file that nobody looks for.
        symbols: Names that it has to have.

    Raises:
        RunError: If there is no compiler, or it fails, or what it writes is no library.
    """
    compiler = os.environ.get("CC") or sysconfig.get_config_var("CC") or "cc"
    try:
        program = shlex.split(compiler)
    except ValueError as error:
        raise RunError(f"the environment variable CC is {compiler!r} ({error}); {NAME}") from error
    if not program:
        raise RunError(f"the environment variable CC is {compiler!r}; {NAME}")
    command = [*program, "-std=c17", "-shared", "-fPIC", "-fwrapv", "-DNDEBUG"]
    command += [*arguments, "-o", str(made)]
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, errors="replace", stdin=subprocess.DEVNULL
        )
    except OSError as error:
        raise RunError(
            f"there is no C compiler '{command[0]}' ({error.strerror}), which new kernels need: "
            "install gcc, or name another one by the environment variable CC"
        ) from error
    if done.returncode != 0:
        made.unlink(missing_ok=True)
        full = f"; {SAY}, or make room" if "No space left" in done.stderr else ""
        raise RunError(f"the C compiler fails{full}: {shlex.join(command)}\n{done.stderr}")
    content = made.read_bytes() if made.is_file() else b""
    if not is_library(content) or not all(name.encode() in content for name in symbols):
        made.unlink(missing_ok=True)
        raise RunError(
            f"the C compiler '{compiler}' ends without an error, and what it writes is not the "
            "library that was requested; install gcc, or name another compiler by the environment "
            "variable CC"
        )
    seal(made)
