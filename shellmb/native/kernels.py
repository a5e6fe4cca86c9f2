"""Compiled forms, as DOLFINx takes them, and one place that says how kernels are compiled."""

import ctypes
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from mpi4py import MPI  # before dolfinx

import cffi  # type: ignore[import-untyped]
import ffcx.codegeneration.jit as ffcx_jit
import ffcx.naming
import ffcx.options
import numpy as np
from dolfinx import default_scalar_type, fem
from dolfinx.fem.forms import form_cpp_class, get_integration_domains
from ufl import Form
from ufl.core.expr import Expr
from ufl.domain import extract_domains

from shellmb.barrier import first_found
from shellmb.errors import RunError
from shellmb.native.assembler import is_interpreted, is_native
from shellmb.native.compiling.compiler import compile_new, library
from shellmb.native.compiling.flags import Item, flags_for
from shellmb.native.compiling.folder import JIT_OPTIONS, cache_folder, raise_together
from shellmb.native.compiling.store import is_whole, loading
from shellmb.native.derivatives import CachedDerivative, Record, read, write
from shellmb.native.later import Later, plain
from shellmb.native.reference import compiled_form

__all__ = ["JIT_OPTIONS", "cache_folder"]


@dataclass(frozen=True, eq=False)
class Kernel:
    """A compiled form or expression, loaded.

    Attributes:
        name: Of its file: forms that are alike share one.
        form: FFCx's description of it, a `ufcx_form` or `ufcx_expression` of C.
        library: What holds the code.
    """

    name: str
    form: Any
    library: ctypes.CDLL

    @property
    def address(self) -> Any:
        """Address of the description, as DOLFINx takes it."""
        return ufcx_interface().cast("uintptr_t", self.form)

    def reads(self, coefficients: Sequence[Any]) -> list[Any]:
        """Find the coefficients that it reads, in its own order, as DOLFINx takes them."""
        places, count = self.form.original_coefficient_positions, self.form.num_coefficients
        return [coefficients[places[i]]._cpp_object for i in range(count)]


def compiled(form: Form, flags: Sequence[str] = ()) -> fem.Form:
    """A form compiled, or found in the cache.

    Args:
        form: One that is not empty; its parameters are Constants, so that their values do not
            matter here.
        flags: More ones of the C compiler; with "-O0" a kernel that is called a few times only is
            there in a quarter of the time.

    Raises:
        RunError: If the C compiler fails; on all ranks.
    """
    return compile_all([form], flags)[0]


def compile_all(forms: Sequence[Form], flags: Sequence[str] = ()) -> list[fem.Form]:
    """Forms compiled side by side, those that are not in the cache, which takes half the time.

    Args:
        forms: Forms that are not empty, on meshes of one communicator; the call is collective.
        flags: As of `compiled`.

    Raises:
        RunError: If the C compiler fails; on all ranks.
    """
    return [form for form in compile_with_derivatives(forms, flags) if form is not None]


def compile_with_derivatives(
    forms: Sequence[Form | CachedDerivative], flags: Sequence[str] = ()
) -> list[fem.Form | None]:
    """Forms and derivatives of forms compiled side by side; see `compile_all`.

    Args:
        forms: Forms that are not empty, and derivatives of such.
        flags: As of `compiled`.

    Returns:
        Them; None for a derivative that vanishes.

    Raises:
        RunError: If the C compiler fails; on all ranks.
    """
    if not forms:
        return []
    if not is_native():
        return [compiled_form(plain(f if isinstance(f, Form) else f.form()), flags) for f in forms]
    if is_interpreted():
        each = [_interpreted([form], flags) for form in forms]
        return [own[0] if own else None for own in each]
    return _compiled_with_derivatives(forms, flags)


def together[K](
    forms: Iterable[tuple[K, Form | CachedDerivative]], moving: Collection[fem.Function]
) -> dict[K, list[fem.Form]]:
    """Forms as programs, those of one key as one.

    Args:
        forms: Forms that are not empty, and derivatives of such, with their keys.
        moving: Functions that change from call to call; what follows from others alone is kept.
    """
    groups: dict[K, list[Form | CachedDerivative]] = {}
    for key, form in forms:
        groups.setdefault(key, []).append(form)
    found = {key: _interpreted(some, (), moving) for key, some in groups.items()}
    return {key: made for key, made in found.items() if made}


def _interpreted(
    forms: Sequence[Form | CachedDerivative],
    flags: Sequence[str],
    moving: Collection[fem.Function] = (),
) -> list[fem.Form]:
    """The sum of forms as a program, or compiled one by one where programs lack something."""
    from shellmb.native.programs.forms import summed
    from shellmb.native.programs.graph import Unsupported

    comm = comm_of(forms[0] if isinstance(forms[0], Form) else forms[0].of)
    _refuse_others(forms, comm)
    try:
        made = [summed(forms, moving)]
    except Unsupported:
        made = _compiled_with_derivatives(forms, flags)
    return [form for form in made if form is not None]


def _compiled_with_derivatives(
    forms: Sequence[Form | CachedDerivative], flags: Sequence[str]
) -> list[fem.Form | None]:
    comm = comm_of(forms[0] if isinstance(forms[0], Form) else forms[0].of)
    cache_folder()  # on all ranks, as it may be refused
    _refuse_others(forms, comm)
    places, records = comm.bcast(_known(forms, flags) if comm.rank == 0 else None)
    # derivatives whose kernels are not known are taken, of those with one kernel the first
    taken: dict[Any, Form] = {}
    for form, place in zip(forms, places, strict=True):
        if place not in records and place not in taken:
            taken[place] = form if isinstance(form, Form) else form.form()
    compile_missing([f for f in taken.values() if not f.empty()], comm, flags)
    made: list[fem.Form | None] = []
    for form, place in zip(forms, places, strict=True):
        if isinstance(form, Form):
            made.append(None if form.empty() else _compiled(form, flags))
            continue
        if place not in records:
            own = taken[place]
            records[place] = form.record(own, "" if own.empty() else module_name(own, flags))
            if comm.rank == 0:
                write(place, records[place])
        made.append(_differentiated(form, records[place]))
    return made


def _refuse_others(forms: Sequence[Form | CachedDerivative], comm: MPI.Comm) -> None:
    """Refuse forms that differ from rank to rank, of which each would wait for its own; collective.

    Raises:
        RunError: On all ranks, if they differ.
    """
    if comm.size == 1:
        return
    own = [f if isinstance(f, Form) else f.of for f in forms]
    marks = [form.signature() for form in own]
    first = comm.bcast(marks)
    other = next((f for f, a, b in zip(own, first, marks, strict=False) if a != b), None)
    wrong = None
    if other is not None or len(first) != len(marks):
        functions = () if other is None else other.coefficients()
        wrong = "".join(f", of {name}" for name in sorted({str(f.name) for f in functions}))
    wrong = first_found(comm, wrong)
    if wrong is not None:
        raise RunError(
            f"forms{wrong} differ from rank to rank: all ranks must have the same laws and "
            "energies, which ask for no rank and no random number"
        )


def compile_missing(items: Sequence[Item], comm: MPI.Comm, flags: Sequence[str] = ()) -> None:
    """Compile those of some forms and expressions that are not in the cache; collective.

    Args:
        items: Forms that are not empty, and expressions.
        comm: The ranks.
        flags: As of `compiled`.

    Raises:
        RunError: If the C compiler fails; on all ranks.
    """
    failure: Exception | None = None
    if comm.rank == 0:
        try:
            folder, named = cache_folder(), {module_name(item, flags): item for item in items}
            # what is damaged is made anew
            new = {k: item for k, item in named.items() if not is_whole(library(folder, k))}
            written = {k: plain(i) if isinstance(i, Form) else i for k, i in new.items()}
            wanted = {k: (item, flags_for(item, flags)) for k, item in written.items()}
            compile_new(wanted, folder, _TELLING.get())
        except Exception as error:
            failure = error
    raise_together(failure, "kernels could not be compiled", comm)


def _compiled(form: Form, flags: Sequence[str]) -> fem.Form:
    """A form whose kernel is there."""
    spaces = [argument.ufl_function_space() for argument in form.arguments()]
    return _attached(module_name(form, flags), form, spaces, form.coefficients(), form.constants())


def _known(
    forms: Sequence[Form | CachedDerivative], flags: Sequence[str]
) -> tuple[list[Any], dict[Any, Record]]:
    """Find where records of derivatives are kept, numbers of forms, and records with kernels."""
    folder, records = cache_folder(), {}
    places: list[Any] = [
        k if isinstance(form, Form) else form.file(folder, module_name(form.of, flags))
        for k, form in enumerate(forms)
    ]
    for place in places:
        found = None if isinstance(place, int) else read(place)
        if found is not None and (not found.kernel or is_whole(library(folder, found.kernel))):
            records[place] = found
    return places, records


def _differentiated(derivative: CachedDerivative, known: Record) -> fem.Form | None:
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
    kernel = loaded(cache_folder(), name, "form")
    ufcx = kernel.form
    for found in _WATCHING.get():
        found.add(name)
    subdomains = like.subdomain_data()
    (domain,) = subdomains
    offsets = ufcx.form_integral_offsets
    ids = {
        kind.name: [ufcx.form_integral_ids[j] for j in range(offsets[i], offsets[i + 1])]
        for i, kind in enumerate(map(fem.IntegralType, range(len(fem.IntegralType))))
    }
    made = form_cpp_class(default_scalar_type)(
        [kernel.address],
        [space._cpp_object for space in spaces],
        kernel.reads(coefficients),
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
    return fem.Form(made, ufcx, None, kernel)  # type: ignore[arg-type]


@cache
def loaded(folder: Path, name: str, kind: str) -> Kernel:
    """A kernel of the cache; loaded once in a process.

    Args:
        folder: The cache.
        name: Of its file.
        kind: What it is of, "form" or "expression".

    Raises:
        RunError: If it cannot be loaded.
    """
    with loading(library(folder, name)) as file:
        code = ctypes.CDLL(str(file))
        pointer = ctypes.c_void_p.in_dll(code, f"{kind}_{name}_0").value
    return Kernel(name, ufcx_interface().cast(f"ufcx_{kind} *", pointer), code)


@cache
def ufcx_interface() -> cffi.FFI:
    """Interface to FFCx's structures of C."""
    ffi = cffi.FFI()
    scalar = np.dtype(default_scalar_type).name
    ffi.cdef(ffcx_jit.UFC_HEADER_DECL.format(scalar))
    ffi.cdef(ffcx_jit.UFC_INTEGRAL_DECL + ffcx_jit.UFC_FORM_DECL + ffcx_jit.UFC_EXPRESSION_DECL)
    return ffi


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


def comm_of(of: Form | Expr) -> MPI.Comm:
    """The ranks of what a form or an expression is on."""
    domains: Any = of.subdomain_data() if isinstance(of, Form) else extract_domains(of)
    domain = next(iter(domains))
    comm: MPI.Comm = domain.ufl_cargo().comm
    return comm


def module_name(item: Item, flags: Sequence[str] = ()) -> str:
    """Name of the kernel of a form or an expression.

    Args:
        item: The form; or the expression and its points.
        flags: As of `compiled`.
    """
    if isinstance(item, Later):
        return item.kernel(tuple(flags), lambda form: _module_name(form, flags))
    return _module_name(item, flags)


def _module_name(item: Item, flags: Sequence[str]) -> str:
    options = ffcx.options.get_options({"scalar_type": default_scalar_type})
    tag = ffcx_jit._compute_option_signature(options)
    tag += ffcx_jit._compilation_signature(flags_for(item, flags), False)
    kind = "shellmb_form" if isinstance(item, Form) else "shellmb_expression"
    items: list[Any] = [item]
    return f"{kind}_{ffcx.naming.compute_signature(items, tag)}"


_WATCHING: ContextVar[tuple[set[str], ...]] = ContextVar("watching", default=())


def kernel_name(form: fem.Form) -> str:
    """Name of a form's kernel: forms that are alike share one.

    Args:
        form: A compiled form.
    """
    kernel: Any = form.module
    # DOLFINx has a module of Python there
    return str(kernel.name if isinstance(kernel, Kernel) else kernel.__name__)


@contextmanager
def watched() -> Iterator[set[str]]:
    """Collects the names of the kernels that are compiled, or found in the cache, meanwhile."""
    found: set[str] = set()
    token = _WATCHING.set((*_WATCHING.get(), found))
    try:
        yield found
    finally:
        _WATCHING.reset(token)
