"""Counting negative eigenvalues of sparse matrices."""

from mpi4py import MPI as _MPI  # noqa: F401  (before petsc4py)
from petsc4py import PETSc

import numpy as np
import pytest

from shellmb.system.direct.mumps import Inertia
from shellmb.system.direct.symmetry import is_symmetric


def matrix(values: np.ndarray) -> PETSc.Mat:
    A = PETSc.Mat().createAIJ(values.shape, comm=PETSc.COMM_SELF)
    A.setUp()
    A.setValues(range(len(values)), range(len(values)), values)
    A.assemble()
    return A


def symmetric(negative: int, size: int = 12) -> np.ndarray:
    """A full matrix with so many negative eigenvalues."""
    turned = np.linalg.qr(np.random.default_rng(1).normal(size=(size, size)))[0]
    values = np.linspace(1.0, 2.0, size)
    values[:negative] *= -1
    full = turned * values @ turned.T
    return (full + full.T) / 2


@pytest.mark.parametrize("negative", [0, 1, 5, 12])
def test_negative_eigenvalues(negative: int) -> None:
    assert Inertia(matrix(symmetric(negative)), "test_inertia_").negative() == negative


def test_values_may_change_and_the_matrix_stays_as_it_is() -> None:
    A = matrix(symmetric(2))
    inertia = Inertia(A, "test_inertia_twice_")
    assert inertia.negative() == 2
    A.shift(-1.5)
    wanted = int(np.sum(np.linalg.eigvalsh(symmetric(2) - 1.5 * np.eye(12)) < 0))
    assert wanted > 2
    assert inertia.negative() == wanted


def test_a_saddle_point() -> None:
    """As many negative ones as constraints."""
    full = np.zeros((6, 6))
    full[:4, :4] = np.diag([1.0, 2.0, 3.0, 4.0])
    full[4:, :4] = [[1.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, -1.0]]
    full[:4, 4:] = full[4:, :4].T
    assert Inertia(matrix(full), "test_inertia_saddle_").negative() == 2


def test_without_symmetry_the_determinant_tells_odd_numbers() -> None:
    """Of real negative eigenvalues; complex ones come in pairs."""
    full = symmetric(1)
    assert Inertia(matrix(full), "test_inertia_symmetric_").symmetric
    full[0, 3] += 1e-3
    inertia = Inertia(matrix(full), "test_inertia_none_")
    assert not inertia.symmetric
    assert inertia.odd() == bool(np.sum(np.linalg.eigvals(full).real < 0) % 2)
    assert Inertia(matrix(-full), "test_inertia_minus_").odd() == (np.linalg.det(-full) < 0)


@pytest.mark.parametrize("size", [12, 400])
def test_one_entry_in_a_matrix_shows_beside_its_round_off(size: int) -> None:
    """Whatever units rows have; 3e-12 of its row and column, where round-off is 1e-16."""
    units = 10.0 ** np.random.default_rng(2).uniform(-6, 6, size)
    full = units[:, None] * symmetric(3, size) * units
    # round-off that differs on both sides of the diagonal
    full *= 1 + 1e-16 * np.random.default_rng(3).normal(size=full.shape)
    assert is_symmetric(matrix(full))
    for share, seen in ((1e-14, True), (3e-12, False), (1e-3, False)):
        other = full.copy()
        other[1, 5] += share * np.sqrt(np.abs(full[1]).max() * np.abs(full[5]).max())
        assert is_symmetric(matrix(other)) is seen, share
