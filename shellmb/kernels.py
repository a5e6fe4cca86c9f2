"""Compiled forms: one place that says how DOLFINx compiles."""

import platform
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from mpi4py import MPI as _MPI  # noqa: F401  (before dolfinx)

from dolfinx import fem
from ufl import Form


def _compiler_flags() -> list[str]:
    """Flags that let the loops of kernels use the processor's vectors: twice as fast.

    What matters is that sums may be reordered and multiplications fused (`-ffast-math` without its
    promise that nothing is ever infinite or NaN: those must be seen). A level that the processor
    has is named, and not `native`, so that another machine with the same cache compiles anew.
    """
    flags = ["-O2", "-g0", "-ftree-vectorize", "-ffp-contract=fast", "-fno-math-errno"]
    flags += ["-fassociative-math", "-fno-signed-zeros", "-fno-trapping-math"]
    processor = Path("/proc/cpuinfo")
    if platform.machine() == "x86_64" and processor.exists():
        features = next((x for x in processor.read_text().split("\n") if x.startswith("flags")), "")
        if {"avx2", "fma", "bmi2", "movbe"} <= set(features.split()):
            flags.append("-march=x86-64-v3")
    return flags


COMPILER_FLAGS = _compiler_flags()

# Two processes that need the same kernel compile it once: the second waits for the first. DOLFINx
# gives up after ten seconds, less than a large form takes on a busy machine.
JIT_OPTIONS = {"timeout": 600, "cffi_extra_compile_args": COMPILER_FLAGS}


def compiled(form: Form) -> fem.Form:
    """A form compiled, or found in the cache.

    Args:
        form: Any form; its parameters are Constants, so that their values do not matter here.
    """
    made = fem.form(form, jit_options=JIT_OPTIONS)
    for found in _WATCHING.get():
        found.add(kernel_name(made))
    return made


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
