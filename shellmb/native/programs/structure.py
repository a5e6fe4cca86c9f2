"""Structure of integrands: operations on functions and Constants that are known by numbers.

Forms of bodies that are alike have the same structure, and differ in what the numbers stand for.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ufl.classes import GeometricQuantity
from ufl.core.expr import Expr
from ufl.core.multiindex import FixedIndex


class Structure:
    """Operations of some expressions, each once.

    Args:
        expressions: The expressions.
        known: Structure of some of what they are made of, whose numbers come first.

    Attributes:
        coefficients: Numbers of functions, in the order in which they appear.
        constants: Numbers of Constants, likewise.
        arguments: Arguments by their number.
        key: What expressions of the same structure have in common.
    """

    def __init__(self, expressions: Iterable[Expr], known: Structure | None = None) -> None:
        before: dict[str, dict[Any, Any]] = {} if known is None else vars(known)
        self.coefficients: dict[Any, int] = dict(before.get("coefficients", {}))
        self.constants: dict[Any, int] = dict(before.get("constants", {}))
        self.arguments: dict[int, Any] = dict(before.get("arguments", {}))
        # of indices and labels of variables, by their kind and count
        self._names: dict[Any, int] = dict(before.get("_names", {}))
        self._operations: dict[Any, int] = dict(before.get("_operations", {}))
        self._numbers: dict[int, int] = dict(before.get("_numbers", {}))
        roots = [self._number(expression) for expression in expressions]
        self.key = *roots, *self._operations

    def _number(self, root: Any) -> int:
        """Number of an operation, behind those that it is of."""
        numbers, operations, stack = self._numbers, self._operations, [root]
        while stack:
            expr = stack[-1]
            own = id(expr)
            if own in numbers:
                stack.pop()
                continue
            if expr._ufl_is_terminal_:
                operation = self._terminal(expr)
            else:
                of = expr.ufl_operands
                missing = [o for o in of if id(o) not in numbers]
                if missing:
                    stack += reversed(missing)
                    continue
                operation = expr._ufl_typecode_, *[numbers[id(o)] for o in of]
            stack.pop()
            numbers[own] = operations.setdefault(operation, len(operations))
        return numbers[id(root)]

    def _terminal(self, expr: Any) -> tuple[Any, ...]:
        name = expr._ufl_handler_name_
        match name:
            case "coefficient":
                number = self.coefficients.setdefault(expr, len(self.coefficients))
                return name, number, repr(expr.ufl_element())
            case "constant":
                number = self.constants.setdefault(expr, len(self.constants))
                return name, number, expr.ufl_shape
            case "argument":
                self.arguments[expr.number()] = expr
                return name, expr.number(), repr(expr.ufl_element())
            case "multi_index":
                return name, *map(self._index, expr)
            case "label":
                return name, self._names.setdefault((name, expr.count()), len(self._names))
            case "int_value" | "float_value" | "real_value":
                return name, float(expr)
            case "zero":
                return name, expr.ufl_shape, expr.ufl_free_indices
        return name, "" if isinstance(expr, GeometricQuantity) else repr(expr)

    def _index(self, index: Any) -> int:
        """A fixed index, or the number of a free one below zero."""
        if isinstance(index, FixedIndex):
            return int(index)
        return -1 - self._names.setdefault(("index", index.count()), len(self._names))
