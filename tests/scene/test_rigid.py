"""Rigid bodies: inertia, axes, places."""

import numpy as np
import pytest

from shellmb.scene import RigidBody
from shellmb.scene.multibody.rigid import rotation_matrix


def test_euler_tensor_of_a_brick():
    """``int rho y y^T`` of a brick is diag(a^2, b^2, c^2) m/12."""
    m, sides = 3.0, np.array([1.0, 2.0, 3.0])
    moments = m / 12 * (sides @ sides - sides**2)
    body = RigidBody("brick", m, moments)
    np.testing.assert_allclose(body.euler_tensor, np.diag(m / 12 * sides**2), rtol=1e-14)
    np.testing.assert_array_equal(body.inertia_tensor, np.diag(moments))


def test_euler_tensor_of_a_turned_brick_and_a_rod():
    R = rotation_matrix((0.3, -0.4, 1.2))
    J = R @ np.diag([5.0, 4.0, 3.0]) @ R.T
    body = RigidBody("b", 1.0, J)
    np.testing.assert_allclose(body.euler_tensor, R @ np.diag([1.0, 2.0, 3.0]) @ R.T, atol=1e-14)
    rod = RigidBody("rod", 1.0, R @ np.diag([1.0, 1.0, 1e-10]) @ R.T)
    assert np.linalg.eigvalsh(rod.euler_tensor)[0] > -1e-15


def test_equality_of_the_triangle_up_to_round_off_is_welcome():
    """A flat body: one moment is the sum of the others."""
    flat = RigidBody("flat", 1.0, (1.0, 2.0, 3.0 + 1e-10))
    E = flat.euler_tensor
    assert np.linalg.eigvalsh(E)[0] >= 0
    np.testing.assert_allclose(E, np.diag([2, 1, 0]), atol=1e-10)
    assert RigidBody("point", 1.0, (0, 0, 0)).euler_tensor.tolist() == np.zeros((3, 3)).tolist()


def test_rotation_vector_and_matrix():
    R = rotation_matrix((0, 0, np.pi / 2))
    np.testing.assert_allclose(R, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-14)
    np.testing.assert_array_equal(rotation_matrix((0, 0, 0)), np.eye(3))
    vector = (0.3, -2.0, 0.7)
    np.testing.assert_allclose(rotation_matrix(vector) @ vector, vector, rtol=1e-14)
    by_vector = RigidBody("a", 1, (1, 1, 1), rotation=vector)
    by_matrix = RigidBody("a", 1, (1, 1, 1), rotation=rotation_matrix(vector))
    np.testing.assert_allclose(by_vector.axes, by_matrix.axes, atol=1e-14)
    assert np.linalg.det(by_vector.axes) == pytest.approx(1)


def test_a_matrix_of_few_digits_is_made_orthonormal():
    R = np.round(rotation_matrix((0.1, 0.2, 0.3)), 7)
    axes = RigidBody("a", 1, (1, 1, 1), rotation=R).axes
    np.testing.assert_allclose(axes.T @ axes, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(axes, R, atol=2e-7)


def test_places():
    body = RigidBody(
        "a",
        1,
        (1, 1, 1),
        position=(1, 2, 3),
        rotation=(0, 0, np.pi / 2),
        com=(1, 0, 0),
        points={"tip": (2, 0, 1)},
    )
    np.testing.assert_allclose(body.place("tip"), (1, 4, 4))
    np.testing.assert_allclose(body.center, (1, 3, 3))
    np.testing.assert_allclose(body.place("origin"), (1, 2, 3))
    np.testing.assert_allclose(body.place(), (1, 2, 3))
    np.testing.assert_array_equal(body.place((7, 8, 9)), (7, 8, 9))
    assert body.point_names == ("origin", "center", "tip")
