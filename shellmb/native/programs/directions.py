"""Directions of derivatives: reference coordinates, functions, and components of a variable."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from shellmb.native.programs.graph import Graph, Input, Scalar


class Along:
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

    def of_variable(self, label: int, component: int) -> Scalar | None:
        """A variable changes as what it is."""
        return None


class Gateaux:
    """Direction in the space of functions: what some components of coefficients change by.

    Args:
        zero: The number.
        along: Derivative of a value along a reference coordinate.
        directions: Changes by number of the coefficient and of its component.
    """

    def __init__(
        self,
        zero: int,
        along: Callable[[Scalar, int], Scalar],
        directions: Mapping[tuple[int, int], Scalar],
    ) -> None:
        self._zero, self._along, self._directions = zero, along, directions
        self.memo: dict[int, Scalar] = {}

    def of_input(self, item: Input) -> Scalar:
        """Value of the direction there, or its derivative."""
        found = self._directions.get((item.source, item.component))
        if found is None:
            return self._zero
        for along, times in enumerate(item.orders):
            for _ in range(times):
                found = self._along(found, along)
        return found

    def of_variable(self, label: int, component: int) -> Scalar | None:
        """A variable changes as what it is."""
        return None


class ByVariable:
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
