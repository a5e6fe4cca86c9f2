"""Factors in a band of small matrices that need pivots."""

from petsc4py import PETSc

import numpy as np
import pytest

from shellmb.system.direct import banded
from shellmb.system.direct.banded import BandedFactors
from shellmb.system.direct.solver import DirectSolver, Factors, Purpose

RANDOM = np.random.default_rng(3)


def chained(n: int, reach: int = 3) -> np.ndarray:
    """Unknowns of a chain in any order, in unlike units, half of them without a diagonal."""
    i, j = np.indices((n, n))
    A = np.where(np.abs(i - j) <= reach, RANDOM.normal(size=(n, n)), 0.0)
    A[::2, ::2][np.eye(len(A[::2]), dtype=bool)] = 0.0
    units = 10.0 ** RANDOM.integers(-5, 6, size=n)
    order = RANDOM.permutation(n)
    return (units[:, None] * A * units)[np.ix_(order, order)]


def sparse(A: np.ndarray) -> tuple[PETSc.Mat, np.ndarray]:
    rows, columns = np.nonzero(A + np.eye(len(A)))
    starts = np.searchsorted(rows, np.arange(len(A) + 1)).astype(np.int32)
    values = A[rows, columns].copy()
    csr = starts, columns.astype(np.int32), values
    return PETSc.Mat().createAIJWithArrays(A.shape, csr, comm=PETSc.COMM_SELF), values


@pytest.mark.parametrize("n", [1, 7, 60])
def test_solutions_in_unlike_units(n: int) -> None:
    full = chained(n) + (n == 1)
    units = np.abs(full).max(axis=1)
    A, values = sparse(full)
    solver = DirectSolver(A, f"band{n}_", np.ones(n), values=values)
    # each time anew with the values that are there
    for factor in (-3.0, 1.0):
        assert solver.factorise(Purpose.LAGGED) is None
        given = units * RANDOM.normal(size=n)
        b, x, rest = (A.createVecLeft() for _ in range(3))
        b.array[:] = given
        assert solver.solve(b, x) is None
        A.mult(x, rest)
        # residuals relative to what each row adds up
        terms = np.abs(full) @ np.abs(x.array) + np.abs(given)
        assert np.all(np.abs(rest.array - given) <= 1e-12 * terms)
        if solver.factors is not Factors.PLAIN:
            assert solver.solve_transposed(b, x) is None
            A.multTranspose(x, rest)
            terms = np.abs(full.T) @ np.abs(x.array) + np.abs(given)
            assert np.all(np.abs(rest.array - given) <= 1e-12 * terms)
        full *= factor
        values *= factor
        A.stateIncrease()
    if n > 1:
        assert solver.factors is Factors.BANDED


def test_a_singular_matrix_has_none_and_the_next_one_has() -> None:
    full = chained(12)
    full[3] = full[5]
    A, values = sparse(full)
    factors = BandedFactors(A, values)
    assert factors.pays and not factors.factorise()
    good, other = sparse(chained(12))
    assert BandedFactors(good, other).factorise()


def test_chains_of_blocks_have_the_band_of_neighbours() -> None:
    """Bodies of 12 unknowns and joints of 10 between them: two bodies and a joint are coupled.

    Reverse Cuthill-McKee has two joints more in the band.
    """
    block = np.repeat(np.arange(21), [10, 12] * 10 + [10])
    a, b = np.meshgrid(block, block, indexing="ij")
    body = a % 2 == 1
    coupled = np.abs(a - b) <= np.where(body & (b % 2 == 1), 2, 1)
    coupled &= body | (b % 2 == 1) | (a == b)
    order = RANDOM.permutation(len(block))
    full = np.where(coupled, RANDOM.normal(size=coupled.shape), 0.0)[np.ix_(order, order)]
    A, values = sparse(full)
    factors = BandedFactors(A, values)
    assert factors.factorise()
    below, above = factors.struct[0].below, factors.struct[0].above
    assert max(below, above) <= 12 + 10 + 12
    b, x = A.createVecs()
    b.array[:] = RANDOM.normal(size=len(block))
    factors.solve(b, x)
    terms = np.abs(full) @ np.abs(x.array) + np.abs(b.array)
    assert np.all(np.abs(full @ x.array - b.array) <= 1e-12 * terms)


def test_matrices_without_a_band_are_left_to_others() -> None:
    A, values = sparse(RANDOM.normal(size=(200, 200)))
    assert not BandedFactors(A, values).pays


def test_matrices_of_surfaces_are_not_searched(monkeypatch: pytest.MonkeyPatch) -> None:
    """A search takes longer than the model of a plate, and no order of a surface is in a band."""
    size = 3600
    places = np.arange(size, dtype=np.int32)
    # each unknown is coupled with those of the row of nodes beside it
    one, other = places[:-700], places[700:]
    rows, columns = np.concatenate([one, other]), np.concatenate([other, one])
    asked = []
    counted = banded._multiplications
    monkeypatch.setattr(banded, "_multiplications", lambda *a: asked.append(a) or counted(*a))
    each, order = banded.narrowed(places, rows, columns)
    assert each > banded.EACH
    assert order is places
    assert len(asked) == 1
