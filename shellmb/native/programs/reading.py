"""UFL read as scalars of a graph: tensor algebra, gradients, derivatives."""

import itertools
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import cache, partial, reduce
from typing import Any

import numpy as np
import numpy.typing as npt
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.core.expr import Expr
from ufl.core.multiindex import FixedIndex

from shellmb.native.programs.directions import Along, ByVariable, Gateaux
from shellmb.native.programs.geometry import (
    Geometry,
    Tensor,
    array,
    contract,
    crossed,
    det,
    inverse,
    times,
)
from shellmb.native.programs.graph import UNARY, Graph, Input, Multilinear, Scalar, Unsupported

# source of the values of the first argument; that of the second is one less
ARGUMENT = -2

FUNCTIONS = {name: name for name in UNARY} | {"ln": "log"}
COMPARISONS = {name: name for name in ("lt", "le", "gt", "ge", "eq", "ne")}
COMPARISONS |= {"and_condition": "and", "or_condition": "or", "not_condition": "not"}
BINARIES = {"atan2": "atan2", "min_value": "min", "max_value": "max"}


class Reader:
    """Reads expressions over one kind of entity of a mesh.

    Args:
        domain: The mesh, as UFL knows it.
        coefficients: Functions, by their number.
        constants: Places of the Constants among all numbers of such.
        arguments: Elements of the arguments.
        vanishes: Decides whether a function's value, or a derivative of it, is zero everywhere.
        facet: Whether it is over facets.
        static: Sources of values that seldom change.

    Attributes:
        graph: What is read.
        geometry: Geometry of the cells.
    """

    def __init__(
        self,
        domain: Any,
        coefficients: Collection[Any],
        constants: Mapping[Any, int],
        arguments: Sequence[Any],
        vanishes: Callable[[Input], bool],
        facet: bool = False,
        static: Collection[int] = (),
    ) -> None:
        self.graph = Graph(static)
        self._numbers = {f: k for k, f in enumerate(coefficients)}
        self._constants = constants
        self._elements = [f.ufl_element() for f in coefficients]
        self._arguments = arguments
        self._gdim, self._tdim = domain.geometric_dimension, domain.topological_dimension
        # nothing here refers to the reader, which is large and is to go with its last user
        self.value = partial(_value, self.graph, vanishes)
        along = [Along(self.value, a) for a in range(self._tdim)]
        self.along = partial(_along, self.graph, self.value, along)
        self._memo: dict[Any, Tensor] = {}
        self._bound: dict[int, int] = {}
        self._directions: dict[Any, Gateaux] = {}
        self._kept: list[Any] = []
        dimensions = self._gdim, self._tdim
        self.geometry = Geometry(self.graph, self.value, dimensions, facet)

    def tensor(self, expr: Expr) -> Tensor:
        """Read an expression; indices that are free have the values that are bound to them.

        Returns:
            An array, or what is in it where it has no shape.
        """
        free, key = expr.ufl_free_indices, id(expr)
        where: Any = (key, *[self._bound[k] for k in free]) if free else key
        found = self._memo.get(where)
        if found is None:
            name = expr._ufl_handler_name_
            own = _way(name)
            if own is not None:
                made = own(self, expr)
            elif name in FUNCTIONS:
                made = self.graph.unary(FUNCTIONS[name], *map(self.tensor, expr.ufl_operands))
            elif name in BINARIES:
                made = self.graph.binary(BINARIES[name], *map(self.tensor, expr.ufl_operands))
            elif name in COMPARISONS:
                args: Any = map(self.tensor, expr.ufl_operands)
                made = self.graph.operation(COMPARISONS[name], *args)
            else:
                lowered = apply_algebra_lowering(expr)
                if type(lowered) is type(expr):
                    raise Unsupported(name)
                made = self.tensor(lowered)
            # what has no shape is itself
            scalar = not expr.ufl_shape and isinstance(made, np.ndarray)
            found = self._memo[where] = made[()] if scalar else made
            # what is known by its id has to live
            self._kept.append(expr)
        return found

    # values that are given

    def _zero(self, expr: Any) -> Tensor:
        return np.full(expr.ufl_shape, self.graph.zero, dtype=object)

    def _scalar_value(self, expr: Any) -> Scalar:
        return self.graph.number(float(expr))

    _int_value = _float_value = _real_value = _scalar_value

    def _identity(self, expr: Any) -> Tensor:
        return self._numbers_of(np.eye(expr.ufl_shape[0]))

    def _permutation_symbol(self, expr: Any) -> Tensor:
        made = np.zeros(expr.ufl_shape)
        for order in itertools.permutations(range(len(expr.ufl_shape))):
            made[order] = np.linalg.det(np.eye(len(order))[list(order)])
        return self._numbers_of(made)

    def _numbers_of(self, values: npt.NDArray[np.float64]) -> Tensor:
        return _mapped(lambda value: self.graph.number(float(value)), values)

    def _constant(self, expr: Any) -> Tensor:
        first, shape = self._constants[expr], expr.ufl_shape
        return _mapped(
            self.graph.constant, first + np.arange(int(np.prod(shape, initial=1))).reshape(shape)
        )

    def _function(self, source: int, expr: Any, element: Any) -> Tensor:
        found = np.empty(expr.ufl_shape, dtype=object)
        found.ravel()[:] = self._mapped_values(source, element, 0)
        return found

    def _mapped_values(self, source: int, element: Any, first: int) -> list[Scalar]:
        """Components of a function in the cell, by those in the reference cell."""
        size, none = element.reference_value_size, (0,) * self._tdim
        match type(element.pullback).__name__:
            case "MixedPullback":
                found: list[Scalar] = []
                for part in element.sub_elements:
                    found += self._mapped_values(source, part, first)
                    first += part.reference_value_size
                return found
            case "IdentityPullback":
                return [self.value(Input(source, first + k, none)) for k in range(size)]
            case "CovariantPiola":
                own = [self.value(Input(source, first + k, none)) for k in range(size)]
                K = self.geometry.inverse
                return [contract(self.graph, K[:, i], own) for i in range(self._gdim)]
        raise Unsupported(f"an element that is mapped by {type(element.pullback).__name__}")

    def _reference_values(self, element: Any, values: Sequence[Scalar]) -> list[Scalar]:
        """Components in the reference cell by those in the cell."""
        match type(element.pullback).__name__:
            case "MixedPullback":
                found: list[Scalar] = []
                for part in element.sub_elements:
                    size = self._size(part)
                    found += self._reference_values(part, values[:size])
                    values = values[size:]
                return found
            case "IdentityPullback":
                return list(values)
        J = self.geometry.jacobian
        return [contract(self.graph, J[:, a], values) for a in range(self._tdim)]

    def _size(self, element: Any) -> int:
        """Number of an element's components in the cell."""
        kind = type(element.pullback).__name__
        if kind == "MixedPullback":
            return sum(map(self._size, element.sub_elements))
        return int(element.reference_value_size) if kind == "IdentityPullback" else self._gdim

    def _coefficient(self, expr: Any) -> Tensor:
        number = self._numbers[expr]
        return self._function(number, expr, self._elements[number])

    def _argument(self, expr: Any) -> Tensor:
        return self._function(ARGUMENT - expr.number(), expr, self._arguments[expr.number()])

    def _variable(self, expr: Any) -> Tensor:
        of, label = array(self.tensor(expr.ufl_operands[0])), expr.label().count()
        if any(isinstance(value, Multilinear) for value in of.flat):
            raise Unsupported("a variable that is an argument")
        numbers = np.arange(of.size).reshape(of.shape)
        return _pairwise(partial(self.graph.alias, label), numbers, of)

    # geometry

    def _spatial_coordinate(self, expr: Any) -> Tensor:
        return self.geometry.coordinates()

    def _jacobian(self, expr: Any) -> Tensor:
        return self.geometry.jacobian

    def _jacobian_determinant(self, expr: Any) -> Scalar:
        return self.geometry.determinant

    def _jacobian_inverse(self, expr: Any) -> Tensor:
        return self.geometry.inverse

    def _facet_normal(self, expr: Any) -> Tensor:
        return self.geometry.normal()

    # algebra

    def _sum(self, expr: Any) -> Tensor:
        a, b = map(self.tensor, expr.ufl_operands)
        return _pairwise(self.graph.add, a, b) if expr.ufl_shape else self.graph.add(a, b)

    def _product(self, expr: Any) -> Scalar:
        return self.graph.mul(*map(self.tensor, expr.ufl_operands))

    def _division(self, expr: Any) -> Tensor:
        a, b = map(self.tensor, expr.ufl_operands)
        by = partial(self.graph.div, b=b)
        return _mapped(by, a) if expr.ufl_shape else by(a)

    def _power(self, expr: Any) -> Scalar:
        return self.graph.pow(*map(self.tensor, expr.ufl_operands))

    def _conditional(self, expr: Any) -> Tensor:
        condition, *ways = expr.ufl_operands
        where = self.tensor(condition)
        assert isinstance(where, int)
        a, b = map(self.tensor, ways)
        return _pairwise(lambda x, y: self.graph.choose(where, x, y), a, b)

    def _conj(self, expr: Any) -> Tensor:
        return self.tensor(expr.ufl_operands[0])

    _real = _conj

    def _cross(self, expr: Any) -> Tensor:
        return crossed(self.graph, *map(self.tensor, expr.ufl_operands))

    def _dot(self, expr: Any) -> Tensor:
        return times(self.graph, *map(self.tensor, expr.ufl_operands))

    def _inner(self, expr: Any) -> Scalar:
        a, b = (array(self.tensor(o)).ravel() for o in expr.ufl_operands)
        return contract(self.graph, a, b)

    def _outer(self, expr: Any) -> Tensor:
        a, b = (array(self.tensor(o)) for o in expr.ufl_operands)
        made = [[self.graph.mul(x, y) for y in b.ravel()] for x in a.ravel()]
        return array(made).reshape(a.shape + b.shape)

    def _transposed(self, expr: Any) -> Tensor:
        return self.tensor(expr.ufl_operands[0]).T

    def _trace(self, expr: Any) -> Scalar:
        return self.graph.total(list(np.diagonal(self.tensor(expr.ufl_operands[0]))))

    def _determinant(self, expr: Any) -> Scalar:
        return det(self.graph, self.tensor(expr.ufl_operands[0]))

    def _inverse(self, expr: Any) -> Tensor:
        return inverse(self.graph, self.tensor(expr.ufl_operands[0]))

    # indices

    def _list_tensor(self, expr: Any) -> Tensor:
        return array([self.tensor(o) for o in expr.ufl_operands])

    def _places(self, indices: Any) -> tuple[int, ...]:
        return tuple(
            int(i) if isinstance(i, FixedIndex) else self._bound[i.count()] for i in indices
        )

    def _indexed(self, expr: Any) -> Scalar:
        of, indices = expr.ufl_operands
        places = self._places(indices)
        # one component of many is read alone
        while True:
            name = of._ufl_handler_name_
            if name == "list_tensor":
                of, places = of.ufl_operands[places[0]], places[1:]
            elif name == "component_tensor":
                inner, inner_indices = of.ufl_operands
                names = [i.count() for i in inner_indices]
                return self._with(names, places, inner)
            elif name == "sum":
                return self.graph.total([self.tensor(o)[places] for o in of.ufl_operands])
            else:
                return self.tensor(of)[places]
            if not places:
                return self.tensor(of)

    def _with(self, names: Sequence[int], values: Sequence[int], inner: Any) -> Tensor:
        before = self._bound
        self._bound = before | dict(zip(names, values, strict=True))
        found = self.tensor(inner)
        self._bound = before
        return found

    def _component_tensor(self, expr: Any) -> Tensor:
        inner, indices = expr.ufl_operands
        names = [i.count() for i in indices]
        made = np.empty(expr.ufl_shape, dtype=object)
        for places in itertools.product(*map(range, expr.ufl_shape)):
            made[places] = self._with(names, places, inner)
        return made

    def _index_sum(self, expr: Any) -> Tensor:
        inner, indices = expr.ufl_operands
        (index,) = indices
        parts = (self._with([index.count()], [k], inner) for k in range(expr.dimension()))
        # of derivatives by vectors it may be one of vectors
        add = self.graph.add
        return reduce(partial(_pairwise, add) if expr.ufl_shape else add, parts)

    # derivatives

    def _grad(self, expr: Any) -> Tensor:
        (of,), K = expr.ufl_operands, self.geometry.inverse
        values = array(self.tensor(of))
        made = np.empty((*values.shape, self._gdim), dtype=object)
        for place in np.ndindex(values.shape):
            slopes = [self.along(values[place], a) for a in range(self._tdim)]
            for i in range(self._gdim):
                made[(*place, i)] = contract(self.graph, K[:, i], slopes)
        return made

    def _coefficient_derivative(self, expr: Any) -> Tensor:
        integrand, functions, directions, more = expr.ufl_operands
        if more.ufl_operands:
            raise Unsupported("derivatives of coefficients that are given")
        found: dict[tuple[int, int], Scalar] = {}
        for f, v in zip(functions.ufl_operands, directions.ufl_operands, strict=True):
            values = array(self.tensor(v))
            if f._ufl_handler_name_ == "coefficient":
                number = self._numbers[f]
                own = self._reference_values(self._elements[number], list(values.ravel()))
                for k, value in enumerate(own):
                    found[number, k] = value
            elif f._ufl_handler_name_ == "indexed":
                of, indices = f.ufl_operands
                if of._ufl_handler_name_ != "coefficient":
                    raise Unsupported("a derivative by a part of an expression")
                place = np.ravel_multi_index(self._places(indices), of.ufl_shape)
                found[self._numbers[of], int(place)] = values[()]
            else:
                raise Unsupported(f"a derivative by {f._ufl_handler_name_}")
        key = tuple((*place, id(value)) for place, value in found.items())
        if key not in self._directions:
            self._directions[key] = Gateaux(self.graph, self.along, found)
        return _mapped(self._directions[key].derivative, self.tensor(integrand))

    def _variable_derivative(self, expr: Any) -> Tensor:
        of, variable = expr.ufl_operands
        self.tensor(variable)
        values, shape = array(self.tensor(of)), variable.ufl_shape
        label = variable.label().count()
        made = np.empty((*values.shape, *shape), dtype=object)
        for k, place in enumerate(np.ndindex(shape)):
            along = partial(self.graph.derivative, direction=ByVariable(self.graph, label, k))
            made[(..., *place)] = _mapped(along, values)
        return made


@cache
def _way(name: str) -> Callable[[Reader, Any], Tensor] | None:
    """The way to read an operation, by its name; None if there is none of its own."""
    return getattr(Reader, f"_{name}", None)


def _value(graph: Graph, vanishes: Callable[[Input], bool], item: Input) -> Scalar:
    """The value of a function, or of a derivative."""
    of = graph.argument if item.source <= ARGUMENT else graph.input
    return graph.zero if vanishes(item) else of(item)


def _along(
    graph: Graph, value: Callable[[Input], Scalar], along: Sequence[Along], of: Scalar, a: int
) -> Scalar:
    """Derivative along a reference coordinate."""
    return graph.derivative(of, along[a], lambda item: value(item.derived(a)))


def _mapped(function: Callable[[Any], Scalar], values: Any) -> Tensor:
    return np.frompyfunc(function, 1, 1)(values)


def _pairwise(function: Callable[[Scalar, Scalar], Scalar], a: Tensor, b: Tensor) -> Tensor:
    return np.frompyfunc(function, 2, 1)(a, b)
