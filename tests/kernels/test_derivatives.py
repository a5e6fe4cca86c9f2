"""Derivatives whose kernels are known are not taken again, and are the same."""

from mpi4py import MPI

import dolfinx.mesh
import numpy as np
import pytest
import ufl
from dolfinx import fem

from shellmb.native import derivatives, kernels
from shellmb.native.derivatives import Derivative

pytestmark = pytest.mark.usefixtures("compiled_forms")


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setitem(kernels.JIT_OPTIONS, "cache_dir", str(tmp_path / "cache"))
    return tmp_path / "cache"


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


def matrices(cells: int) -> list[np.ndarray | None]:
    form, u, load, other = residual(cells)
    wanted = [Derivative(form, f) for f in (u, load, other)]
    made = kernels.compile_with_derivatives([form, *wanted])
    assert made[0].rank == 1
    return [fem.assemble_matrix(a).to_dense() for a in made[1:] if a is not None]


def taken(cells: int) -> list[np.ndarray]:
    """The same by DOLFINx alone."""
    form, *functions = residual(cells)
    return [fem.assemble_matrix(fem.form(ufl.derivative(form, f))).to_dense() for f in functions]


def test_known_ones_are_not_taken_again(cache, monkeypatch) -> None:
    for found, exact in zip(matrices(3), taken(3), strict=True):
        assert np.abs(found - exact).max() < 1e-14 * np.abs(exact).max()

    def never(*_, **__):
        raise AssertionError("a derivative was taken whose kernel is known")

    # another mesh, other functions and constants of other values
    exact = taken(5)
    monkeypatch.setattr(derivatives.ufl, "derivative", never)
    for found, value in zip(matrices(5), exact, strict=True):
        assert np.abs(found - value).max() < 1e-14 * np.abs(value).max()


def seen_through(few, u: fem.Function) -> ufl.Form:
    """A form of what is made of few numbers, which `few` marks or not, one in another."""
    test = ufl.TestFunction(u.function_space)
    first = few(ufl.as_vector([u**2, ufl.sin(u)]))
    second = few(u * ufl.as_vector([first[0] * first[1], ufl.exp(first[1])]))
    return ufl.dot(second, ufl.as_vector([test, u * test.dx(0)]) * first[0]) * ufl.dx


def test_derivatives_through_few_numbers(cache) -> None:
    """They are those by the unknowns, of one function and of several with shares."""
    mesh = dolfinx.mesh.create_unit_interval(MPI.COMM_SELF, 3)
    u = fem.Function(fem.functionspace(mesh, ("Lagrange", 1)))
    u.interpolate(lambda x: 1 + x[0] ** 2)
    form = seen_through(ufl.variable, u)
    shares = fem.Constant(mesh, np.array([0.3]))
    wanted = [Derivative(form, u), Derivative(form, u, shares=shares)]
    found = [fem.assemble_matrix(a).to_dense() for a in kernels.compile_with_derivatives(wanted)]
    plain = fem.form(ufl.derivative(seen_through(lambda value: value, u), u))
    exact = fem.assemble_matrix(plain).to_dense()
    for matrix, share in zip(found, (1.0, 0.3), strict=True):
        assert np.abs(matrix - share * exact).max() < 1e-14 * np.abs(exact).max()


def test_derivatives_with_one_kernel_are_taken_once(cache, monkeypatch) -> None:
    """Of unknown functions with other shares."""
    form, u, _, other = residual(2)
    shares = [fem.Constant(form.ufl_domain(), np.array(s)) for s in ([1.0, 0.0], [0.0, 2.0])]
    exact = taken(2)
    written, by_shares = [], derivatives.by_shares
    monkeypatch.setattr(derivatives, "by_shares", lambda *a: written.append(a) or by_shares(*a))
    made = kernels.compile_with_derivatives([Derivative(form, u, [other], s) for s in shares])
    assert len(written) == 1
    for a, scaled in zip(made, (exact[0], 2 * exact[2]), strict=True):
        assert np.abs(fem.assemble_matrix(a).to_dense() - scaled).max() < 1e-14 * scaled.max()


def test_one_that_vanishes_is_remembered(cache) -> None:
    mesh = dolfinx.mesh.create_unit_interval(MPI.COMM_SELF, 2)
    space = fem.functionspace(mesh, ("Lagrange", 1))
    u, test = fem.Function(space), ufl.TestFunction(space)
    form = ufl.conditional(ufl.gt(u, 0), 1.0, 2.0) * test * ufl.dx
    for _ in range(2):
        _, derivative = kernels.compile_with_derivatives([form, Derivative(form, u)])
        assert derivative is None


def test_what_is_left_of_a_record_is_made_anew(cache) -> None:
    first = matrices(2)
    files = [*cache.glob("*.by*")]
    assert len(files) == 3
    files[0].write_text("{")
    for kernel in cache.glob("shellmb_form_*.so"):
        kernel.unlink()
    kernels.loaded.cache_clear()
    for found, again in zip(matrices(2), first, strict=True):
        assert np.array_equal(found, again)


def test_what_is_written_by_hand_is_known_by_its_source(tmp_path) -> None:
    """Who changes a derivative and not its residual gets the new one."""
    (tmp_path / "steps").mkdir()
    file = tmp_path / "steps" / "work.py"
    file.write_text("one")
    first = derivatives.written_as(tmp_path)
    derivatives.written_as.cache_clear()
    assert derivatives.written_as(tmp_path) == first
    file.write_text("two")
    derivatives.written_as.cache_clear()
    assert derivatives.written_as(tmp_path) != first
    derivatives.written_as.cache_clear()
