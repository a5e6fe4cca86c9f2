"""Expressions at points of cells."""

import math
from collections.abc import Callable
from typing import Any

from mpi4py import MPI as _MPI  # noqa: F401  (before dolfinx)

import numpy as np
from dolfinx import cpp, fem, mesh  # type: ignore[attr-defined]
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.native import library as native
from shellmb.native import reference
from shellmb.native.assembler import is_native
from shellmb.native.library import CArrays, cell_dofs, doubles
from shellmb.native.programs.expressions import ExpressionProgram
from shellmb.native.programs.graph import Unsupported

# of a line
MIDDLE = np.array([[0.5]])


def compiled_expression(value: Expr, points: Floats) -> fem.Expression:
    """An expression without arguments made ready for DOLFINx; collective.

    Args:
        value: The expression.
        points: Where on the reference element it is wanted, shape (n, dimension).
    """
    program = _program(value, np.reshape(points, (len(points), -1)))
    if program is None:
        return reference.compiled_expression(value, points)
    # as DOLFINx attaches data to a kernel that it has compiled
    made: fem.Expression = object.__new__(fem.Expression)
    made._ufl_expression, made._argument_space = value, None
    made._ufcx_expression, made._code = program.form, ""
    made._cpp_object = cpp.fem.create_expression_float64(
        program.address,
        [function._cpp_object for function in program.coefficients],
        [constant._cpp_object for constant in program.constants],
        [],
        None,
    )
    made._module = program  # type: ignore[attr-defined]
    return made


def _program(value: Expr, points: Floats) -> ExpressionProgram | None:
    """Program of an expression at points; None where DOLFINx has to compile it."""
    if not is_native():
        return None
    try:
        return ExpressionProgram(value, points)
    except Unsupported:
        return None


def values_in_cells(value: Expr, points: Any, domain: mesh.Mesh) -> Callable[[], Floats]:
    """Make what finds an expression in the cells that this rank owns; collective.

    Args:
        value: The expression, without arguments.
        points: Where on the reference element it is wanted, shape (n, dimension).
        domain: The mesh.

    Returns:
        Gives its values as they are now, shape (cells, points, components).
    """
    expression = compiled_expression(value, np.asarray(points))
    owned = domain.topology.index_map(domain.topology.dim).size_local
    cells, shape = (
        np.arange(owned, dtype=np.int32),
        (owned, len(points), math.prod(value.ufl_shape)),
    )
    return lambda: np.asarray(expression.eval(domain, cells)).reshape(shape)


def values_at_states(value: Expr, state: fem.Function) -> Callable[[Floats], Floats]:
    """Make what finds an expression on a mesh of lines at many states of a function in it.

    Args:
        value: The expression, a vector without arguments.
        state: The function, whose values the last state stays in.

    Returns:
        Gives values in the middle of the cells of this rank, shape (k, cells, n), at local arrays
        of the function, shape (k, dofs).
    """
    program = _program(value, MIDDLE)
    if program is not None:
        return _AtStates(value, state, program)
    expression = reference.compiled_expression(value, MIDDLE)
    domain, size = state.function_space.mesh, int(value.ufl_shape[0])
    every = np.arange(len(domain.geometry.dofmaps[0]), dtype=np.int32)

    def find(states: Floats) -> Floats:
        found = np.zeros((len(states), len(every), size))
        for values, array in zip(found, states, strict=True):
            state.x.array[:] = array
            values[:] = expression.eval(domain, every).reshape(values.shape)
        return found

    return find


class _AtStates:
    def __init__(self, value: Expr, state: fem.Function, kernel: ExpressionProgram) -> None:
        pointer = CArrays()
        self._lib, self._kept = native.cells().lib, (pointer, kernel)
        self._constants = [constant.value.reshape(-1) for constant in kernel.constants]
        self._packed = np.zeros(sum(map(len, self._constants)))
        self._place, size = state.x.array, int(value.ufl_shape[0])
        domain = state.function_space.mesh
        geometry = np.ascontiguousarray(domain.geometry.x[domain.geometry.dofmaps[0]])
        tables, values = [], []
        for function in kernel.coefficients:
            tables.append(cell_dofs(function.function_space))
            values.append(pointer(function.x.array))
        tables = kernel.program.of_each(tables)
        sizes = [table.shape[1] for table in tables]
        function = pointer.ffi.cast("uintptr_t", kernel.form.tabulate_tensor_float64)
        members = {
            "function": pointer.ffi.cast("void *", int(function)),
            "lanes": 1,
            "opens": True,
            "closes": True,
            "adds": True,
            "constants": pointer(self._packed),
            "rows": size,
            "columns": 1,
            "row_place": pointer(np.arange(size, dtype=np.int32)),
            "coefficients": len(sizes),
            "values": pointer.many("double *", values),
            "dofs": pointer.many("int *", [pointer(table) for table in tables]),
            "sizes": pointer(np.array([*sizes, 0], dtype=np.int32)),
        }
        cells = {
            "cells": len(geometry),
            "size": size,
            "dofs": pointer(np.arange(geometry.shape[0] * size, dtype=np.int32)),
            "geometry": pointer(geometry),
            "geometry_size": int(np.prod(geometry.shape[1:])),
            "coefficient_size": sum(sizes) + 1,
            "lanes": 1,
        }
        self._loop = pointer.many("Cells", [cells]), pointer.many("Kernel", [members]), 1
        self._shape = len(geometry), size

    def __call__(self, states: Floats) -> Floats:
        if self._constants:
            np.concatenate(self._constants, out=self._packed)
        found = np.zeros((len(states), *self._shape))
        for values, state in zip(found, states, strict=True):
            self._place[:] = state
            self._lib.residual(*self._loop, doubles(values))
        return found
