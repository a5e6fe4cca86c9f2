"""Integrands as programs: what is read off any UFL is what FFCx compiles, and runs are the same."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from mpi4py import MPI  # before dolfinx

import basix
import basix.ufl
import numpy as np
import pytest
import ufl
from dolfinx import fem, mesh

from shellmb.demos import sudden_load
from shellmb.native import kernels
from shellmb.native.expressions import values_in_cells
from shellmb.native.kernels import compiled
from shellmb.simulate.simulation import Simulation
from shellmb.system.assembly.functionals import DolfinxResiduals
from tests.golden import runs
from tests.golden.test_golden import bound

RANDOM = np.random.default_rng(5)
# sums of some hundred terms, in another order
BOUND = 1e-12
QUICK = ("shell ed", "triangles ep", "joint ed", "chain ep4", "hyperelastic ep", "modal ep")


def surface(cell: mesh.CellType) -> mesh.Mesh:
    """A bent surface in space, whose cells differ."""
    flat = mesh.create_unit_square(MPI.COMM_SELF, 2, 2, cell)
    x = flat.geometry.x
    nodes = x.copy()
    nodes[:, 2] = 0.3 * x[:, 0] ** 2 + 0.1 * x[:, 0] * x[:, 1]
    nodes[:, :2] += 0.05 * RANDOM.normal(size=(len(x), 2))
    name = "quadrilateral" if cell == mesh.CellType.quadrilateral else "triangle"
    element = basix.ufl.element("Lagrange", name, 1, shape=(3,))
    return mesh.create_mesh(MPI.COMM_SELF, flat.geometry.dofmaps[0], element, nodes)


def functions(domain: mesh.Mesh) -> tuple[fem.Function, fem.Function, fem.Constant]:
    name = domain.ufl_cell().cellname
    parts = [
        basix.ufl.element("Lagrange", name, 2, shape=(3,)),
        basix.ufl.element("Lagrange", name, 1, shape=(2,), discontinuous=True),
        basix.ufl.element("Lagrange", name, 2),
    ]
    q = fem.Function(fem.functionspace(domain, basix.ufl.mixed_element(parts)))
    h = fem.Function(fem.functionspace(domain, ("DG", 0)))
    for f in (q, h):
        f.x.array[:] = RANDOM.uniform(0.2, 1.0, len(f.x.array))
    return q, h, fem.Constant(domain, RANDOM.uniform(0.2, 1.0, (2, 2)))


def integrands(q: fem.Function, h: fem.Function, c: fem.Constant) -> dict[str, ufl.core.expr.Expr]:
    u, N, lam = ufl.split(q)
    F = ufl.grad(u)
    C = F.T * F
    e = ufl.variable(ufl.as_vector([C[0, 0] - 1, C[1, 1] - 1, C[0, 1]]))
    psi = (c[0, 0] * ufl.dot(e, e) ** 2 + ufl.exp(-(e[0] ** 2)) + ufl.sqrt(1 + e[1] ** 2)) * h
    A = ufl.as_matrix([[2 + u[0], u[1]], [u[2], 3 + lam]])
    i, j = ufl.indices(2)
    return {
        "potential and its stress": psi + ufl.dot(ufl.diff(psi, e), e),
        "second derivatives": ufl.inner(ufl.grad(F[0, 1]), ufl.grad(lam)),
        "matrices": ufl.det(A) + ufl.tr(ufl.inv(A)) + ufl.inner(A, ufl.sym(A * A.T)),
        "indices": A[i, j] * c[j, i] + ufl.outer(u, u)[0, 1] + ufl.cross(u, F[:, 0])[2],
        "choices": ufl.conditional(ufl.lt(u[0], u[1]), u[0] ** 3, lam) + ufl.max_value(u[2], lam)
        + ufl.min_value(N[0], N[1]) + abs(u[0] - u[1]),
        "functions": ufl.sin(u[0]) * ufl.cos(u[1]) + ufl.atan2(u[1], u[2]) + ufl.ln(lam)
        + ufl.tanh(N[0]) + ufl.asin(0.5 * u[0]) + ufl.acos(0.5 * u[0]) + ufl.tan(u[1])
        + ufl.erf(u[2]) + u[1] ** 2.5 + ufl.sinh(N[1]) / ufl.cosh(u[2]),
        "places": ufl.dot(ufl.SpatialCoordinate(q.function_space.mesh), u) * lam,
    }  # fmt: skip


def tensors(form: fem.Form) -> np.ndarray:
    if form.rank == 0:
        return np.array([fem.assemble_scalar(form)])
    if form.rank == 1:
        return fem.assemble_vector(form).array
    return fem.assemble_matrix(form).to_dense()


@pytest.mark.parametrize("cell", [mesh.CellType.quadrilateral, mesh.CellType.triangle])
def test_any_integrand_is_what_ffcx_compiles(cell: mesh.CellType) -> None:
    """Kind: all of UFL that bodies and users write, over cells and facets, with derivatives."""
    domain = surface(cell)
    q, h, c = functions(domain)
    domain.topology.create_connectivity(1, 2)
    facets = mesh.exterior_facet_indices(domain.topology)
    tags = mesh.meshtags(domain, 1, facets, (np.arange(len(facets)) % 2).astype(np.int32))
    ds = ufl.Measure("ds", domain, subdomain_data=tags)
    normal = ufl.FacetNormal(domain)
    every = sum(integrands(q, h, c).values())
    energy = every * ufl.dx(degree=3)
    energy += ufl.dot(normal, ufl.split(q)[0]) ** 3 * ds(0, degree=4)
    energy += h * ufl.split(q)[2] * ds(1, degree=2)
    slope = ufl.derivative(energy, q)
    for form in (energy, slope, ufl.derivative(slope, q)):
        reference = tensors(fem.form(form))
        found = tensors(compiled(form))
        assert np.abs(found - reference).max() < BOUND * np.abs(reference).max()


def custom(cell: mesh.CellType, modes: list[tuple[int, int]], size: int) -> Any:
    """A discontinuous element of one's own: polynomials of the cell's set in components.

    Args:
        cell: The cell.
        modes: Component and polynomial of each function.
        size: Number of components; none of a scalar.
    """
    kind, degree = basix.CellType[cell.name], 1
    wide = max(size, 1)
    points, weights = basix.make_quadrature(kind, 4)
    table = basix.tabulate_polynomials(basix.PolynomialType.legendre, kind, degree, points)
    polynomials = len(table)
    coefficients = np.zeros((len(modes), wide * polynomials))
    moments = np.zeros((len(modes), wide, len(points), 1))
    for k, (component, polynomial) in enumerate(modes):
        coefficients[k, component * polynomials + polynomial] = 1.0
        moments[k, component, :, 0] = table[polynomial] * weights
    none, counts = np.zeros((0, 2)), [len(own) for own in basix.topology(kind)]
    return basix.ufl.custom_element(
        kind,
        (size,) if size else (),
        coefficients,
        [[none] * counts[0], [none] * counts[1], [points], []],
        [
            [np.zeros((0, wide, 0, 1))] * counts[0],
            [np.zeros((0, wide, 0, 1))] * counts[1],
            [moments],
            [],
        ],
        0,
        basix.MapType.identity,
        basix.SobolevSpace.L2,
        True,
        0,
        1,
    )


@pytest.mark.parametrize("cell", [mesh.CellType.quadrilateral, mesh.CellType.triangle])
def test_elements_and_rules_of_ones_own(cell: mesh.CellType) -> None:
    """Kind: mixed spaces with elements of one's own, scalars and vectors, and several rules."""
    domain = surface(cell)
    name = domain.ufl_cell().cellname
    stress = [(0, 0), (1, 0), (2, 0), (0, 1), (1, 2)]
    parts = [
        basix.ufl.element("Lagrange", name, 1, shape=(3,)),
        custom(cell, stress, 3),
        basix.ufl.blocked_element(custom(cell, [(0, 0), (0, 2)], 0), shape=(2,)),
        custom(cell, [(0, 1)], 0),
        basix.ufl.element("DG", name, 0, shape=(2,)),
    ]
    q = fem.Function(fem.functionspace(domain, basix.ufl.mixed_element(parts)))
    alone = fem.Function(fem.functionspace(domain, parts[1]))
    h = fem.Function(fem.functionspace(domain, ("DG", 0, (2,))))
    for f in (q, alone, h):
        f.x.array[:] = RANDOM.uniform(0.2, 1.0, len(f.x.array))
    u, S, a, b, m = ufl.split(q)
    F = ufl.grad(u)
    e = ufl.as_vector([F[0, 0], F[1, 1], F[0, 1] + F[1, 0] + a[0] * b])
    first = ufl.dot(S, e) + h[0] * ufl.dot(S, S) * b + ufl.sin(m[0]) * ufl.dot(u, u)
    second = h[1] * ufl.inner(F, F) ** 2 + ufl.dot(alone, S) * a[1] + m[1] * F[2, 0] ** 2
    third = ufl.inner(ufl.grad(S), ufl.grad(S)) + ufl.dot(S, S) ** 2 + ufl.grad(b)[0] * u[1]
    energy, random = b * ufl.dx(degree=1), np.random.default_rng(7)
    for number, integrand in enumerate((first, second, third)):
        # the same in each run of the test: FFCx compiles them
        places = random.uniform(0.1, 0.4, (2 + number, 2))
        weights = random.uniform(0.1, 0.3, len(places))
        rule = {"quadrature_rule": "custom", "quadrature_points": places}
        energy += integrand * ufl.dx(metadata=rule | {"quadrature_weights": weights})
    slope = ufl.derivative(energy, q)
    for form in (energy, slope, ufl.derivative(slope, q), ufl.derivative(slope, alone)):
        reference = tensors(fem.form(form))
        found = tensors(compiled(form))
        assert np.abs(found - reference).max() < BOUND * np.abs(reference).max()


def test_expressions_at_points(cell: mesh.CellType = mesh.CellType.quadrilateral) -> None:
    domain = surface(cell)
    q, h, c = functions(domain)
    values = ufl.as_vector([*integrands(q, h, c).values(), ufl.as_ufl(0.0)])
    points = RANDOM.uniform(0.1, 0.4, (5, 2))
    cells = np.arange(4, dtype=np.int32)
    reference = fem.Expression(values, points).eval(domain, cells)
    found = values_in_cells(values, points, domain)().reshape(reference.shape)
    np.testing.assert_allclose(found, reference, rtol=BOUND, atol=BOUND * np.abs(reference).max())


@pytest.fixture
def no_compiler(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Nothing is compiled or taken from the cache."""

    def shut(*_: object, **__: object) -> None:
        raise AssertionError("a kernel is asked for")

    monkeypatch.setattr("dolfinx.jit.ffcx_jit", shut)
    monkeypatch.setattr(kernels, "compiled_form", shut)
    yield


@pytest.mark.parametrize(
    "name",
    [*QUICK, *(pytest.param(n, marks=pytest.mark.slow) for n in runs.STORED if n not in QUICK)],
)
def test_golden_runs_need_no_kernel(name: str, no_compiler: None) -> None:
    """Kind: every scheme with every kind of body, and all that is made of runs."""
    apart = runs.differences(runs.history(name), runs.frozen()[name])
    worst = max(apart, key=apart.__getitem__)
    assert apart[worst] < bound(name), worst


@pytest.mark.parametrize("scheme", ["ep", "ed3"])
def test_what_is_kept_follows_from_what_it_depends_on(scheme: str) -> None:
    """Kind: functions, constants and unknowns that change between two calls, alone and at once."""
    made = sudden_load.scene()
    (shell,) = made.shells
    made = replace(
        made,
        shells=replace(shell, mesh=(3, 1)),
        scheme=scheme,
    )
    simulation = Simulation(made, MPI.COMM_SELF)
    system, random = simulation.problem.system, np.random.default_rng(3)
    # nothing is kept where DOLFINx calls the programs
    offsets = system.numbering.offsets.tolist()
    plain = DolfinxResiduals(system.residual_forms, system.fields, offsets)
    functions = {f for form in system.forms for f in form.coefficients()}
    constants = {c for form in system.forms for c in form.constants()}
    arrays = [f.x.array for f in sorted(functions, key=lambda f: f.count())]
    arrays += [c.value.reshape(-1) for c in sorted(constants, key=lambda c: c.count())]
    for changed in ([], arrays, *([array] for array in arrays), [], arrays):
        for array in changed:
            array *= random.uniform(0.9, 1.1, len(array))
        found, expected = np.zeros((2, len(system.exchange.wanted)))
        for residuals, local in ((system.residuals, found), (plain, expected)):
            residuals.refresh()
            residuals.add(local)
        assert np.abs(found - expected).max() < BOUND * np.abs(expected).max()


def test_what_programs_lack_is_compiled() -> None:
    """Integrals over interior facets."""
    domain = surface(mesh.CellType.triangle)
    q, _, _ = functions(domain)
    form = ufl.jump(ufl.split(q)[2]) ** 2 * ufl.dS
    found = tensors(compiled(form))
    np.testing.assert_allclose(found, tensors(fem.form(form)))
