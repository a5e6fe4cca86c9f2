"""The loops in C over cells and nodes, compiled at installation, or else at first use."""

import ctypes
import importlib.machinery
import importlib.util
import logging
import sys
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
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
        RunError: If the C compiler fails; on all ranks.
    """
    failure: Exception | None = None
    if comm.rank == 0:
        try:
            _found().result()
        except Exception as error:
            failure = error
    raise_together(failure, "the loops over cells could not be compiled", comm)
    module = _found().result()
    functions = [_address(_of_scipy("cython_blas"), "dgemm")]
    lapack = _of_scipy("cython_lapack")
    functions += [_address(lapack, name) for name in ("dgetrf", "dgetri")]
    petsc = ctypes.CDLL(PETSc.__file__)
    arrays = (f"Vec{do}Array{kind}" for kind in ("Read", "") for do in ("Get", "Restore"))
    own = [ctypes.cast(petsc[name], ctypes.c_void_p).value for name in ("MatSolve", *arrays)]
    module.lib.use_libraries([module.ffi.cast("void *", f) for f in (*functions, *own)])
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


def begin(comm: MPI.Comm) -> None:
    """Compile the functions, where that is still to be done, while other things happen.

    Args:
        comm: Its first rank compiles for all.

    Raises:
        RunError: If ranks are on different processors; on all of them.
    """
    kinds = {" ".join(flags) for flags in comm.allgather(COMPILER_FLAGS)}
    if len(kinds) > 1:
        raise RunError(
            "the ranks run on different processors, whose compiled loops differ: give all the "
            f"level of the oldest by the environment variable {FORCED_LEVEL}, and the same "
            f"{FORCED_LANES}, if any"
        )
    if comm.rank == 0:
        # all ranks tell what fails, where they need it
        with suppress(RunError):
            _found()


@cache
def _found() -> Future[ModuleType]:
    """The module: as it was installed, as an earlier run compiled it, or once it is compiled."""
    named = named_source()
    name, *_ = named
    found: Future[ModuleType] = Future()
    # what was installed, or is damaged, may be another one, or of a newer system
    with suppress(ImportError):
        found.set_result(_load(name, INSTALLED))
        return found
    folder = cache_folder()
    target = folder / f"{name}.so"
    with suppress(ImportError):
        found.set_result(_load(name, target))
        return found
    _log.warning("the loops in C are compiled, once on this machine, which takes about 10 s")
    scratch = write_c(folder, named)
    pool = ThreadPoolExecutor(max_workers=1)
    found = pool.submit(_compile, name, scratch, target)
    pool.shutdown(wait=False)
    return found


def _compile(name: str, source: Path, target: Path) -> ModuleType:
    """Compile and load the module.

    Raises:
        RunError: If there is no compiler, or it fails, or what it writes cannot be loaded.
    """
    compile_c(source, target)
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
