"""Tables of functions at the points of a rule, for each facet or for the cell, by Basix."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import basix
import numpy as np
from ufl import Integral, Mesh, as_ufl
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives
from ufl.algorithms.apply_integral_scaling import compute_integrand_scaling_factor
from ufl.algorithms.estimate_degrees import estimate_total_polynomial_degree
from ufl.classes import FormArgument, GeometricQuantity
from ufl.corealg.traversal import traverse_unique_terminals

from shellmb.arrays import Floats
from shellmb.native.derivatives import taken
from shellmb.native.programs.geometry import COORDINATES
from shellmb.native.programs.graph import Input, Unsupported
from shellmb.native.programs.reading import ARGUMENT

# what is nearer to zero is zero, as in FFCx
TINY = 1e-9


@dataclass(frozen=True)
class Place:
    """Places of the values of a component among those of a cell: `first + stride node`."""

    first: int
    stride: int


@dataclass(frozen=True, eq=False)
class Points:
    """Points of a rule in the reference cell, for each entity.

    Args:
        places: The points, shape (entities, points, dimension).
        weights: Shape (points,).
        numbers: Tangent and normal of each facet of the reference cell; none for the cell,
            shape (entities, 2 dimension) or (1, 0).
    """

    places: Floats
    weights: Floats
    numbers: Floats


def points_of(integral: Any) -> Points:
    """The points of an integral's rule."""
    domain, kind = integral.ufl_domain(), integral.integral_type()
    cell = basix.CellType[domain.ufl_cell().cellname]
    if kind not in ("cell", "exterior_facet"):
        raise Unsupported(kind)
    facet = kind == "exterior_facet"
    over = basix.cell.subentity_types(cell)[-2][0] if facet else cell
    md = integral.metadata()
    rule = md.get("quadrature_rule", "default")
    places: Any
    weights: Any
    if rule == "custom":
        places = np.array(md["quadrature_points"], dtype=float)
        weights = np.array(md["quadrature_weights"], dtype=float)
    elif rule == "vertex":
        places = basix.cell.geometry(over)
        weights = np.full(len(places), basix.cell.volume(over) / len(places))
    elif over == basix.CellType.point:
        places, weights = np.zeros((1, 0)), np.ones(1)
    else:
        degree = md.get("quadrature_degree", -1)
        if degree is None or degree == "auto" or degree < 0:
            degree = _estimated(integral)
        kinds = {"default": "default", "GLL": "gll", "GL": "default"}
        if rule not in kinds:
            raise Unsupported(f"rule {rule}")
        scheme = basix.quadrature.string_to_type(rule)
        places, weights = basix.make_quadrature(over, int(degree), rule=scheme)
    if not facet:
        return Points(places[None], weights, np.zeros((1, 0)))
    return _on_facets(cell, places, weights)


def _on_facets(cell: Any, places: Floats, weights: Floats) -> Points:
    corners, dim = basix.cell.geometry(cell), len(basix.topology(cell)) - 1
    found, numbers = [], []
    normals = basix.cell.facet_outward_normals(cell)
    for vertices, normal in zip(basix.topology(cell)[dim - 1], normals, strict=True):
        first = corners[vertices[0]]
        tangent = corners[vertices[1]] - first if dim == 2 else np.zeros(dim)
        along = places.reshape(len(weights), -1) @ tangent[None] if dim == 2 else 0.0
        found.append(first + along * np.ones((len(weights), 1)))
        numbers.append([*tangent, *normal])
    return Points(np.array(found), weights, np.array(numbers))


def _estimated(integral: Any) -> int:
    """Degree that UFL estimates for a rule that has none."""
    value, domain = integral.integrand(), integral.ufl_domain()
    more = _degree_of_size(integral.integral_type(), domain.ufl_coordinate_element())
    leaves: list[Any] = list(traverse_unique_terminals(value))
    functions: list[Any] = [f for f in leaves if isinstance(f, FormArgument)]
    if not (
        any(isinstance(x, GeometricQuantity) for x in leaves)
        or any(f.ufl_element().embedded_superdegree for f in functions)
    ):
        # what is made of constants in a cell is one, as of joints
        return more
    integrand = apply_derivatives(apply_algebra_lowering(taken(integral.integrand())))
    return int(estimate_total_polynomial_degree(integrand)) + more


@cache
def _degree_of_size(kind: str, element: Any) -> int:
    """Degree of the size of a cell or facet to its reference, by the element of the mesh."""
    size = Integral(as_ufl(1), kind, Mesh(element), "everywhere", {}, None)
    return int(compute_integrand_scaling_factor(size)[1])


@cache
def component_of(element: Any, component: int) -> tuple[Any, int, int]:
    """Element of a component of functions, the first of its dofs and their stride.

    Args:
        element: Element of the functions.
        component: Number of the component in the reference cell.
    """
    # Basix looks through all parts of an element each time
    return (
        element.get_component_element(component)
        if element.reference_value_shape
        else (element, 0, 1)
    )


class Tables:
    """Values of functions at the points of a rule.

    Args:
        points: The points.
        domain: The mesh, as UFL knows it.
        elements: Elements of coefficients, then of arguments.
        arguments: Elements of the arguments.
    """

    def __init__(
        self, points: Points, domain: Any, elements: Sequence[Any], arguments: Sequence[Any]
    ) -> None:
        self._points, self._elements, self._arguments = points, elements, arguments
        self._coordinates = domain.ufl_coordinate_element()
        self._offsets = np.concatenate([[0], np.cumsum([e.dim for e in elements])]).astype(int)
        self._known: dict[Any, int] = {}
        self.tables: list[Floats] = []
        self._of: dict[Input, tuple[int, Place]] = {}

    @cached_property
    def _flat(self) -> Floats:
        return self._points.places.reshape(-1, self._points.places.shape[-1])

    def vanishes(self, item: Input) -> bool:
        """Decide whether a value is zero at all points, on all cells."""
        number, _ = self.find(item)
        return number < 0

    def find(self, item: Input) -> tuple[int, Place]:
        """Number of a value's table, -1 for one that is zero, and where its values are."""
        if item not in self._of:
            self._of[item] = self._find(item)
        return self._of[item]

    def at_points(self, components: int) -> None:
        """Let values of the first argument stand at the points themselves, component by component.

        Args:
            components: How many there are.
        """
        none = (0,) * self._points.places.shape[-1]
        self.tables.append(np.eye(len(self._points.weights))[None])
        for k in range(components):
            found = len(self.tables) - 1, Place(k, components)
            self._of[Input(ARGUMENT, k, none)] = found

    def _find(self, item: Input) -> tuple[int, Place]:
        offset = 0
        if item.source == COORDINATES:
            element = self._coordinates
        elif item.source <= ARGUMENT:
            element = self._arguments[ARGUMENT - item.source]
        else:
            element, offset = self._elements[item.source], int(self._offsets[item.source])
        own, first, stride = component_of(element, item.component)
        if item.source == COORDINATES:
            # three numbers of each node, whatever the dimension
            first, stride = item.component, 3
        key = own, item.orders
        if key not in self._known:
            self._known[key] = self._table(own, item.orders)
        return self._known[key], Place(offset + int(first), int(stride))

    def _table(self, element: Any, orders: tuple[int, ...]) -> int:
        total = sum(orders)
        try:
            every = element.tabulate(total, self._flat)
        except (RuntimeError, ValueError, AssertionError) as error:
            raise Unsupported(f"an element without such a table: {error}") from error
        values = np.array(every[basix.index(*orders) if total else 0], dtype=float)
        for near in (0.0, 1.0, -1.0):
            values[np.abs(values - near) < TINY] = near
        if not values.any():
            return -1
        values = values.reshape(*self._points.places.shape[:2], -1)
        for k, other in enumerate(self.tables):
            if other.shape == values.shape and np.array_equal(other, values):
                return k
        self.tables.append(values)
        return len(self.tables) - 1
