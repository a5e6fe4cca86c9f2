"""What one process does by loops in C is what several do with messages."""

from mpi4py import MPI  # noqa: F401  (before dolfinx)

import numpy as np
import pytest

from shellmb.native import library as native
from shellmb.scene import Clamped, EdgeForce, Isotropic, Rectangle, Scene, Shell
from shellmb.simulate.simulation import Simulation
from shellmb.system.condensation.reduction import Reduction
from shellmb.system.direct.solver import Purpose
from shellmb.system.nullspace.directornodes import TURN
from shellmb.system.nullspace.directors import constraint, pseudo_inverse, violation

# differences are those of sums in another order
ROUND_OFF = 1e-12


@pytest.fixture(scope="module", params=["ep", "ed"])
def simulation(request) -> Simulation:
    """A plate after two steps."""
    section = Isotropic(E=1e7, nu=0.3, thickness=0.01, density=1e3)
    shell = Shell("plate", Rectangle(1.0, 0.5), section, mesh=(2, 1))
    scene = Scene(
        "plate",
        shell,
        supports=Clamped("left"),
        loads=EdgeForce("right", (0, 0, 10.0)),
        scheme=request.param,
        dt=0.01,
        t_end=1.0,
    )
    made = Simulation(scene)
    for _ in range(2):
        made.advance()
    return made


def some(size: int) -> np.ndarray:
    return np.random.default_rng(size).normal(size=size)


@pytest.mark.parametrize("loaded", [False, True])
def test_a_solution_at_once(simulation, loaded) -> None:
    """Both passes with PETSc's solution between them are the three, one after the other."""
    iteration = simulation.problem.iteration
    reduction, system = iteration.linear, simulation.problem.system
    assert isinstance(reduction, Reduction) and reduction._at_once is not None
    assert reduction.factorise(Purpose.LAGGED) is None and reduction.solver.direct
    b, dx = system.b.duplicate(), system.x.duplicate()
    b.array[:] = some(len(b.array_r))
    local = len(reduction.numbers.full.wanted)
    load, given = (some(local), 1e-3 * some(local)) if loaded else (None, np.zeros(local))
    assert reduction._at_once.solve(reduction.solver.made, b, load, given, dx)[0] == 0
    parts, rhs, solution = np.zeros(len(dx.array_r)), *reduction.A.createVecs()[::-1]
    reduction._passes.before(b.array_r, load, rhs.array)
    reduction.solver._ksp.solve(rhs, solution)
    reduction._passes.after(solution.array_r, given, parts)
    assert np.abs(dx.array_r - parts).max() <= ROUND_OFF * np.abs(parts).max() > 0


def test_a_residual_at_once(simulation) -> None:
    """Fields take the unknowns, and what follows them does, too."""
    system, found = simulation.problem.system, []
    x, start = system.x.copy(), system.x.copy()
    x.array[:] += 1e-3 * some(len(x.array_r))
    once = system.evaluation
    assert once is not None
    try:
        for system.evaluation in (once, None):
            system.evaluate(start, system.b)
            system.evaluate(x, system.b)
            values = [field.function.x.array.copy() for field in system.fields]
            found.append([system.b.array_r.copy(), system.reactions.copy(), *values])
    finally:
        system.evaluation = once
        system.evaluate(start, system.b)
    for one, other in zip(*found, strict=True):
        assert np.array_equal(one, other) and one.any()


@pytest.mark.parametrize("k", [1, 3])
def test_violations_of_directors(k) -> None:
    """Of nodes that count, the largest; what is no number wins."""
    lib = native.cells().lib
    reference, values = np.tile(np.eye(3)[:k].ravel(), (4, 1)), 0.1 * some(12 * k)
    dofs, counts = np.arange(12 * k).reshape(4, 3 * k), np.array([1, 0, 1, 1], dtype=np.uint8)
    expected = np.abs(violation(reference + values.reshape(4, -1))).max(axis=1)
    pointers, back = [native.longs(dofs)], np.ones((4, 3 * k))
    pointers += map(native.doubles, (reference, values))
    arguments = 4, k, *pointers, native.bytes_of(counts), 1e-13, native.doubles(back)
    assert lib.violation(*arguments) == pytest.approx(max(expected[[0, 2, 3]]), rel=1e-14)
    d = (reference + values.reshape(4, -1))[[0, 2, 3]]
    nearer = -np.einsum("nic,nc->ni", pseudo_inverse(constraint(d)), violation(d))
    assert back[[0, 2, 3]] == pytest.approx(nearer, rel=1e-12, abs=1e-14)
    assert not back[1].any()
    values[6 * k] = np.nan
    assert np.isnan(lib.violation(*arguments))


@pytest.mark.parametrize("size", [1e-3, 1.0])
def test_turning_nodes(simulation, size) -> None:
    """Small updates turn directors; large ones are taken as they are."""
    nodes, system = simulation.problem.iteration.nodes, simulation.problem.system
    x, found = system.x.copy(), []
    change = size * some(len(x.array_r))
    loops = nodes._loops
    assert loops
    try:
        for way in (loops, None):
            nodes._loops = way
            for of_field in nodes.sets.values():
                of_field.settled = True
            dx = x.duplicate()
            dx.array[:] = change
            nodes.turn(x, dx)
            near = x.copy()
            near.array[:] += 1e-2 * change
            nodes.normalise(near)
            settled = [of_field.settled for of_field in nodes.sets.values()]
            found.append((dx.array_r.copy(), near.array_r.copy(), settled))
    finally:
        nodes._loops = loops
    for serial, parallel in zip(*found, strict=True):
        assert np.allclose(serial, parallel, rtol=0.0, atol=1e-14)
    turned = np.abs(found[0][0] - change).max() > 1e-8
    assert turned == (size < TURN)
    assert found[0][2] == [turned] * len(nodes.sets)


@pytest.mark.parametrize("size", [1e200, np.inf])
def test_updates_far_away_say_nothing(simulation, size) -> None:
    """Of such without squares nothing is told, which one rank alone might: iterations diverge."""
    nodes, x = simulation.problem.iteration.nodes, simulation.problem.system.x.copy()
    loops, found = nodes._loops, []
    try:
        for nodes._loops in (loops, None):
            dx = x.duplicate()
            dx.array[:] = size
            nodes.turn(x, dx)
            found.append(dx.array_r.copy())
    finally:
        nodes._loops = loops
    np.testing.assert_array_equal(*found)


def test_bases_of_directors(simulation) -> None:
    """At a state that moves: what constraints do not see, and nothing of nodes that are held."""
    nodes, fields = simulation.problem.iteration.nodes, simulation.problem.system.fields
    assert any(of_field.held.any() for of_field in nodes.sets.values())
    for of_field in nodes.sets.values():
        of_field.renew(fields)
        right, left, forces, *_ = of_field.made
        free, C = ~of_field.held, constraint(of_field.mean(fields))
        for basis, rows in ((right, constraint(of_field.at(fields))), (left, C)):
            assert np.allclose((rows @ basis)[free], 0.0, atol=1e-13)
            assert np.allclose(np.linalg.matrix_rank(basis[free]), of_field.size)
        assert np.allclose((C @ forces)[free], np.eye(C.shape[1]), atol=1e-13)
        assert not any(basis[of_field.held].any() for basis in (right, left, forces))
