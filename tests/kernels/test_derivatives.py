"""Derivatives of forms: by functions, by what has shares of several, through few numbers."""

from mpi4py import MPI

import dolfinx.mesh
import numpy as np
import ufl
from dolfinx import fem

from shellmb.native.derivatives import derivative
from shellmb.native.kernels import compile_all
from shellmb.native.programs.forms import Interpreted


def residual(cells: int):
    """A form with two functions, of which one does not stand where the other is differentiated."""
    mesh = dolfinx.mesh.create_unit_interval(MPI.COMM_SELF, cells)
    space = fem.functionspace(mesh, ("Lagrange", 1))
    load, u, other = (fem.Function(space) for _ in range(3))
    gone, stiff = fem.Constant(mesh, 7.0), fem.Constant(mesh, 2.0 + cells)
    u.interpolate(lambda x: 1 + x[0] ** 2)
    other.interpolate(lambda x: np.cos(x[0]))
    test = ufl.TestFunction(space)
    form = (stiff * other * u**3 * test + gone * load * test) * ufl.dx
    return form, u, load, other


def test_derivatives_are_those_of_ufl() -> None:
    """By one function, by one whose derivative has no function, and by several with shares."""
    form, u, load, other = residual(3)

    def plain(function: fem.Function) -> np.ndarray:
        return fem.assemble_matrix(fem.form(ufl.derivative(form, function))).to_dense()

    shares = fem.Constant(form.ufl_domain(), np.array([1.0, 2.0]))
    exact = [plain(u), plain(load), plain(u) + 2 * plain(other)]
    wanted = [derivative(form, u), derivative(form, load), derivative(form, u, [other], shares)]
    for found, right in zip(compile_all(wanted), exact, strict=True):
        assert np.abs(fem.assemble_matrix(found).to_dense() - right).max() < 1e-14 * right.max()


def seen_through(few, u: fem.Function) -> ufl.Form:
    """A form of what is made of few numbers, which `few` marks or not, one in another."""
    test = ufl.TestFunction(u.function_space)
    first = few(ufl.as_vector([u**2, ufl.sin(u)]))
    second = few(u * ufl.as_vector([first[0] * first[1], ufl.exp(first[1])]))
    return ufl.dot(second, ufl.as_vector([test, u * test.dx(0)]) * first[0]) * ufl.dx


def test_derivatives_through_few_numbers() -> None:
    """They are those by the unknowns, of one function and of several with shares."""
    mesh = dolfinx.mesh.create_unit_interval(MPI.COMM_SELF, 3)
    u = fem.Function(fem.functionspace(mesh, ("Lagrange", 1)))
    u.interpolate(lambda x: 1 + x[0] ** 2)
    form = seen_through(ufl.variable, u)
    shares = fem.Constant(mesh, np.array([0.3]))
    wanted = [derivative(form, u), derivative(form, u, shares=shares)]
    found = [fem.assemble_matrix(a).to_dense() for a in compile_all(wanted)]
    plain = fem.form(ufl.derivative(seen_through(lambda value: value, u), u))
    exact = fem.assemble_matrix(plain).to_dense()
    for matrix, share in zip(found, (1.0, 0.3), strict=True):
        assert np.abs(matrix - share * exact).max() < 1e-14 * np.abs(exact).max()


def test_one_that_vanishes_is_none() -> None:
    mesh = dolfinx.mesh.create_unit_interval(MPI.COMM_SELF, 2)
    space = fem.functionspace(mesh, ("Lagrange", 1))
    u, test = fem.Function(space), ufl.TestFunction(space)
    form = ufl.conditional(ufl.gt(u, 0), 1.0, 2.0) * test * ufl.dx
    assert compile_all([derivative(form, u)]) == []


def test_derivatives_of_forms_that_dolfinx_compiles() -> None:
    """By several functions with shares, of gradients too, where programs lack a function."""
    _, u, _, other = residual(3)
    test, dx = ufl.TestFunction(u.function_space), ufl.dx(degree=6)
    few = ufl.variable(ufl.as_vector([ufl.bessel_J(1, u), u.dx(0) ** 2 * other]))
    form = few[0] * few[1] * test * dx + u.dx(0) * other * test.dx(0) * dx
    shares = fem.Constant(form.ufl_domain(), np.array([1.0, 2.0]))
    (found,) = compile_all([derivative(form, u, [other], shares)])
    assert not isinstance(found.module, Interpreted)
    exact = sum(
        share * fem.assemble_matrix(fem.form(ufl.derivative(form, f))).to_dense()
        for share, f in ((1, u), (2, other))
    )
    assert np.abs(fem.assemble_matrix(found).to_dense() - exact).max() < 1e-13 * np.abs(exact).max()
