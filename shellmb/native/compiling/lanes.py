"""Kernels of several cells at once: C with a vector for each number.

FFCx writes the kernel of one cell, of which a compiler makes vectors in loops over nine nodes, at
best. Here every number of a cell is a vector with those of as many cells as the processor has
places ("lanes") for, as in Sun et al., A study of vectorization for matrix-free finite element
methods, Int. J. High Perform. Comput. Appl. 34 (2020) 629-644. What it saves is in
docs/theory/built.md.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from ffcx.codegeneration import lnodes
from ffcx.codegeneration.C.formatter import Formatter, math_table
from ffcx.codegeneration.lnodes import DataType

# functions of C that `lanes.h` has
FUNCTIONS = {"sqrt", "fabs", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh"}
FUNCTIONS |= {"exp", "log", "erf", "pow", "atan2", "fmin", "fmax"}

HEADER = Path(__file__).with_suffix(".h")
MANY = """
static void lanes_{name}(lanes *restrict A, const lanes *restrict w, const double *restrict c,
                         const lanes *restrict coordinate_dofs)
{{
{body}
}}
"""
ONE = """static const int sizes[3] = {{{sizes}}};
alone(lanes_{name}, sizes, A, w, c, coordinate_dofs);"""


class UnknownCode(Exception):
    """Code that lanes do not have."""


class LanesFormatter(Formatter):
    """FFCx's code in C, with numbers of several cells."""

    def __call__(self, obj: Any) -> str:
        """The code of a node."""
        own = NODES.get(type(obj))
        return str(super().__call__(obj)) if own is None else own(self, obj)

    def _dtype_to_name(self, dtype: DataType) -> str:
        # whole numbers, signs for example, are counted as others
        return "mask" if dtype == DataType.BOOL else "lanes"

    def declare_array(self, array: lnodes.ArrayDecl) -> str:
        """An array; tables are the same for all cells."""
        return str(Formatter(self.scalar_type)(array) if array.const else super().__call__(array))

    def declare(self, variable: lnodes.VariableDecl) -> str:
        """A variable with its value."""
        value, symbol = self(variable.value), variable.symbol
        if symbol.dtype != DataType.BOOL:
            value = f"ZERO + ({value})"
        return f"{self._dtype_to_name(symbol.dtype)} {self(symbol)} = {value};\n"

    def assign(self, assigned: lnodes.Assign) -> str:
        """A value, perhaps one that all cells have."""
        return f"{self(assigned.lhs)} = ZERO + ({self(assigned.rhs)});\n"

    def compare(self, compared: Any) -> str:
        """A comparison."""
        return f"(ZERO + ({self(compared.lhs)})) {compared.op} (ZERO + ({self(compared.rhs)}))"

    def combine(self, both: Any) -> str:
        """Two conditions."""
        return f"({self(both.lhs)}) {both.op[0]} ({self(both.rhs)})"

    def negate(self, negated: lnodes.Not) -> str:
        """A condition that must not hold."""
        return f"~({self(negated.arg)})"

    def choose(self, chosen: lnodes.Conditional) -> str:
        """One of two values in each cell."""
        ways = f"ZERO + ({self(chosen.true)}), ZERO + ({self(chosen.false)})"
        return f"choose({self(chosen.condition)}, {ways})"

    def call(self, function: lnodes.MathFunction) -> str:
        """A function."""
        name, args = math_table["float64"].get(function.function, function.function), function.args
        if name == "pow" and getattr(args[1], "value", None) in (2, 3, 4):
            return "(" + " * ".join([f"({self(args[0])})"] * int(args[1].value)) + ")"
        if name not in FUNCTIONS:
            raise UnknownCode(name)
        return f"lanes_{name}({', '.join(f'ZERO + ({self(a)})' for a in args)})"


# Nodes that lanes write in their own way
NODES: dict[type, Callable[[LanesFormatter, Any], str]] = {
    lnodes.ArrayDecl: LanesFormatter.declare_array,
    lnodes.VariableDecl: LanesFormatter.declare,
    lnodes.Assign: LanesFormatter.assign,
    lnodes.And: LanesFormatter.combine,
    lnodes.Or: LanesFormatter.combine,
    lnodes.Not: LanesFormatter.negate,
    lnodes.Conditional: LanesFormatter.choose,
    lnodes.MathFunction: LanesFormatter.call,
}
NODES |= dict.fromkeys(
    (lnodes.EQ, lnodes.NE, lnodes.LT, lnodes.GT, lnodes.LE, lnodes.GE), LanesFormatter.compare
)
