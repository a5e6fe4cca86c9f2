"""Matrices of scenes: frequencies, static deflections, damping, and what has no inertia."""

from typing import Any

import numpy as np
import pytest
import scipy.sparse.linalg as spla

import shellmb as sm
from shellmb.errors import SceneError
from shellmb.running.natural_modes.vibration import natural_modes
from shellmb.running.rotating.campbell import campbell

SECTION = sm.Isotropic(E=70e9, nu=0.3, thickness=2e-3, density=2700.0)
MOTION: dict[str, Any] = {"scheme": "ep", "dt": 1.0, "t_end": 1.0}
TIP = (1.0, 0.125, 0.0)


def strip(**more: Any) -> sm.Scene:
    """A cantilever plate."""
    shell = sm.Shell("strip", sm.Rectangle(1.0, 0.25), SECTION, mesh=(4, 1), **more)
    return sm.Scene("strip", shell, supports=sm.Clamped("left"), **MOTION)


@pytest.mark.parametrize("more", [{}, {"rotary_inertia": False}, {"cell": "tri"}])
def test_frequencies_are_those_of_the_modes(more: dict[str, Any]) -> None:
    scene = strip(**more)
    found = sm.matrices(scene)
    squares, shapes = found.modes(4)
    # each is found to the tolerance of its eigensolver
    np.testing.assert_allclose(np.sqrt(squares), natural_modes(scene, count=4).omega, rtol=1e-7)
    for A in (found.M, found.C, found.K):
        # of K round-off of stretching, which is (length/thickness)^2 times as stiff as bending
        assert abs(A - A.T).max() <= 1e-12 * max(abs(A).max(), 1e-300)
    np.testing.assert_allclose(shapes.T @ (found.M @ shapes), np.eye(4), atol=1e-8)


def test_a_force_moves_the_tip_as_in_linear_statics() -> None:
    found = sm.matrices(strip())
    row = found.row(TIP)
    moved = row @ spla.spsolve(found.K.tocsc(), row)
    still = sm.Scene(
        "strip",
        strip().shells,
        supports=sm.Clamped("left"),
        loads=sm.PointForce(TIP, (0, 0, 1.0)),
        probes=sm.Probe("tip", TIP),
        scheme="linear-statics",
    )
    assert moved == pytest.approx(sm.run(still).history["tip"].iloc[-1], rel=1e-7)
    space = found.state_space(row, row)
    assert (space.C @ np.linalg.solve(-space.A, space.B)).item() == pytest.approx(moved, rel=1e-6)


def pendulum() -> sm.Scene:
    """A flexible rod with a ball at its end, on a sprung and damped hinge."""
    section = sm.RectangularSection(E=2e9, nu=0.3, width=0.02, height=0.02, density=1000.0)
    return sm.Scene(
        "pendulum",
        beams=sm.Beam("rod", sm.Line((0, 0, 0), (1, 0, 0)), section, elements=2),
        rigid_bodies=sm.RigidBody("ball", 0.2, (1e-4, 1e-4, 1e-4), position=(1.1, 0, 0)),
        joints=[
            sm.Revolute("pin", sm.GROUND, "rod", at=(0, 0, 0), axis=(0, 1, 0)),
            sm.Weld("weld", "rod", "ball", at=(1, 0, 0)),
        ],
        force_elements=[sm.JointSpring("k", "pin", 5.0), sm.JointDamper("c", "pin", 0.1)],
        **MOTION,
    )


def test_joints_springs_and_dampers_are_in_the_matrices() -> None:
    """Complex eigenvalues are those of the modes about a rest, which are found in another way."""
    found, scene = sm.matrices(pendulum()), pendulum()
    values = np.linalg.eigvals(found.state_space(modes=found.size - 1).A)
    swings = sorted((v for v in values if v.imag > 0), key=abs)[:3]
    reference = campbell(scene, [0.0], count=3).modes[0]
    lowest = sorted((v for v in reference.values if v.imag > 0), key=abs)[:3]
    # the highest of those that are found is known to 4e-6
    np.testing.assert_allclose(swings, lowest, rtol=1e-4)
    assert swings[0].real < -0.05
    # the ball moves with the rod: the hinge's spring, and the rod's bending
    row = found.row((1.1, 0, 0), body="ball")
    moved = row @ spla.spsolve(found.K.tocsc(), row)
    bending = 2e9 * 0.02**4 / 12
    rod = (1.1**3 - 0.1**3) / 3 / bending
    assert moved == pytest.approx(1.1**2 / 5.0 + rod, rel=1e-3)


def test_bad_rows_get_a_sentence() -> None:
    found = sm.matrices(strip())
    with pytest.raises(SceneError, match=r"'strip' has no node at .0\.9, 0, 0.; the nearest one"):
        found.row((0.9, 0, 0))
    with pytest.raises(SceneError, match="inputs have 3 columns; they must have"):
        found.state_space(np.zeros(3))
    with pytest.raises(SceneError, match="modes is 0; it must be from 1 to"):
        found.state_space(modes=0)
