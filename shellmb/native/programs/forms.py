"""Forms whose integrands are programs, as DOLFINx and our loops take them."""

from __future__ import annotations

import itertools
import math
import struct
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

from mpi4py import MPI as _MPI  # noqa: F401  (before dolfinx)

import numpy as np
from dolfinx import default_scalar_type, fem
from dolfinx.fem import IntegralType
from dolfinx.fem.forms import form_cpp_class, get_integration_domains
from ufl import Form
from ufl.classes import GeometricQuantity
from ufl.core.expr import Expr
from ufl.core.multiindex import Index
from ufl.utils.sorting import canonicalize_metadata

from shellmb.arrays import Bools, Int32s, Ints
from shellmb.native import library as native
from shellmb.native.compiling.flags import LANES
from shellmb.native.compiling.source import INTEGRALS
from shellmb.native.library import CArrays
from shellmb.native.programs.building import Rule
from shellmb.native.programs.geometry import COORDINATES
from shellmb.native.programs.graph import Unsupported
from shellmb.native.programs.reading import Reader
from shellmb.native.programs.tables import Tables, points_of

KIND_COUNT = len(IntegralType.__members__)
KINDS = {"cell": IntegralType.cell, "exterior_facet": IntegralType.exterior_facet}
# programs by the structures of their forms: to read a form takes longer than many runs, and they
# know numbers, elements and places of functions, but no function and no mesh
READ: dict[Any, list[Program]] = {}
# nodes for each point from which sums are not collected in meshes of few cells: what is so long is
# hardly linear, and to collect it takes longer than many steps gain
LONG, FEW = 4000, 4


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


class Structure:
    """Operations of some expressions, each once, on functions and Constants known by numbers.

    Forms of bodies that are alike have the same, and differ in what the numbers stand for.

    Args:
        expressions: The expressions.

    Attributes:
        coefficients: Numbers of functions, in the order in which they appear.
        constants: Numbers of Constants, likewise.
        arguments: Arguments by their number.
        key: What expressions of the same structure have in common.
    """

    def __init__(self, expressions: Iterable[Expr]) -> None:
        self.coefficients: dict[Any, int] = {}
        self.constants: dict[Any, int] = {}
        self.arguments: dict[int, Any] = {}
        # of indices and labels of variables
        self._names: dict[Any, int] = {}
        self._operations: dict[Any, int] = {}
        self._numbers: dict[int, int] = {}
        roots = [self._number(expression) for expression in expressions]
        self.key = *roots, *self._operations

    @property
    def elements(self) -> list[Any]:
        """Elements of the arguments."""
        return [argument.ufl_element() for _, argument in sorted(self.arguments.items())]

    def _number(self, expr: Any) -> int:
        """Number of an operation, behind those that it is of."""
        operation, numbers = [expr._ufl_typecode_], self._numbers
        for of in expr.ufl_operands:
            number = numbers.get(id(of))
            operation.append(self._number(of) if number is None else number)
        if len(operation) == 1:
            operation += self._terminal(expr)
        found = self._operations.setdefault(tuple(operation), len(self._operations))
        numbers[id(expr)] = found
        return found

    def _terminal(self, expr: Any) -> tuple[Any, ...]:
        names = self._names
        match expr._ufl_handler_name_:
            case "coefficient":
                return _placed(expr, self.coefficients), repr(expr.ufl_element())
            case "constant":
                return _placed(expr, self.constants), expr.ufl_shape
            case "argument":
                self.arguments[expr.number()] = expr
                return expr.number(), repr(expr.ufl_element())
            case "multi_index":
                # free ones below zero
                return tuple(~_placed(i, names) if isinstance(i, Index) else int(i) for i in expr)
            case "label":
                return (_placed(expr, names),)
            case "int_value" | "float_value" | "real_value":
                return (float(expr),)
        return () if isinstance(expr, GeometricQuantity) else (repr(expr),)


def _placed(item: Any, among: dict[Any, int]) -> int:
    """Number of an item, the next one if it has none yet."""
    return among.setdefault(item, len(among))


def constant_places(constants: Collection[Any]) -> dict[Any, int]:
    """Places of Constants among the numbers of all of them."""
    sizes = [math.prod(constant.ufl_shape) for constant in constants]
    return dict(zip(constants, itertools.accumulate(sizes, initial=0), strict=False))


def rules_of(
    integrals: Sequence[Any], structure: Structure, static: list[int], keeps: float
) -> list[Rule]:
    """Programs of each quadrature rule of integrals over one kind of entity.

    Args:
        integrals: The integrals.
        structure: Of all integrands of the form.
        static: Sources of values that seldom change: what follows from these alone is kept.
        keeps: Nodes for each point up to which sums are collected.
    """
    functions, places = structure.coefficients, constant_places(structure.constants)
    domain, facet = integrals[0].ufl_domain(), integrals[0].integral_type() != "cell"
    elements, arguments = [f.ufl_element() for f in functions], structure.elements
    groups: dict[bytes, tuple[Any, list[Any]]] = {}
    for integral in integrals:
        points = points_of(integral)
        key = points.places.tobytes() + points.weights.tobytes()
        groups.setdefault(key, (points, []))[1].append(integral.integrand())
    found = []
    for points, integrands in groups.values():
        tables = Tables(points, domain, elements, arguments)
        reader = Reader(domain, functions, places, arguments, tables.vanishes, facet, static)
        value = reader.graph.total([reader.tensor(x) for x in integrands])
        value = reader.graph.mul(value, reader.geometry.scale())
        found.append(Rule(reader, value, len(arguments), points, tables, keeps))
    return found


class Program:
    """The program of a form over one kind of entity, for C.

    Args:
        rules: What each quadrature rule adds.
        sizes: Dofs of the arguments.
        steady: Of each coefficient of a cell whether it seldom changes.
        coordinates: How many numbers a cell's coordinates are.
        first: Place of the first constant.

    Attributes:
        kept: Numbers that are kept of a cell, or of a facet.
        reads: Which coefficients it reads.
        vanishes: Whether it gives nothing but zero.
    """

    def __init__(
        self,
        rules: Sequence[Rule],
        sizes: Sequence[int],
        steady: Bools,
        coordinates: int,
        first: int,
    ) -> None:
        self.vanishes = not any(rule.parts for rule in rules)
        self.reads, places = _read(rules, len(steady))
        edges = np.flatnonzero(np.diff([0, *steady[self.reads].astype(int), 0])).reshape(-1, 2)
        ranges = [{"first": int(a), "count": int(b - a)} for a, b in edges]
        # behind a stamp and what it follows from
        place = 1 + coordinates + sum(some["count"] for some in ranges)
        values = sum(rule.kept for rule in rules)
        self.kept = place + values if values else 0
        # keeps what C points to
        self._pointer = pointer = CArrays()
        structs = []
        for rule in rules:
            structs.append(rule.struct(pointer, first, place, places))
            place += rule.kept
        constants = sorted({first + k for rule in rules for k in rule.constants})
        members = {
            "rank": len(sizes),
            "columns": sizes[1] if len(sizes) == 2 else 1,
            "rules": len(rules),
            "rule": pointer.many("Rule", structs),
            "registers": max((r.registers * r.chunk for r in rules), default=0),
            "products": max((r.products for r in rules), default=0),
            "factors": max((r.factors for r in rules), default=0),
            "reads": len(self.reads) if len(self.reads) < len(places) else 0,
            "read": pointer(np.append(self.reads, 0).astype(np.int32)),
            "kept": self.kept,
            "ranges": len(ranges),
            "coordinates": coordinates,
            "constants": len(constants),
            "range": pointer.many("Range", ranges),
            "constant": pointer(np.array([*constants, 0], dtype=np.int32)),
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
    if len(groups) > INTEGRALS or not {kind for kind, _ in groups} <= set(KINDS):
        raise Unsupported("so many or such integrals")
    order = sorted(groups, key=lambda key: (list(KINDS).index(key[0]), str(type(key[1])), key[1]))
    integrals = [integral for key in order for integral in groups[key]]
    ufl_domain, *others = dict.fromkeys(integral.ufl_domain() for integral in integrals)
    if others:
        raise Unsupported("several meshes")
    structure = Structure(integral.integrand() for integral in integrals)
    coefficients, sizes = list(structure.coefficients), [e.dim for e in structure.elements]
    elements = [f.ufl_element() for f in coefficients]
    steady = [bool(moving) and repr(element) not in moving for element in elements]
    static = [COORDINATES, *np.flatnonzero(steady).tolist()] if moving else []
    steady_dofs = np.repeat(np.array(steady, bool), [element.dim for element in elements])
    of_mesh = ufl_domain.ufl_coordinate_element()
    places = [(*key, len(groups[key])) for key in order]
    rules = [canonicalize_metadata(integral.metadata()) for integral in integrals]
    cells = ufl_domain.ufl_cargo().topology.index_map(ufl_domain.topological_dimension)
    keeps = 0 if not moving else LONG if cells.size_global <= FEW else math.inf
    known = structure.key, *places, *rules, repr(of_mesh), keeps, *static
    # such a key is long: each look for it takes its time
    programs = READ.get(known)
    if programs is None:
        every = (rules_of(groups[key], structure, static, keeps) for key in order)
        coordinates = 3 * (of_mesh.dim // of_mesh.block_size)
        programs = [Program(some, sizes, steady_dofs, coordinates, len(order)) for some in every]
        READ[known] = programs
    if len(sizes) == 2 and all(program.vanishes for program in programs):
        return None
    lib, ffi, pointer = native.cells().lib, native.cells().ffi, CArrays()
    addresses = fem.Constant(ufl_domain, np.array([some.address(pointer) for some in programs]))
    all_of_them = np.arange(len(coefficients), dtype=np.int8)
    of_kinds: dict[IntegralType, list[Any]] = {kind: [] for kind in KINDS.values()}
    kernels = []
    for number, key in enumerate(order):
        one = ffi.addressof(lib, f"interpret_one_{number}")
        many = ffi.NULL
        if LANES > 1 and key[0] == "cell":
            many = ffi.addressof(lib, f"interpret_lanes_{number}")
        functions = {"tabulate_tensor_float64": one, "tabulate_tensor_float32": many}
        kernels.append(SimpleNamespace(**functions, program=programs[number]))
        own, entities = of_kinds[KINDS[key[0]]], _entities(groups[key][0])
        own.append((len(own), int(ffi.cast("uintptr_t", one)), entities, all_of_them))
    counts = [0, *(len(of_kinds.get(IntegralType(k), ())) for k in range(KIND_COUNT))]
    ufcx = SimpleNamespace(form_integral_offsets=np.cumsum(counts).tolist(), form_integrals=kernels)
    made = form_cpp_class(default_scalar_type)(
        [v.ufl_function_space()._cpp_object for _, v in sorted(structure.arguments.items())],
        {kind: own for kind, own in of_kinds.items() if own},
        [f._cpp_object for f in coefficients],
        [addresses._cpp_object, *(c._cpp_object for c in structure.constants)],
        False,
        [],
        ufl_domain.ufl_cargo(),
    )
    module: Any = Interpreted(forms, (programs, pointer, addresses))
    return fem.Form(made, ufcx, None, module)


def _read(rules: Sequence[Rule], size: int) -> tuple[Ints, Ints]:
    """Coefficients of a cell that rules read, and places of all among these.

    Nodes of each function stay at equal distances; where they would not, all are read.
    """
    values = [places for rule in rules for places in rule.read()]
    reads = np.unique(np.concatenate([*values, np.zeros(0)])).astype(int)
    places = np.zeros(size, dtype=int)
    places[reads] = np.arange(len(reads))
    if any(len(np.unique(np.diff(places[some]))) > 1 for some in values):
        reads = places = np.arange(size)
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
