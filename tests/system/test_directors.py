"""Tangent spaces and finite rotations of directors and triples."""

import numpy as np
import pytest

from shellmb.system.nullspace.directorpath import NodeBases
from shellmb.system.nullspace.directors import (
    any_pseudo_inverse,
    constraint,
    null_space,
    orthonormal,
    pseudo_inverse,
    rotated,
    violation,
)

RANDOM = np.random.default_rng(3)


def tangent(d: np.ndarray) -> np.ndarray:
    """Basis of the null space of the constraints at directors, shape (n, 3 k, m)."""
    none, dofs, first = np.zeros(len(d), bool), np.arange(d.size).reshape(d.shape), np.eye(4)[0]
    values, weights = [np.zeros(d.size)] * 4, [first, first]
    made = NodeBases("bases", (2, 1), none, dofs, d, values, weights)
    made()
    return made.found[0]


def some(k: int, n: int = 20) -> np.ndarray:
    """Orthonormal directors in general position, shape (n, 3 k)."""
    if k == 1:
        d = RANDOM.normal(size=(n, 3))
        return d / np.linalg.norm(d, axis=1)[:, None]
    return np.linalg.qr(RANDOM.normal(size=(n, 3, 3)))[0].reshape(n, 9)


@pytest.mark.parametrize("k", [1, 3])
def test_tangent_is_the_null_space_of_the_constraints(k: int) -> None:
    # also of mean directors, which are neither of unit length nor at right angles
    for d in (some(k), some(k) + 0.3 * RANDOM.normal(size=(20, 3 * k))):
        Z, C = tangent(d), constraint(d)
        np.testing.assert_allclose(C @ Z, 0.0, atol=1e-13)
        assert Z.shape[2] == d.shape[1] - C.shape[1]
        assert np.linalg.svd(Z)[1].min() > 0.1


@pytest.mark.parametrize("z", [1.0, -1.0, 0.0, -0.0])
def test_tangent_of_one_director_is_defined_everywhere(z: float) -> None:
    d = np.array([[0.0, 0.0, z] if z else [1.0, 0.0, z]])
    Z = tangent(d)[0]
    np.testing.assert_allclose(np.column_stack([Z, d[0]]).T @ Z, np.eye(3)[:, :2], atol=1e-14)


@pytest.mark.parametrize("k", [1, 3])
def test_constraint_is_the_derivative_of_the_violation(k: int) -> None:
    d, change = some(k), RANDOM.normal(size=(20, 3 * k))
    # quadratic: the central difference is exact but for round-off
    difference = (violation(d + change) - violation(d - change)) / 2
    np.testing.assert_allclose(
        np.einsum("ncj,nj->nc", constraint(d), change), difference, atol=1e-13
    )


@pytest.mark.parametrize("k", [1, 3])
def test_finite_rotations_keep_lengths_and_angles(k: int) -> None:
    d = some(k)
    for size in (1e-8, 1.0, 50.0):
        turned = rotated(d, size * RANDOM.normal(size=d.shape))[0]
        assert np.abs(violation(turned)).max() < 1e-14


@pytest.mark.parametrize("k", [1, 3])
def test_finite_rotations_agree_with_tangent_changes_to_first_order(k: int) -> None:
    d = some(k)
    Z = tangent(d)
    change = np.einsum("nij,nj->ni", Z, RANDOM.normal(size=(20, Z.shape[2])))
    errors = [np.abs(rotated(d, h * change)[0] - d - h * change).max() for h in (1e-2, 5e-3)]
    # what is left is of second order
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)


def test_rodrigues_parameters_of_a_triple_and_of_one_director_agree() -> None:
    frames, theta = some(3), RANDOM.normal(size=(20, 3))
    v = frames.reshape(-1, 3, 3)
    turned = rotated(frames, np.cross(theta[:, None, :], v).reshape(-1, 9))[0].reshape(-1, 3, 3)
    # a director alone does not see the rotation about itself
    third = v[:, 2]
    across = theta - np.einsum("ni,ni->n", theta, third)[:, None] * third
    alone = rotated(third, np.cross(across, third))[0]
    together = rotated(frames, np.cross(across[:, None, :], v).reshape(-1, 9))[0].reshape(-1, 3, 3)
    np.testing.assert_allclose(together[:, 2], alone, atol=1e-14)
    # the angle is that of Cayley's map: tan(angle/2) = |theta|/2
    angle = 2 * np.arctan(np.linalg.norm(theta, axis=1) / 2)
    trace = np.einsum("nki,nki->n", turned, v)
    np.testing.assert_allclose(trace, 1 + 2 * np.cos(angle), atol=1e-13)


@pytest.mark.parametrize("k", [1, 3])
def test_nearest_directors_and_multipliers(k: int) -> None:
    d = some(k)
    near = orthonormal(d + 1e-3 * RANDOM.normal(size=d.shape))
    assert np.abs(violation(near)).max() < 1e-14
    assert np.abs(near - d).max() < 5e-3
    C = constraint(near)
    forces = RANDOM.normal(size=(20, C.shape[1]))
    held = np.einsum("ncj,nc->nj", C, forces)
    found = np.einsum("njc,nj->nc", pseudo_inverse(C), held)
    np.testing.assert_allclose(found, forces, atol=1e-12)


@pytest.mark.parametrize("d", [np.zeros(9), np.full(9, 1e200), np.full(9, np.nan)])
def test_directors_that_depend_on_one_another_give_no_exception(d: np.ndarray) -> None:
    """It would be raised on one rank only; a NaN fails the convergence test of all."""
    with np.errstate(all="ignore"):
        assert not np.any(np.isfinite(tangent(d[None])))
        assert not np.all(np.isfinite(pseudo_inverse(constraint(d[None]))))
        rows = constraint(d[None])[0]
        assert any_pseudo_inverse(rows).shape == rows.T.shape
        assert null_space(rows, 3).shape == (9, 3)
