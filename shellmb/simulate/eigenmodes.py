"""The lowest eigenvalues of a model's stiffness and mass, and the stability of its states."""

from collections.abc import Callable
from typing import NamedTuple

from petsc4py import PETSc

import numpy as np

from shellmb.arrays import Bools, Complex, Floats
from shellmb.errors import ConvergenceError
from shellmb.model.elements import coordinate_of
from shellmb.model.model import Model
from shellmb.preprocessing.bodyfields import NONE
from shellmb.preprocessing.modal.tangent import Blocks, bending_scales
from shellmb.system.assembly.blocks import BlockSystem
from shellmb.system.direct.mumps import Inertia, new_prefix
from shellmb.system.direct.symmetry import is_symmetric, sizes_of
from shellmb.system.eigenvalues import eigenpairs, quotients

# parts of bodies that are resultants or multipliers; each assumed strain `S` makes a pair with its
# resultant, of one eigenvalue of either sign
CONSTRAINTS = ("N", "lam", "mu", "hold")
# times what the sum of all products, each off by a last digit, can be off by (measured: 0.95 of it
# at most in free plates and beams)
SUM_ROUND_OFF = 10.0
# a mode below this fraction of the first elastic eigenvalue is a rigid-body motion
RIGID = 1e-5
# the shift lies this many times D/(m L^4) below zero: near the lowest modes, and never on one
SHIFT = 10.0
# Eigenvalues below this fraction of the shift are zero, where all modes are rigid, and so are those
# below this many times what round-off of the stiffness can make (six free plates and beams: 0.95 of
# it at most). Where the matrix is not symmetric, that is known to less
ZERO, ROUND_OFF, NEUTRAL = 1e-10, 10.0, 1e-6
# imaginary parts beyond this of the square are no round-off: where loads follow the bodies, both
# planes of a square column have the same square, which round-off splits by 1e-12
COMPLEX = 1e-6
# Where no count tells of what diverges, it is looked for at lower and lower shifts, down to so many
# times the first one and the lowest that is found, a few at each; two squares that are as near as
# the last number are one
FARTHEST, FARTHER, AT_ONCE, SAME = 1e4, 20.0, 4, 1e-6


class StabilityState(NamedTuple):
    """Properties of a state.

    Args:
        unstable: Number of directions in which it is unstable; None if it is not known.
        symmetric: Whether its stiffness matrix is symmetric. If it is not, `unstable` is None or
            one: an odd number of them.
    """

    unstable: int | None
    symmetric: bool


class Stability:
    """Counts unstable directions of states of a block system, by the inertia of its stiffness.

    All unknowns are in that matrix, resultants and multipliers too: its potential has a saddle, and
    each resultant and each multiplier of a constraint adds one negative eigenvalue, whatever the
    state is. What there is beyond these are directions in which bodies can move to a lower
    potential (J. Nocedal, S. J. Wright, Numerical Optimization, theorem 16.3). Resultants that
    cells eliminate elsewhere are in the matrix here: in thin bodies what they leave is known to
    `(length/thickness)^2` times round-off only.

    Args:
        model: Its bodies, one for each field.
        system: The system.
        matrix: Gives the stiffness matrix at the state that the functions hold, without rows and
            columns of fixed unknowns; always the same one.
    """

    def __init__(
        self, model: Model, system: BlockSystem, matrix: Callable[[], PETSc.Mat] | None = None
    ) -> None:
        self._matrix = matrix or system.symmetric_jacobian
        self._system, self._constraints = system, _constraints(model, system)
        self._inertia: Inertia | None = None
        self._b, self._x = system.x.duplicate(), system.x.duplicate()

    def look(self) -> StabilityState:
        """Properties of the state that the functions hold; collective."""
        A = self._matrix_now = self._matrix()
        if self._inertia is None:
            self._inertia = Inertia(A, f"{new_prefix(self)}inertia_")
        if self._inertia.symmetric:
            negative = self._inertia.negative()
            # fewer than there are constraints: the matrix is singular
            known = negative is not None and negative >= self._constraints
            return StabilityState(negative - self._constraints if known else None, True)  # type: ignore
        odd = self._inertia.odd()
        unstable = 1 if odd is not None and odd != self._constraints % 2 else None
        return StabilityState(unstable, False)

    def apply_inverse(self, b: Floats) -> Floats:
        """Displacement by forces of the state last examined, whose matrix must be symmetric.

        Args:
            b: One number for each owned unknown; those that are held stay.
        """
        assert self._inertia is not None
        self._b.array[:] = b
        self._b.array[self._system.fixed] = 0.0
        self._inertia.solve(self._b, self._x)
        return np.array(self._x.array_r)

    def round_off(self, vector: Floats) -> float:
        """Bound on the round-off of `v.Kv`, at the state last examined.

        Args:
            vector: `v`, one number for each owned unknown.
        """
        self._b.array[:] = np.abs(vector)
        sizes_of(self._matrix_now).mult(self._b, self._x)
        return SUM_ROUND_OFF * float(np.finfo(float).eps * self._b.dot(self._x))


def _constraints(model: Model, system: BlockSystem) -> int:
    """Number of resultants and multipliers over all ranks, those that are held left out."""
    n = system.numbering
    marks: Bools = np.zeros(n.owned, dtype=bool)
    for k, body in enumerate(model.bodies):
        for part in CONSTRAINTS:
            marks[n.own(k, body.mixed.dofs.get(part, NONE))] = True
    marks[system.fixed] = False
    return int(system.comm.allreduce(int(np.sum(marks))))


class Lowest(NamedTuple):
    """Eigenvalues and vectors, those of rigid motions first, then by their real parts.

    Args:
        values: Squares of the angular frequencies, rad^2/s^2.
        vectors: Their vectors, all unknowns of the system.
        rigid: Number of rigid motions.
        unstable: Number of directions in which the state is unstable; None where it is not known.
        energies: Halves of the quadratic forms of the stiffness, of the size of each vector.
    """

    values: Complex
    vectors: list[PETSc.Vec]
    rigid: int
    unstable: int | None
    energies: list[float]


def lowest(
    model: Model, system: BlockSystem, stiffness: Blocks, mass: Blocks, count: int, loaded: bool
) -> Lowest:
    """The lowest eigenvalues; collective.

    Args:
        model: The model.
        system: Its block system at a state.
        stiffness: Forms of its stiffness matrix there, as of `tangent`.
        mass: Forms of its mass matrix.
        count: Number of eigenvalues, those of rigid motions included.
        loaded: Whether loads act at the state.

    Raises:
        ConvergenceError: If the eigenproblem does not converge, or there are fewer eigenvalues.
    """
    K = system.symmetric_matrix(stiffness, 1.0)
    M = system.symmetric_matrix(mass, 0.0)
    symmetric = is_symmetric(K)
    shift = shift_below(model, loaded)
    values, vectors = eigenpairs(K, M, count, shift, symmetric)
    unstable = _unstable(model, system, K, M, RIGID * abs(shift)) if symmetric else None
    missing = (unstable or 0) - int(np.sum(values.real < -RIGID * abs(shift)))
    if missing > 0:
        # far beyond a critical load the lowest ones are not those next to the shift
        values, vectors = eigenpairs(K, M, count + missing, shift, symmetric)
    if not symmetric:
        # nothing counts them there
        values, vectors = _with_far_ones(K, M, values, vectors, shift)
    values.imag *= np.abs(values.imag) > COMPLEX * np.abs(values)
    zero = np.full(len(values), NEUTRAL * abs(shift))
    if symmetric:
        quotient, round_off = quotients(K, M, vectors)
        values, zero = (
            quotient.astype(np.complex128),
            np.maximum(ZERO * abs(shift), ROUND_OFF * round_off),
        )
    else:
        # told from the elastic ones by the largest gap, not by the highest mode asked for
        elastic = float(np.max(np.abs(values)))
        positive = np.sort(np.abs(values))
        zero = np.maximum(zero, RIGID * next((v for v in positive if v > 1e-8 * elastic), elastic))
    still = np.abs(values) < zero
    order = np.lexsort((values.real, ~still))[:count]
    kept, rigid = [vectors[k] for k in order], int(np.sum(still[order]))
    energies = [float(np.real(vector.dot(K * vector))) / 2 for vector in kept]
    return Lowest(values[order], kept, rigid, unstable, energies)


def _with_far_ones(
    K: PETSc.Mat, M: PETSc.Mat, values: Complex, vectors: list[PETSc.Vec], shift: float
) -> tuple[Complex, list[PETSc.Vec]]:
    """Add pairs that diverge far beyond the shift, next to lower and lower ones.

    What diverges is nearer to a shift that is twice as low than all that swings.
    """
    target, few = shift, min(len(values), AT_ONCE)
    while target > FARTHEST * shift or target > FARTHER * np.min(values.real):
        target = 10.0 * target
        try:
            found, there = eigenpairs(K, M, few, target, False)
        except ConvergenceError:
            # of few unknowns multipliers are all that is there
            break
        # of double ones, as of a square column, both
        known, lowest = values, float(np.min(values.real))
        for value, vector, own in zip(found, there, quotients(K, M, there)[0], strict=True):
            new = np.min(np.abs(known - value)) > SAME * abs(value)
            # of multipliers the quotient is another number
            diverges = value.imag == 0.0 and abs(own - value.real) < SAME * abs(value)
            if diverges and new and value.real < -RIGID * abs(shift):
                values, vectors = np.append(values, value), [*vectors, vector]
        if np.min(values.real) < lowest:
            # go on from there
            target = max(target, float(np.min(values.real)) / 5.0)
    return values, vectors


def _unstable(
    model: Model, system: BlockSystem, K: PETSc.Mat, M: PETSc.Mat, above: float
) -> int | None:
    """Number of squares below `-above`, which leaves out those that are zero up to round-off."""
    shifted = K.copy()
    shifted.axpy(above, M)
    return Stability(model, system, lambda: shifted).look().unstable


def shift_below(model: Model, loaded: bool) -> float:
    """A negative shift of the size of the lowest eigenvalues, rad^2/s^2."""
    found = bending_scales(model)
    found += [float(np.min(data.omega2)) / SHIFT for data in model.modal]
    if not found:
        # rigid bodies swing by their weight, by springs, or as the scene's time says
        scene, size = model.scene, model.length
        weights = scene.weights if loaded else ()
        found = [float(np.linalg.norm(w.acceleration)) / size for w in weights]
        for e in scene.force_elements:
            arm = size if coordinate_of(scene, e)[1] == "rotation" else 1.0
            found += [e.stiffness / arm**2 / model.mass] if e.stiffness else []
        found = found or [scene.t_end**-2]
    return -SHIFT * min(found)
