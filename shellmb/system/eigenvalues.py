"""Eigenvalues nearest to a shift of pairs of matrices (SLEPc, shift and invert)."""

from collections.abc import Sequence
from typing import Any

from petsc4py import PETSc

import numpy as np

from shellmb.arrays import Complex, Floats
from shellmb.errors import ConvergenceError, TooFewModesError
from shellmb.system.direct.mumps import MUMPS_OPTIONS, new_prefix, use_mumps
from shellmb.system.direct.symmetry import sizes_of

# Eigenvalues of multipliers are infinite, and come out as large ones, of either sign or in complex
# pairs, that are no eigenvalues: of their equation, multiplied by the vector, a tenth of the
# largest term is left or more, of others round-off. Of zero ones only round-off is there.
FALSE = 1e-2

# multiples of the shift: eigenvalues beyond one are looked at so, and none is beyond the other
LARGE, INFINITE = 1e3, 1e12

# Eigenvalues below this fraction of the shift are zero. Where the lowest other one is large, the
# inverse hardly tells eigenvalues apart, and the shift moves to this fraction of that one
ZERO, NEARER = 1e-3, 0.1


def eigenpairs(
    K: PETSc.Mat, M: PETSc.Mat, count: int, shift: float, symmetric: bool, higher: bool = True
) -> tuple[Complex, list[PETSc.Vec]]:
    """Eigenvalues nearest to the shift and their vectors, sorted by their real parts.

    Of a complex pair the first one has the real part of the vector, the other one the imaginary
    part.

    Args:
        K: Stiffness matrix, perhaps indefinite.
        M: Mass matrix, perhaps singular.
        count: Number of pairs wanted.
        shift: Negative number of the size of the lowest eigenvalues.
        symmetric: Whether `K` is.
        higher: Whether to look much higher where too few are found.

    Raises:
        ConvergenceError: If the matrix has no factors, or there are fewer pairs.
    """
    try:
        solver = _solved(K, M, count, shift, symmetric)
    except PETSc.Error as error:
        raise ConvergenceError(
            f"modes: the matrix of the eigenproblem has no factors (PETSc error {error.ierr}); it "
            "must be regular: look for bodies without stiffness and mass"
        ) from error
    # a basis that breaks down (-2) holds all pairs that there are
    if solver.getConverged() < count and solver.getConvergedReason() != -2:
        raise ConvergenceError(
            f"modes: {solver.getConverged()} of {count} modes converged; request fewer, or "
            "refine the mesh"
        )
    pairs = []
    for k in range(solver.getConverged()):
        vector, imaginary = K.createVecRight(), K.createVecRight()
        value = complex(solver.getEigenpair(k, vector, imaginary))
        size = abs(value / shift)
        if size < LARGE or (size < INFINITE and _left(value, vector, imaginary, K, M) < FALSE):
            pairs.append((value, imaginary if value.imag < 0 else vector))
    lowest = min((size for v, _ in pairs if (size := abs(v / shift)) > ZERO), default=0.0)
    if lowest > LARGE:
        return eigenpairs(K, M, count, NEARER * lowest * shift, symmetric, higher)
    if len(pairs) < count:
        if higher:
            # seen from here all others are infinite: perhaps they are only far above
            return eigenpairs(K, M, count, INFINITE / LARGE * shift, symmetric, higher=False)
        raise TooFewModesError(count=count, there=len(pairs))
    pairs.sort(key=lambda pair: (pair[0].real, -pair[0].imag))
    return np.array([value for value, _ in pairs[:count]]), [vector for _, vector in pairs[:count]]


def _solved(K: PETSc.Mat, M: PETSc.Mat, count: int, target: float, symmetric: bool) -> Any:
    """The eigensolver of SLEPc that has found what is nearest to a target.

    Args:
        K: First matrix of the pair.
        M: The second one.
        count: How many eigenvalues are wanted.
        target: What they are near to, in their real parts; 0: by their size.
        symmetric: Whether `K` is.
    """
    # runs without eigenproblems do not load it
    from slepc4py import SLEPc

    solver = SLEPc.EPS().create(K.getComm())
    solver.setOperators(K, M)
    kinds, which = SLEPc.EPS.ProblemType, SLEPc.EPS.Which
    solver.setProblemType(kinds.GHEP if symmetric else kinds.GNHEP)
    solver.setType(SLEPc.EPS.Type.KRYLOVSCHUR)
    solver.setWhichEigenpairs(which.TARGET_REAL if target else which.TARGET_MAGNITUDE)
    solver.setTarget(target)
    # a wide basis finds multiple eigenvalues, such as the six rigid-body modes, all at once
    solver.setDimensions(count, min(max(4 * count, 40), K.getSize()[0]))
    solver.setTolerances(1e-10, 500)
    shift_and_invert(solver)
    solver.solve()
    return solver


def _left(
    value: complex, vector: PETSc.Vec, imaginary: PETSc.Vec, K: PETSc.Mat, M: PETSc.Mat
) -> float:
    """Share that is left of the equation of an eigenvalue in the direction of its vector."""
    y, terms = K.createVecLeft(), []
    for factor, A in ((1.0, K), (-value, M)):
        A.mult(vector, y)
        form, across = complex(vector.dot(y)), complex(imaginary.dot(y))
        A.mult(imaginary, y)
        form += complex(imaginary.dot(y)) + 1j * (complex(vector.dot(y)) - across)
        terms.append(factor * form)
    return left(terms)


def left(terms: Sequence[complex]) -> float:
    """Remainder of terms that add up to zero, relative to the largest of them."""
    return abs(sum(terms)) / max(*map(abs, terms), 1e-300)


def quotients(K: PETSc.Mat, M: PETSc.Mat, vectors: Sequence[PETSc.Vec]) -> tuple[Floats, Floats]:
    """Rayleigh's quotients of vectors, and what round-off of the stiffness makes of them at most.

    Of symmetric matrices their errors are the squares of those of the vectors: motions without
    stiffness, which the inverse knows to 1e-9 of the shift, have quotients of round-off.

    Args:
        K: Stiffness matrix.
        M: Mass matrix.
        vectors: Eigenvectors of finite eigenvalues.
    """
    sizes, found, y = sizes_of(K), [], K.createVecLeft()
    for vector in vectors:
        size = vector.copy()
        size.abs()
        terms = []
        for A, v in ((K, vector), (sizes, size), (M, vector)):
            A.mult(v, y)
            terms.append(float(np.real(v.dot(y))))
        found.append((terms[0] / terms[2], np.finfo(float).eps * terms[1] / terms[2]))
    values, round_off = np.array(found).T
    return values, round_off


def shift_and_invert(solver: Any) -> None:
    """Let an eigensolver of SLEPc find what is nearest to its target, by factors of MUMPS.

    Args:
        solver: An `EPS` or a `PEP`.
    """
    from slepc4py import SLEPc

    transform = solver.getST()
    transform.setType(SLEPc.ST.Type.SINVERT)
    ksp = transform.getKSP()
    ksp.setType(PETSc.KSP.Type.PREONLY)
    use_mumps(ksp.getPC(), PETSc.PC.Type.LU, new_prefix(solver), MUMPS_OPTIONS)


def nearest_to_zero(K: PETSc.Mat, G: PETSc.Mat, count: int) -> tuple[Complex, list[PETSc.Vec]]:
    """Numbers nearest to zero at which `K + number G` is singular, with their vectors.

    Args:
        K: A regular matrix.
        G: Another one.
        count: How many are wanted.

    Raises:
        ConvergenceError: If `K` has no factors, or none is found.
    """
    minus = G.copy()
    minus.scale(-1.0)
    try:
        solver = _solved(K, minus, count, 0.0, symmetric=False)
    except PETSc.Error as error:
        raise ConvergenceError(
            f"buckling: the stiffness matrix cannot be factorised (PETSc error {error.ierr}); "
            "hold everything that can move freely in the reference configuration"
        ) from error
    found = []
    for k in range(solver.getConverged()):
        vector, imaginary = K.createVecRight(), K.createVecRight()
        found.append((complex(solver.getEigenpair(k, vector, imaginary)), vector))
    if not found:
        raise ConvergenceError("buckling: no load factor was found; the loads strain nothing")
    return np.array([value for value, _ in found]), [vector for _, vector in found]
