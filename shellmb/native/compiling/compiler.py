"""The C compiler."""

import os
import shlex
import subprocess
import sysconfig
from collections.abc import Iterable, Sequence
from pathlib import Path

from shellmb.errors import RunError
from shellmb.native.compiling.store import SAY, is_library, seal

NAME = "it must name a C compiler, as gcc does"


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
            f"there is no C compiler '{command[0]}' ({error.strerror}), which the loops over "
            "cells need: install gcc, or name another one by the environment variable CC"
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
