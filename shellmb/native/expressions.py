"""Expressions at points of cells, as programs of the loops in C or by DOLFINx."""

import math
from collections.abc import Callable
from typing import Any

from mpi4py import MPI as _MPI  # noqa: F401  (before dolfinx)

import numpy as np
from dolfinx import fem, mesh
from ufl.core.expr import Expr
from ufl.domain import extract_domains

from shellmb.arrays import Floats, Ints
from shellmb.native import library as native
from shellmb.native import reference
from shellmb.native.assembler import is_native
from shellmb.native.library import CArrays, cell_dofs, doubles
from shellmb.native.programs.building import Rule
from shellmb.native.programs.forms import READ, Program, Structure, constant_places
from shellmb.native.programs.geometry import array
from shellmb.native.programs.graph import Input, Unsupported, linear
from shellmb.native.programs.reading import ARGUMENT, Reader
from shellmb.native.programs.tables import Points, Tables

# of a line
MIDDLE = np.array([[0.5]])


def values_in_cells(
    value: Expr, points: Any, domain: mesh.Mesh, cells: slice | Ints | None = None
) -> Callable[[], Floats]:
    """Make what finds an expression in cells of this rank; collective.

    Args:
        value: The expression, without arguments.
        points: Where on the reference element it is wanted, shape (n, dimension).
        domain: The mesh.
        cells: Numbers of the cells; None: those that this rank owns.

    Returns:
        Gives its values as they are now, shape (cells, points, components).
    """
    places = np.reshape(np.asarray(points, dtype=float), (len(points), -1))
    if cells is None:
        cells = slice(domain.topology.index_map(domain.topology.dim).size_local)
    if is_native():
        try:
            return _CellValues(value, places, domain, cells)
        except Unsupported:
            # then DOLFINx has to compile it
            pass
    expression = reference.compiled_expression(value, np.asarray(points))
    numbers = np.arange(len(domain.geometry.dofmaps[0]), dtype=np.int32)[cells]
    shape = len(numbers), len(points), math.prod(value.ufl_shape)
    return lambda: np.asarray(expression.eval(domain, numbers)).reshape(shape)


def values_at_states(value: Expr, state: fem.Function) -> Callable[[Floats], Floats]:
    """Make what finds an expression on a mesh of lines at many states of a function in it.

    Args:
        value: The expression, a vector without arguments.
        state: The function, whose values the last state stays in.

    Returns:
        Gives values in the middle of the cells of this rank, shape (k, cells, n), at local arrays
        of the function, shape (k, dofs).
    """
    domain, size = state.function_space.mesh, int(value.ufl_shape[0])
    cells, place = len(domain.geometry.dofmaps[0]), state.x.array
    now = values_in_cells(value, MIDDLE, domain, np.s_[:])

    def find(states: Floats) -> Floats:
        found = np.zeros((len(states), cells, size))
        for values, given in zip(found, states, strict=True):
            place[:] = given
            values[:] = now()[:, 0]
        return found

    return find


class _CellValues:
    """Values in cells of a mesh by the loop over them in C; arguments as above."""

    def __init__(self, value: Expr, points: Floats, domain: mesh.Mesh, cells: slice | Ints) -> None:
        program, structure = _program_of(value, points)
        self._lib, pointer = native.cells().lib, CArrays()
        address = np.array([program.address(pointer)])
        self._constants = [address, *(c.value.reshape(-1) for c in structure.constants)]
        self._packed = np.zeros(sum(map(len, self._constants)))
        geometry = np.ascontiguousarray(domain.geometry.x[domain.geometry.dofmaps[0][cells]])
        functions = list(structure.coefficients)
        tables = program.of_each([cell_dofs(f.function_space)[cells] for f in functions])
        sizes = [table.shape[1] for table in tables]
        count = len(geometry)
        self._shape = count, len(points), math.prod(value.ufl_shape)
        size = self._shape[1] * self._shape[2]
        members = {
            "function": pointer.ffi.cast("void *", self._lib.interpret_one_0),
            "lanes": 1,
            "adds": True,
            "constants": pointer(self._packed),
            "rows": size,
            "columns": 1,
            "row_place": pointer(np.arange(size, dtype=np.int32)),
            "coefficients": len(sizes),
            "values": pointer.many("double *", [pointer(f.x.array) for f in functions]),
            "dofs": pointer.many("int *", [pointer(table) for table in tables]),
            "sizes": pointer(np.array([*sizes, 0], dtype=np.int32)),
        }
        where = {
            "cells": count,
            "size": size,
            "dofs": pointer(np.arange(count * size, dtype=np.int32)),
            "geometry": pointer(geometry),
            "geometry_size": int(np.prod(geometry.shape[1:])),
            "coefficient_size": sum(sizes) + 1,
            "lanes": 1,
        }
        self._kept = pointer, program
        self._loop = pointer.many("Cells", [where]), pointer.many("Kernel", [members]), 1

    def __call__(self) -> Floats:
        """Values as they are now."""
        np.concatenate(self._constants, out=self._packed)
        found = np.zeros(self._shape)
        self._lib.residual(*self._loop, doubles(found))
        return found


def _program_of(value: Expr, points: Floats) -> tuple[Program, Structure]:
    """An expression without arguments as a program, whose rows are points and their components.

    Args:
        value: The expression.
        points: Points on the reference element, shape (n, dimension).

    Returns:
        The program, and functions and Constants that it reads.

    Raises:
        Unsupported: If it has something that programs do not have.
    """
    structure = Structure([value])
    coefficients = structure.coefficients
    domain: Any = extract_domains(value)[0]
    key = structure.key, repr(domain.ufl_coordinate_element()), points.tobytes()
    if key not in READ:
        places = Points(points[None], np.ones(len(points)), np.zeros((1, 0)))
        tables = Tables(places, domain, [f.ufl_element() for f in coefficients], [])
        known = constant_places(structure.constants)
        reader = Reader(domain, coefficients, known, [], tables.vanishes)
        values = array(reader.tensor(value)).ravel()
        tables.at_points(len(values))
        none = (0,) * domain.topological_dimension
        parts: Any = {(Input(ARGUMENT, k, none),): node for k, node in enumerate(values)}
        rule = Rule(reader, linear(parts, reader.graph.zero), 1, places, tables)
        steady = np.zeros(sum(f.ufl_element().dim for f in coefficients), bool)
        READ[key] = [Program([rule], [len(values)], steady, 0, 1)]
    (program,) = READ[key]
    return program, structure
