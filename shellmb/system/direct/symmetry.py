"""Asymmetry of a matrix: by two products with it, or entry by entry."""

from petsc4py import PETSc

import numpy as np

from shellmb.arrays import Floats

# The largest entry of `A - A^T` of a matrix that is symmetric, scaled as `unsymmetry` does it:
# round-off is 1e-15 (quadrilaterals, beams) to 1.2e-14 (triangles 2e-5 times as thick as long).
# Pressure, follower forces and moments that keep their direction add 2e-9 or more to shells 2e-4
# times as thick as long, 3e-12 to those of 2e-5, and 3e-10 to beams of 1e-5
SYMMETRIC_ENTRIES = 1e-12
# products add up a hundred entries of a row, each with its round-off; what is beyond this is looked
# at entry by entry. Of what is beyond 3e-12 in one entry only, two in a hundred vectors see less
SURE = 1e-13


def asymmetry(A: PETSc.Mat) -> float:
    """Size of `A - A^T` relative to that of `A`, as two vectors at random see it.

    Differences of `x.Ay` and `y.Ax` are as large as that matrix in Frobenius's norm, and those that
    see nothing have probability zero. Unknowns are scaled so that diagonals are one: forces that
    follow a soft part count beside a firm one.

    Args:
        A: The matrix; collective.
    """
    x, y = A.createVecs()
    forces = x.duplicate()
    A.getDiagonal(forces)
    diagonal = np.abs(forces.array_r)
    scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    x.array[:], y.array[:] = np.random.default_rng(A.comm.rank).normal(size=(2, len(scale))) * scale
    A.mult(y, forces)
    there = x.dot(forces)
    forces.array[:] *= scale
    size = forces.norm()
    A.mult(x, forces)
    return float(abs(there - y.dot(forces)) / (size or 1.0))


def is_symmetric(A: PETSc.Mat) -> bool:
    """Decide whether a matrix is symmetric up to round-off, to its last entry.

    Products with vectors at random see whether `A - A^T` is round-off; where it is not clearly so,
    entries are looked at.

    Args:
        A: The matrix; collective.
    """
    return _seen(A) < SURE or unsymmetry(A) < SYMMETRIC_ENTRIES


def _seen(A: PETSc.Mat) -> float:
    """Largest entry of `(A - A^T) x`, scaled as `unsymmetry` does it, of a vector at random."""
    x, y = A.createVecs()
    other = x.duplicate()
    largest = _of_rows(A)
    scale = 1.0 / np.sqrt(np.where(largest > 0.0, largest, 1.0))
    x.array[:] = np.random.default_rng(A.comm.rank).normal(size=len(scale)) * scale
    A.mult(x, y)
    A.multTranspose(x, other)
    other.axpy(-1.0, y)
    other.array[:] *= scale
    return float(other.norm(PETSc.NormType.NORM_INFINITY))


def unsymmetry(A: PETSc.Mat) -> float:
    """Largest entry of `A - A^T`, rows and columns scaled by the largest entries of those of `A`.

    A few unknowns that a following force acts on show among any number of others, and units do not
    count. It takes copies of the matrix, where `asymmetry` takes products.

    Args:
        A: The matrix; collective.
    """
    other, factors = A.copy(), A.createVecLeft()
    other.transpose()
    largest = np.maximum(_of_rows(A), _of_rows(other))
    factors.array[:] = 1.0 / np.sqrt(np.where(largest > 0.0, largest, 1.0))
    other.axpy(-1.0, A)
    other.diagonalScale(factors, factors)
    factors.array[:] = _of_rows(other)
    return float(factors.max()[1])


def sizes_of(A: PETSc.Mat) -> PETSc.Mat:
    """The matrix of the sizes of a matrix's entries."""
    ends, columns, values = A.getValuesCSR()
    return PETSc.Mat().createAIJ(A.getSizes(), csr=(ends, columns, np.abs(values)), comm=A.comm)


def _of_rows(A: PETSc.Mat) -> Floats:
    """Size of the largest entry of each row of this rank."""
    ends, _, values = A.getValuesCSR()
    np.abs(values, out=values)
    # of rows without entries it takes what follows
    found = np.maximum.reduceat(np.append(values, 0.0), ends[:-1])
    return np.asarray(np.where(np.diff(ends) > 0, found, 0.0))
