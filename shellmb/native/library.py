"""The loops in C over cells and nodes, compiled at installation, or else at first use."""

import ctypes
import importlib.util
import logging
from collections.abc import Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import numpy.typing as npt

from shellmb.arrays import Floats, Int32s, Ints
from shellmb.errors import RunError
from shellmb.native.compiling.flags import COMPILER_FLAGS, FORCED_LANES, FORCED_LEVEL
from shellmb.native.compiling.folder import SAY, cache_folder, raise_together
from shellmb.native.compiling.source import INSTALLED, compile_c, named_source, write_c

_log = logging.getLogger(__name__)

# functions of BLAS and LAPACK, which PETSc needs, too, and of PETSc itself
OF_PETSC = ["dgemm_", "dgetrf_", "dgetri_", "MatSolve"]
OF_PETSC += [f"Vec{do}Array{kind}" for kind in ("Read", "") for do in ("Get", "Restore")]
# bytes that vectors of any processor begin at multiples of
LINE = 64
# of arrays by the letters of their types: names of these take longer than all else here
KINDS = {"d": "double[]", "i": "int[]", "l": "int64_t[]", "q": "int64_t[]"}


@cache
def cells(comm: MPI.Comm = MPI.COMM_WORLD) -> Any:
    """The compiled functions (`.lib`) and the means to make their arguments (`.ffi`); collective.

    Args:
        comm: The first of its ranks compiles.

    Raises:
        RunError: If ranks are on different processors, or the C compiler fails; on all ranks.
    """
    if len({" ".join(flags) for flags in comm.allgather(COMPILER_FLAGS)}) > 1:
        raise RunError(
            "the ranks run on different processors, whose compiled loops differ: give all the "
            f"level of the oldest by the environment variable {FORCED_LEVEL}, and the same "
            f"{FORCED_LANES}, if any"
        )
    failure: Exception | None = None
    if comm.rank == 0:
        try:
            _module()
        except Exception as error:
            failure = error
    raise_together(failure, "the loops over cells could not be compiled", comm)
    module, petsc = _module(), ctypes.CDLL(PETSc.__file__)
    functions = [ctypes.cast(petsc[name], ctypes.c_void_p).value for name in OF_PETSC]
    module.lib.use_libraries([module.ffi.cast("void *", f) for f in functions])
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
        # refuses what does not lie in one piece, and keeps the array
        made = self.ffi.from_buffer(KINDS[array.dtype.char], array)
        self._kept.append(made)
        return made

    def many(self, kind: str, pointers: Sequence[Any]) -> Any:
        """A C array."""
        made = self.ffi.new(f"{kind}[]", list(pointers) or 1)
        self._kept.append(made)
        return made


def doubles(array: Floats | None) -> Any:
    """Pointer for C to an array's numbers, which the caller keeps alive; NULL for None."""
    ffi = cells().ffi
    return ffi.NULL if array is None else ffi.from_buffer("double[]", array)


def entries(vector: PETSc.Vec, changed: bool = False) -> Any:
    """Pointer for C to a vector's numbers on this rank, for as long as the vector lives.

    NumPy's arrays of vectors and pointers to these take three times as long.

    Args:
        vector: The vector.
        changed: Whether they are to be changed.
    """
    return cells().lib.entries(vector.handle, changed)


def longs(array: Ints) -> Any:
    """Pointer for C to an array's integers, which the caller keeps alive."""
    return cells().ffi.from_buffer("int64_t[]", array)


def bytes_of(array: npt.NDArray[np.uint8]) -> Any:
    """Pointer for C to an array's bytes, which the caller keeps alive."""
    return cells().ffi.from_buffer("unsigned char[]", array)


def cell_dofs(space: Any) -> Int32s:
    """Local dofs of all cells of a function space, blocks unrolled, shape (cells, n)."""
    dofmap: Any = getattr(space.dofmap, "_cpp_object", space.dofmap)
    dofs, bs = np.asarray(dofmap.map()), dofmap.index_map_bs
    if bs == 1:
        return np.ascontiguousarray(dofs, dtype=np.int32)
    rolled = bs * dofs[:, :, None] + np.arange(bs)
    return np.ascontiguousarray(rolled.reshape(len(dofs), bs * dofs.shape[1]), dtype=np.int32)


def side_by_side[T: np.generic](table: npt.NDArray[T], lanes: int) -> npt.NDArray[T]:
    """Numbers of cells as kernels of several cells take them.

    Args:
        table: Numbers of each cell, shape (cells, ...).
        lanes: How many cells stand side by side.

    Returns:
        Them, shape (groups, numbers of a cell, lanes), of several at a whole line of the memory;
        the last cell is repeated where cells are missing. Of one they are what they were.
    """
    count, size = len(table), int(np.prod(table.shape[1:]))
    if lanes == 1:
        return np.ascontiguousarray(table).reshape(count, size, 1)
    cells = np.minimum(np.arange(-(-count // lanes) * lanes), count - 1)
    groups = table.reshape(count, size)[cells]
    groups = groups.reshape(len(cells) // lanes, lanes, size).transpose(0, 2, 1)
    made = whole_lines(groups.size, table.dtype).reshape(groups.shape)
    made[...] = groups
    return made


def whole_lines(size: int, dtype: npt.DTypeLike) -> npt.NDArray[Any]:
    """Zeros from the beginning of a line of the memory on, shape (size,)."""
    spare = np.zeros(size + LINE, dtype=dtype)
    first = -spare.ctypes.data % LINE // spare.itemsize
    return spare[first : first + size]


@cache
def _module() -> ModuleType:
    """The module: as it was installed, as an earlier run compiled it, or compiled now."""
    named = named_source()
    name, *_ = named
    # what was installed, or is damaged, may be another one, or of a newer system
    with suppress(ImportError):
        return _load(name, INSTALLED)
    folder = cache_folder()
    target = folder / f"{name}.so"
    with suppress(ImportError):
        return _load(name, target)
    _log.warning("the loops in C are compiled, once on this machine, which takes about 10 s")
    compile_c(write_c(folder, named), target)
    try:
        return _load(name, target)
    except ImportError as error:
        target.unlink(missing_ok=True)
        raise RunError(
            f"what the C compiler writes, {target}, cannot be loaded ({error}): see that files may "
            f"be executed there, or {SAY}, or another compiler by CC"
        ) from error


def _load(name: str, library: Path) -> ModuleType:
    """Load the module.

    Raises:
        ImportError: If there is no such file, or it is no such library.
    """
    spec = importlib.util.spec_from_file_location(name, library)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
