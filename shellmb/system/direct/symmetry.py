"""How far a matrix is from being symmetric, at the price of two products with it."""

from __future__ import annotations

from petsc4py import PETSc

import numpy as np


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
