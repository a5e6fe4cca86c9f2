"""The angle of a body in a step, from the nodes at both ends of it."""

import numpy as np
import pytest

from shellmb.observers.account.rotations import BodyRotations, fit
from shellmb.scene import InitialVelocity, Isotropic, Rectangle, Scene, Shell
from shellmb.simulate.simulation import Simulation


def sums(x, d, R):
    """Those of nodes that turn by R about the origin, as a body gives them."""
    end, directors = x @ R.T, d @ R.T
    mid, dx = (x + end) / 2, end - x
    m, dd = (d + directors) / 2, directors - d
    squares = np.concatenate([mid.T @ mid, mid.T @ dx, m.T @ m, m.T @ dd]).ravel()
    return np.concatenate([[len(x)], mid.sum(axis=0), dx.sum(axis=0), squares])


@pytest.mark.parametrize("angle", [1e-6, 0.3, 3.0])
def test_angle_of_a_rigid_rotation(angle) -> None:
    """Exact for any angle, axis and place; positions and directors share in it."""
    random = np.random.default_rng(1)
    x = random.normal(size=(12, 3)) + np.array([5, -3, 2])
    axis = random.normal(size=3)
    axis /= np.linalg.norm(axis)
    d = random.normal(size=(12, 3))
    K = np.cross(np.eye(3), -axis)
    R = np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K
    (found,), (radius,) = fit(sums(x, d, R)[None])
    # half a turn away the middle is on the axis
    assert found == pytest.approx(angle, rel=1e-6)
    assert radius > 0


def test_plate_that_spins_in_its_plane_turns_though_its_directors_do_not() -> None:
    """In EP by 2 atan(w dt/2), a soft one a little less as it stretches."""
    soft = Isotropic(E=1.0, nu=0.3, thickness=0.2, density=1.0)
    plate = Shell("plate", Rectangle(1.0, 0.5), soft, mesh=(2, 1))
    initial = InitialVelocity(spin=(0, 0, 0.1), about=(0.5, 0.25, 0))
    scene = Scene("spin", plate, initial=initial, scheme="ep", dt=1.0, t_end=3.0)
    turning = BodyRotations()
    Simulation(scene).run([turning])
    turn = turning.turns["plate"]
    assert turn.largest == pytest.approx(2 * np.arctan(0.05), rel=1e-2)
    assert turn.total == pytest.approx(3 * turn.largest, rel=5e-2)
    # of the nodes, which lie evenly in the rectangle: sqrt((1 + 1/4)/12) and a little more
    assert turn.radius == pytest.approx(np.sqrt(1.25 / 12), rel=0.3)
