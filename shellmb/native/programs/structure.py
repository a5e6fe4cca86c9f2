"""Structure of integrands: operations on functions and Constants that are known by numbers.

Forms of bodies that are alike have the same structure, and differ in what the numbers stand for.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ufl.classes import GeometricQuantity
from ufl.core.expr import Expr
from ufl.core.multiindex import Index


class Structure:
    """Operations of some expressions, each once.

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
        found = self._numbers.get(id(expr))
        if found is None:
            of = expr.ufl_operands
            about = map(self._number, of) if of else self._terminal(expr)
            operation = expr._ufl_typecode_, *about
            found = self._operations.setdefault(operation, len(self._operations))
            self._numbers[id(expr)] = found
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
