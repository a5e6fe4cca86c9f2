"""Number of unstable directions of a static state, by the inertia of its stiffness matrix.

All unknowns are in that matrix, resultants and multipliers too: its potential has a saddle, and
each resultant and each multiplier of a constraint adds one negative eigenvalue, whatever the state
is. What there is beyond these are directions in which bodies can move to a lower potential
(J. Nocedal, S. J. Wright, Numerical Optimization, theorem 16.3). Resultants that cells eliminate
elsewhere are in the matrix here: in thin bodies what they leave is known to `(length/thickness)^2`
times round-off only.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from petsc4py import PETSc

import numpy as np

from shellmb.arrays import Bools, Floats
from shellmb.model.model import Model
from shellmb.preprocessing.bodyfields import NONE
from shellmb.system.assembly.blocks import BlockSystem
from shellmb.system.direct.inertia import Inertia
from shellmb.system.direct.mumps import new_prefix

# parts of bodies that are resultants or multipliers; each assumed strain `S` makes a pair with its
# resultant, of one eigenvalue of either sign
CONSTRAINTS = ("N", "lam", "mu", "hold")

# times what the sum of all products, each off by a last digit, can be off by (measured: 0.95 of it
# at most in free plates and beams)
ROUND_OFF = 10.0


@dataclass(frozen=True)
class StabilityState:
    """Properties of a state.

    Args:
        unstable: Number of directions in which it is unstable; None if it is not known.
        symmetric: Whether its stiffness matrix is symmetric. If it is not, `unstable` is None or
            one: an odd number of them.
    """

    unstable: int | None
    symmetric: bool


class Stability:
    """Counts unstable directions of states of a block system.

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
        return StabilityState(
            1 if odd is not None and odd != self._constraints % 2 else None, False
        )

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
        A = self._matrix_now
        ends, columns, entries = A.getValuesCSR()
        sizes = PETSc.Mat().createAIJ(
            A.getSizes(), csr=(ends, columns, np.abs(entries)), comm=A.comm
        )
        self._b.array[:] = np.abs(vector)
        sizes.mult(self._b, self._x)
        return ROUND_OFF * float(np.finfo(float).eps * self._b.dot(self._x))


def _constraints(model: Model, system: BlockSystem) -> int:
    """Number of resultants and multipliers over all ranks, those that are held left out."""
    n = system.numbering
    marks: Bools = np.zeros(n.owned, dtype=bool)
    for k, body in enumerate(model.bodies):
        for part in CONSTRAINTS:
            numbers = n.by_field[k][body.mixed.dofs.get(part, NONE)] - n.start
            marks[numbers[(numbers >= 0) & (numbers < n.owned)]] = True
    marks[system.fixed] = False
    return int(system.comm.allreduce(int(np.sum(marks))))
