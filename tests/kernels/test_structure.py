"""Forms of the same structure have one program; each form has its own numbers.

The kind: two forms that differ in their functions, Constants, mesh or order of creation, which are
one program, and two that differ in one operation, number, index, element, label or rule.
"""

from collections.abc import Callable
from typing import Any

from mpi4py import MPI

import dolfinx.mesh
import numpy as np
import pytest
import ufl
from dolfinx import fem

from shellmb.native.kernels import compiled
from shellmb.native.programs.forms import Structure


def written(cells: int, stiff: float, degree: int = 1, turned: bool = False) -> ufl.Form:
    """A form with two functions and a Constant; `turned`: what stands for them is made later."""
    mesh = dolfinx.mesh.create_unit_square(MPI.COMM_SELF, cells, 1)
    space = fem.functionspace(mesh, ("Lagrange", degree, (2,)))
    scale = None if turned else fem.Constant(mesh, stiff)
    u, v = (fem.Function(space) for _ in range(2))
    scale = scale or fem.Constant(mesh, stiff)
    u.interpolate(lambda x: [1 + x[0], x[1] ** 2])
    v.interpolate(lambda x: [x[1], stiff * x[0]])
    E = ufl.variable(ufl.sym(ufl.grad(u)))
    (i,) = ufl.indices(1)
    test = ufl.TestFunction(space)
    energy = scale * ufl.inner(E, E) * ufl.exp(u[0])
    return (ufl.inner(ufl.diff(energy, E), ufl.grad(test)) + v[i] * test[i] * u[1]) * ufl.dx


def key(form: ufl.Form) -> Any:
    return Structure(integral.integrand() for integral in form.integrals()).key


def test_forms_that_are_alike_share_a_program_and_no_number() -> None:
    """Assembled in turn they are those that DOLFINx compiles."""
    forms = [written(2, 3.0), written(3, 0.5, turned=True)]
    assert key(forms[0]) == key(forms[1])
    made = [compiled(form) for form in forms]
    first, second = (form.ufcx_form.form_integrals[0].program for form in made)
    assert first is second
    exact = [fem.assemble_vector(fem.form(form)).array for form in forms]
    for which in (0, 1, 1, 0):
        found = fem.assemble_vector(made[which]).array
        assert np.abs(found - exact[which]).max() < 1e-14 * np.abs(exact[which]).max()


SPACE = fem.functionspace(
    dolfinx.mesh.create_unit_square(MPI.COMM_SELF, 1, 1), ("Lagrange", 1, (2,))
)
U, V, W = (fem.Function(SPACE) for _ in range(3))
PAIRS: dict[str, Callable[[], tuple[Any, Any]]] = {
    "operation": lambda: (U[0] + V[0], U[0] * V[0]),
    "number": lambda: (2.0 * U[0], 2.0000000000000004 * U[0]),
    "fixed index": lambda: (U[0], U[1]),
    "free index": lambda: (ufl.dot(U, U), ufl.dot(U, V)),
    "function": lambda: (U[0] * V[1] + U[1], U[0] * V[1] + V[1]),
    "component": lambda: (U[0] / V[0], U[0] / V[1]),
    "derivative": lambda: tuple(ufl.derivative(U[0] * V[0], f, W) for f in (U, V)),
    "element": lambda: (U[0], fem.Function(fem.functionspace(SPACE.mesh, ("DG", 1, (2,))))[0]),
    "label": lambda: tuple(
        ufl.diff(a[0] * b[1], c) for a, b in [(ufl.variable(U), ufl.variable(U))] for c in (a, b)
    ),
}


@pytest.mark.parametrize("what", PAIRS)
def test_what_differs_is_another_structure(what: str) -> None:
    first, second = PAIRS[what]()
    assert Structure([first]).key != Structure([second]).key
    assert Structure([first]).key == Structure([first]).key


def test_rules_and_elements_are_of_the_program() -> None:
    forms = [written(2, 1.0), written(2, 1.0, degree=2)]
    (integral,) = forms[0].integrals()
    rules = [integral.integrand() * ufl.dx(degree=n) for n in (2, 4)]
    programs = [compiled(form).ufcx_form.form_integrals[0].program for form in (*forms, *rules)]
    assert len(set(map(id, programs))) == 4
