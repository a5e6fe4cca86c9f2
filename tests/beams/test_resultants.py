"""Forces and moments of beams are those of statics, in the deformed position and whatever acts."""

import numpy as np
import pytest

from shellmb.demos.verification.cantilever import exact_cantilever
from shellmb.running.execute import execute
from shellmb.scene import (
    Beam,
    Clamped,
    FollowerForce,
    FollowerLineForce,
    FollowerMoment,
    GeneralSection,
    Line,
    LineForce,
    PointForce,
    PointMoment,
    Probe,
    Scene,
    Weld,
)
from shellmb.simulate.simulation import Simulation

SECTION = GeneralSection((1e3, 5e2, 5e2, 1.0, 1.0, 1.5))
LINE = Line((0, 0, 0), (1, 0, 0))
FORCE, MOMENT, LOAD = (
    np.array([0.5, -1.0, 1.6]),
    np.array([0.2, 0.3, -0.1]),
    np.array([0.2, 0.4, 0]),
)


def beam(degree: int = 2) -> Beam:
    return Beam("b", LINE, SECTION, elements=8, degree=degree)


def nodes(simulation: Simulation) -> tuple[np.ndarray, np.ndarray]:
    """Positions and directors of all nodes along the beam, shapes (n, 3) and (n, 3, 3)."""
    body = simulation.model.beams["b"]
    q = simulation.problem.levels["b"].q.x.array
    X = body.mixed.nodes("u")
    order = np.argsort(X[:, 0])
    x = X + q[body.mixed.dofs["u"]].reshape(-1, 3)
    return x[order], body.frames_at(q)[order]


# Gauss values are continued to the node: by a line with degree 2, by a parabola with degree 3
@pytest.mark.parametrize(("degree", "error"), [(2, 3e-3), (3, 1e-4)])
def test_dead_loads(solve, last, degree, error) -> None:
    """At the clamp, whose directors are the axes, in equilibrium with the deformed beam."""
    loads = (PointForce("end", tuple(FORCE)), PointMoment("end", tuple(MOMENT)))
    run = solve(
        beam(degree),
        "force",
        "moment",
        supports=Clamped("start"),
        loads=(*loads, LineForce(tuple(LOAD))),
    )
    exact = exact_cantilever(
        np.asarray(SECTION.stiffness),
        1.0,
        force=FORCE,
        moment=MOMENT,
        load=LOAD,
        stretch_of_line=True,
    )
    assert np.linalg.norm(exact.tip) > 0.2
    size = np.linalg.norm(FORCE)
    np.testing.assert_allclose(last(run, "start", "force"), FORCE + LOAD, atol=error * size)
    np.testing.assert_allclose(last(run, "start", "moment"), exact.moment[0], atol=error * size)
    R = exact.rotation[-1]
    np.testing.assert_allclose(last(run, "end", "force"), R.T @ FORCE, atol=error * size)
    np.testing.assert_allclose(last(run, "end", "moment"), R.T @ MOMENT, atol=error * size)


def test_follower_loads(solve, last) -> None:
    """Force, moment and line force that turn with the beam, by their sums in its last position."""
    run = solve(
        beam(3),
        "force",
        "moment",
        supports=Clamped("start"),
        loads=(
            FollowerForce("end", tuple(FORCE)),
            FollowerMoment("end", tuple(MOMENT)),
            FollowerLineForce(tuple(LOAD)),
        ),
    )
    x, d = nodes(run.simulation)
    # components along d_k
    force, moment = FORCE @ d[-1], MOMENT @ d[-1]
    assert np.linalg.norm(force - FORCE) > 0.3
    # the nodes of cubic elements on [0, 1] with the weights of the Lobatto rule
    weights = np.array([1, 5, 5, 1]) / 12 / 8
    spread = LOAD @ d
    pulled, turned = np.zeros(3), np.zeros(3)
    for e in range(8):
        here = slice(3 * e, 3 * e + 4)
        pulled += weights @ spread[here]
        turned += weights @ np.cross(x[here], spread[here])
    np.testing.assert_allclose(last(run, "start", "force"), force + pulled, atol=1e-3)
    exact = moment + np.cross(x[-1], force) + turned
    np.testing.assert_allclose(last(run, "start", "moment"), exact, atol=1e-3)


def test_two_beams_with_a_force_where_they_meet() -> None:
    """The resultant jumps by it; ends of two bodies do not share a mean."""
    beams = (
        Beam("a", Line((0, 0, 0), (1, 0, 0)), SECTION, elements=4),
        Beam("b", Line((1, 0, 0), (2, 0, 0)), SECTION, elements=4),
    )
    scene = Scene(
        "two",
        beams=beams,
        joints=Weld("w", "a", "b", at="end", second_at="start"),
        supports=Clamped("start", body="a"),
        loads=(
            PointForce("end", (0, 1e-3, 0), body="a"),
            PointForce("end", (0, 0, 2e-3), body="b"),
        ),
        probes=tuple(
            Probe(f"{body}{k}", place, quantity="force", component=k, body=body)
            for body, place in (("a", "end"), ("b", "start"))
            for k in (1, 2)
        ),
        scheme="static",
        dt=1.0,
    )
    row = execute(scene).history.iloc[-1]
    # the load where they meet is put on the first of them: the weld carries the other alone
    assert row["a1"] == pytest.approx(1e-3, rel=1e-4)
    assert row["a2"] == pytest.approx(2e-3, rel=1e-4)
    assert abs(row["b1"]) < 1e-7
    assert row["b2"] == pytest.approx(2e-3, rel=1e-4)
    weld = np.linalg.norm([row[f"w.F{k}"] for k in (1, 2, 3)])
    assert weld == pytest.approx(2e-3, rel=1e-6)
