"""The loops in C over cells and nodes, compiled at first use as DOLFINx compiles its kernels."""

from __future__ import annotations

import ctypes
import hashlib
import importlib.machinery
import importlib.util
import os
import sys
import tempfile
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

from mpi4py import MPI

import cffi  # type: ignore[import-untyped]
import dolfinx.jit
import numpy as np
import numpy.typing as npt

from shellmb.kernels import COMPILER_FLAGS

HERE = Path(__file__).parent


@cache
def cells(comm: MPI.Comm = MPI.COMM_WORLD) -> Any:
    """The compiled functions (`.lib`) and the means to make their arguments (`.ffi`); collective.

    Args:
        comm: The first of its ranks compiles.
    """
    module = _build() if comm.rank == 0 else None
    comm.barrier()
    module = module or _build()
    library = module.lib
    pointers = [_address(_of_scipy("cython_blas"), "dgemm")]
    lapack = _of_scipy("cython_lapack")
    pointers += [_address(lapack, name) for name in ("dgetrf", "dgetri")]
    library.use_libraries(*(module.ffi.cast("void *", p) for p in pointers))
    return module


class CArrays:
    """Pointers for C to arrays that live as long as this object."""

    def __init__(self) -> None:
        self.ffi = cells().ffi
        self._kept: list[Any] = []

    def __call__(self, array: npt.NDArray[Any] | None) -> Any:
        """Pointer to the array's data; NULL for None."""
        if array is None:
            return self.ffi.NULL
        kinds = {"float64": "double *", "int32": "int *", "int64": "int64_t *"}
        assert array.flags.c_contiguous
        self._kept.append(array)
        return self.ffi.cast(kinds[array.dtype.name], array.ctypes.data)

    def many(self, kind: str, pointers: Sequence[Any]) -> Any:
        """A C array."""
        made = self.ffi.new(f"{kind}[]", list(pointers) or 1)
        self._kept.append(made)
        return made


def doubles(array: npt.NDArray[np.float64] | None) -> Any:
    """Pointer for C to an array's numbers, which the caller keeps alive; NULL for None."""
    ffi = cells().ffi
    return ffi.NULL if array is None else ffi.from_buffer("double[]", array)


def longs(array: npt.NDArray[np.int64]) -> Any:
    """The same of integers."""
    return cells().ffi.from_buffer("int64_t[]", array)


def bytes_of(array: npt.NDArray[np.uint8]) -> Any:
    """The same of bytes."""
    return cells().ffi.from_buffer("unsigned char[]", array)


def _of_scipy(name: str) -> ModuleType:
    """A module of `scipy.linalg` without the package, which takes as long to import as DOLFINx.

    Where the package is loaded already, or later, it has the same module.
    """
    full = f"scipy.linalg.{name}"
    if full in sys.modules:
        return sys.modules[full]
    scipy = importlib.util.find_spec("scipy")
    folders = [str(Path(at, "linalg")) for at in (scipy and scipy.submodule_search_locations) or ()]
    spec = importlib.machinery.PathFinder.find_spec(full, folders)
    if spec is None or spec.loader is None:
        raise ImportError(f"there is no {full}; SciPy is incomplete")
    module = importlib.util.module_from_spec(spec)
    sys.modules[full] = module
    spec.loader.exec_module(module)
    return module


def _address(module: Any, name: str) -> int:
    """Address of a BLAS or LAPACK function that SciPy exports to Cython."""
    capsule = module.__pyx_capi__[name]
    api = ctypes.pythonapi
    api.PyCapsule_GetName.restype = ctypes.c_char_p
    api.PyCapsule_GetName.argtypes = [ctypes.py_object]
    api.PyCapsule_GetPointer.restype = ctypes.c_void_p
    api.PyCapsule_GetPointer.argtypes = [ctypes.py_object, ctypes.c_char_p]
    return int(api.PyCapsule_GetPointer(capsule, api.PyCapsule_GetName(capsule)))


def _build() -> ModuleType:
    names = ("cells.h", "cells.c", "nodes.c")
    header, *sources = ((HERE / name).read_text() for name in names)
    source = "\n".join(sources)
    key = "\n".join([header, source, sys.version, cffi.__version__, *COMPILER_FLAGS])
    name = f"shellmb_cells_{hashlib.sha256(key.encode()).hexdigest()[:16]}"
    where = Path(dolfinx.jit.get_options()["cache_dir"])
    where.mkdir(parents=True, exist_ok=True)
    target = where / f"{name}.so"
    if not target.exists():
        ffi = cffi.FFI()
        ffi.cdef(header)
        includes = "#include <stdint.h>\n"
        ffi.set_source(name, includes + header + source, extra_compile_args=COMPILER_FLAGS)
        with tempfile.TemporaryDirectory(dir=where) as scratch:
            made = ffi.compile(tmpdir=scratch)
            # at once: another process may look for it at any moment
            os.replace(made, target)
    spec = importlib.util.spec_from_file_location(name, target)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
