"""Kernels of several cells at once, a language of FFCx's: C with a vector for each number.

FFCx writes the kernel of one cell, of which a compiler makes vectors in loops over nine nodes, at
best. Here every number of a cell is a vector with those of as many cells as the processor has
places ("lanes") for, as in Sun et al., A study of vectorization for matrix-free finite element
methods, Int. J. High Perform. Comput. Appl. 34 (2020) 629-644. What it saves is in
docs/theory/built.md.

FFCx is told the name of this module in place of "C". Of a cell's integral come two functions: one
of many cells, in a place that UFCx has for single precision, and one of one cell, for DOLFINx.
"""

from functools import singledispatchmethod
from math import prod
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from ffcx.codegeneration import lnodes
from ffcx.codegeneration.backend import FFCXBackend
from ffcx.codegeneration.C import expression, file, form
from ffcx.codegeneration.C import integral as one_cell
from ffcx.codegeneration.C import integral_template as template
from ffcx.codegeneration.C.formatter import Formatter, math_table
from ffcx.codegeneration.integral_generator import IntegralGenerator
from ffcx.codegeneration.lnodes import DataType

__all__ = ["NODES", "LanesFormatter", "expression", "file", "form", "integral"]

# of FFCx's options: how many nodes a cell of the mesh has
NODES = "shellmb_nodes"

# functions of C that `lanes.h` has
FUNCTIONS = {"sqrt", "fabs", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh"}
FUNCTIONS |= {"exp", "log", "erf", "pow", "atan2", "fmin", "fmax"}

MANY = """
static void lanes_{name}(lanes *restrict A, const lanes *restrict w, const double *restrict c,
                         const lanes *restrict coordinate_dofs)
{{
{body}
}}
"""
ONE = """static const int sizes[3] = {{{sizes}}};
alone(lanes_{name}, sizes, A, w, c, coordinate_dofs);"""
ONE_MEMBER = ".tabulate_tensor_float64 = tabulate_tensor_{name},"
MANY_MEMBER = ".tabulate_tensor_float32 = (ufcx_tabulate_tensor_float32 *)lanes_{name},"


class UnknownCode(Exception):
    """Something that lanes have not."""


class LanesFormatter(Formatter):
    """FFCx's code in C, with numbers of several cells."""

    def _dtype_to_name(self, dtype: DataType) -> str:
        # whole numbers, signs for example, are counted as others
        return "mask" if dtype == DataType.BOOL else "lanes"

    @singledispatchmethod
    def __call__(self, obj: Any) -> str:
        """The code of a node."""
        return str(super().__call__(obj))

    @__call__.register
    def _(self, array: lnodes.ArrayDecl) -> str:
        # tables are the same for all cells
        return str(Formatter(self.scalar_type)(array) if array.const else super().__call__(array))

    @__call__.register
    def _(self, variable: lnodes.VariableDecl) -> str:
        value, symbol = self(variable.value), variable.symbol
        if symbol.dtype != DataType.BOOL:
            value = f"ZERO + ({value})"
        return f"{self._dtype_to_name(symbol.dtype)} {self(symbol)} = {value};\n"

    @__call__.register
    def _(self, assigned: lnodes.Assign) -> str:
        # to what all cells have, too
        return f"{self(assigned.lhs)} = ZERO + ({self(assigned.rhs)});\n"

    @__call__.register(lnodes.EQ)
    @__call__.register(lnodes.NE)
    @__call__.register(lnodes.LT)
    @__call__.register(lnodes.GT)
    @__call__.register(lnodes.LE)
    @__call__.register(lnodes.GE)
    def _(self, compared: Any) -> str:
        return f"(ZERO + ({self(compared.lhs)})) {compared.op} (ZERO + ({self(compared.rhs)}))"

    @__call__.register(lnodes.And)
    @__call__.register(lnodes.Or)
    def _(self, both: Any) -> str:
        return f"({self(both.lhs)}) {both.op[0]} ({self(both.rhs)})"

    @__call__.register
    def _(self, negated: lnodes.Not) -> str:
        return f"~({self(negated.arg)})"

    @__call__.register
    def _(self, chosen: lnodes.Conditional) -> str:
        ways = f"ZERO + ({self(chosen.true)}), ZERO + ({self(chosen.false)})"
        return f"choose({self(chosen.condition)}, {ways})"

    @__call__.register
    def _(self, function: lnodes.MathFunction) -> str:
        name, args = math_table["float64"].get(function.function, function.function), function.args
        if name == "pow" and getattr(args[1], "value", None) in (2, 3, 4):
            return "(" + " * ".join([f"({self(args[0])})"] * int(args[1].value)) + ")"
        if name not in FUNCTIONS:
            raise UnknownCode(name)
        return f"lanes_{name}({', '.join(f'ZERO + ({self(a)})' for a in args)})"


def _generator(ir: Any, domain: Any, options: dict[str, Any]) -> tuple[str, str]:
    """Code of an integral, as `ffcx.codegeneration.C.integral.generator`."""
    if ir.expression.integral_type != "cell":
        return one_cell.generator(ir, domain, options)
    parts = IntegralGenerator(ir, FFCXBackend(ir, options)).generate(domain)
    try:
        body = LanesFormatter(options["scalar_type"])(parts)
    except UnknownCode:
        return one_cell.generator(ir, domain, options)
    name = f"{ir.expression.name}_{domain.name}"
    offsets = ir.expression.coefficient_offsets
    sizes = (
        prod(ir.expression.tensor_shape),
        max((at + f.ufl_element().dim for f, at in offsets.items()), default=0),
        3 * options[NODES],
    )
    enabled = ", ".join(map(str, map(int, ir.enabled_coefficients)))
    array = f"enabled_coefficients_{name}"
    alone = template.factory.format(
        factory_name=name,
        enabled_coefficients=array if enabled else "NULL",
        enabled_coefficients_init=f"static bool {array}[] = {{{enabled}}};" if enabled else "",
        tabulate_tensor=ONE.format(name=name, sizes=", ".join(map(str, sizes))),
        needs_facet_permutations="false",
        scalar_type="double",
        geom_type="double",
        coordinate_element_hash=f"UINT64_C({ir.expression.coordinate_element_hash})",
        tabulate_tensor_float32=MANY_MEMBER.format(name=name),
        tabulate_tensor_float64=ONE_MEMBER.format(name=name),
        tabulate_tensor_complex64="",
        tabulate_tensor_complex128="",
        domain=int(domain),
    )
    header = Path(__file__).with_suffix(".h").read_text()
    return template.declaration.format(factory_name=name), header + MANY.format(
        name=name, body=body
    ) + alone


integral = SimpleNamespace(generator=_generator)
