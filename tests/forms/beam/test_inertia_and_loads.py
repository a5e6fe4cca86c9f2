"""Inertia of beams and loads on them, against closed forms on rigid motions."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import ufl
from dolfinx import fem

from shellmb.model.body import kinetic_energy
from shellmb.scene import FollowerLineForce, Gravity, Line, LineForce, LineMoment
from tests.forms.conftest import compiled

FORCE = (0.3, -0.5, 0.7)
LOADS = {
    "line force": LineForce(FORCE),
    "follower line force": FollowerLineForce(FORCE),
    "line moment": LineMoment(FORCE),
    "gravity": Gravity(FORCE),
}


def test_inertia_is_that_of_the_section_swept_along_the_line(sample, rng) -> None:
    """A straight beam along x as a rigid body, with eccentric mass and a product of inertia."""
    length = 2.0
    beam = sample(2, "coupled", (), 2, Line((0, 0, 0), (length, 0, 0)))
    body, section = beam.body, beam.body.beam.section
    m, (s2, s3), (J22, J23, J33) = section.mass
    velocity, omega = rng.normal(size=(2, 3))
    beam.set_part(beam.v, "u", velocity + np.cross(omega, beam.X))
    beam.set_part(beam.v, "w", np.cross(omega, beam.D))
    beam.b.x.array[:] = 0.0
    axis = fem.Constant(body.domain.mesh, np.zeros(3))
    forms = [
        compiled(form)
        for form in (body.momentum(beam.v, axis), body.angular_momentum(beam.b, beam.v, axis))
    ]
    momenta = np.zeros((2, 3))
    for k in range(3):
        axis.value[:] = np.eye(3)[k]
        momenta[:, k] = [fem.assemble_scalar(form) for form in forms]
    # int rho (x, y, z) and int rho (x, y, z)(x, y, z)
    first = length * np.array([m * length / 2, s2, s3])
    products = [
        [m * length**2 / 3, s2 * length / 2, s3 * length / 2],
        [s2 * length / 2, J22, J23],
        [s3 * length / 2, J23, J33],
    ]
    second = length * np.array(products)
    inertia = np.trace(second) * np.eye(3) - second
    linear = m * length * velocity + np.cross(omega, first)
    angular = np.cross(first, velocity) + inertia @ omega
    np.testing.assert_allclose(momenta, [linear, angular], rtol=1e-12)
    kinetic = beam.value("kinetic energy", lambda: kinetic_energy(body, beam.v))
    assert kinetic == pytest.approx((linear @ velocity + angular @ omega) / 2, rel=1e-12)


@pytest.mark.parametrize("degree", [2, 3])
def test_no_motion_has_a_negative_kinetic_energy(sample, degree: int) -> None:
    """Far off the line, mass and moments nearly cancel: they need the same rule."""
    body = sample(degree, "far", (), 2, Line((0, 0, 0), (1, 0, 0))).body
    test, trial = (f(body.mixed.space) for f in (ufl.TestFunction, ufl.TrialFunction))
    mass = fem.assemble_matrix(compiled(body.inertia(trial, test))).to_dense()
    values = np.linalg.eigvalsh(mass)
    assert values[0] > -1e-14 * values[-1]


@pytest.fixture(params=LOADS)
def loaded(request: pytest.FixtureRequest, sample: Any) -> tuple[str, Any, Callable[[], ufl.Form]]:
    """A load, the beam it acts on, and its virtual work in the direction `v` at the state `b`."""
    beam = sample(2, "coupled", (LOADS[request.param],))
    factors = beam.body.loads()
    factors.update(lambda time: 1.0)
    return request.param, beam, lambda: factors.virtual_work(beam.b, beam.v)


def test_tangent_of_loads_is_the_derivative(loaded, rng, turn) -> None:
    name, beam, make = loaded
    beam.randomise(beam.b, rng, 0.1, turn(rng))
    beam.noise(beam.v, rng)
    beam.noise(beam.dq, rng)
    form = make()
    derivative = ufl.algorithms.expand_derivatives(ufl.derivative(form, beam.b, beam.dq))
    dead = name in {"line force", "gravity"}
    assert derivative.empty() == dead
    found = 0.0 if dead else fem.assemble_scalar(compiled(derivative))
    kernel, h = compiled(form), 1e-5
    centre, ends = beam.b.x.array.copy(), []
    for sign in (1, -1):
        beam.b.x.array[:] = centre + sign * h * beam.dq.x.array
        ends.append(fem.assemble_scalar(kernel))
    # h^2 of the third derivative, eps/h of round-off
    assert (ends[0] - ends[1]) / (2 * h) == pytest.approx(found, rel=1e-7, abs=1e-8)


def test_loads_do_the_work_of_their_resultants_on_rigid_velocities(loaded, rng, turn) -> None:
    """Dead ones keep their direction, moments work on turns alone, weight on the centroids."""
    name, beam, make = loaded
    body = beam.body
    beam.b.x.array[:] = 0.0
    beam.move_rigidly(beam.b, turn(rng), np.zeros(3))
    # frames that are not orthonormal, as at a mid-point: moments work on the turn all the same
    skew = np.eye(3) + 0.2 * rng.normal(size=(3, 3))
    beam.set_frames(beam.b, skew @ (beam.D + beam.part(beam.b, "w").reshape(-1, 3, 3)))
    velocity, omega = rng.normal(size=(2, 3))
    x, d = beam.X + beam.part(beam.b, "u"), beam.D + beam.part(beam.b, "w").reshape(-1, 3, 3)
    beam.set_part(beam.v, "u", velocity + np.cross(omega, x))
    beam.set_part(beam.v, "w", np.cross(omega, d))

    v, r, F = (fem.Constant(body.domain.mesh, np.array(c)) for c in (velocity, omega, FORCE))
    speed, (d1, d2, d3) = v + ufl.cross(r, body.position(beam.b)), body.directors(beam.b)
    m, (s2, s3), _ = body.beam.section.mass
    full, nodes = body.rules.full, body.rules.nodes
    expected = {
        "line force": ufl.dot(F, speed) * full,
        "follower line force": ufl.dot(F[0] * d1 + F[1] * d2 + F[2] * d3, speed) * full,
        "line moment": ufl.dot(F, r) * nodes,
        "gravity": m * ufl.dot(F, speed) * nodes
        + ufl.dot(F, ufl.cross(r, s2 * d2 + s3 * d3)) * nodes,
    }
    found = fem.assemble_scalar(compiled(make()))
    right = fem.assemble_scalar(compiled(expected[name]))
    assert found == pytest.approx(right, rel=1e-11)
