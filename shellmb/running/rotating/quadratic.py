"""Quadratic eigenvalue problems `(s^2 M + s C + K) v = 0` with complex pairs (SLEPc)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from petsc4py import PETSc
from slepc4py import SLEPc

import numpy as np

from shellmb.errors import ConvergenceError
from shellmb.system.eigenvalues import FALSE, left, shift_and_invert

# Parts of the shift, and bases as multiples of what is wanted: of small systems the basis holds
# infinite eigenvalues, too, which LAPACK cannot always sort (PETSc error 76), and others can.
ATTEMPTS = ((1.0, 4), (1.37, 4), (1.0, 2), (0.71, 3), (1.21, 2))

# Where modes are damped beyond oscillation, half of their eigenvalues crowd at the inverse of the
# damping's time, and Arnoldi's method parts them with a large basis only.
CROWDED = ((1.0, 16), (1.37, 16))

# eigenvalues below this part of the shift are zero: a double one, as of a free rotation, is found
# to the square root of round-off
NEUTRAL = 3e-3

# iterations of each; what does not crowd takes ten
MOST = 100


class Pair(NamedTuple):
    """An eigenvalue and its vector, of which real and imaginary part are vectors of unknowns.

    Args:
        value: Eigenvalue, its imaginary part positive or zero, 1/s.
        real: Real part of the vector.
        imaginary: Imaginary part; zero where the eigenvalue is real.
    """

    value: complex
    real: PETSc.Vec
    imaginary: PETSc.Vec


def solve_quadratic(
    K: PETSc.Mat, C: PETSc.Mat, M: PETSc.Mat, count: int, shift: float
) -> list[Pair]:
    """Eigenvalues nearest to a shift, sorted by their size; of a complex pair one.

    Arnoldi's method on the linearisation (TOAR), shifted and inverted at a real number, so that
    one real factorisation does. Rows of constraints have no mass: their infinite eigenvalues are
    those that the inverse makes zero.

    Args:
        K: Stiffness.
        C: Damping and gyroscopic terms.
        M: Mass.
        count: Number of pairs wanted.
        shift: The shift, real and positive, 1/s.

    Raises:
        ConvergenceError: If the eigenproblem does not converge, or has fewer modes.
    """
    for attempts in (ATTEMPTS, CROWDED):
        solver = _first(K, C, M, count, shift, attempts)
        found, wanted = solver.getConverged(), solver.getDimensions()[0]
        if found >= wanted:
            break
    else:
        raise ConvergenceError(
            f"modes: {found} of {wanted} eigenvalues converged; request fewer modes, or "
            "refine the mesh"
        )
    pairs = []
    for k in range(found):
        vectors = K.createVecRight(), K.createVecRight()
        value = complex(solver.getEigenpair(k, *vectors))
        pair = Pair(value, *vectors)
        if value.imag >= 0 and (abs(value) < shift or _left(pair, K, C, M) < FALSE):
            pairs.append(pair)
    return sorted(pairs, key=lambda pair: abs(pair.value))


def _first(
    K: PETSc.Mat,
    C: PETSc.Mat,
    M: PETSc.Mat,
    count: int,
    shift: float,
    attempts: Sequence[tuple[float, int]],
) -> SLEPc.PEP:
    """The solver after the first of some attempts whose eigenvalues could be sorted."""
    failure: Exception | None = None
    for part, basis in attempts:
        try:
            return _solved(K, C, M, count, part * shift, basis)
        except (PETSc.Error, SystemError) as error:
            # raised through Cython it may come as the cause of a SystemError
            failure = error
    raise ConvergenceError(
        "modes: the eigenproblem has no solution; its matrix must be regular: look for "
        f"bodies without stiffness and mass ({failure})"
    ) from failure


def _solved(
    K: PETSc.Mat, C: PETSc.Mat, M: PETSc.Mat, count: int, shift: float, basis: int
) -> SLEPc.PEP:
    """The solver after its work, with a basis of so many times the eigenvalues wanted."""
    solver = SLEPc.PEP().create(K.getComm())
    solver.setOperators([K, C, M])
    solver.setProblemType(SLEPc.PEP.ProblemType.GENERAL)
    solver.setType(SLEPc.PEP.Type.TOAR)
    solver.setWhichEigenpairs(SLEPc.PEP.Which.TARGET_MAGNITUDE)
    solver.setTarget(shift)
    size = 2 * K.getSize()[0]
    wanted = min(2 * count, size)
    solver.setDimensions(wanted, min(max(basis * wanted, 10 * basis), size))
    solver.setTolerances(1e-11, MOST)
    shift_and_invert(solver)
    solver.solve()
    return solver


def _left(pair: Pair, K: PETSc.Mat, C: PETSc.Mat, M: PETSc.Mat) -> float:
    """Remainder of the equation in the direction of the vector, over its largest term."""
    s = pair.value
    return left([s**power * product(A, pair, pair) for power, A in enumerate((K, C, M))])


def product(A: PETSc.Mat, first: Pair, second: Pair) -> complex:
    """`v^H A w` of the vectors of two pairs, for a real matrix."""
    y = A.createVecLeft()
    parts = []
    for vector in (second.real, second.imaginary):
        A.mult(vector, y)
        parts.append(complex(first.real.dot(y), -first.imaginary.dot(y)))
    return parts[0] + 1j * parts[1]


def turned(pair: Pair, angle: float) -> Pair:
    """The pair with its vector times `exp(i angle)`."""
    cosine, sine = np.cos(angle), np.sin(angle)
    real, imaginary = pair.real.copy(), pair.imaginary.copy()
    real.scale(cosine)
    real.axpy(-sine, pair.imaginary)
    imaginary.scale(cosine)
    imaginary.axpy(sine, pair.real)
    return Pair(pair.value, real, imaginary)
