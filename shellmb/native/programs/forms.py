"""Forms whose integrands are programs, as DOLFINx and our loops take them."""

from __future__ import annotations

import struct
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

from mpi4py import MPI as _MPI  # noqa: F401  (before dolfinx)

import numpy as np
from dolfinx import default_scalar_type, fem
from dolfinx.fem import IntegralType
from dolfinx.fem.forms import form_cpp_class, get_integration_domains
from ufl import Form

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
# rules by the signatures of their forms: to read a form takes longer than many runs, and rules know
# numbers, elements and places of functions, but no function and no mesh
READ: dict[tuple[str, int, tuple[int, ...]], list[Rule]] = {}


@dataclass(frozen=True, eq=False)
class Interpreted:
    """Stand-in for the module of a form that DOLFINx has compiled.

    Args:
        form: The form.
        kept: What its programs point to.
    """

    form: Form
    kept: Any

    @property
    def name(self) -> str:
        """Name that forms with the same programs share."""
        return str(self.form.signature())


def constant_places(constants: Sequence[Any]) -> dict[Any, int]:
    """Places of Constants among the numbers of all of them."""
    places, place = {}, 0
    for constant in constants:
        places[constant] = place
        place += int(np.prod(constant.ufl_shape, initial=1))
    return places


def rules_of(
    integrals: Sequence[Any],
    coefficients: Sequence[Any],
    constants: Sequence[Any],
    arguments: Sequence[Any],
    static: Collection[int] = (),
) -> list[Rule]:
    """Programs of each quadrature rule of integrals over one kind of entity.

    Args:
        integrals: The integrals.
        coefficients: Functions of the form.
        constants: Constants of the form.
        arguments: Elements of the arguments.
        static: Sources of values that seldom change: what follows from these alone is kept.
    """
    places, domain = constant_places(constants), integrals[0].ufl_domain()
    facet = integrals[0].integral_type() != "cell"
    elements = [f.ufl_element() for f in coefficients]
    groups: dict[bytes, tuple[Any, list[Any]]] = {}
    for integral in integrals:
        points = points_of(integral)
        key = points.places.tobytes() + points.weights.tobytes()
        groups.setdefault(key, (points, []))[1].append(integral.integrand())
    found = []
    for points, integrands in groups.values():
        tables = Tables(points, domain, elements, arguments)
        reader = Reader(domain, coefficients, places, arguments, tables.vanishes, facet, static)
        value = reader.graph.total([reader.scalar(x) for x in integrands])
        value = reader.graph.mul(value, reader.geometry.scale())
        found.append(Rule(reader, value, len(arguments), points, tables, bool(static)))
    return found


class Program:
    """The program of a form over one kind of entity, for C.

    Args:
        rules: What each quadrature rule adds.
        rank: Number of arguments.
        columns: Dofs of the second argument; 1 without.
        steady: Of each coefficient of a cell whether it seldom changes.
        coordinates: How many numbers a cell's coordinates are.

    Attributes:
        kept: Numbers that are kept of a cell, or of a facet.
        reads: Which coefficients it reads.
    """

    def __init__(
        self,
        rules: Sequence[Rule],
        rank: int,
        columns: int,
        steady: Bools,
        coordinates: int,
    ) -> None:
        self._rules, self._rank, self._columns = list(rules), rank, columns
        self._coordinates = coordinates
        self.reads, self._places = _read(rules, len(steady))
        edges = np.flatnonzero(np.diff([0, *steady[self.reads].astype(int), 0])).reshape(-1, 2)
        self._ranges = [(int(first), int(last - first)) for first, last in edges]
        # behind a stamp and what it follows from
        self._first = 1 + coordinates + sum(count for _, count in self._ranges)
        values = sum(rule.kept for rule in rules)
        self.kept = self._first + values if values else 0
        # keeps what C points to
        self.pointer = CArrays()

    def of_each(self, tables: Sequence[Int32s]) -> list[Int32s]:
        """Dofs that it reads of each coefficient, by all of them, cell by cell."""
        found, start = [], 0
        for table in tables:
            own = self.reads - start
            own = own[(own >= 0) & (own < table.shape[1])]
            found.append(np.ascontiguousarray(table[:, own]))
            start += table.shape[1]
        return found

    def address(self, first: int) -> float:
        """Address of it, in the bits of a number that stands before the constants.

        Args:
            first: Place of the first constant.
        """
        rules, place = [], self._first
        for rule in self._rules:
            rules.append(rule.struct(self.pointer, first, place, self._places))
            place += rule.kept
        constants = sorted({first + k for rule in self._rules for k in rule.constants})
        ranges = [{"first": k, "count": count} for k, count in self._ranges]
        seen = np.full(len(constants) + 1, np.nan)
        seen[-1] = 0.0
        members = {
            "rank": self._rank,
            "columns": self._columns,
            "rules": len(rules),
            "rule": self.pointer.many("Rule", rules),
            "registers": max((r.registers * r.chunk for r in self._rules), default=0),
            "products": max((r.products for r in self._rules), default=0),
            "factors": max((r.factors for r in self._rules), default=0),
            "reads": len(self.reads) if len(self.reads) < len(self._places) else 0,
            "read": self.pointer(np.append(self.reads, 0).astype(np.int32)),
            "kept": self.kept,
            "ranges": len(ranges),
            "coordinates": self._coordinates,
            "constants": len(constants),
            "range": self.pointer.many("Range", ranges),
            "constant": self.pointer(np.array([*constants, 0], dtype=np.int32)),
            "seen": self.pointer(seen),
        }
        made = self.pointer.many("Program", [members])
        # what they were made from is of no more use, and the garbage collector looks at all that is
        self._rules.clear()
        place = int(self.pointer.ffi.cast("uintptr_t", made))
        (number,) = struct.unpack("d", struct.pack("Q", place))
        return float(number)


def summed(forms: Sequence[Form], moving: Collection[Any] = ()) -> fem.Form | None:
    """The sum of forms as one, whose kernels are programs; None for a matrix that vanishes.

    Args:
        forms: Forms with the same arguments, over one mesh; without integrals there is none.
        moving: Functions that change from call to call, and with them all that are of their
            elements: what follows from others alone is kept. Without any nothing is.

    Raises:
        Unsupported: If it has something that programs do not have.
    """
    form = forms[0] if len(forms) == 1 else Form([i for one in forms for i in one.integrals()])
    if form.empty():
        return None
    groups: dict[tuple[str, Any], list[Any]] = {}
    for integral in form.integrals():
        key = integral.integral_type(), integral.subdomain_id()
        groups.setdefault(key, []).append(integral)
    coefficients, constants = form.coefficients(), form.constants()
    spaces = [argument.ufl_function_space() for argument in form.arguments()]
    if len(form.ufl_domains()) != 1:
        raise Unsupported("several meshes")
    if len(groups) > INTEGRALS or not {kind for kind, _ in groups} <= set(KINDS):
        raise Unsupported("so many or such integrals")
    (ufl_domain,) = form.ufl_domains()
    lib, ffi = native.cells().lib, native.cells().ffi
    order = sorted(groups, key=lambda key: list(KINDS).index(key[0]))
    elements = [space.ufl_element() for space in spaces]
    columns = elements[1].dim if len(elements) == 2 else 1
    static, steady, coordinates = _steady(ufl_domain, coefficients, moving)
    rules = []
    for number, key in enumerate(order):
        place = form.signature(), number, tuple(static)
        if place not in READ:
            READ[place] = rules_of(groups[key], coefficients, constants, elements, static)
        rules.append(READ[place])
    if len(spaces) == 2 and not any(rule.parts for some in rules for rule in some):
        return None
    programs = [Program(some, len(spaces), columns, steady, coordinates) for some in rules]
    addresses = [program.address(len(programs)) for program in programs]
    places = fem.Constant(ufl_domain, np.array(addresses))
    every = np.arange(len(coefficients), dtype=np.int8)
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
        own.append((len(own), int(ffi.cast("uintptr_t", one)), _entities(form, key), every))
    counts = [0, *(len(integrals.get(IntegralType(k), ())) for k in range(KIND_COUNT))]
    ufcx = SimpleNamespace(form_integral_offsets=np.cumsum(counts).tolist(), form_integrals=kernels)
    made = form_cpp_class(default_scalar_type)(
        [space._cpp_object for space in spaces],
        {kind: own for kind, own in integrals.items() if own},
        [f._cpp_object for f in coefficients],
        [places._cpp_object, *(c._cpp_object for c in constants)],
        False,
        [],
        ufl_domain.ufl_cargo(),
    )
    module = Interpreted(form, (programs, places))
    return fem.Form(made, ufcx, None, module)  # type: ignore[arg-type]


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


def _steady(
    domain: Any, coefficients: Sequence[Any], moving: Collection[Any]
) -> tuple[list[int], Bools, int]:
    """Sources of what seldom changes, which coefficients do, and numbers of coordinates."""
    elements = [f.ufl_element() for f in coefficients]
    changing = {f.ufl_element() for f in moving}
    steady = [bool(moving) and element not in changing for element in elements]
    sources = [COORDINATES, *np.flatnonzero(steady).tolist()] if moving else []
    element = domain.ufl_coordinate_element()
    numbers = 3 * (element.dim // element.block_size)
    return sources, np.repeat(np.array(steady, bool), [e.dim for e in elements]), numbers


def _entities(form: Form, kind: tuple[str, Any]) -> Any:
    """Cells, or facets as pairs of cell and number."""
    ((domain, data),) = form.subdomain_data().items()
    mesh = domain.ufl_cargo()
    integral_type, part = kind
    if integral_type == "cell" and part == "everywhere":
        return np.arange(mesh.topology.index_map(mesh.topology.dim).size_local, dtype=np.int32)
    subdomains = data[integral_type][0]
    parts = part if isinstance(part, tuple) else (part,)
    if subdomains is None or "everywhere" in parts:
        raise Unsupported("all facets, or parts without a list")
    found = get_integration_domains(KINDS[integral_type], subdomains, list(parts))
    own = [np.asarray(e).ravel() for k, e in found if k in parts]
    return np.concatenate([np.zeros(0), *own]).astype(np.int32)
