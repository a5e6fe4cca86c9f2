"""Keys of what forms are written from: with one key, forms differ only in meshes and functions.

A form is what a function of UFL makes of its arguments: states, Constants, measures, sections, and
other functions that hold such. The key has all of this but the identity of meshes, functions and
Constants, of which it has the pattern: what is one in two places here is one there. What is not
known to be harmless, functions and objects of a user above all, has no key. Functions of ours are
taken as they were when the model was begun (`later.begin_model`).
"""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Callable, Hashable, Mapping, Sequence
from enum import Enum
from functools import _lru_cache_wrapper, partial
from types import BuiltinFunctionType, CodeType, FunctionType, MethodType
from typing import Any

from mpi4py import MPI as _MPI  # noqa: F401  (before dolfinx)

import dolfinx.mesh
import numpy as np
import ufl
from dolfinx import fem
from ufl import Form
from ufl.classes import (
    FixedIndex,
    GeometricQuantity,
    Identity,
    Label,
    MultiIndex,
    Operator,
    ScalarValue,
    Zero,
)
from ufl.core.expr import Expr
from ufl.domain import extract_unique_domain

# packages whose functions and classes depend on nothing but their arguments
OURS = (
    "shellmb.forms.",
    "shellmb.model.",
    "shellmb.schemes.",
    "shellmb.native.",
    "ufl.",
    "_operator.",
    "builtins.",
)
# arrays above this size are no parameters of a form [bytes]
SMALL_ARRAY = 4096
# where a class lists its attributes that its forms are written from
READ = "forms_read"
VALUES = (type(None), bool, int, float, complex, str, bytes)


class Unknown(Exception):
    """Something that has no key."""


@dataclasses.dataclass(frozen=True)
class Inputs:
    """Objects that forms are written from.

    Args:
        key: Equal for forms that differ in meshes, functions and Constants only.
        items: Meshes, functions, Constants, arguments and data of measures, in an order that
            follows from the key.
    """

    key: bytes
    items: tuple[Any, ...]


def inputs(*of: Any) -> Inputs | None:
    """Find the inputs of a form; None where there is no key.

    Args:
        of: The function that writes it, and its arguments.
    """
    walk = _Walk()
    try:
        walk.visit(of)
    except (Unknown, RecursionError):
        return None
    whole = "\0".join(walk.tokens).encode(errors="surrogatepass")
    return Inputs(hashlib.blake2b(whole).digest(), tuple(walk.items))


# numbers of elements, and of codes of functions, within a process
_NUMBERS: dict[Hashable, int] = {}


def _number(of: Hashable) -> int:
    return _NUMBERS.setdefault(of, len(_NUMBERS))


class _Walk:
    """A walk through objects, from which a key is made.

    Attributes:
        tokens: What was met.
        items: What forms may differ in.
    """

    def __init__(self) -> None:
        self.tokens: list[str] = []
        self.items: list[Any] = []
        self._seen: dict[int, int] = {}
        # none of them may end before the walk does: another one would have its number
        self._kept: list[Any] = []
        self._indices: dict[int, int] = {}

    def visit(self, item: Any) -> None:
        """Go through an object.

        Args:
            item: The object.

        Raises:
            Unknown: If it has no key.
        """
        kind = type(item)
        if kind in VALUES:
            self.tokens.append(f"{kind.__name__}{item!r}")
            return
        before = self._seen.get(id(item))
        if before is not None:
            self.tokens.append(f"@{before}")
            return
        self._seen[id(item)] = len(self._seen)
        self._kept.append(item)
        handler = HANDLERS.get(kind)
        if handler is None:
            handler = next((h for t, h in FAMILIES if isinstance(item, t)), _Walk.instance)
            HANDLERS[kind] = handler
        handler(self, item)

    def say(self, *tokens: object) -> None:
        """Take down what is met."""
        self.tokens.extend(map(str, tokens))

    def each(self, items: Sequence[Any]) -> None:
        """Go through a sequence."""
        self.say(len(items))
        for item in items:
            self.visit(item)

    def named(self, kind: Any) -> None:
        """Take down the name of a class or function of ours.

        Raises:
            Unknown: If it is not ours.
        """
        module = str(kind.__module__)
        if not f"{module}.".startswith(OURS):
            raise Unknown
        self.say(module, kind.__qualname__)

    def sequence(self, item: Sequence[Any]) -> None:
        """A tuple, perhaps one with names, or a list."""
        if type(item) in (tuple, list):
            self.say(type(item).__name__)
        else:
            self.named(type(item))
        self.each(item)

    def mapping(self, item: Mapping[Any, Any]) -> None:
        """A mapping, in its order."""
        self.say("mapping")
        self.each([part for pair in item.items() for part in pair])

    def names(self, item: frozenset[Any]) -> None:
        """A set of values."""
        if not all(isinstance(part, VALUES) for part in item):
            raise Unknown
        self.say("set", *sorted(map(repr, item)))

    def array(self, item: np.ndarray[Any, Any]) -> None:
        """A small array of numbers."""
        if item.nbytes > SMALL_ARRAY or item.dtype.hasobject:
            raise Unknown
        self.say("array", item.dtype, item.shape, item.tobytes().hex())

    def number(self, item: np.generic) -> None:
        """A number of NumPy."""
        self.say("number", item.dtype, repr(item.item()))

    def member(self, item: Enum) -> None:
        """A member of an enumeration."""
        self.say(type(item).__qualname__, item.name)

    def function(self, item: FunctionType) -> None:
        """A function, with what it holds."""
        self.named(item)
        self.say(_number(item.__code__))
        self.each([cell.cell_contents for cell in item.__closure__ or ()])
        self.visit(item.__defaults__)
        self.visit(item.__kwdefaults__)

    def method(self, item: MethodType) -> None:
        """A method with its object."""
        self.say("method")
        self.visit(item.__func__)
        self.visit(item.__self__)

    def bound(self, item: partial[Any]) -> None:
        """A function with some arguments."""
        self.say("partial")
        self.each((item.func, item.args, item.keywords))

    def remembering(self, item: Any) -> None:
        """A function that remembers its results."""
        self.visit(item.__wrapped__)

    def instance(self, item: Any) -> None:
        """An instance of a class of ours, with what forms read of it.

        Of a dataclass these are the fields that count in comparisons.
        """
        self.named(type(item))
        own: list[str] = []
        if READ in type(item).__dict__:
            # subclasses may read more
            own = getattr(item, READ)
        elif "__dataclass_fields__" in type(item).__dict__:
            own = [field.name for field in dataclasses.fields(item) if field.compare]
        elif getattr(item, "__dict__", True):
            raise Unknown
        self.each([getattr(item, name) for name in own])

    def mesh(self, item: dolfinx.mesh.Mesh) -> None:
        """A mesh of DOLFINx: its domain."""
        self.say("mesh")
        self.visit(item.ufl_domain())

    def domain(self, item: ufl.Mesh) -> None:
        """A domain: one of the items."""
        self.say("domain", _number(item.ufl_coordinate_element()))
        self.items.append(item)

    def space(self, item: Any) -> None:
        """A function space: one of the items."""
        self.say("space", _number(item.ufl_element()))
        self.visit(item.ufl_domain())
        self.items.append(item)

    def coefficient(self, item: ufl.Coefficient) -> None:
        """A function: one of the items."""
        self.say("function")
        self.visit(item.ufl_function_space())
        self.items.append(item)

    def constant(self, item: ufl.Constant) -> None:
        """A Constant: one of the items, whatever its value."""
        self.say("constant", item.ufl_shape)
        self.visit(item.ufl_domain())
        self.items.append(item)

    def argument(self, item: ufl.Argument) -> None:
        """A test or trial function: one of the items."""
        self.say("argument", item.number(), item.part())
        self.visit(item.ufl_function_space())
        self.items.append(item)

    def measure(self, item: ufl.Measure) -> None:
        """A measure, whose data are one of the items."""
        if item.intersect_measures():
            raise Unknown
        self._integral(item.integral_type(), item)

    def _integral(self, kind: str, item: Any) -> None:
        self.say("over", kind, item.subdomain_id())
        self.visit(item.metadata())
        self.visit(item.ufl_domain())
        self.data(item.subdomain_data())

    def data(self, item: Any) -> None:
        """Data of a measure: one of the items, whatever they are."""
        if item is None or id(item) in self._seen:
            self.say(None if item is None else self._seen[id(item)])
            return
        self._seen[id(item)] = len(self._seen)
        self.items.append(item)

    def form(self, item: Form) -> None:
        """A form: what it is written from, or its integrals."""
        source = getattr(item, "written_from", None)
        if source is not None:
            self.say("later")
            self.each(source)
            return
        self.say("form", len(item.integrals()))
        for integral in item.integrals():
            if integral.extra_domain_integral_type_map():
                raise Unknown
            self._integral(integral.integral_type(), integral)
            self.visit(integral.integrand())

    def operator(self, item: Operator) -> None:
        """An expression of others, which is nothing but these and its kind."""
        self.say(type(item).__name__)
        self.each(item.ufl_operands)

    def quantity(self, item: GeometricQuantity) -> None:
        """A quantity of the mesh."""
        self.say(type(item).__name__)
        self.visit(extract_unique_domain(item))

    def scalar(self, item: Any) -> None:
        """A number in a form."""
        self.say("value", repr(item.value()))

    def zero(self, item: Zero) -> None:
        """Zero."""
        if item.ufl_free_indices:
            raise Unknown
        self.say("zero", item.ufl_shape)

    def identity(self, item: Identity) -> None:
        """The identity."""
        self.say("identity", item.ufl_shape)

    def indices(self, item: MultiIndex) -> None:
        """Indices: those that are free by the order in which they come."""
        for index in item.indices():
            if isinstance(index, FixedIndex):
                self.say("fixed", int(index))
            else:
                count = index.count()
                self.say("free", self._indices.setdefault(count, len(self._indices)))

    def label(self, item: Label) -> None:
        """A label, which differs from others."""
        self.say("label")

    def unknown(self, item: Any) -> None:
        """Refuse what has no key."""
        raise Unknown


type Handler = Callable[[_Walk, Any], None]

# by the kind of an object; found once in `FAMILIES`, the first that fits
HANDLERS: dict[type, Handler] = {tuple: _Walk.sequence, list: _Walk.sequence}
FAMILIES: tuple[tuple[Any, Handler], ...] = (
    (fem.FunctionSpace, _Walk.space),
    (ufl.FunctionSpace, _Walk.space),
    (ufl.Coefficient, _Walk.coefficient),
    (ufl.Constant, _Walk.constant),
    (ufl.Argument, _Walk.argument),
    (GeometricQuantity, _Walk.quantity),
    (MultiIndex, _Walk.indices),
    (Label, _Walk.label),
    (Zero, _Walk.zero),
    (ScalarValue, _Walk.scalar),
    (Identity, _Walk.identity),
    (ufl.classes.BesselFunction, _Walk.unknown),
    (ufl.classes.BaseFormOperator, _Walk.unknown),
    (Operator, _Walk.operator),
    (Expr, _Walk.unknown),
    (Form, _Walk.form),
    (ufl.Measure, _Walk.measure),
    (dolfinx.mesh.Mesh, _Walk.mesh),
    (ufl.Mesh, _Walk.domain),
    ((tuple, list), _Walk.sequence),
    (Mapping, _Walk.mapping),
    ((set, frozenset), _Walk.names),
    (Enum, _Walk.member),
    (np.ndarray, _Walk.array),
    (np.generic, _Walk.number),
    (MethodType, _Walk.method),
    (FunctionType, _Walk.function),
    (partial, _Walk.bound),
    (_lru_cache_wrapper, _Walk.remembering),
    ((BuiltinFunctionType, type), _Walk.named),
    (CodeType, _Walk.unknown),
)
