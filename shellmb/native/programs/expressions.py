"""Expressions at points of cells as programs."""

from __future__ import annotations

from functools import cache
from typing import Any

from mpi4py import MPI as _MPI  # noqa: F401  (before dolfinx)

import cffi  # type: ignore[import-untyped]
import ffcx.codegeneration.jit as ffcx_jit
import numpy as np
from dolfinx import default_scalar_type, fem
from ufl.core.expr import Expr
from ufl.domain import extract_domains

from shellmb.arrays import Floats
from shellmb.native import library as native
from shellmb.native.library import CArrays
from shellmb.native.programs.building import Rule
from shellmb.native.programs.forms import READ, Program, Structure, constant_places
from shellmb.native.programs.graph import Input, linear
from shellmb.native.programs.reading import ARGUMENT, Reader
from shellmb.native.programs.tables import Points, Tables


@cache
def ufcx_interface() -> cffi.FFI:
    """Interface to FFCx's structures of C."""
    ffi = cffi.FFI()
    ffi.cdef(ffcx_jit.UFC_HEADER_DECL.format(np.dtype(default_scalar_type).name))
    ffi.cdef(ffcx_jit.UFC_INTEGRAL_DECL + ffcx_jit.UFC_FORM_DECL + ffcx_jit.UFC_EXPRESSION_DECL)
    return ffi


class ExpressionProgram:
    """An expression without arguments as a program, as FFCx describes one that is compiled.

    Args:
        value: The expression.
        points: Points on the reference element, shape (n, dimension).

    Attributes:
        form: Its description, a `ufcx_expression` of C.
        coefficients: Functions that it reads, in their order.
        constants: Constants that it reads, in their order.
        program: The program.
        address: Address of the description, as DOLFINx takes it.

    Raises:
        Unsupported: If it has something that programs do not have.
    """

    def __init__(self, value: Expr, points: Floats) -> None:
        structure = Structure([value])
        coefficients, constants = structure.coefficients, structure.constants
        domain: Any = extract_domains(value)[0]
        key = structure.key, repr(domain.ufl_coordinate_element()), points.tobytes()
        if key not in READ:
            places = Points(points[None], np.ones(len(points)), np.zeros((1, 0)))
            tables = Tables(places, domain, [f.ufl_element() for f in coefficients], [])
            known = constant_places(constants)
            reader = Reader(domain, coefficients, known, [], tables.vanishes)
            values = reader.tensor(value).ravel()
            tables.at_points(len(values))
            none = (0,) * domain.topological_dimension
            parts: Any = {(Input(ARGUMENT, k, none),): node for k, node in enumerate(values)}
            rule = Rule(reader, linear(parts, reader.graph.zero), 1, places, tables)
            steady = np.zeros(sum(f.ufl_element().dim for f in coefficients), bool)
            READ[key] = [Program([rule], [len(values)], steady, 0, 1)]
        (self.program,) = READ[key]
        pointer = CArrays()
        place = fem.Constant(domain, np.array([self.program.address(pointer)]))
        self.coefficients, self.constants = list(coefficients), [place, *constants]
        self._kept: tuple[Any, ...] = pointer, place
        ffi = ufcx_interface()
        positions = np.arange(max(len(coefficients), 1), dtype=np.int32)
        shape = np.array([*value.ufl_shape, 0], dtype=np.int32)
        where = np.ascontiguousarray(points.ravel(), dtype=float)
        self._kept += positions, shape, where
        lib, own = native.cells().lib, native.cells().ffi
        function = int(own.cast("uintptr_t", own.addressof(lib, "interpret_one_0")))
        members = {
            "tabulate_tensor_float64": ffi.cast("ufcx_tabulate_tensor_float64 *", function),
            "num_coefficients": len(coefficients),
            "num_constants": len(self.constants),
            "original_coefficient_positions": ffi.cast("int *", positions.ctypes.data),
            "num_points": len(points),
            "entity_dimension": points.shape[1],
            "points": ffi.cast("double *", where.ctypes.data),
            "value_shape": ffi.cast("int *", shape.ctypes.data),
            "num_components": len(value.ufl_shape),
            "rank": 0,
            "coordinate_element_hash": domain.ufl_coordinate_element().basix_hash(),
        }
        self.form = ffi.new("ufcx_expression *", members)
        self.address = ffi.cast("uintptr_t", self.form)
