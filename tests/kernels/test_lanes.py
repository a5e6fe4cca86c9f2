"""Programs for several cells at once beside the same for one cell, and beside FFCx's kernels."""

from collections.abc import Callable
from typing import Any

from mpi4py import MPI

import numpy as np
import pytest
import ufl
from dolfinx import fem, mesh

from shellmb.native import library as native
from shellmb.native.compiling.flags import LANES
from shellmb.native.kernels import compile_all, compiled
from shellmb.native.library import cell_dofs, side_by_side
from shellmb.native.reference import compiled_form
from shellmb.system.assembly.functionals import functionals, vector_of
from shellmb.system.assembly.loops import FormLoop, LoopResiduals, MeshGeometry

# another order of the same operations, as part of the largest value: 9e-15 was seen
ROUND_OFF = 2e-13

INTEGRANDS: dict[str, Callable[[Any, Any], Any]] = {
    "sqrt": lambda u, c: ufl.sqrt(u) + ufl.sqrt(c),
    "abs": lambda u, c: abs(u - 1.4),
    "sin": lambda u, c: ufl.sin(u),
    "cos": lambda u, c: ufl.cos(u) * ufl.cos(c),
    "tan": lambda u, c: ufl.tan(u / 2),
    "asin": lambda u, c: ufl.asin(u / 3),
    "acos": lambda u, c: ufl.acos(u / 3),
    "atan": lambda u, c: ufl.atan(u),
    "atan2": lambda u, c: ufl.atan2(u - 1.4, c),
    "sinh": lambda u, c: ufl.sinh(u),
    "cosh": lambda u, c: ufl.cosh(u),
    "tanh": lambda u, c: ufl.tanh(u),
    "exp": lambda u, c: ufl.exp(u),
    "log": lambda u, c: ufl.ln(u),
    "erf": lambda u, c: ufl.erf(u),
    "square": lambda u, c: (u + c) ** 2,
    "cube": lambda u, c: u**3 + c**3,
    "fourth": lambda u, c: u**4,
    "power": lambda u, c: u**-1.5 + u**5 + u**c,
    "smaller": lambda u, c: ufl.min_value(u, 1.4) + ufl.max_value(u, c),
    "sign": lambda u, c: ufl.sign(u - 1.4),
    "either": lambda u, c: ufl.conditional(ufl.lt(u, 1.4), u**2, c),
    # what is not chosen must not be seen
    "not chosen": lambda u, c: ufl.conditional(ufl.gt(u, 1.4), ufl.ln(u - 1.4), ufl.sqrt(1.4 - u)),
    "both": lambda u, c: ufl.conditional(ufl.And(ufl.gt(u, 1.2), ufl.le(u, 1.6)), u, 2 * u),
    "one of": lambda u, c: ufl.conditional(ufl.Or(ufl.lt(u, 1.2), ufl.ge(u, 1.6)), u, 2 * u),
    "not": lambda u, c: ufl.conditional(ufl.Not(ufl.lt(u, 1.4)), u, 2 * u),
    "of constants": lambda u, c: ufl.conditional(ufl.ne(c, 1.0), u, 2 * u),
}


def _field(cells: int, cell: mesh.CellType = mesh.CellType.quadrilateral) -> fem.Function:
    domain = mesh.create_rectangle(MPI.COMM_SELF, [(0, 0), (1, 1)], (cells, 1), cell)
    space = fem.functionspace(domain, ("Lagrange", 2))
    u = fem.Function(space)
    u.x.array[:] = np.random.default_rng(3).uniform(1.0, 2.0, len(u.x.array))
    return u


def _constant(u: fem.Function) -> fem.Constant:
    return fem.Constant(u.function_space.mesh, 1.3)


def _same(found: Any, exact: Any) -> None:
    """But for the order of operations."""
    exact = np.asarray(exact)
    np.testing.assert_allclose(found, exact, rtol=0.0, atol=ROUND_OFF * np.abs(exact).max())


def _many(form: fem.Form) -> bool:
    """Whether a form's kernel is one of several cells."""
    ufcx: Any = form.ufcx_form
    return bool(ufcx.form_integrals[0].tabulate_tensor_float32)


def test_functions():
    """All in one form, each with rows of its own."""
    u = _field(LANES + 1)
    space = fem.functionspace(u.function_space.mesh, ("Lagrange", 2, (len(INTEGRANDS),)))
    integrands = ufl.as_vector([make(u, _constant(u)) for make in INTEGRANDS.values()])
    form = ufl.dot(integrands, ufl.TestFunction(space)) * ufl.dx
    many = compiled(form)
    assert _many(many)
    exact = fem.assemble_vector(compiled_form(form)).array.reshape(-1, len(INTEGRANDS))
    # one cell at a time, as DOLFINx calls it, too
    for found in (_residual(space, many), fem.assemble_vector(many).array):
        for name, own, right in zip(INTEGRANDS, found.reshape(exact.shape).T, exact.T, strict=True):
            assert np.isfinite(right).all(), name
            assert np.abs(own - right).max() < ROUND_OFF * np.abs(right).max(), name


def test_what_programs_lack_has_kernels_of_one_cell():
    u = _field(LANES + 1)
    form = compiled(ufl.bessel_J(1, u) * ufl.TestFunction(u.function_space) * ufl.dx)
    assert not _many(form)
    _same(_residual(u.function_space, form), fem.assemble_vector(form).array)


class _Cells(MeshGeometry):
    """The cells with one field, as `MeshCells` of a system has them."""

    def __init__(self, space: fem.FunctionSpace) -> None:
        super().__init__(space.mesh)
        self.dofs = cell_dofs(space)
        self.size = self.dofs.shape[1]
        self.places = [np.arange(self.size, dtype=np.int32)]

    def struct(self, loop: FormLoop, **more: Any) -> Any:
        return super().struct(loop, size=self.size, dofs=loop.pointer(self.dofs))


def _residual(space: fem.FunctionSpace, *forms: fem.Form) -> Any:
    cells: Any = _Cells(space)
    found = np.zeros(len(fem.Function(space).x.array))
    LoopResiduals([(cells, [(form, (0,), -1) for form in forms])]).add(found)
    return found


def test_forms_of_the_same_rows_add_up():
    u = _field(LANES + 2)
    v = ufl.TestFunction(u.function_space)
    forms = [
        u * v * ufl.dx,
        u * v * ufl.ds,
        u**2 * v.dx(0) * ufl.dx,
        ufl.bessel_J(1, u) * v * ufl.dx,
    ]
    exact = sum(fem.assemble_vector(compiled(form)).array for form in forms)
    _same(_residual(u.function_space, *map(compiled, forms)), exact)


@pytest.mark.parametrize("cells", sorted({1, LANES - 1, LANES, LANES + 1, 3 * LANES + 2} - {0}))
@pytest.mark.parametrize("cell", [mesh.CellType.quadrilateral, mesh.CellType.triangle])
def test_any_number_of_cells(cells: int, cell: mesh.CellType):
    u = _field(cells, cell)
    c = _constant(u)
    energy = u**3 * ufl.dx + c * ufl.inner(ufl.grad(u), ufl.grad(u)) * ufl.dx + u**2 * ufl.ds
    residual = ufl.derivative(energy, u)
    exact = fem.assemble_vector(compiled(residual)).array
    _same(_residual(u.function_space, compiled(residual)), exact)
    value = fem.assemble_scalar(compiled(energy))
    # the second one finds what the first one left
    functional = functionals([[energy], [energy]], MPI.COMM_SELF)
    _same(functional(), value)
    _same(functional(), value)
    # beside a sum of two forms, three numbers of one
    densities = u, u**2, ufl.exp(u)
    axes = vector_of(u.function_space.mesh, len(densities))
    vector = ufl.dot(ufl.as_vector(densities), axes) * ufl.dx
    exact = [fem.assemble_scalar(compiled(f * ufl.dx)) for f in densities]
    functional = functionals([[energy, energy], [vector, vector]], MPI.COMM_SELF)
    _same(functional() / 2, [value, *exact])


def test_jacobian():
    domain = _field(2 * LANES - 1).function_space.mesh
    # no two cells share a dof, so that the blocks of the whole matrix are those of the cells
    space = fem.functionspace(domain, ("DG", 2))
    u = fem.Function(space)
    u.x.array[:] = np.random.default_rng(4).uniform(1.0, 2.0, len(u.x.array))
    v, du = ufl.TestFunction(space), ufl.TrialFunction(space)
    jacobians = [ufl.exp(u) * du.dx(0) * v * ufl.dx, u * du * v.dx(1) * ufl.dx]
    many = compile_all(jacobians)
    assert all(map(_many, many))
    # one cell at a time
    dense = [fem.assemble_matrix(form).to_dense() for form in many]
    cells, exact = _Cells(space), sum(dense)
    loop = FormLoop(cells, [(form, (0,), 0) for form in many])
    loop.bind(cells)
    ((_, found),) = loop.matrices(cells)
    _same(found, [exact[np.ix_(d, d)] for d in cells.dofs])
    # what is put where others are added: before them, and over whatever was there
    alone = compiled_form(jacobians[0])
    other = [np.ix_(d, d) for d in cells.dofs[LANES:]]
    exact = exact + dense[0]
    assert loop.covered
    for twice in (False, True):
        # the second time rows and columns of two fields are at the same places
        cells.places = [cells.places[0]] * (1 + twice)
        forms = [
            (alone, (0,), 0),
            *((form, (k * twice,), k * twice) for k, form in enumerate(many)),
        ]
        loop = FormLoop(cells, forms)
        assert loop.covered != twice
        last = np.full((LANES, cells.size, cells.size), 1e3)
        loop.bind(cells)
        arguments = *loop.mesh, LANES, 2 * LANES - 1, native.doubles(last)
        native.cells().lib.cell_matrices(*arguments)
        _same(last[:-1], [exact[d] for d in other])


def test_lines_and_single_cells():
    # mechanisms: bodies and joints are cells of lines, a single one of which is evaluated alone
    for cells, many in ((4, True), (1, False)):
        domain = mesh.create_interval(MPI.COMM_SELF, cells, (0.0, 1.0))
        u = fem.Function(fem.functionspace(domain, ("Lagrange", 1)))
        (form,) = compile_all([u * ufl.dx(domain)])
        assert _many(form)
        geometry = MeshGeometry(domain)
        geometry.places = [np.zeros(1, np.int32)]
        assert FormLoop(geometry, [(form, (0,), -1)]).lanes == (LANES if many else 1)


def test_side_by_side():
    table = np.arange(10, dtype=np.int32).reshape(5, 2)
    found = side_by_side(table, 4)
    assert found.flags.c_contiguous and found.ctypes.data % 64 == 0
    np.testing.assert_array_equal(found[0], [[0, 2, 4, 6], [1, 3, 5, 7]])
    np.testing.assert_array_equal(found[1], [[8] * 4, [9] * 4])
    assert side_by_side(table[:0], 4).shape == (0, 2, 4)
    np.testing.assert_array_equal(side_by_side(table, 1)[:, :, 0], table)
