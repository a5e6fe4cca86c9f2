"""Compiled forms: one place that says how DOLFINx compiles."""

import importlib.util
import logging
import platform
import sysconfig
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from pathlib import Path
from typing import Any

from mpi4py import MPI  # before dolfinx

import ffcx.codegeneration.jit as ffcx_jit
import ffcx.naming
import ffcx.options
import numpy as np
import numpy.typing as npt
import ufl
from dolfinx import default_scalar_type, fem, jit
from dolfinx.fem.forms import form_cpp_class, get_integration_domains
from ufl import Form
from ufl.core.expr import Expr

from shellmb.compiler import compile_new
from shellmb.derivatives import Known, Record, read, write
from shellmb.locks import FileLock


def _compiler_flags() -> list[str]:
    """Flags that let the loops of kernels use the processor's vectors: twice as fast.

    What matters is that sums may be reordered and multiplications fused (`-ffast-math` without its
    promise that nothing is ever infinite or NaN: those must be seen). A level that the processor
    has is named, and not `native`, so that another machine with the same cache compiles anew.
    """
    flags = ["-g0", "-ffp-contract=fast", "-fno-math-errno", "-fassociative-math"]
    flags += ["-fno-signed-zeros", "-fno-trapping-math"]
    processor = Path("/proc/cpuinfo")
    if platform.machine() == "x86_64" and processor.exists():
        features = next((x for x in processor.read_text().split("\n") if x.startswith("flags")), "")
        if {"avx2", "fma", "bmi2", "movbe"} <= set(features.split()):
            flags.append("-march=x86-64-v3")
    return flags


COMPILER_FLAGS = ["-O2", "-ftree-vectorize", *_compiler_flags()]

# FFCx writes straight code in which -O2 finds nothing more than -O1 with vectors: kernels of shells
# are as fast, and compiled in 0.6 of the time (5.3 s instead of 8.9 for those of `sudden_load`).
# Its loops over the nodes of a cell are short: unrolled they take 0.85 of the time in residuals and
# 0.96 in Jacobians (docs/theory/built.md). Vectors outside loops cost gcc a tenth, and gain nothing
KERNEL_FLAGS = ["-O1", "-ftree-loop-vectorize", "-funroll-loops", *_compiler_flags()]

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
    name, comm = module_name(form), _comm(form)
    with _alone(comm, name):
        if not comm.bcast(_ready(name)):
            jit.ffcx_jit(comm, form, {"scalar_type": default_scalar_type}, JIT_OPTIONS)
    spaces = [argument.ufl_function_space() for argument in form.arguments()]
    return _attached(name, form, spaces, form.coefficients(), form.constants())


def compile_all(forms: Sequence[Form]) -> list[fem.Form]:
    """Forms compiled side by side, those that are not in the cache, which takes half the time.

    Args:
        forms: Forms that are not empty, on meshes of one communicator; the call is collective.

    Raises:
        RuntimeError: If the C compiler fails; on all ranks.
    """
    return [form for form in compile_with_derivatives(forms) if form is not None]


def compile_with_derivatives(forms: Sequence[Form | Known]) -> list[fem.Form | None]:
    """Forms and derivatives of forms compiled side by side; see `compile_all`.

    Args:
        forms: Forms that are not empty, and derivatives of such.

    Returns:
        Them; None for a derivative that vanishes.

    Raises:
        RuntimeError: If the C compiler fails; on all ranks.
    """
    if not forms:
        return []
    comm = _comm(forms[0] if isinstance(forms[0], Form) else forms[0].of)
    records = comm.bcast([_record(form) for form in forms] if comm.rank == 0 else None)
    # derivatives whose kernels are not known are taken
    taken = [
        form.form() if not isinstance(form, Form) and known is None else form
        for form, known in zip(forms, records, strict=True)
    ]
    failure: BaseException | None = None
    if comm.rank == 0:
        try:
            new = [form for form in taken if isinstance(form, Form) and not form.empty()]
            compile_new(new, JIT_OPTIONS, _TELLING.get())
        except Exception as error:
            failure = error
    if comm.bcast(failure is not None):
        raise RuntimeError("forms could not be compiled") from failure
    made: list[fem.Form | None] = []
    for given, form, known in zip(forms, taken, records, strict=True):
        if not isinstance(form, Form):
            made.append(_differentiated(form, known))
            continue
        made.append(None if form.empty() else compiled(form))
        if not isinstance(given, Form) and comm.rank == 0:
            name = "" if form.empty() else module_name(form)
            write(given.file(_folder(), module_name(given.of)), given.record(form, name))
    return made


def _record(form: Form | Known) -> Record | None:
    """What is known of a derivative, if its kernel is there."""
    if isinstance(form, Form):
        return None
    found = read(form.file(_folder(), module_name(form.of)))
    return found if found is not None and (not found.kernel or _ready(found.kernel)) else None


def _differentiated(derivative: Known, known: Record) -> fem.Form | None:
    """The derivative of a form with a kernel that is known, without taking it."""
    if not known.kernel:
        return None
    return _attached(
        known.kernel,
        derivative.of,
        derivative.spaces,
        [derivative.coefficients[k] for k in known.coefficients],
        [derivative.constants[k] for k in known.constants],
    )


def _attached(
    name: str, like: Form, spaces: Sequence[Any], coefficients: Sequence[Any], constants: Any
) -> fem.Form:
    """A kernel with its data, as `dolfinx.fem.form` attaches them.

    That function looks for the module in a list of all files of the cache, which takes longer the
    more there are (35 ms with 15 000), and asks for the form in UFL, also of a derivative.

    Args:
        name: Name of the kernel's module.
        like: A form with the same integrals and mesh.
        spaces: Of the arguments.
        coefficients: In the order in which the kernel's form has them.
        constants: Likewise.
    """
    module, kernel = _loaded(_folder() / name)
    for found in _WATCHING.get():
        found.add(name)
    subdomains = like.subdomain_data()
    (domain,) = subdomains
    offsets = kernel.form_integral_offsets
    ids = {
        kind.name: [kernel.form_integral_ids[j] for j in range(offsets[i], offsets[i + 1])]
        for i, kind in enumerate(map(fem.IntegralType, range(len(fem.IntegralType))))
    }
    made = form_cpp_class(default_scalar_type)(
        [module.ffi.cast("uintptr_t", module.ffi.addressof(kernel))],
        [space._cpp_object for space in spaces],
        [
            coefficients[kernel.original_coefficient_positions[i]]._cpp_object
            for i in range(kernel.num_coefficients)
        ],
        [constant._cpp_object for constant in constants],
        {
            fem.IntegralType[kind]: get_integration_domains(
                fem.IntegralType[kind], data[0], ids[kind]
            )
            for kind, data in subdomains[domain].items()
        },
        [],
        domain.ufl_cargo(),
    )
    return fem.Form(made, kernel, None, module)


@cache
def _loaded(path: Path) -> tuple[Any, Any]:
    """A module of the cache and the form in it; loaded once in a process.

    Args:
        path: Of the module, without what its name ends with.
    """
    file = path.with_suffix(sysconfig.get_config_var("EXT_SUFFIX"))
    spec = importlib.util.spec_from_file_location(path.name, file)
    if spec is None or spec.loader is None:
        raise ImportError(f"{file} is no extension module")
    module: Any = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    (form,) = (name for name in dir(module.lib) if name.startswith("form_"))
    return module, getattr(module.lib, form)


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
    name = module_name((value, np.reshape(points, (len(points), -1))))
    with _alone(_comm(value), name):
        options = JIT_OPTIONS | {"cache_dir": str(_folder(name))}
        return fem.Expression(value, points, jit_options=options)


@contextmanager
def _alone(comm: MPI.Comm, name: str) -> Iterator[None]:
    """Only one process compiles a kernel; what a killed one has left of it is removed.

    A process that was killed while it compiled leaves a file that DOLFINx would wait for. Who holds
    the lock and finds such a file knows that nobody is compiling it.
    """
    # one rank compiles, the others load
    if comm.rank != 0 or _ready(name):
        yield
        return
    source = _folder(name) / f"{name}.c"
    ready = source.with_suffix(".c.cached")
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


def _comm(of: Form | Expr) -> MPI.Comm:
    domain: Any = ufl.domain.extract_domains(of)[0]
    comm: MPI.Comm = domain.ufl_cargo().comm
    return comm


def _folder(name: str = "") -> Path:
    """Where a module is kept, by its name.

    Those of expressions have a folder to themselves: FFCx lists all files beside them.
    """
    cached = Path(jit.get_options(JIT_OPTIONS)["cache_dir"])
    return cached / "expressions" if name.startswith("libffcx_expressions") else cached


def _ready(name: str) -> bool:
    """Whether a kernel is compiled, by the name of its module."""
    return (_folder(name) / f"{name}.c.cached").exists()


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
