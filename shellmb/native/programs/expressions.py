"""Expressions at points of cells as programs."""

from typing import Any

from mpi4py import MPI as _MPI  # noqa: F401  (before dolfinx)

import numpy as np
from ufl.core.expr import Expr
from ufl.domain import extract_domains

from shellmb.arrays import Floats
from shellmb.native.programs.algebra import array
from shellmb.native.programs.building import Rule
from shellmb.native.programs.forms import READ, Program, Structure, constant_places
from shellmb.native.programs.graph import Input, linear
from shellmb.native.programs.reading import ARGUMENT, Reader
from shellmb.native.programs.tables import Points, Tables


def program_of(value: Expr, points: Floats) -> tuple[Program, Structure]:
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
