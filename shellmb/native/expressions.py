"""Compiled expressions: values at points of cells."""

from collections.abc import Callable

from mpi4py import MPI as _MPI  # noqa: F401  (before dolfinx)

import numpy as np
from dolfinx import cpp, fem  # type: ignore[attr-defined]
from ufl.algorithms.analysis import extract_coefficients, extract_constants
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.native import reference
from shellmb.native.assembler import is_native
from shellmb.native.kernels import cache_folder, comm_of, compile_missing, loaded, module_name


def compiled_expression(value: Expr, points: Floats) -> fem.Expression:
    """An expression without arguments compiled, or found in the cache; collective.

    Args:
        value: The expression.
        points: Where on the reference element it is wanted, shape (n, dimension).

    Raises:
        RunError: If the C compiler fails; on all ranks.
    """
    if not is_native():
        return reference.compiled_expression(value, points)
    item = value, np.reshape(points, (len(points), -1))
    compile_missing([item], comm_of(value))
    kernel = loaded(cache_folder(), module_name(item), "expression")
    # as DOLFINx attaches data to a kernel, which it would compile one at a time
    made: fem.Expression = object.__new__(fem.Expression)
    made._ufl_expression, made._argument_space = value, None
    made._ufcx_expression, made._code = kernel.form, ""
    made._cpp_object = cpp.fem.create_expression_float64(
        kernel.address,
        kernel.reads(extract_coefficients(value)),
        [constant._cpp_object for constant in extract_constants(value)],
        [],
        None,
    )
    return made


def evaluate(expression: fem.Expression, values: fem.Function) -> None:
    """Give a function the values of an expression in all cells of this rank.

    Args:
        expression: The expression.
        values: The function, on the same mesh.
    """
    evaluation(expression, values)()


def evaluation(expression: fem.Expression, values: fem.Function) -> Callable[[], None]:
    """Make what gives a function the values of an expression in all cells of this rank.

    As `Function.interpolate`, which takes most of its time to find out what it is given.

    Args:
        expression: The expression.
        values: The function, on the same mesh.
    """
    cells = values.function_space.mesh.topology.index_map(values.function_space.mesh.topology.dim)
    every = np.arange(cells.size_local + cells.num_ghosts, dtype=np.int32)
    put, made = values._cpp_object.interpolate_expr, expression._cpp_object
    return lambda: put(made, every, every)
