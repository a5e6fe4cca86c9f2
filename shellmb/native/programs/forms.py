"""Forms whose integrands are programs, as DOLFINx and our loops take them."""

from __future__ import annotations

import itertools
import struct
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

from mpi4py import MPI as _MPI  # noqa: F401  (before dolfinx)

import numpy as np
from dolfinx import default_scalar_type, fem
from dolfinx.fem import IntegralType
from dolfinx.fem.forms import form_cpp_class, get_integration_domains
from ufl import Form
from ufl.classes import CoefficientDerivative
from ufl.utils.sorting import canonicalize_metadata

from shellmb.arrays import Int32s, Ints
from shellmb.native import library as native
from shellmb.native.compiling.flags import LANES
from shellmb.native.compiling.source import INTEGRALS
from shellmb.native.library import CArrays
from shellmb.native.programs.building import Rule
from shellmb.native.programs.geometry import COORDINATES
from shellmb.native.programs.graph import Unsupported
from shellmb.native.programs.reading import Reader
from shellmb.native.programs.structure import Structure
from shellmb.native.programs.tables import Points, Tables, points_of

KIND_COUNT = len(IntegralType.__members__)
KINDS = {"cell": IntegralType.cell, "exterior_facet": IntegralType.exterior_facet}
# rules by the structures of their integrands: to read them takes longer than many runs, and rules
# know numbers, elements and places of functions, but no function and no mesh
READ: dict[Any, list[Rule]] = {}
# programs, likewise, by these and by where the numbers of functions and Constants stand
PROGRAMS: dict[Any, Program] = {}
# structures and readers of what derivatives are taken of, by the ids of its expressions
_READ_ONCE: ContextVar[dict[Any, Any] | None] = ContextVar("read_once", default=None)


@contextmanager
def read_once() -> Iterator[None]:
    """What derivatives are taken of is read once in here for all derivatives of it."""
    token = _READ_ONCE.set({})
    try:
        yield
    finally:
        _READ_ONCE.reset(token)


@dataclass(frozen=True, eq=False)
class Interpreted:
    """Stand-in for the module of a form that DOLFINx has compiled.

    Args:
        forms: The forms that add up to it.
        kept: What its programs point to.
    """

    forms: Sequence[Form]
    kept: Any

    @property
    def name(self) -> str:
        """Name that forms with the same programs share."""
        return "+".join(str(form.signature()) for form in self.forms)


def dimension(function: Any) -> int:
    """Number of dofs that a function has in a cell."""
    return int(function.ufl_element().dim)


def size(constant: Any) -> int:
    """Number of numbers of a Constant."""
    return int(np.prod(constant.ufl_shape, initial=1))


def starts(items: Iterable[Any], count: Callable[[Any], int]) -> dict[Any, int]:
    """Place of the first number of each item among the numbers of all.

    Args:
        items: The items.
        count: Gives how many numbers an item has.
    """
    return dict(zip(items, itertools.accumulate(map(count, items), initial=0), strict=False))


def _ranges(first: Mapping[Any, int], items: Iterable[Any], count: Callable[[Any], int]) -> Ints:
    """Places of all numbers of some items."""
    own = [first[item] + np.arange(count(item)) for item in items]
    return np.concatenate([np.zeros(0, dtype=int), *own])


class Integrands:
    """Integrands over one kind of entity, and what derivatives in them are taken of.

    The latter is read once for all derivatives of it, in here or in what is `read_once`.

    Args:
        integrals: The integrals.
    """

    def __init__(self, integrals: Sequence[Any]) -> None:
        self.integrals, self.domain = integrals, integrals[0].ufl_domain()
        self.kind = integrals[0].integral_type()
        self._roots = [_underived(integral.integrand()) for integral in integrals]
        key = self.kind, id(self.domain), *map(id, self._roots)
        # what is known by its id has to live
        new = Structure(self._roots), dict[bytes, tuple[Reader, Tables]](), self._roots
        known = (_READ_ONCE.get() or {}).setdefault(key, new)
        self._base, self._readers, _ = known
        self.structure = Structure((i.integrand() for i in integrals), self._base)

    def rules(self, arguments: Sequence[Any], static: Collection[int] = ()) -> list[Rule]:
        """Programs of each quadrature rule.

        Args:
            arguments: Elements of the arguments.
            static: Sources of values that seldom change: what follows from these alone is kept.
        """
        groups: dict[bytes, tuple[Any, list[int]]] = {}
        for k, integral in enumerate(self.integrals):
            points = points_of(integral)
            key = points.places.tobytes() + points.weights.tobytes()
            groups.setdefault(key, (points, []))[1].append(k)
        found = []
        for key, (points, own) in groups.items():
            if key not in self._readers:
                self._readers[key] = self._reader(self._base, points, arguments, static)
                for k in own:
                    self._readers[key][0].tensor(self._roots[k])
            known = self._readers[key]
            reader, tables = self._reader(self.structure, points, arguments, static, *known)
            value = reader.graph.total([reader.scalar(self.integrals[k].integrand()) for k in own])
            value = reader.graph.mul(value, reader.geometry.scale())
            found.append(Rule(reader, value, len(arguments), points, tables, bool(static)))
        return found

    def _reader(
        self,
        structure: Structure,
        points: Points,
        arguments: Sequence[Any],
        static: Collection[int],
        known: Reader | None = None,
        tables: Tables | None = None,
    ) -> tuple[Reader, Tables]:
        functions, places = structure.coefficients, starts(structure.constants, size)
        elements, facet = [f.ufl_element() for f in functions], self.kind != "cell"
        own = Tables(points, self.domain, elements, arguments, tables)
        vanishes = own.vanishes
        return (
            Reader(self.domain, functions, places, arguments, vanishes, facet, static, known),
            own,
        )


def _underived(integrand: Any) -> Any:
    """What a derivative is taken of, or what is none."""
    return integrand.ufl_operands[0] if isinstance(integrand, CoefficientDerivative) else integrand


class Program:
    """The program of a form over one kind of entity, for C.

    Args:
        rules: What each quadrature rule adds.
        rank: Number of arguments.
        columns: Dofs of the second argument; 1 without.
        layout: Numbers that it gets.
        structure: What the rules add up to.

    Attributes:
        kept: Numbers that are kept of a cell, or of a facet.
        reads: Which coefficients it reads.
        vanishes: Whether it gives nothing but zero.
    """

    def __init__(
        self,
        rules: Sequence[Rule],
        rank: int,
        columns: int,
        layout: Layout,
        structure: Structure,
    ) -> None:
        dofs, constants, steady = layout.dofs(structure), layout.numbers(structure), layout.steady
        self.vanishes = not any(rule.parts for rule in rules)
        self.reads, places = _read(rules, dofs, len(steady))
        edges = np.flatnonzero(np.diff([0, *steady[self.reads].astype(int), 0])).reshape(-1, 2)
        ranges = [{"first": int(a), "count": int(b - a)} for a, b in edges]
        coordinates = 3 * (layout.element.dim // layout.element.block_size)
        # behind a stamp and what it follows from
        place = 1 + coordinates + sum(some["count"] for some in ranges)
        values = sum(rule.kept for rule in rules)
        self.kept = place + values if values else 0
        # keeps what C points to
        self._pointer = pointer = CArrays()
        structs = []
        for rule in rules:
            structs.append(rule.struct(pointer, constants, place, places[dofs]))
            place += rule.kept
        seen = sorted({int(constants[k]) for rule in rules for k in rule.constants})
        members = {
            "rank": rank,
            "columns": columns,
            "rules": len(rules),
            "rule": pointer.many("Rule", structs),
            "registers": max((r.registers * r.chunk for r in rules), default=0),
            "products": max((r.products for r in rules), default=0),
            "factors": max((r.factors for r in rules), default=0),
            "reads": len(self.reads) if len(self.reads) < len(steady) else 0,
            "read": pointer(np.append(self.reads, 0).astype(np.int32)),
            "kept": self.kept,
            "ranges": len(ranges),
            "coordinates": coordinates,
            "constants": len(seen),
            "range": pointer.many("Range", ranges),
            "constant": pointer(np.array([*seen, 0], dtype=np.int32)),
        }
        (self._made,) = pointer.many("Program", [members])

    def of_each(self, tables: Sequence[Int32s]) -> list[Int32s]:
        """Dofs that it reads of each coefficient, by all of them, cell by cell."""
        found, start = [], 0
        for table in tables:
            own = self.reads - start
            own = own[(own >= 0) & (own < table.shape[1])]
            found.append(np.ascontiguousarray(table[:, own]))
            start += table.shape[1]
        return found

    def address(self, pointer: CArrays) -> float:
        """Address of it for one form, in the bits of a number that stands before the constants.

        Args:
            pointer: Keeps what is of this form alone: numbers that C writes.
        """
        made = pointer.many("Program", [self._made])
        (program,) = made
        program.rule = rules = pointer.many("Rule", list(self._made.rule[0 : program.rules]))
        for rule in rules[0 : program.rules]:
            for stage in (rule.steady, rule.always):
                size = stage.numbers + stage.constants + rule.entity_size + stage.uniform_ops + 1
                stage.uniform = pointer(np.array(pointer.ffi.unpack(stage.uniform, size)))
        program.seen = pointer(np.append(np.full(program.constants, np.nan), 0.0))
        place = int(pointer.ffi.cast("uintptr_t", made))
        (number,) = struct.unpack("d", struct.pack("Q", place))
        return float(number)


def summed(forms: Sequence[Form], moving: Collection[str] = ()) -> fem.Form | None:
    """The sum of forms as one, whose kernels are programs; None for a matrix that vanishes.

    Args:
        forms: Forms with the same arguments, over one mesh; without integrals there is none.
        moving: Elements of functions that change from call to call: what follows from others
            alone is kept. Without any nothing is.

    Raises:
        Unsupported: If it has something that programs do not have.
    """
    groups: dict[tuple[str, Any], list[Any]] = {}
    for integral in [integral for form in forms for integral in form.integrals()]:
        key = integral.integral_type(), integral.subdomain_id()
        groups.setdefault(key, []).append(integral)
    if not groups:
        return None
    ufl_domain, *others = dict.fromkeys(i.ufl_domain() for some in groups.values() for i in some)
    if others:
        raise Unsupported("several meshes")
    if len(groups) > INTEGRALS or not {kind for kind, _ in groups} <= set(KINDS):
        raise Unsupported("so many or such integrals")
    order = sorted(groups, key=lambda key: (list(KINDS).index(key[0]), str(type(key[1])), key[1]))
    integrands = [Integrands(groups[key]) for key in order]
    layout = Layout([some.structure for some in integrands], ufl_domain, moving)
    programs = [program_of(some, layout) for some in integrands]
    if len(layout.arguments) == 2 and all(program.vanishes for program in programs):
        return None
    lib, ffi, pointer = native.cells().lib, native.cells().ffi, CArrays()
    places = fem.Constant(ufl_domain, np.array([program.address(pointer) for program in programs]))
    every = np.arange(len(layout.coefficients), dtype=np.int8)
    integrals: dict[IntegralType, list[Any]] = {kind: [] for kind in KINDS.values()}
    kernels = []
    for number, key in enumerate(order):
        one = ffi.addressof(lib, f"interpret_one_{number}")
        many = ffi.NULL
        if LANES > 1 and key[0] == "cell" and ufl_domain.topological_dimension == 2:
            many = ffi.addressof(lib, f"interpret_lanes_{number}")
        functions = {"tabulate_tensor_float64": one, "tabulate_tensor_float32": many}
        kernels.append(SimpleNamespace(**functions, program=programs[number]))
        own = integrals[KINDS[key[0]]]
        entities = _entities(groups[key][0])
        own.append((len(own), int(ffi.cast("uintptr_t", one)), entities, every))
    counts = [0, *(len(integrals.get(IntegralType(k), ())) for k in range(KIND_COUNT))]
    ufcx = SimpleNamespace(form_integral_offsets=np.cumsum(counts).tolist(), form_integrals=kernels)
    made = form_cpp_class(default_scalar_type)(
        [argument.ufl_function_space()._cpp_object for argument in layout.arguments],
        {kind: own for kind, own in integrals.items() if own},
        [f._cpp_object for f in layout.coefficients],
        [places._cpp_object, *(c._cpp_object for c in layout.constants)],
        False,
        [],
        ufl_domain.ufl_cargo(),
    )
    module = Interpreted(forms, (programs, pointer, places))
    return fem.Form(made, ufcx, None, module)  # type: ignore[arg-type]


class Layout:
    """Numbers that kernels of a form get.

    Args:
        structures: Of the integrands over each kind of entity.
        domain: The mesh, as UFL knows it.
        moving: Elements of functions that change from call to call.

    Attributes:
        coefficients: Functions of the form.
        constants: Constants of the form; before them stands one number for each of `structures`.
        arguments: Its arguments.
        element: Of the coordinates.
        moving: Those elements.
        steady: Of each coefficient of a cell whether it seldom changes.
    """

    def __init__(
        self, structures: Sequence[Structure], domain: Any, moving: Collection[str]
    ) -> None:
        self.coefficients = list(dict.fromkeys(f for some in structures for f in some.coefficients))
        self.constants = list(dict.fromkeys(c for some in structures for c in some.constants))
        arguments = {k: v for some in structures for k, v in some.arguments.items()}
        self.arguments = [arguments[k] for k in sorted(arguments)]
        self.element, self.moving = domain.ufl_coordinate_element(), moving
        self._dofs = starts(self.coefficients, dimension)
        self._numbers = starts(self.constants, size)
        self._programs = len(structures)
        steady = map(self.is_steady, self.coefficients)
        self.steady = np.repeat([*steady, False], [*map(dimension, self.coefficients), 0])

    def is_steady(self, function: Any) -> bool:
        """Decide whether a function seldom changes."""
        return bool(self.moving) and repr(function.ufl_element()) not in self.moving

    def dofs(self, structure: Structure) -> Ints:
        """Places of dofs of a structure's functions."""
        return _ranges(self._dofs, structure.coefficients, dimension)

    def numbers(self, structure: Structure) -> Ints:
        """Places of numbers of a structure's Constants."""
        return self._programs + _ranges(self._numbers, structure.constants, size)


def program_of(integrands: Integrands, layout: Layout) -> Program:
    """Program of integrals over one kind of entity; those of the same structure share it.

    Args:
        integrands: Their integrands.
        layout: Where their numbers stand.

    Raises:
        Unsupported: If they have something that programs do not have.
    """
    structure = integrands.structure
    functions = enumerate(structure.coefficients)
    static = [COORDINATES, *(k for k, f in functions if layout.is_steady(f))]
    elements = [argument.ufl_element() for argument in layout.arguments]
    key = (
        structure.key,
        integrands.kind,
        repr(layout.element),
        *(canonicalize_metadata(integral.metadata()) for integral in integrands.integrals),
        *map(repr, elements),
        *(static if layout.moving else ()),
    )
    if key not in READ:
        READ[key] = integrands.rules(elements, static if layout.moving else ())
    numbers = layout.dofs(structure), layout.numbers(structure), layout.steady
    whole = key, *(some.tobytes() for some in numbers)
    if whole not in PROGRAMS:
        columns = elements[1].dim if len(elements) == 2 else 1
        PROGRAMS[whole] = Program(READ[key], len(elements), columns, layout, structure)
    return PROGRAMS[whole]


def _read(rules: Sequence[Rule], dofs: Ints, count: int) -> tuple[Ints, Ints]:
    """Coefficients of a cell that rules read, and places of all among these.

    Nodes of each function stay at equal distances; where they would not, all are read.
    """
    values = [dofs[places] for rule in rules for places in rule.read()]
    reads = np.unique(np.concatenate([*values, np.zeros(0)])).astype(int)
    places = np.zeros(count, dtype=int)
    places[reads] = np.arange(len(reads))
    if any(len(np.unique(np.diff(places[some]))) > 1 for some in values):
        reads = places = np.arange(count)
    return reads, places


def _entities(integral: Any) -> Any:
    """Cells, or facets as pairs of cell and number."""
    mesh = integral.ufl_domain().ufl_cargo()
    kind, part = integral.integral_type(), integral.subdomain_id()
    if kind == "cell" and part == "everywhere":
        return np.arange(mesh.topology.index_map(mesh.topology.dim).size_local, dtype=np.int32)
    subdomains = integral.subdomain_data()
    parts = part if isinstance(part, tuple) else (part,)
    if subdomains is None or "everywhere" in parts:
        raise Unsupported("all facets, or parts without a list")
    found = get_integration_domains(KINDS[kind], subdomains, list(parts))
    own = [np.asarray(e).ravel() for k, e in found if k in parts]
    return np.concatenate([np.zeros(0), *own]).astype(np.int32)
