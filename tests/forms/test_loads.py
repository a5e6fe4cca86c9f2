"""Loads: resultants on a turned plate in closed form, tangents of the follower loads."""

from typing import Any

import numpy as np
import pytest
import ufl
from dolfinx import fem

from shellmb.scene import (
    EdgeForce,
    EdgeMoment,
    FollowerEdgeForce,
    FollowerSurfaceForce,
    Gravity,
    Pressure,
    SurfaceForce,
)
from tests.forms.conftest import compiled

FORCE = (0.3, -0.5, 0.7)
LOADS = {
    "surface force": SurfaceForce(FORCE),
    "follower surface force": FollowerSurfaceForce(FORCE),
    "pressure": Pressure(0.9),
    "gravity": Gravity(FORCE),
    "edge force": EdgeForce("right", FORCE),
    "follower edge force": FollowerEdgeForce("right", FORCE),
    "edge moment": EdgeMoment("right", FORCE),
}
# the panel of conftest: a cylinder of radius 1 between 10 and 60 degrees, 0.8 long
ARC, LENGTH = np.radians([10, 60]), 0.8
AREA = (ARC[1] - ARC[0]) * LENGTH
# geometry of order two in place of the arc
GEOMETRY = 2e-4


@pytest.fixture(params=LOADS)
def loaded(request: pytest.FixtureRequest, sample: Any) -> tuple[str, Any, Any]:
    """A load, the panel it acts on, and its virtual work in the direction `v` at the state `b`."""
    name = request.param
    panel = sample("quad", "coupled", (LOADS[name],))
    factors = panel.body.loads()
    factors.update(lambda time: 1.0)
    return name, panel, lambda: factors.virtual_work(panel.b, panel.v)


def test_tangent_is_the_derivative(loaded, rng, turn) -> None:
    name, panel, make = loaded
    form = make()
    panel.randomise(panel.b, rng, 0.1, turn(rng))
    panel.noise(panel.v, rng)
    panel.noise(panel.dq, rng)
    derivative = ufl.algorithms.expand_derivatives(ufl.derivative(form, panel.b, panel.dq))
    dead = name in {"surface force", "gravity", "edge force"}
    assert derivative.empty() == dead
    found = 0.0 if dead else fem.assemble_scalar(compiled(derivative))
    kernel, h = compiled(form), 1e-4
    centre, ends = panel.b.x.array.copy(), []
    for sign in (1, -1):
        panel.b.x.array[:] = centre + sign * h * panel.dq.x.array
        ends.append(fem.assemble_scalar(kernel))
    # at most quadratic in the state, so that central differences are exact but for round-off, other
    # than moments on an edge, which turn with the director's unit vector: those are off by h^2
    off = h**2 if name == "edge moment" else 100 * np.finfo(float).eps / h
    assert (ends[0] - ends[1]) / (2 * h) == pytest.approx(found, abs=off)


def integral(f: Any) -> np.ndarray:
    """Integral over the panel's angle by the mid-point rule, per length of the generator."""
    n = 2000
    angles = ARC[0] + (np.arange(n) + 0.5) / n * (ARC[1] - ARC[0])
    return np.mean([f(angle) for angle in angles], axis=0) * (ARC[1] - ARC[0])


def triad(angle: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Along the arc, along the axis, outward normal."""
    t, n = np.array([-np.sin(angle), np.cos(angle), 0]), np.array([np.cos(angle), np.sin(angle), 0])
    return t, np.array([0.0, 0.0, 1.0]), n


def resultant(name: str, panel: Any) -> np.ndarray:
    """Resultant force of a load on the undeformed panel in closed form."""
    F = np.array(FORCE)
    t, _, n = triad(ARC[1])
    match name:
        case "surface force":
            return F * AREA
        case "gravity":
            return F * AREA * panel.body.shell.section.mass[0]
        case "edge force":
            return F * LENGTH
        case "follower edge force":
            # outward, along the edge so that the triad is right-handed, normal
            return (F[0] * t + F[1] * np.cross(n, t) + F[2] * n) * LENGTH
        case "pressure":
            return 0.9 * LENGTH * integral(lambda angle: triad(angle)[2])
        case "follower surface force":

            def density(angle: float) -> np.ndarray:
                normal = triad(angle)[2]
                e1 = np.array([0.3, 1.0, 0.2])
                e1 = e1 - (e1 @ normal) * normal
                e1 /= np.linalg.norm(e1)
                return F[0] * e1 + F[1] * np.cross(normal, e1) + F[2] * normal

            return LENGTH * integral(density)
    return np.zeros(3)


def test_resultants_turn_with_the_shell_or_stay(loaded, rng, turn) -> None:
    name, panel, make = loaded
    Q = turn(rng)
    panel.b.x.array[:] = 0.0
    panel.move_rigidly(panel.b, Q, rng.normal(size=3))
    kernel = compiled(make())
    found = np.zeros(3)
    for axis in range(3):
        panel.v.x.array[:] = 0.0
        panel.set_part(panel.v, "u", np.tile(np.eye(3)[axis], (len(panel.X), 1)))
        found[axis] = fem.assemble_scalar(kernel)
    expected = resultant(name, panel)
    if name in {"pressure", "follower surface force", "follower edge force"}:
        expected = Q @ expected
    # the end tangent of a quadratic arc of 25 degrees is off by more than its area is
    np.testing.assert_allclose(found, expected, atol=GEOMETRY * (5 if "edge" in name else 1))


def test_an_edge_moment_does_work_on_rotations(sample, rng, turn) -> None:
    """On a rotation `omega` the work is `m . omega`, but for the part about the director itself."""
    panel = sample("quad", "coupled", (LOADS["edge moment"],))
    factors = panel.body.loads()
    factors.update(lambda time: 1.0)
    Q, omega, m = turn(rng), rng.normal(size=3), np.array(FORCE)
    panel.b.x.array[:] = 0.0
    panel.move_rigidly(panel.b, Q, np.zeros(3))
    panel.v.x.array[:] = 0.0
    panel.set_part(panel.v, "w", np.cross(omega, panel.D @ Q.T))
    found = fem.assemble_scalar(compiled(factors.virtual_work(panel.b, panel.v)))
    d = Q @ triad(ARC[1])[2]
    assert found == pytest.approx((m @ omega - (m @ d) * (d @ omega)) * LENGTH, abs=GEOMETRY)


def test_pressure_is_the_gradient_of_the_volume(sample, rng) -> None:
    """On a uniform growth, the work is p times the growth of the volume under the panel."""
    panel = sample("quad", "coupled", (LOADS["pressure"],))
    factors = panel.body.loads()
    factors.update(lambda time: 1.0)
    grow = 0.3
    panel.b.x.array[:] = 0.0
    radial = panel.X * np.array([1.0, 1.0, 0.0])
    panel.set_part(panel.b, "u", grow * radial)
    panel.v.x.array[:] = 0.0
    panel.set_part(panel.v, "u", radial)
    found = fem.assemble_scalar(compiled(factors.virtual_work(panel.b, panel.v)))
    assert found == pytest.approx(0.9 * (1 + grow) * AREA, abs=GEOMETRY)
