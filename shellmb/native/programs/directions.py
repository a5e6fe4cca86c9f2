"""Directions of derivatives: reference coordinates, functions, and components of a variable."""

from collections.abc import Callable, Mapping

from shellmb.native.programs.graph import Direction, Graph, Input, Key, Multilinear, Scalar, linear

# source of the changes of variables
VARIABLE = -1000
# numbers that a change may be made of without a stand-in
FEW = 6


class Along(Direction):
    """Direction of one reference coordinate.

    Args:
        value: The value of a function, or of a derivative.
        along: Number of the coordinate.
    """

    def __init__(self, value: Callable[[Input], Scalar], along: int) -> None:
        self._value, self._along = value, along
        self.memo: dict[int, Scalar] = {}

    def of_input(self, item: Input) -> Scalar:
        """Derivative of a function's value."""
        return self._value(item.derived(self._along))


class Gateaux(Direction):
    """Direction in the space of functions: what some components of coefficients change by.

    Args:
        graph: Where it is.
        along: Derivative of a value along a reference coordinate.
        directions: Changes by number of the coefficient and of its component.
    """

    def __init__(
        self,
        graph: Graph,
        along: Callable[[Scalar, int], Scalar],
        directions: Mapping[tuple[int, int], Scalar],
    ) -> None:
        self._graph, self._along, self._directions = graph, along, directions
        self.memo: dict[int, Scalar] = {}
        # changes of variables, which stand by themselves until all is derived by these: what is
        # made of few numbers is derived by these, and not by all unknowns
        self._of: dict[Input, Scalar] = {}
        changes = [x for x in directions.values() if x != graph.zero]
        self._apart = all(isinstance(x, Multilinear) for x in changes)

    def of_input(self, item: Input) -> Scalar:
        """Value of the direction there, or its derivative."""
        found = self._directions.get((item.source, item.component))
        if found is None:
            return self._graph.zero
        for along, times in enumerate(item.orders):
            for _ in range(times):
                found = self._along(found, along)
        return found

    def through(self, node: int, change: Scalar) -> Scalar:
        """The change of a variable stands by itself, but for one of few numbers."""
        if not self._apart or not isinstance(change, Multilinear) or len(change.parts) <= FEW:
            return change
        item = Input(VARIABLE, node, ())
        self._of[item] = self._put(change)
        return Multilinear({(item,): self._graph.one})

    def derivative(self, value: Scalar) -> Scalar:
        """Derivative of a value in this direction."""
        return self._put(self._graph.derivative(value, self))

    def _put(self, value: Scalar) -> Scalar:
        """Put in the changes of variables."""
        if not isinstance(value, Multilinear):
            return value
        graph, found = self._graph, dict[Key, int]()
        parts: list[Scalar] = []
        for key, node in value.parts.items():
            if key[-1].source != VARIABLE:
                found[key] = node
                continue
            part = graph.mul(node, self._of[key[-1]])
            others = Multilinear({key[:-1]: graph.one}) if key[1:] else graph.one
            parts.append(graph.mul(part, others))
        return graph.total([linear(found, graph.zero), *parts])


class ByVariable(Direction):
    """Direction of one component of a variable, alone.

    Args:
        graph: Where it is.
        label: Of the variable.
        component: The component.
    """

    def __init__(self, graph: Graph, label: int, component: int) -> None:
        self._graph, self._label, self._component = graph, label, component
        self.memo: dict[int, Scalar] = {}

    def of_input(self, item: Input) -> Scalar:
        """Functions do not change."""
        return self._graph.zero

    def of_variable(self, label: int, component: int) -> Scalar | None:
        """One for that component."""
        if label != self._label:
            return None
        return self._graph.one if component == self._component else self._graph.zero
