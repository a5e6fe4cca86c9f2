"""UFL forms that are created lazily, and known facts of forms that are alike.

To write a form in UFL, to look through it and to sign it takes longer than all else in the model of
a small scene. Much of it is done again and again: for each of several bodies that are alike, for
companions of a run with other elements, for each scene of a study. So a form here is a function
with its arguments. If a form with the same key (`native.alike`) was written before, its kernel,
its functions and its Constants are known, and it is not written at all.

What is known holds for one model and its companions (`known_forms`). The next model begins with
nothing: who has changed an equation sees it act, in one process, too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from functools import cached_property, wraps
from typing import Any

import ufl
from ufl import Form
from ufl.core.expr import Expr

from shellmb.native.alike import Inputs, inputs

# slots of a form of UFL
_SLOTS = tuple(Form.__slots__)

Places = tuple[int, ...]


@dataclass(frozen=True)
class Facts:
    """Facts of a form in terms of its inputs, the same for all forms with its key.

    Args:
        coefficients: Places of its functions among the items of the inputs.
        constants: Places of its Constants.
        arguments: Places of its test and trial functions.
        measures: Places of its domains, and of the data of its integrals over each, by their kind;
            -1 where there are none.
        empty: Whether it has no integrals.
        names: Names of its kernels by the flags of their compiler.
    """

    coefficients: Places
    constants: Places
    arguments: Places
    measures: tuple[tuple[int, Mapping[str, Places]], ...]
    empty: bool
    names: dict[tuple[str, ...], str] = field(default_factory=dict)


_KNOWN: dict[bytes, Facts] = {}
_COMPANION = ContextVar("companion", default=False)


@contextmanager
def known_forms() -> Iterator[None]:
    """Context of models of comparison runs, which reuse known facts of the last model's forms."""
    before = _COMPANION.set(True)
    try:
        yield
    finally:
        _COMPANION.reset(before)


def begin_model() -> None:
    """Forget facts of forms of earlier models, unless the next one is of a comparison run."""
    if not _COMPANION.get():
        _KNOWN.clear()


class Later(Form):
    """A UFL form that is created lazily.

    Args:
        write: Writes it: a function of its arguments alone.
        arguments: Its arguments.
    """

    def __init__(self, write: Callable[..., Form], *arguments: Any) -> None:
        # nothing of UFL's own: `__getattr__` gives that
        self.written_from = write, *arguments

    def __getattr__(self, name: str) -> Any:
        """Write the form: one of UFL's slots is looked at."""
        if name not in _SLOTS:
            raise AttributeError(name)
        made = self.written
        for slot in _SLOTS:
            setattr(self, slot, getattr(made, slot))
        return getattr(self, name)

    @cached_property
    def written(self) -> Form:
        """The form of UFL, which has looked through itself."""
        write, *arguments = self.written_from
        made = write(*arguments)
        if isinstance(made, Later):
            return made.written
        # fills all slots
        made.subdomain_data()
        made.arguments()
        return made

    @cached_property
    def _inputs(self) -> Inputs | None:
        return inputs(*self.written_from)

    @cached_property
    def _facts(self) -> Facts | None:
        """Facts of it that others share; None: there is no key."""
        if self._inputs is None:
            return None
        found = _KNOWN.get(self._inputs.key)
        if found is None and (found := _facts_of(self.written, self._inputs)) is not None:
            _KNOWN[self._inputs.key] = found
        return found

    def _at(self, places: Places) -> tuple[Any, ...]:
        assert self._inputs is not None
        return tuple(self._inputs.items[k] for k in places)

    def coefficients(self) -> Any:
        """Functions of the form."""
        facts = self._facts
        return Form.coefficients(self) if facts is None else self._at(facts.coefficients)

    def constants(self) -> Any:
        """Constants of the form."""
        facts = self._facts
        return Form.constants(self) if facts is None else self._at(facts.constants)

    def arguments(self) -> Any:
        """Test and trial functions of the form."""
        facts = self._facts
        return Form.arguments(self) if facts is None else self._at(facts.arguments)

    def empty(self) -> bool:
        """Decide whether it has no integrals."""
        facts = self._facts
        return bool(Form.empty(self)) if facts is None else facts.empty

    def subdomain_data(self) -> Any:
        """Data of its integrals, by domain and kind."""
        facts = self._facts
        if facts is None:
            return Form.subdomain_data(self)
        items = (*self._inputs.items, None) if self._inputs is not None else ()
        return {
            items[domain]: {kind: [items[k] for k in places] for kind, places in data.items()}
            for domain, data in facts.measures
        }

    def kernel(self, flags: tuple[str, ...], name: Callable[[Form], str]) -> str:
        """Name of its kernel.

        Args:
            flags: More flags of the C compiler.
            name: Finds the name.
        """
        names = {} if self._facts is None else self._facts.names
        if flags not in names:
            names[flags] = name(self.written)
        return names[flags]

    def __add__(self, other: Any) -> Any:
        """Sum with another form, or with nothing."""
        return Later(_added, self, other) if isinstance(other, Form) else _sum(self, other)

    def __radd__(self, other: Any) -> Any:
        """Sum with another form, or with nothing."""
        return Later(_added, other, self) if isinstance(other, Form) else _sum(self, other)

    def __sub__(self, other: Any) -> Any:
        """Difference from another form."""
        return self + (-other)

    def __rsub__(self, other: Any) -> Any:
        """Difference of another form from it."""
        return other + (-self)

    def __neg__(self) -> Any:
        """The form with the other sign."""
        return Later(_opposite, self)

    def __rmul__(self, scalar: Any) -> Any:
        """Multiple of the form."""
        return Later(_multiple, scalar, self)


def later[**P](function: Callable[P, Form]) -> Callable[P, Form]:
    """Decorate a function that writes a form: it is called when somebody looks into the form.

    Args:
        function: What it returns follows from its arguments alone, and is never None; called
            without names of arguments.
    """

    @wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> Form:
        return function(*args, **kwargs) if kwargs else Later(function, *args)

    return call


def plain(form: Form) -> Form:
    """A form as UFL's algorithms take it.

    Args:
        form: A form, written or not.
    """
    return form.written if isinstance(form, Later) else form


@later
def integral(density: Expr, measure: ufl.Measure) -> Form:
    """Integral of a density.

    Args:
        density: The density.
        measure: The measure.
    """
    return density * measure


def _sum(form: Form, other: Any) -> Any:
    return Form.__add__(form, other)


def _added(a: Form, b: Form) -> Form:
    return Form([*a.integrals(), *b.integrals()])


def _opposite(a: Form) -> Form:
    return Form([-integral for integral in a.integrals()])


def _multiple(scalar: Any, a: Form) -> Form:
    return Form([scalar * integral for integral in a.integrals()])


def _facts_of(form: Form, known: Inputs) -> Facts | None:
    """Facts of a form; None where it has something that is not among its inputs."""
    places = {id(item): k for k, item in enumerate(known.items)} | {id(None): -1}

    def found(items: Iterable[Any]) -> Places:
        return tuple(places[id(item)] for item in items)

    try:
        return Facts(
            found(form.coefficients()),
            found(form.constants()),
            found(form.arguments()),
            tuple(
                (places[id(domain)], {kind: found(data) for kind, data in kinds.items()})
                for domain, kinds in form.subdomain_data().items()
            ),
            form.empty(),
        )
    except KeyError:
        return None
