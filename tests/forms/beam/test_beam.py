"""Beams: strains, virtual work, exact work over an interval."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import ufl
from dolfinx import fem

from shellmb.forms import frame
from shellmb.model.body import strain_energy
from shellmb.scene import Line
from shellmb.schemes.base import at_state, interval
from shellmb.schemes.residuals.residual import interval_forces, jump_energy
from tests.forms.conftest import compiled

# central differences of step H: error H^2 of the third derivative, plus eps/H of round-off
H = 1e-6
FD = 1e-7
BETA = 0.6


def work(sample: Any, kind: str) -> tuple[str, Callable[[], ufl.Form]]:
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
def test_tangent_is_the_derivative_of_the_residual(beam, kind, rng, turn) -> None:
    name, make = work(beam, kind)
    for size, Q in ((0.01, None), (0.05, turn(rng))):
        beam.randomise(beam.a, rng, size, Q)
        beam.randomise(beam.b, rng, size, Q)
        beam.noise(beam.v, rng)
        beam.noise(beam.dq, rng)
        tangent = beam.value(f"{name} tangent", lambda: ufl.derivative(make(), beam.b, beam.dq))
        centre, ends = beam.b.x.array.copy(), []
        for sign in (1, -1):
            beam.b.x.array[:] = centre + sign * H * beam.dq.x.array
            ends.append(beam.value(name, make))
        scale = max(abs(tangent), *map(abs, ends))
        assert abs((ends[0] - ends[1]) / (2 * H) - tangent) < FD * max(1.0, scale)


def test_work_of_a_state_is_the_derivative_of_the_energy(beam, rng, turn) -> None:
    body, b = beam.body, beam.b

    def potential() -> ufl.Form:
        constraint = frame.orthonormality(body.layout.part(b, "w"), body.frames)
        held = ufl.dot(body.layout.part(b, "lam"), constraint)
        W = strain_energy(body, b) + body.section.force * held * body.rules.nodes
        for tie in body.ties:
            held = ufl.dot(body.layout.part(b, "hold"), tie.constraints(b))
            W += body.section.force * held * body.rules.full
        return W

    name, make = work(beam, "state")
    for size, Q in ((0.01, None), (0.05, turn(rng))):
        beam.randomise(b, rng, size, Q)
        beam.noise(beam.v, rng)
        expected = beam.value("potential", lambda: ufl.derivative(potential(), b, beam.v))
        assert beam.value(name, make) == pytest.approx(expected, rel=1e-11)


def satisfy_compatibility(beam: Any, q: fem.Function) -> None:
    """Set the forces so that their equations hold; these are linear in them."""
    if beam.body.ties:
        # nothing holds these frames to the body
        q.x.array[beam.body.mixed.dofs["hold"]] = 0.0
    rows = beam.body.mixed.dofs["N"]
    key = f"compatibility of {q.name}"
    if key not in beam.compiled:
        test = ufl.TestFunction(beam.body.mixed.space)
        beam.compiled[key] = compiled(interval_forces(beam.body, at_state(q), test))
    form = beam.compiled[key]
    q.x.array[rows] = 0.0
    rest = fem.assemble_vector(form).array[rows]
    matrix = np.empty((len(rows), len(rows)))
    for k, dof in enumerate(rows):
        q.x.array[dof] = 1.0
        matrix[:, k] = fem.assemble_vector(form).array[rows] - rest
        q.x.array[dof] = 0.0
    q.x.array[rows] = np.linalg.solve(matrix, -rest)


def two_states(beam: Any, rng: np.random.Generator, turn: np.ndarray | None) -> None:
    """Two states with compatible forces, orthonormal frames and arbitrary multipliers."""
    beam.randomise(beam.a, rng, 0.05)
    beam.randomise(beam.b, rng, 0.08, turn)
    for q in (beam.a, beam.b):
        satisfy_compatibility(beam, q)
    beam.v.x.array[:] = beam.b.x.array - beam.a.x.array


def test_work_over_an_interval_is_the_change_of_energy(beam, rng, turn) -> None:
    """Eqs. (18)-(22); the multipliers do no work between frames that are orthonormal."""
    two_states(beam, rng, turn(rng))
    energies = [
        beam.value(f"energy of {q.name}", lambda q=q: strain_energy(beam.body, q))
        for q in (beam.a, beam.b)
    ]
    done = beam.value(*work(beam, "interval, no jump"))
    assert done == pytest.approx(energies[1] - energies[0], rel=1e-11)


def test_the_jump_term_does_the_work_that_is_dissipated(beam, rng) -> None:
    two_states(beam, rng, None)
    difference = beam.value(*work(beam, "interval")) - beam.value(*work(beam, "interval, no jump"))
    lost = beam.value("jump", lambda: jump_energy(beam.body, beam.a, beam.b))
    assert lost > 0
    assert difference == pytest.approx(BETA * lost, rel=1e-10)


def test_an_interval_of_length_zero_is_a_state(beam, rng) -> None:
    beam.randomise(beam.b, rng, 0.05)
    beam.a.x.array[:] = beam.b.x.array
    beam.noise(beam.v, rng)
    state = beam.value(*work(beam, "state"))
    assert beam.value(*work(beam, "interval")) == pytest.approx(state, rel=1e-12)


def test_a_rigid_motion_changes_neither_strains_nor_energy(beam, rng, turn) -> None:
    beam.randomise(beam.b, rng, 0.05)
    energy = beam.value("energy of b", lambda: strain_energy(beam.body, beam.b))
    strains = beam.at_points(beam.body.strains(beam.b))
    beam.move_rigidly(beam.b, turn(rng), rng.normal(size=3))
    # round-off of displacements of order one against strains of order 0.1
    np.testing.assert_allclose(beam.at_points(beam.body.strains(beam.b)), strains, atol=1e-13)
    moved = beam.value("energy of b", lambda: strain_energy(beam.body, beam.b))
    assert moved == pytest.approx(energy, rel=1e-12)


def test_the_reference_state_has_no_strain_however_it_is_moved(beam, rng, turn) -> None:
    beam.b.x.array[:] = 0.0
    beam.move_rigidly(beam.b, turn(rng), rng.normal(size=3))
    np.testing.assert_allclose(beam.at_points(beam.body.strains(beam.b)), 0, atol=1e-13)


def test_resultants_are_stiffness_times_strains(beam, rng) -> None:
    """Where compatibility holds; at the Gauss points, which are the nodes of the forces."""
    beam.randomise(beam.b, rng, 0.05)
    satisfy_compatibility(beam, beam.b)
    points = beam.body.mixed.subspaces["N"].element.interpolation_points
    found = beam.at_points(beam.body.resultants(beam.b), points).reshape(-1, 12)[:, 6:]
    strains = beam.at_points(beam.body.strains(beam.b), points).reshape(-1, 6)
    expected = strains @ np.array(beam.body.beam.section.stiffness)
    np.testing.assert_allclose(found, expected, atol=1e-12 * np.max(np.abs(expected)))


def put_into_strains(beam: Any, Gamma: np.ndarray, K: np.ndarray) -> None:
    """Put a straight beam along x into the state of constant strains: a helix."""
    S, k = np.cross(np.eye(3), K), np.linalg.norm(K)
    u, d = np.zeros_like(beam.X), np.zeros_like(beam.D)
    for node, s in enumerate(beam.X[:, 0]):
        # columns of R are the directors: R' = R S, x' = R (Gamma + e1)
        R = np.eye(3) + np.sin(k * s) / k * S + (1 - np.cos(k * s)) / k**2 * S @ S
        way = s * np.eye(3) + (1 - np.cos(k * s)) / k**2 * S
        way += (k * s - np.sin(k * s)) / k**3 * S @ S
        u[node] = way @ (Gamma + np.eye(3)[0]) - beam.X[node]
        d[node] = R.T
    beam.set_part(beam.b, "u", u)
    beam.set_frames(beam.b, d)


@pytest.mark.parametrize("degree", [2, 3])
def test_strains_of_a_helix_in_closed_form(sample, degree: int) -> None:
    """Their signs and order too: a straight beam put into constant strains of large size."""
    Gamma, K = np.array([0.1, -0.2, 0.3]), np.array([0.5, -0.7, 0.9])
    # the line is stretched by shear, too
    exact = np.array([Gamma[0] + Gamma @ Gamma / 2, *Gamma[1:], *K])
    errors = []
    for elements in (4, 8):
        beam = sample(degree, "rectangle", (), elements, Line((0, 0, 0), (1, 0, 0)))
        np.testing.assert_allclose(beam.D, np.tile(np.eye(3), (len(beam.X), 1, 1)), atol=1e-14)
        put_into_strains(beam, Gamma, K)
        strains = beam.at_points(beam.body.strains(beam.b)).reshape(-1, 6)
        errors.append(np.max(np.abs(strains - exact)))
    # derivatives of interpolations converge with the degree
    assert errors[1] < 1e-2
    assert np.log2(errors[0] / errors[1]) > degree - 0.3


@pytest.mark.parametrize("degree", [2, 3])
def test_a_free_beam_has_six_rigid_modes_and_no_others(sample, degree: int) -> None:
    """Stiffness of a single curved element on the motions that its constraints allow."""
    beam = sample(degree, "coupled", elements=1)
    beam.b.x.array[:] = 0.0
    test, trial = (f(beam.body.mixed.space) for f in (ufl.TestFunction, ufl.TrialFunction))
    work = interval_forces(beam.body, at_state(beam.b), test)
    tangent = fem.assemble_matrix(compiled(ufl.derivative(work, beam.b, trial)))
    singular = np.linalg.svd(tangent.to_dense(), compute_uv=False)
    assert np.sum(singular < 1e-10 * singular[0]) == 6
