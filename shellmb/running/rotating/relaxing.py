"""Poles of sections that relax: `(s^2 M + s C + K + sum_i s tau_i/(1 + s tau_i) K_i) v = 0`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from petsc4py import PETSc

import numpy as np

from shellmb.errors import ConvergenceError
from shellmb.running.rotating.quadratic import NEUTRAL, Pair, product, solve_quadratic
from shellmb.system.eigenvalues import factors_of_mumps

# Newton's method ends at this change of the pole, relative; so many steps at most
EXACT, MOST = 1e-11, 30
# so many more modes than wanted: branches order them anew
SPARE = 4
# poles nearer than this, with shapes as near, are one
SAME = 1e-6
# branches with this share of the energy of a mode have no part in it
HARDLY = 1e-9
# Creep is slow: only what is below this part of the shift is zero, or does not grow, and rigid
# motions, known to a small part of the shift, are brought below it
STILL = 1e-10


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
        whole = np.poly1d(parts)
        for time in self.branches:
            whole *= np.poly1d([time, 1.0])
        for time, own in self.branches.items():
            term = np.poly1d([time * product(own, v, v), 0.0])
            for other in self.branches:
                term *= np.poly1d([other, 1.0] if other != time else [1.0])
            whole += term
        roots = np.asarray(whole.roots)
        straight = np.abs(roots.imag) < SAME * np.abs(roots)
        high = roots[~straight & (roots.imag > 0)].tolist()
        return [*high, *roots[straight & (roots.real > 0)].real.astype(complex).tolist()]

    def _refined(self, v: Pair, shift: float) -> Iterator[Pair]:
        """The poles near a mode; none where it neither oscillates nor grows."""
        if self._strained(v, shift):
            yield from (self._pole(s, v) for s in self._starts(v))
        else:
            yield Pair(STILL * v.value, *v[1:]) if abs(v.value) < NEUTRAL * shift else v

    def _pole(self, s: complex, v: Pair) -> Pair:
        """The pole from a first one and its shape, by Newton's method."""
        begin = s
        for _ in range(MOST):
            x = self._inverse(s, v)
            step = product(self.M, v, v) / product(self.M, v, x)
            s -= step
            size = np.sqrt(product(self.M, x, x).real)
            for part in (x.real, x.imaginary):
                part.scale(1 / size)
            v = Pair(s, x.real, x.imaginary)
            if abs(step) < EXACT * abs(s):
                return v
        raise ConvergenceError(
            f"modes: the pole of sections that relax near {begin:.6g} 1/s did not converge in "
            f"{MOST} steps; request fewer modes, or refine the mesh"
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
        real, imaginary = self.K.copy(), self.K.copy()
        first, second = self.K.createVecLeft(), self.K.createVecLeft()
        real.scale(0.0)
        imaginary.scale(0.0)
        y = first.duplicate()
        for factor, slope, A in terms:
            whole, change = complex(factor), complex(slope)
            real.axpy(whole.real, A)
            imaginary.axpy(whole.imag, A)
            for part, on in ((v.real, change), (v.imaginary, 1j * change)):
                A.mult(part, y)
                first.axpy(on.real, y)
                second.axpy(on.imag, y)
        minus = imaginary.copy()
        minus.scale(-1.0)
        nested = PETSc.Mat().createNest([[real, minus], [imaginary, real]], comm=self.K.getComm())
        matrix = nested.convert("aij")
        b, x = matrix.createVecLeft(), matrix.createVecRight()
        n = first.getLocalSize()
        b.array[:n], b.array[n:] = first.array, second.array
        solver = PETSc.KSP().create(self.K.getComm())
        solver.setOperators(matrix)
        solver.setType(PETSc.KSP.Type.PREONLY)
        factors_of_mumps(solver, solver)
        solver.solve(b, x)
        found = self.K.createVecRight(), self.K.createVecRight()
        found[0].array[:], found[1].array[:] = x.array[:n], x.array[n:]
        return Pair(s, *found)
