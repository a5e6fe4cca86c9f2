"""Compiled forms: one place that says how DOLFINx compiles."""

import platform
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from mpi4py import MPI as _MPI  # noqa: F401  (before dolfinx)

from dolfinx import fem
from ufl import Form

from shellmb.compiler import compile_new


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

# Two processes that need the same kernel compile it once: the second waits for the first. DOLFINx
# gives up after ten seconds, less than a large form takes on a busy machine.
JIT_OPTIONS = {"timeout": 600, "cffi_extra_compile_args": KERNEL_FLAGS}


def compiled(form: Form) -> fem.Form:
    """A form compiled, or found in the cache.

    Args:
        form: Any form; its parameters are Constants, so that their values do not matter here.
    """
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
