"""Forms made ready for DOLFINx and our loops: their integrands as programs that C interprets."""

from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

from mpi4py import MPI  # before dolfinx

import numpy as np
from dolfinx import fem, la
from ufl import Form

from shellmb.arrays import Floats
from shellmb.errors import RunError, alike
from shellmb.native.assembler import is_native
from shellmb.native.programs.forms import Interpreted, summed
from shellmb.native.programs.graph import Unsupported
from shellmb.native.reference import compiled_form


def compiled(form: Form) -> fem.Form:
    """A form made ready.

    Args:
        form: One that is not empty; its parameters are Constants, so that their values do not
            matter here.
    """
    return compile_all([form])[0]


def assembled(form: Form) -> Floats:
    """Vector of a form with a test function, a local array with its ghosts; collective."""
    vector = fem.assemble_vector(compiled(form))
    vector.scatter_reverse(la.InsertMode.add)
    vector.scatter_forward()
    return np.array(vector.array)


def compile_all(forms: Sequence[Form]) -> list[fem.Form]:
    """Forms made ready, without those that are empty.

    Args:
        forms: Forms on meshes of one communicator; the call is collective.
    """
    return [made for some in together(enumerate(forms)).values() for made in some]


def together[K](
    forms: Iterable[tuple[K, Form]], moving: Collection[fem.Function] = ()
) -> dict[K, list[fem.Form]]:
    """Forms made ready, those of one key as one program; collective.

    Args:
        forms: Forms with their keys.
        moving: Functions that change from call to call; what follows from others alone is kept.
            Without any nothing is.

    Returns:
        Forms by their keys, without empty ones: one of each, or all where there are no programs.
    """
    groups: dict[K, list[Form]] = {}
    for key, form in forms:
        groups.setdefault(key, []).append(form)
    if is_native():
        _refuse_others([form for some in groups.values() for form in some])
    elements = {repr(function.ufl_element()) for function in moving}
    return {k: made for k, some in groups.items() if (made := _made(some, elements))}


def _made(forms: Sequence[Form], moving: Collection[str]) -> list[fem.Form]:
    """The sum of forms as a program, or one by one by DOLFINx where programs lack something."""
    if not is_native():
        return [form for form in map(compiled_form, forms) if form is not None]
    try:
        made = [summed(forms, moving)]
    except Unsupported as lacking:
        made = [_by_dolfinx(form, lacking) for form in forms]
    found = [form for form in made if form is not None]
    for names in _WATCHING.get():
        names.update(map(kernel_name, found))
    return found


def _by_dolfinx(form: Form, lacking: Unsupported) -> fem.Form | None:
    """A form compiled by DOLFINx.

    Raises:
        RunError: If the C compiler fails.
    """
    try:
        return compiled_form(form)
    except Exception as error:
        raise RunError(
            f"a form with {lacking}, which has to be compiled, cannot be: {error}"
        ) from error


def _refuse_others(forms: Sequence[Form]) -> None:
    """Refuse forms that differ from rank to rank, of which each would wait for its own; collective.

    Raises:
        RunError: On all ranks, if they differ.
    """
    comm = next((comm_of(form) for form in forms if not form.empty()), MPI.COMM_SELF)
    if comm.size == 1:
        return
    marks = [form.signature() for form in forms]
    first = comm.bcast(marks)
    other = next((f for f, a, b in zip(forms, first, marks, strict=False) if a != b), None)
    with alike(comm):
        if other is not None or len(first) != len(marks):
            functions = () if other is None else other.coefficients()
            of = "".join(f", of {name}" for name in sorted({str(f.name) for f in functions}))
            raise RunError(
                f"forms{of} differ from rank to rank: all ranks must have the same laws and "
                "energies, which ask for no rank and no random number"
            )


def comm_of(form: Form) -> MPI.Comm:
    """The ranks of what a form is on."""
    comm: MPI.Comm = form.integrals()[0].ufl_domain().ufl_cargo().comm
    return comm


_WATCHING: ContextVar[tuple[set[str], ...]] = ContextVar("watching", default=())


def kernel_name(form: fem.Form) -> str:
    """Name of a form's program: forms that are alike share one.

    Args:
        form: A form that was made ready.
    """
    kernel: Any = form.module
    # DOLFINx has a module of Python there
    return str(kernel.name if isinstance(kernel, Interpreted) else kernel.__name__)


@contextmanager
def watched() -> Iterator[set[str]]:
    """Collects the names of the programs that are made meanwhile."""
    found: set[str] = set()
    token = _WATCHING.set((*_WATCHING.get(), found))
    try:
        yield found
    finally:
        _WATCHING.reset(token)
