"""Eigenvalue problems `(s^2 M + s C + K) v = 0` with complex pairs (SLEPc), and with relaxation.

Maxwell branches add `sum_i s tau_i/(1 + s tau_i) K_i` to the stiffness.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import NamedTuple

from mpi4py import MPI as _MPI  # noqa: F401  (before petsc4py)
from petsc4py import PETSc
from slepc4py import SLEPc

import numpy as np

from shellmb.errors import ConvergenceError
from shellmb.simulate.eigenmodes import ROUND_OFF
from shellmb.system.direct.mumps import MUMPS_OPTIONS, Inertia, new_prefix, use_mumps
from shellmb.system.direct.symmetry import is_symmetric
from shellmb.system.eigenvalues import FALSE, left, quotients, shift_and_invert

# Parts of the shift, and bases as multiples of what is wanted: of small systems the basis holds
# infinite eigenvalues, too, which LAPACK cannot always sort (PETSc error 76), and others can.
ATTEMPTS = ((1.0, 4), (1.37, 4), (1.0, 2), (0.71, 3), (1.21, 2))
# rounds of scaling after which rows of equations have one size to a few per cent
ROUNDS = 10

# Where modes are damped beyond oscillation, half of their eigenvalues crowd at the inverse of the
# damping's time, and Arnoldi's method parts them with a large basis only.
CROWDED = ((1.0, 16), (1.37, 16))

# Eigenvalues below this part of the shift may be zero: a double one, as of a free rotation, is
# found to the square root of round-off
NEUTRAL = 3e-3
# Vectors are cleared of others. What is left makes zeros of the first part of the shift (3e-10 was
# seen), and where something spins of the second one (8e-6)
MIXED, TILTED = 1e-8, 3e-5
# Arnoldi's method may find zeros whose vectors have others, farther than this part of the shift:
# they are none (4e-3 and 8e-6 were seen)
BESIDE = 3e-4
# times that vectors are cleared: once left 3e-3 of the shift
CLEARED = 3

# all that is so slow is nearer to the shift than this part of it, and found before what is not
BEYOND = 1.01
# iterations of each; what does not crowd takes ten
MOST = 100

# Newton's method ends at this change of the pole, relative; so many steps at most
EXACT, STEPS = 1e-11, 30
# where its matrix is singular, it goes on beside that by this part
ASIDE = 1e-13
# so many more modes than wanted: branches order them anew
SPARE = 4
# poles nearer than this, with shapes as near, are one
SAME = 1e-6
# branches with this share of the energy of a mode have no part in it
HARDLY = 1e-9
# Creep is slow: only what is below this part of the shift is zero, or does not grow, and rigid
# motions, known to a small part of the shift, are brought below it
STILL = 1e-10


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
    those that the inverse makes zero. Unknowns are scaled, so that their units do not matter.

    Args:
        K: Stiffness.
        C: Damping and gyroscopic terms.
        M: Mass.
        count: Number of pairs wanted.
        shift: The shift, real and positive, 1/s.

    Raises:
        ConvergenceError: If the eigenproblem does not converge, or has fewer modes.
    """
    sizes, (K, C, M) = _scaled([A.copy() for A in (K, C, M)], shift)
    for attempts in (ATTEMPTS, CROWDED):
        solver = _first(K, C, M, count, attempts)
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
        if value.imag >= 0 and (abs(value) < 1 or _left(pair, K, C, M) < FALSE):
            pair = _sharpened(pair, K, C, M) if abs(value) > 1 else pair
            for vector in vectors:
                vector.pointwiseMult(vector, sizes)
            pairs.append(pair._replace(value=shift * pair.value))
    return sorted(pairs, key=lambda pair: abs(pair.value))


def _scaled(matrices: list[PETSc.Mat], shift: float) -> tuple[PETSc.Vec, list[PETSc.Mat]]:
    """Sizes of unknowns by which rows of equations at a shift are alike, and these equations.

    By the diagonal alone it is not done: forces of mixed forms and multipliers have little there.
    """
    sizes = matrices[0].createVecRight()
    sizes.set(1.0)
    for power, A in enumerate(matrices):
        A.scale(shift**power)
    at_shift, factors = sum(matrices[1:], matrices[0]), sizes.copy()
    for _ in range(ROUNDS):
        starts, _, values = at_shift.getValuesCSR()
        rows = np.repeat(np.arange(len(starts) - 1), np.diff(starts))
        sums = np.bincount(rows, np.abs(values), minlength=len(starts) - 1)
        factors.array = 1 / np.sqrt(np.where(sums > 0, sums, 1.0))
        at_shift.diagonalScale(factors, factors)
        sizes.pointwiseMult(sizes, factors)
    for A in matrices:
        A.diagonalScale(sizes, sizes)
    return sizes, matrices


def told_from_zero(
    pairs: Sequence[Pair], K: PETSc.Mat, C: PETSc.Mat, M: PETSc.Mat, shift: float
) -> list[Pair]:
    """Pairs, those that are zero with a value below `STILL` of the shift; collective.

    Heavy bodies on soft springs swing slowly, and what only a damper holds creeps: their stiffness
    or damping is no round-off.

    Args:
        pairs: The pairs.
        K: Stiffness.
        C: Damping and gyroscopic terms.
        M: Mass.
        shift: The shift at which they were found, 1/s.
    """
    slow = [pair for pair in pairs if abs(pair.value) < NEUTRAL * shift]
    if not slow:
        return list(pairs)
    mixed = MIXED if is_symmetric(C) else TILTED
    found = [pair for pair in pairs if abs(pair.value) >= NEUTRAL * shift]
    near = NEUTRAL * shift
    solver = _factored(K + near * C + near**2 * M)
    for pair in slow:
        clear = pair
        # what the first one leaves of fast ones is little for the last
        for _ in range(CLEARED):
            clear = _cleared(clear, C, M, solver, near)
            clear = clear._replace(value=_quotient(clear, K, C, M))
        if abs(clear.value - pair.value) < BESIDE * shift:
            still = abs(clear.value) < mixed * shift
            found.append(clear._replace(value=STILL * pair.value) if still else clear)
    return sorted(found, key=lambda pair: abs(pair.value))


def motions(
    matrices: tuple[PETSc.Mat, PETSc.Mat, PETSc.Mat],
    branches: Mapping[float, PETSc.Mat],
    count: int,
    shift: float,
    exact: Callable[[Pair], Pair] = lambda pair: pair,
) -> tuple[list[Pair], list[Pair]]:
    """Lowest pairs: those that are zero, each free motion once, and the others; collective.

    The zero of a free motion is double, and found as a complex pair or as two real numbers: it is
    half as many motions as zeros at least. That of what only a damper holds is single. Shapes tell
    them apart, but where many zeros mix they are less different than the motions, and pivots of the
    stiffness count what it does not hold.

    Args:
        matrices: Stiffness, damping and gyroscopic terms, and mass.
        branches: As of `Relaxing`; without any, those that creep and decay count, too.
        count: Number of pairs wanted.
        shift: The shift at which they are found, 1/s.
        exact: Gives a pair whose exact value is known.

    Raises:
        ConvergenceError: If the eigenproblem does not converge, or has fewer modes.
    """
    find = Relaxing(*matrices, branches).solve if branches else partial(solve_quadratic, *matrices)
    pairs = [exact(pair) for pair in find(count, shift)]
    if not branches:
        pairs = told_from_zero(pairs, *matrices, shift)
    zero = [pair for pair in pairs if abs(pair.value) < STILL * shift]
    above = [pair for pair in pairs if abs(pair.value) >= STILL * shift]
    if not zero:
        return [], above
    K, C, M = matrices
    least = math.ceil(sum(1 if pair.value.imag == 0 else 2 for pair in zero) / 2)
    complete = any(abs(pair.value - shift) > BEYOND * shift for pair in above)
    if complete and C.norm() > 0 and is_symmetric(K):
        slow = sum(abs(pair.value) < NEUTRAL * shift for pair in above)
        least = max(least, _unheld(K, M, NEUTRAL * shift) - slow)
    return _shapes(zero, least, M), above


def _unheld(K: PETSc.Mat, M: PETSc.Mat, slow: float) -> int:
    """Number of squares that are nearer to zero than that of a frequency; zero if unknown."""
    counts = []
    for square in (-(slow**2), slow**2):
        shifted = K.copy()
        shifted.axpy(square, M)
        counts.append(Inertia(shifted, f"{new_prefix(shifted)}unheld_").negative())
    below, above = counts
    return 0 if below is None or above is None else below - above


def _shapes(zero: Sequence[Pair], least: int, M: PETSc.Mat) -> list[Pair]:
    """Motions of zeros that differ from one another, the clearest first, `least` at least."""
    parts = [product(M, pair, pair).real ** -0.5 * part for pair in zero for part in pair[1:]]
    found: list[Pair] = []
    while parts:
        squares = [part.dot(M * part) for part in parts]
        k = int(np.argmax(squares))
        if squares[k] <= (SAME if len(found) >= least else 0.0):
            break
        shape = squares[k] ** -0.5 * parts.pop(k)
        found.append(Pair(0j, shape, 0.0 * shape))
        across = M * shape
        for part in parts:
            part.axpy(-across.dot(part), shape)
    return found


def _round_off(A: PETSc.Mat, M: PETSc.Mat, pair: Pair) -> float:
    """Round-off of `v^T A v/(v^T M v)` of the larger part of a vector."""
    return float(quotients(A, M, [max(pair[1:], key=lambda vector: vector.norm())])[1][0])


def _above(A: PETSc.Mat, M: PETSc.Mat, pair: Pair) -> complex:
    """`v^H A v/(v^H M v)`; zero where it may be round-off."""
    size = product(A, pair, pair) / product(M, pair, pair)
    return size if abs(size) > ROUND_OFF * _round_off(A, M, pair) else 0.0


def _quotient(pair: Pair, K: PETSc.Mat, C: PETSc.Mat, M: PETSc.Mat) -> complex:
    """Eigenvalue of a slow vector."""
    return nearest_root([1.0, *(_above(A, M, pair) for A in (C, K))], pair.value)


def _cleared(pair: Pair, C: PETSc.Mat, M: PETSc.Mat, solver: PETSc.KSP, near: float) -> Pair:
    """A pair without what Arnoldi's method mixes into it: fast ones, and violated constraints.

    Args:
        pair: The pair, beside zero.
        C: Damping and gyroscopic terms.
        M: Mass.
        solver: Has factors of the whole `near` zero.
        near: Where that is, 1/s.
    """
    s, (_, a, b) = pair.value + near, pair
    found = a.duplicate(), b.duplicate()
    solver.solve(s.real * (M * a) - s.imag * (M * b) + C * a, found[0])
    solver.solve(s.real * (M * b) + s.imag * (M * a) + C * b, found[1])
    # of size one: zeros grow in each
    size = math.hypot(*(part.norm() for part in found))
    return Pair(pair.value, *(1 / size * part for part in found))


def _factored(A: PETSc.Mat) -> PETSc.KSP:
    """Solver with factors of a matrix."""
    solver = PETSc.KSP().create(A.getComm())
    solver.setOperators(A)
    solver.setType(PETSc.KSP.Type.PREONLY)
    use_mumps(solver.getPC(), PETSc.PC.Type.LU, new_prefix(solver), MUMPS_OPTIONS)
    return solver


def _sharpened(pair: Pair, K: PETSc.Mat, C: PETSc.Mat, M: PETSc.Mat) -> Pair:
    """A pair that oscillates with the nearest root of `v^H T(s) v`.

    What the inverse about the shift is known to makes values far from it less exact by their
    distance over the shift.
    """
    if pair.value.imag == 0:
        return pair
    value = nearest_root([product(A, pair, pair) for A in (M, C, K)], pair.value)
    return pair._replace(value=value)


def nearest_root(parts: Sequence[complex], value: complex) -> complex:
    """The root of a polynomial that is nearest to a value; the value itself without any."""
    nearest = min([*np.roots(parts), np.inf], key=lambda root: abs(root - value))
    return complex(nearest) if np.isfinite(nearest) else value


def _first(
    K: PETSc.Mat, C: PETSc.Mat, M: PETSc.Mat, count: int, attempts: Sequence[tuple[float, int]]
) -> SLEPc.PEP:
    """The solver after the first of some attempts whose eigenvalues could be sorted."""
    failure: BaseException | None = None
    size = 2 * K.getSize()[0]
    wanted = min(2 * count, size)
    for part, basis in attempts:
        solver = SLEPc.PEP().create(K.getComm())
        solver.setOperators([K, C, M])
        solver.setProblemType(SLEPc.PEP.ProblemType.GENERAL)
        solver.setType(SLEPc.PEP.Type.TOAR)
        solver.setWhichEigenpairs(SLEPc.PEP.Which.TARGET_MAGNITUDE)
        solver.setTarget(part)
        solver.setDimensions(wanted, min(max(basis * wanted, 10 * basis), size))
        solver.setTolerances(1e-11, MOST)
        try:
            shift_and_invert(solver)
            solver.solve()
        except (PETSc.Error, SystemError) as error:
            # raised through Cython it may come as the cause of a SystemError
            failure = error if isinstance(error, PETSc.Error) else error.__cause__ or error
        else:
            return solver
    raise ConvergenceError(
        "modes: the eigenproblem has no solution; its matrix must be regular: look for "
        f"bodies without stiffness and mass (PETSc error {getattr(failure, 'ierr', failure)})"
    ) from failure


def _left(pair: Pair, K: PETSc.Mat, C: PETSc.Mat, M: PETSc.Mat) -> float:
    """Remainder of the equation in the direction of the vector, over its largest term."""
    s = pair.value
    return left([s**power * product(A, pair, pair) for power, A in enumerate((K, C, M))])


def product(A: PETSc.Mat, first: Pair, second: Pair) -> complex:
    """`v^H A w` of the vectors of two pairs, for a real matrix."""
    y, z = A * second.real, A * second.imaginary
    real = first.real.dot(y) + first.imaginary.dot(z)
    return complex(real, first.real.dot(z) - first.imaginary.dot(y))


def turned(pair: Pair, angle: float) -> Pair:
    """The pair with its vector times `exp(i angle)`."""
    cosine, sine = math.cos(angle), math.sin(angle)
    real = cosine * pair.real - sine * pair.imaginary
    return Pair(pair.value, real, cosine * pair.imaginary + sine * pair.real)


def poles_of_one(parts: Sequence[complex], branches: Mapping[float, complex]) -> list[complex]:
    """Poles of one coordinate that oscillate, of pairs one, and then those that grow.

    Args:
        parts: Mass, damping and long-term stiffness.
        branches: Stiffness of the branches, by time [s].
    """
    whole = np.poly1d(parts)
    for time in branches:
        whole *= np.poly1d([time, 1.0])
    for time, own in branches.items():
        term = np.poly1d([time * own, 0.0])
        for other in branches:
            term *= np.poly1d([other, 1.0] if other != time else [1.0])
        whole += term
    roots = np.asarray(whole.roots)
    straight = np.abs(roots.imag) < SAME * np.abs(roots)
    high = roots[~straight & (roots.imag > 0)].tolist()
    return [*high, *roots[straight & (roots.real > 0)].real.astype(complex).tolist()]


class Relaxing:
    """Equations of motion with Maxwell branches, about a state where these are relaxed.

    Args:
        K: Long-term stiffness.
        C: Damping and gyroscopic terms.
        M: Mass.
        branches: Stiffness of the branches, by time [s].
    """

    def __init__(
        self, K: PETSc.Mat, C: PETSc.Mat, M: PETSc.Mat, branches: Mapping[float, PETSc.Mat]
    ) -> None:
        self.K, self.C, self.M, self.branches = K, C, M, branches

    def solve(self, count: int, shift: float) -> list[Pair]:
        """Lowest poles that oscillate, of pairs one, with those that are zero or grow.

        Each is found by Newton's method on the full equations, from the mode with the stiffness
        that the branches have at the shift.

        Args:
            count: Number of pairs wanted.
            shift: Size of the lowest eigenvalues, real and positive, 1/s.

        Raises:
            ConvergenceError: If one does not converge, or there are fewer.
        """
        stiff = self.K.copy()
        for time, own in self.branches.items():
            quick = (shift * time) ** 2
            stiff.axpy(quick / (1 + quick), own)
        found: list[Pair] = []
        for pair in solve_quadratic(stiff, self.C, self.M, count + SPARE, shift):
            for refined in self._refined(pair, shift):
                if not any(self._alike(refined, other) for other in found):
                    found.append(refined)
        return sorted(found, key=lambda pair: abs(pair.value))

    def _alike(self, one: Pair, other: Pair) -> bool:
        if abs(one.value - other.value) > SAME * abs(one.value):
            return False
        squares = product(self.M, one, one).real * product(self.M, other, other).real
        return abs(product(self.M, one, other)) ** 2 > (1 - SAME) * squares

    def _starts(self, v: Pair) -> list[complex]:
        """Roots of `v^H T(s) v` that oscillate, of pairs one, or grow."""
        parts = [product(A, v, v) for A in (self.M, self.C, self.K)]
        return poles_of_one(parts, {t: product(own, v, v) for t, own in self.branches.items()})

    def _refined(self, v: Pair, shift: float) -> Iterator[Pair]:
        """The poles near a mode; none where it neither oscillates nor grows."""
        if self._strained(v, shift):
            yield from (self._pole(s, v) for s in self._starts(v))
        else:
            yield from told_from_zero([v], self.K, self.C, self.M, shift)

    def _pole(self, s: complex, v: Pair) -> Pair:
        """The pole from a first one and its shape, by Newton's method."""
        begin, round_off = s, _round_off(self.K, self.M, v)
        for _ in range(STEPS):
            x = self._inverse(s, v)
            step = product(self.M, v, v) / product(self.M, v, x)
            if not np.isfinite(step):
                # it is a pole to the last digit, where there is no inverse
                s *= 1 + ASIDE
                continue
            s -= step
            size = np.sqrt(product(self.M, x, x).real)
            for part in (x.real, x.imaginary):
                part.scale(1 / size)
            v = Pair(s, x.real, x.imaginary)
            # rigid motions on soft springs are known to what round-off of stiffness is beside these
            if abs(step) * abs(s) < max(EXACT * abs(s) ** 2, round_off):
                return v
        raise ConvergenceError(
            f"modes: the pole of sections that relax near {begin:.6g} 1/s did not converge in "
            f"{STEPS} steps; request fewer modes, or refine the mesh"
        )

    def _strained(self, v: Pair, shift: float) -> bool:
        """Decide whether any branch has a part in a mode: rigid motions have none."""
        inertia = max(abs(v.value), shift) ** 2 * product(self.M, v, v).real
        some = sum(product(own, v, v).real for own in self.branches.values())
        return some > HARDLY * inertia

    def _inverse(self, s: complex, v: Pair) -> Pair:
        """`T(s)^-1 T'(s) v`, in real numbers of twice the size."""
        own = self.branches.items()
        stiff = [(s * t / (1 + s * t), t / (1 + s * t) ** 2, A) for t, A in own]
        terms = [(1.0, 0.0, self.K), (s, 1.0, self.C), (s**2, 2 * s, self.M), *stiff]
        real, imaginary = 0.0 * self.K, 0.0 * self.K
        first, second = 0.0 * v.real, 0.0 * v.real
        for factor, slope, A in terms:
            whole, change = complex(factor), complex(slope)
            real.axpy(whole.real, A)
            imaginary.axpy(whole.imag, A)
            y, z = A * v.real, A * v.imaginary
            first += change.real * y - change.imag * z
            second += change.imag * y + change.real * z
        minus = -1.0 * imaginary
        nested = PETSc.Mat().createNest([[real, minus], [imaginary, real]], comm=self.K.getComm())
        matrix = nested.convert("aij")
        b, x = matrix.createVecLeft(), matrix.createVecRight()
        n = first.getLocalSize()
        b.array[:n], b.array[n:] = first.array, second.array
        _factored(matrix).solve(b, x)
        found = self.K.createVecRight(), self.K.createVecRight()
        found[0].array[:], found[1].array[:] = x.array[:n], x.array[n:]
        return Pair(s, *found)
