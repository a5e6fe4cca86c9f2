"""The block system on its own: links, fixed dofs, Jacobian, the two Newton solvers, failures."""

from dataclasses import replace
from typing import Any

from mpi4py import MPI

import numpy as np
import pytest
import ufl
from dolfinx import fem, mesh

from shellmb.errors import ConvergenceError
from shellmb.system.assembly.blocks import BlockSystem
from shellmb.system.assembly.fields import Field, Link, Part
from shellmb.system.newton.iteration import Iteration, NewtonSettings
from shellmb.system.newton.solver import NEWTON

N = 6


def line_field(name: str, load: float, links: tuple[Link, ...] = (), **more: Any) -> Field:
    """A nonlinear bar on the unit interval: `(1 + u^2) u' v' - load v`."""
    space = fem.functionspace(mesh.create_unit_interval(MPI.COMM_WORLD, N), ("Lagrange", 1))
    u, v = fem.Function(space, name=name), ufl.TestFunction(space)
    f = fem.Constant(space.mesh, load)
    residual = ((1 + u**2) * u.dx(0) * v.dx(0) - f * v) * ufl.dx
    dofs = np.arange(len(u.x.array), dtype=np.int32)
    part = Part(name, dofs, 1.0, f"another {name}")
    return Field(name, u, (residual,), (part,), links=links, **more)


def at(field: Field, x: float) -> np.ndarray:
    space = field.function.function_space
    return fem.locate_dofs_geometrical(space, lambda p: np.isclose(p[0], x)).astype(np.int32)


def chain(load: float = 1.0) -> list[Field]:
    """Two bars, the end of the first being the start of the second; the first's start is held."""
    first = line_field("first", load)
    first = replace(first, fixed=at(first, 0.0), values=np.array([0.2]))
    second = line_field("second", load)
    link = Link(at(second, 0.0), 0, at(first, 1.0).astype(np.int64))
    return [first, replace(second, links=(link,))]


def solve(fields: list[Field], kind: str = "newton", **settings: Any) -> BlockSystem:
    system = BlockSystem(MPI.COMM_WORLD, fields)
    iteration = Iteration(system, NewtonSettings(**settings), f"test_{kind}_{id(system)}_")
    NEWTON[kind](iteration).solve()
    return system


def test_linked_dofs_are_numbered_once() -> None:
    fields = chain()
    system = BlockSystem(MPI.COMM_WORLD, fields)
    assert system.size == 2 * (N + 1) - 1
    numbers = system.numbering.by_field
    assert numbers[1][at(fields[1], 0.0)] == numbers[0][at(fields[0], 1.0)]


def test_a_link_to_a_dof_that_is_linked_itself_is_refused() -> None:
    first, second = chain()
    third = line_field("third", 1.0)
    to_first = Link(at(third, 0.0), 0, at(first, 1.0).astype(np.int64))
    # the second bar's start is the third's, which is the first's end
    to_third = Link(at(second, 0.0), 2, at(third, 0.0).astype(np.int64))
    fields = [first, replace(second, links=(to_third,)), replace(third, links=(to_first,))]
    with pytest.raises(ValueError, match="linked itself"):
        BlockSystem(MPI.COMM_WORLD, fields)


@pytest.mark.parametrize("kind", NEWTON)
def test_two_linked_bars_are_one_of_twice_the_length(kind: str) -> None:
    fields = chain()
    solve(fields, kind, tolerance=1e-12)
    # Kirchhoff's transformation: w = u + u^3/3 has w'' = -1, and w' = 0 at the free end x = 2
    x = fields[1].function.function_space.tabulate_dof_coordinates()[:, 0] + 1
    w = 0.2 + 0.2**3 / 3 + 2 * x - x**2 / 2
    u = fields[1].function.x.array
    # linear elements of 1/6
    np.testing.assert_allclose(u + u**3 / 3, w, rtol=5e-3)
    assert fields[1].function.x.array[at(fields[1], 0.0)] == pytest.approx(
        fields[0].function.x.array[at(fields[0], 1.0)], abs=0
    )


def test_a_dof_is_fixed_on_whatever_field_it_is_named() -> None:
    by_first, by_second = chain(), chain()
    by_first[0].fixed = np.append(by_first[0].fixed, at(by_first[0], 1.0)).astype(np.int32)
    by_first[0].values = np.array([0.2, 0.7])
    by_second[1].fixed, by_second[1].values = at(by_second[1], 0.0), np.array([0.7])
    for fields in (by_first, by_second):
        system = solve(fields)
        assert len(system.fixed) == 2
        assert fields[0].function.x.array[at(fields[0], 1.0)] == pytest.approx(0.7, abs=1e-14)
    for a, b in zip(by_first, by_second, strict=True):
        np.testing.assert_allclose(a.function.x.array, b.function.x.array, atol=1e-14)


def test_reactions_balance_the_loads() -> None:
    system = solve(chain(load=0.5), tolerance=1e-12)
    assert len(system.reactions) == 1
    # both bars are pulled by 0.5 along their unit lengths
    assert system.reactions[0] == pytest.approx(-1.0, rel=1e-12)


def test_jacobian_is_the_derivative_of_the_residual() -> None:
    fields = chain()
    system = BlockSystem(MPI.COMM_WORLD, fields)
    system.update_fixed_values()
    random = np.random.default_rng(5)
    x, dx = random.normal(size=(2, system.size))

    def residual(values: np.ndarray) -> np.ndarray:
        system.x.array[:] = values
        system.scatter(system.x)
        system.residual(system.x, system.b)
        return system.b.array.copy()

    h = 1e-5
    difference = (residual(x + h * dx) - residual(x - h * dx)) / (2 * h)
    residual(x)
    system.jacobian(system.x, system.A)
    direction, product = system.x.duplicate(), system.x.duplicate()
    direction.array[:] = dx
    system.A.mult(direction, product)
    np.testing.assert_allclose(product.array, difference, rtol=1e-7, atol=1e-7)


def test_both_solvers_find_the_same() -> None:
    results = []
    for kind in NEWTON:
        fields = chain()
        solve(fields, kind, tolerance=1e-10)
        results.append(np.concatenate([f.function.x.array for f in fields]))
    np.testing.assert_allclose(results[0], results[1], rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("kind", NEWTON)
def test_a_failure_names_the_field_and_what_to_try(kind: str) -> None:
    with pytest.raises(ConvergenceError, match="too many iterations; the first did not") as caught:
        first, second = chain()
        second = replace(second, parts=(replace(second.parts[0], scale=1e9),))
        solve([first, second], kind, max_iterations=2)
    assert "try another first" in str(caught.value)
    assert caught.value.field == "first"
    assert set(caught.value.norms) == {"first", "second"}


@pytest.mark.parametrize("kind", NEWTON)
def test_a_singular_system_says_so(kind: str) -> None:
    free = line_field("free", 1.0)
    # nothing depends on this field at all: its rows are zero
    v = ufl.TestFunction(free.function.function_space)
    free.residual = (
        free.function * fem.Constant(free.function.function_space.mesh, 0.0) * v * ufl.dx,
    )
    with pytest.raises(ConvergenceError, match="singular"):
        solve([free], kind)


@pytest.mark.parametrize("kind", NEWTON)
def test_divergence_is_told_from_slow_convergence(kind: str) -> None:
    fields = chain(load=1e6)
    fields[0] = replace(fields[0], parts=(replace(fields[0].parts[0], bound=10.0),))
    with pytest.raises(ConvergenceError, match="diverged"):
        solve(fields, kind)
