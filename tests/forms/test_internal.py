"""Internal virtual work: tangents, potentials, frame indifference, exact work over an interval."""

from typing import Any

import numpy as np
import pytest
import ufl
from dolfinx import fem

from shellmb.forms.steps.mixed import Interval
from shellmb.model.body import strain_energy
from shellmb.schemes.base import at_state, interval
from shellmb.schemes.residuals.residual import interval_forces, jump_energy
from tests.forms.conftest import compiled, tie_of_strains

# central differences of step H: error H^2 of the third derivative, plus eps/H of round-off
H = 1e-6
FD = 1e-7
BETA = 0.6


def work(sample: Any, kind: str) -> tuple[str, Any]:
    """Virtual work in the direction `v`, of a single state or over an interval."""
    b, v = sample.b, sample.v
    if kind == "state":
        return kind, lambda: interval_forces(sample.body, at_state(b), v)
    # the kernel of the interval with a jump serves without one: beta is a Constant
    if "beta" not in vars(sample):
        sample.beta = fem.Constant(b.function_space.mesh, BETA)
    sample.beta.value = 0.0 if kind == "interval, no jump" else BETA
    return "interval", lambda: interval_forces(sample.body, interval(sample.a, b, sample.beta), v)


@pytest.mark.parametrize("kind", ["state", "interval"])
def test_tangent_is_the_derivative_of_the_residual(panel, kind, rng, turn) -> None:
    name, make = work(panel, kind)
    for size, Q in ((0.01, None), (0.05, turn(rng))):
        panel.randomise(panel.a, rng, size, Q)
        panel.randomise(panel.b, rng, size, Q)
        panel.noise(panel.v, rng)
        panel.noise(panel.dq, rng)
        tangent = panel.value(f"{name} tangent", lambda: ufl.derivative(make(), panel.b, panel.dq))
        centre = panel.b.x.array.copy()
        ends = []
        for sign in (1, -1):
            panel.b.x.array[:] = centre + sign * H * panel.dq.x.array
            ends.append(panel.value(name, make))
        scale = max(abs(tangent), *map(abs, ends))
        assert abs((ends[0] - ends[1]) / (2 * H) - tangent) < FD * max(1.0, scale)


def potential(sample: Any) -> ufl.Form:
    """What the virtual work of a single state is the derivative of."""
    body, q = sample.body, sample.b
    W = strain_energy(body, q)
    D, w = body.director, body.layout.part(q, "w")
    constraint = (ufl.dot(D + w, D + w) - 1) / 2
    W += body.section.force * body.layout.part(q, "lam") * constraint * body.rules.nodes
    for tie in body.ties:
        held = ufl.dot(body.layout.part(q, "hold"), tie.constraints(q))
        W += body.section.force * held * body.rules.full
    if "S" in body.layout.parts:
        # forces tie strains of the elements to those of the displacements
        W += tie_of_strains(body, q)
    return W


def test_work_of_a_state_is_the_derivative_of_the_energy(panel, rng, turn) -> None:
    name, make = work(panel, "state")
    for size, Q in ((0.01, None), (0.05, turn(rng))):
        panel.randomise(panel.b, rng, size, Q)
        panel.noise(panel.v, rng)
        found = panel.value(name, make)
        expected = panel.value(
            "potential", lambda: ufl.derivative(potential(panel), panel.b, panel.v)
        )
        assert found == pytest.approx(expected, rel=1e-11)


def strains_at_points(panel: Any) -> np.ndarray:
    """The eight strains at the four corners of a square inside each cell."""
    points = np.array([[0.2, 0.2], [0.6, 0.2], [0.2, 0.6], [0.3, 0.3]])
    expression = fem.Expression(panel.body.strain.value(panel.b), points)
    cells = np.arange(panel.body.surface_mesh.mesh.topology.index_map(2).size_local)
    return expression.eval(panel.body.surface_mesh.mesh, cells.astype(np.int32))


def test_a_rigid_motion_changes_neither_strains_nor_energy(panel, rng, turn) -> None:
    panel.randomise(panel.b, rng, 0.05)
    energy = panel.value("energy", lambda: strain_energy(panel.body, panel.b))
    strains = strains_at_points(panel)
    panel.move_rigidly(panel.b, turn(rng), rng.normal(size=3))
    # round-off of displacements of order one against strains of order 0.1
    np.testing.assert_allclose(strains_at_points(panel), strains, atol=1e-13)
    moved = panel.value("energy", lambda: strain_energy(panel.body, panel.b))
    assert moved == pytest.approx(energy, rel=1e-12)


def test_a_rigid_motion_of_the_reference_has_no_strain(panel, rng, turn) -> None:
    panel.b.x.array[:] = 0.0
    panel.move_rigidly(panel.b, turn(rng), rng.normal(size=3))
    np.testing.assert_allclose(strains_at_points(panel), 0, atol=3e-13)
    energy = panel.value("energy", lambda: strain_energy(panel.body, panel.b))
    # round-off of strain energies that do not vanish term by term, in sums of any order
    assert abs(energy) < 1e-18


def satisfy_compatibility(panel: Any, q: fem.Function) -> None:
    """Set the element-wise parts so that the compatibility equations hold: N (linear) or S."""
    if panel.body.ties:
        # nothing holds these frames to the body
        q.x.array[panel.body.mixed.dofs["hold"]] = 0.0
    mixed = panel.body.mixed
    # of nonlinear sections forces are means, and none of a state
    parts, tests = (mixed.stresses,) * 2 if mixed.stresses else (("S",), ("N",))
    dofs, rows = (np.concatenate([mixed.dofs[p] for p in names]) for names in (parts, tests))
    space = mixed.space
    residual = interval_forces(panel.body, at_state(q), ufl.TestFunction(space))
    key = f"compatibility of {q.name}"
    if key not in panel.compiled:
        panel.compiled[key] = compiled(residual)
    # linear in the part and element-wise: columns by unit increments, one component at a time
    form = panel.compiled[key]
    q.x.array[dofs] = 0.0
    rest = fem.assemble_vector(form).array[rows]
    matrix = np.empty((len(dofs), len(dofs)))
    for k, dof in enumerate(dofs):
        q.x.array[dof] = 1.0
        matrix[:, k] = fem.assemble_vector(form).array[rows] - rest
        q.x.array[dof] = 0.0
    q.x.array[dofs] = np.linalg.solve(matrix, -rest)


def test_work_over_an_interval_is_the_change_of_energy(panel, rng, turn) -> None:
    """Eqs. (18)-(22): for any two states with compatible resultants and unit directors."""
    Q = turn(rng)
    panel.randomise(panel.a, rng, 0.05)
    panel.randomise(panel.b, rng, 0.08, Q)
    panel.a.name, panel.b.name = "a", "b"
    energies = []
    for q in (panel.a, panel.b):
        satisfy_compatibility(panel, q)
        energies.append(
            panel.value(f"energy of {q.name}", lambda q=q: strain_energy(panel.body, q))
        )
    panel.v.x.array[:] = panel.b.x.array - panel.a.x.array
    done = panel.value(*work(panel, "interval, no jump"))
    assert done == pytest.approx(energies[1] - energies[0], rel=1e-11)


def test_the_jump_term_does_the_work_that_is_dissipated(panel, rng) -> None:
    """With beta, eq. (32), the work grows by beta times the elastic part of `c^2`, eq. (34)."""
    panel.randomise(panel.a, rng, 0.05)
    panel.randomise(panel.b, rng, 0.08)
    panel.a.name, panel.b.name = "a", "b"
    for q in (panel.a, panel.b):
        satisfy_compatibility(panel, q)
    panel.v.x.array[:] = panel.b.x.array - panel.a.x.array
    with_jump = panel.value(*work(panel, "interval"))
    without = panel.value(*work(panel, "interval, no jump"))
    lost = panel.value("jump", lambda: jump_energy(panel.body, panel.a, panel.b))
    assert lost > 0
    assert with_jump - without == pytest.approx(BETA * lost, rel=1e-10)


def test_an_interval_of_length_zero_is_a_state(panel, rng) -> None:
    panel.randomise(panel.b, rng, 0.05)
    panel.a.x.array[:] = panel.b.x.array
    panel.noise(panel.v, rng)
    state = panel.value(*work(panel, "state"))
    assert panel.value(*work(panel, "interval")) == pytest.approx(state, rel=1e-12)


def test_the_interval_carries_all_it_says() -> None:
    assert Interval._fields == ("a", "b", "mid", "unknown", "beta", "end")
