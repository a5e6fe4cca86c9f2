"""Compiled forms: one place that says how DOLFINx compiles."""

import logging
import platform
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any

from mpi4py import MPI as _MPI  # noqa: F401  (before dolfinx)

import ffcx.codegeneration.jit as ffcx_jit
import ffcx.naming
import ffcx.options
import numpy as np
import numpy.typing as npt
import ufl
from dolfinx import default_scalar_type, fem, jit
from ufl import Form
from ufl.core.expr import Expr

from shellmb.compiler import compile_new
from shellmb.locks import FileLock


def _compiler_flags() -> list[str]:
    """Flags that let the loops of kernels use the processor's vectors: twice as fast.

    What matters is that sums may be reordered and multiplications fused (`-ffast-math` without its
    promise that nothing is ever infinite or NaN: those must be seen). A level that the processor
    has is named, and not `native`, so that another machine with the same cache compiles anew.
    """
    flags = ["-g0", "-ftree-vectorize", "-ffp-contract=fast", "-fno-math-errno"]
    flags += ["-fassociative-math", "-fno-signed-zeros", "-fno-trapping-math"]
    processor = Path("/proc/cpuinfo")
    if platform.machine() == "x86_64" and processor.exists():
        features = next((x for x in processor.read_text().split("\n") if x.startswith("flags")), "")
        if {"avx2", "fma", "bmi2", "movbe"} <= set(features.split()):
            flags.append("-march=x86-64-v3")
    return flags


COMPILER_FLAGS = ["-O2", *_compiler_flags()]

# FFCx writes straight code in which -O2 finds nothing more than -O1 with vectors: kernels of shells
# are as fast, and compiled in 0.6 of the time (5.3 s instead of 8.9 for those of `sudden_load`)
KERNEL_FLAGS = ["-O1", *_compiler_flags()]

# DOLFINx takes a kernel whose file exists and is not compiled for one that another process is
# compiling, waits for it without a word, and gives up after this time [s]. That is left to file
# systems without locks: see `_alone`.
JIT_OPTIONS = {"timeout": 600, "cffi_extra_compile_args": KERNEL_FLAGS}

_log = logging.getLogger(__name__)


def compiled(form: Form) -> fem.Form:
    """A form compiled, or found in the cache.

    Args:
        form: Any form; its parameters are Constants, so that their values do not matter here.
    """
    with _alone(form, form):
        made = fem.form(form, jit_options=JIT_OPTIONS)
    for found in _WATCHING.get():
        found.add(kernel_name(made))
    return made


def compile_all(forms: Sequence[Form]) -> list[fem.Form]:
    """Forms compiled side by side, those that are not in the cache, which takes half the time.

    Args:
        forms: Forms that are not empty, on meshes of one communicator; the call is collective.

    Raises:
        RuntimeError: If the C compiler fails; on all ranks.
    """
    if forms:
        comm = forms[0].ufl_domain().ufl_cargo().comm
        failure: BaseException | None = None
        if comm.rank == 0:
            try:
                compile_new(forms, JIT_OPTIONS, _TELLING.get())
            except Exception as error:
                failure = error
        if comm.bcast(failure is not None):
            raise RuntimeError("forms could not be compiled") from failure
    return [compiled(form) for form in forms]


def _silent(number: int, count: int) -> None:
    pass


_TELLING: ContextVar[Callable[[int, int], None]] = ContextVar("telling", default=_silent)


@contextmanager
def told(tell: Callable[[int, int], None]) -> Iterator[None]:
    """Tells of new kernels that are compiled meanwhile; on the first rank.

    Args:
        tell: Called with the number of a kernel and the number of all that are compiled with it.
    """
    token = _TELLING.set(tell)
    try:
        yield
    finally:
        _TELLING.reset(token)


def compiled_expression(value: Expr, points: npt.NDArray[np.float64]) -> fem.Expression:
    """An expression compiled, or found in the cache.

    Args:
        value: The expression.
        points: Where on the reference element it is wanted, shape (n, dimension).
    """
    with _alone(value, (value, np.reshape(points, (len(points), -1)))):
        return fem.Expression(value, points, jit_options=JIT_OPTIONS)


@contextmanager
def _alone(of: Form | Expr, item: Form | tuple[Expr, Any]) -> Iterator[None]:
    """Only one process compiles a kernel; what a killed one has left of it is removed.

    A process that was killed while it compiled leaves a file that DOLFINx would wait for. Who holds
    the lock and finds such a file knows that nobody is compiling it.
    """
    domain: Any = ufl.domain.extract_domains(of)[0]
    comm = domain.ufl_cargo().comm
    source = jit.get_options(JIT_OPTIONS)["cache_dir"] / f"{module_name(item)}.c"
    ready = source.with_suffix(".c.cached")
    # one rank compiles, the others load
    if comm.rank != 0 or ready.exists():
        yield
        return
    source.parent.mkdir(parents=True, exist_ok=True)
    lock = FileLock(source.with_suffix(".lock"))
    try:
        if not lock.acquire():
            _log.warning("waiting for %s, which compiles the same kernel", lock.owner)
            lock.acquire(wait=True)
        if source.exists() and not ready.exists():
            _log.warning("a kernel that a killed process left unfinished is compiled anew")
            source.unlink()
    except OSError as error:
        _log.warning("the cache of kernels cannot be locked (%s)", error)
    try:
        yield
    finally:
        # Ctrl-C
        if not ready.exists():
            source.unlink(missing_ok=True)
        lock.release()


def module_name(item: Form | tuple[Expr, Any]) -> str:
    """Name that FFCx gives the module of a form, or of an expression and its points.

    Args:
        item: They.
    """
    options = ffcx.options.get_options({"scalar_type": default_scalar_type})
    flags = jit.get_options(JIT_OPTIONS)["cffi_extra_compile_args"]
    tag = ffcx_jit._compute_option_signature(options)
    tag += ffcx_jit._compilation_signature(flags, False)
    kind = "forms" if isinstance(item, Form) else "expressions"
    items: list[Any] = [item]
    return f"libffcx_{kind}_{ffcx.naming.compute_signature(items, tag)}"


_WATCHING: ContextVar[tuple[set[str], ...]] = ContextVar("watching", default=())


def kernel_name(form: fem.Form) -> str:
    """Name of a form's compiled module: forms that are alike share one.

    Args:
        form: A compiled form.
    """
    return str(getattr(form.module, "__name__", form.module))


@contextmanager
def watched() -> Iterator[set[str]]:
    """Collects the names of the kernels that are compiled, or found in the cache, meanwhile."""
    found: set[str] = set()
    token = _WATCHING.set((*_WATCHING.get(), found))
    try:
        yield found
    finally:
        _WATCHING.reset(token)
