"""The loops in C as one library: its source, its name and how it is made.

The installation makes it as well, where nothing but cffi is there (`installing.py`).
"""

import hashlib
import os
import re
import sys
import sysconfig
from pathlib import Path

import cffi  # type: ignore[import-untyped]

from shellmb.native.compiling.compiler import run_compiler
from shellmb.native.compiling.flags import COMPILER_FLAGS
from shellmb.native.compiling.store import writing
from shellmb.native.programs.translation import CODES

NATIVE = Path(__file__).parents[1]
# integrals of a form at most, and functions that interpret the program of each
INTEGRALS, INTERPRETERS = 8, ("interpret_one", "interpret_lanes")
# the head of a function that is not static
EXPORTED = re.compile(r"^(?:void|int|double)\b[^;{}]*\)(?=\n\{)", re.MULTILINE)
# where the installation puts the library
INSTALLED = NATIVE / f"loops{sysconfig.get_config_var('EXT_SUFFIX')}"


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
        begins = f"PyInit_{source.name.partition('.')[0]}"
        with writing(target.parent):
            run_compiler([*COMPILER_FLAGS, include, str(source)], made, [begins])
            # at once: another process may look for it at any moment
            made.replace(target)
    finally:
        source.unlink()
