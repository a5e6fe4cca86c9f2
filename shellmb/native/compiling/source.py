"""The loops in C as one library: its source, its name, and how a compiler makes it.

The installation makes it as well, where nothing but cffi is there (`installing.py`).
"""

import hashlib
import os
import re
import shlex
import subprocess
import sys
import sysconfig
from collections.abc import Sequence
from pathlib import Path

import cffi  # type: ignore[import-untyped]

from shellmb.errors import RunError
from shellmb.native.compiling.flags import COMPILER_FLAGS
from shellmb.native.compiling.folder import SAY, writing
from shellmb.native.programs.translation import CODES

NATIVE = Path(__file__).parents[1]
# integrals of a form at most, and functions that interpret the program of each
INTEGRALS, INTERPRETERS = 8, ("interpret_one", "interpret_lanes")
# the head of a function that is not static
EXPORTED = re.compile(r"^(?:void|int|double)\b[^;{}]*\)(?=\n\{)", re.MULTILINE)
# where the installation puts the library
INSTALLED = NATIVE / f"loops{sysconfig.get_config_var('EXT_SUFFIX')}"

NAME = "it must name a C compiler, as gcc does"


def named_source() -> tuple[str, str, str]:
    """The library's name, which tells what it is made of and for, its declarations, and its C."""
    here = NATIVE / "c"
    first = ("cells.h", "apart.c", "kernels.c", "cells.c", "passes.c")
    last = ("bases.c", "nodes.c", "banded.c", "unknowns.c", "sides.c")
    header, *others = ((here / name).read_text() for name in (*first, *last))
    header += (here / "programs.h").read_text()
    # what is not static is for Python, and for what stands before it
    header += "".join(f"{found};\n" for found in re.findall(EXPORTED, "\n".join(others)))
    kinds = "const double *, const double *, const double *, const int *, const uint8_t *, void *"
    for k in range(INTEGRALS):
        header += "".join(f"void {f}_{k}(double *, {kinds});\n" for f in INTERPRETERS)
    common, both = ((here / name).read_text() for name in ("programs.c", "program.c"))
    common += f"enum {{ {', '.join(CODES).upper()} }};\n"
    ends = "#undef V\n#undef NAME\n#undef FIXED\n#undef INLINED"
    inlined = "inline __attribute__((always_inline))"
    for kind, name, fixed, how in (("double", "one", 0, ""), ("lanes", "lanes", 1, inlined)):
        both_names = f"#define V {kind}\n#define NAME(f) f##_of_{name}\n#define FIXED {fixed}"
        both_names += f"\n#define INLINED {how}"
        others += [common, both_names, both, ends]
        common = ""
    each = [f"INTERPRET({k})" for k in range(INTEGRALS)]
    source = "\n".join([*others, (here / "interpret.c").read_text(), *each])
    key = "\n".join([header, source, sys.version, *COMPILER_FLAGS])
    return f"shellmb_cells_{hashlib.sha256(key.encode()).hexdigest()[:16]}", header, source


def write_c(folder: Path, named: tuple[str, str, str]) -> Path:
    """Write the library's C, with what Python needs to call it, under a name of this process.

    Args:
        folder: The folder.
        named: As from `named_source`.
    """
    name, header, source = named
    ffi = cffi.FFI()
    ffi.cdef(header)
    headers = "#include <math.h>\n#include <stdint.h>\n" + header
    ffi.set_source(name, headers + source, compiler_verbose=False)
    scratch = folder / f"{name}.{os.getpid()}.c"
    with writing(folder):
        ffi.emit_c_code(str(scratch))
    return scratch


def compile_c(source: Path, target: Path) -> None:
    """Make the library of a C file, which is removed.

    Args:
        source: The C, named as the library and something more.
        target: The library.

    Raises:
        RunError: If the compiler fails, or there is no room.
    """
    made = source.with_suffix(".so")
    try:
        include = f"-I{sysconfig.get_path('include')}"
        with writing(target.parent):
            _run_compiler([*COMPILER_FLAGS, include, str(source)], made)
            # at once: another process may look for it at any moment
            made.replace(target)
    finally:
        source.unlink()


def _run_compiler(arguments: Sequence[str], made: Path) -> None:
    """Make a shared library.

    Args:
        arguments: Of the C compiler, which is `$CC`, or the one of Python.
        made: The library, a file that nobody looks for.

    Raises:
        RunError: If there is no compiler, or it fails.
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
