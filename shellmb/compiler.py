"""Kernels compiled side by side into the cache of DOLFINx, which finds them there.

FFCx writes the C code of one form after the other in this process, while C compilers work on the
code of those before: on two cores that halves the wait. No process is forked (MPI and PETSc do not
survive that) and no form is sent anywhere (they do not pickle). Files and locks are those of
`ffcx.codegeneration.jit`, whose version is fixed with DOLFINx's: other processes may wait for them.
"""

import math
import os
import shlex
import subprocess
import sysconfig
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from mpi4py import MPI as _MPI  # noqa: F401  (before dolfinx)

import cffi  # type: ignore[import-untyped]
import ffcx.codegeneration
import ffcx.naming
import ffcx.options
import numpy as np
from dolfinx import default_scalar_type, jit
from ffcx.codegeneration import jit as files
from ufl import Form

from shellmb.locks import FileLock

Tell = Callable[[int, int], None]


def compile_new(forms: Sequence[Form], jit_options: Mapping[str, Any], tell: Tell) -> None:
    """Compile those of some forms that are not in the cache; on one rank.

    Args:
        forms: Forms that are not empty.
        jit_options: Options of DOLFINx's compilation.
        tell: Called with the number of a kernel and how many there are, before each.

    Raises:
        RuntimeError: If the C compiler fails.
    """
    options = ffcx.options.get_options({"scalar_type": default_scalar_type})
    chosen = jit.get_options(dict(jit_options))
    folder, flags = Path(chosen["cache_dir"]), chosen["cffi_extra_compile_args"]
    folder.mkdir(parents=True, exist_ok=True)
    salt = files._compute_option_signature(options)
    salt += files._compilation_signature(flags, chosen["cffi_debug"])
    names = {"libffcx_forms_" + ffcx.naming.compute_signature([f], salt): f for f in forms}
    new = [name for name in names if not (folder / f"{name}.c.cached").exists()]
    # the largest first, so that its compiler is not the one that all wait for in the end
    new.sort(key=lambda name: -_size(names[name]))
    cores = len(os.sched_getaffinity(0))
    started: dict[Path, Future[None]] = {}
    with ExitStack() as locks, ThreadPoolExecutor(max_workers=cores) as pool:
        try:
            for number, name in enumerate(new, start=1):
                tell(number, len(new))
                file = folder / f"{name}.c"
                if not _ours(file, locks):
                    continue
                started[file] = Future()
                _write_code(names[name], name, file, options)
                started[file] = pool.submit(_run_compiler, file, flags)
            for future in started.values():
                future.result()
        except BaseException:
            pool.shutdown(cancel_futures=True)
            # what is not finished, nobody shall wait for
            for file in started:
                if not file.with_suffix(".c.cached").exists():
                    file.unlink(missing_ok=True)
            raise


def _ours(file: Path, locks: ExitStack) -> bool:
    """Whether a module is ours to compile: nobody else does, and nobody has.

    Args:
        file: Its code. What a killed process has left there is removed.
        locks: Gets the lock, if it is ours.
    """
    lock = FileLock(file.with_suffix(".lock"))
    if not lock.acquire():
        # whoever needs it waits for it later (`kernels.compiled`)
        return False
    locks.callback(lock.release)
    if file.with_suffix(".c.cached").exists():
        return False
    file.unlink(missing_ok=True)
    file.open("x").close()
    return True


def _size(form: Form) -> int:
    """Entries of a cell's tensor: what tells large kernels from small ones."""
    elements = (a.ufl_function_space().ufl_element() for a in form.arguments())
    return math.prod(element.dim for element in elements)


def _write_code(form: Form, name: str, file: Path, options: dict[str, Any]) -> None:
    """The C code of an extension module with the kernels of a form, as FFCx makes it."""
    # both are needed for new kernels only
    import ffcx.compiler
    from cffi.recompiler import recompile  # type: ignore[import-untyped]
    from ffcx.ir.analysis.valuenumbering import ValueNumberer

    ValueNumberer.get_node_symbols = _node_symbols  # type: ignore[method-assign]
    code, _ = ffcx.compiler.compile_ufl_objects([form], namespace=name, options=options)
    scalar = np.dtype(options["scalar_type"]).name
    builder = cffi.FFI()
    builder.cdef(
        files.UFC_HEADER_DECL.format(scalar)
        + files.UFC_INTEGRAL_DECL
        + files.UFC_FORM_DECL
        + f"extern ufcx_form {ffcx.naming.form_name(form, 0, name)};\n"
    )
    how = {"c_file": str(file), "call_c_compiler": False, "uses_ffiplatform": False}
    recompile(builder, name, code[1], compiler_verbose=0, **how)


def _node_symbols(numberer: Any, expression: Any) -> Any:
    """Symbols of a node of FFCx's graph, by the graph's own index in place of a search.

    FFCx 0.11 compares with all nodes: that took 50 s of the 58 s for the residual of a hyperelastic
    shell in `ed3`. The code that comes out is the same.
    """
    return numberer.V_symbols[numberer.G.e2i[expression]]


def _run_compiler(file: Path, flags: Sequence[str]) -> None:
    """Compile a module, and say by the file `.c.cached` that it is ready."""
    include = [ffcx.codegeneration.get_include_path(), sysconfig.get_path("include")]
    compiler = os.environ.get("CC") or sysconfig.get_config_var("CC") or "cc"
    built = file.with_suffix(sysconfig.get_config_var("EXT_SUFFIX"))
    command = [*shlex.split(compiler), "-std=c17", "-shared", "-fPIC", "-fwrapv", "-DNDEBUG"]
    command += [*flags, *(f"-I{folder}" for folder in include), str(file), "-o", str(built)]
    done = subprocess.run(command, capture_output=True, text=True, stdin=subprocess.DEVNULL)
    if done.returncode != 0:
        raise RuntimeError(f"{shlex.join(command)} failed:\n{done.stderr}")
    file.with_suffix(".c.cached").write_text(done.stderr)
