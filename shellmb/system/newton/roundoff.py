"""Round-off of the equations: what no update of the unknowns makes smaller."""

import math

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from shellmb.system.assembly.blocks import BlockSystem
from shellmb.system.direct.symmetry import sizes_of
from shellmb.system.newton.convergence import Convergence

# an update that is not smaller than this part of the smallest one so far makes no progress
PROGRESS = 0.5
# so many updates in a row without progress are looked at
STALLED = 2
# motion in an update, relative to the size of bodies, up to which they count as being at rest
STILL = 1e-6
# updates that round-off may make: beyond it forces have no digits that are worth a step
WORST = 1e-4
# residuals up to so many times the round-off of their terms are nothing else: in stalled solutions
# of mechanisms and plates it is 0.2 to 3, before the last iterations 1e5 and more
NOISE = 10.0
EPS = float(np.finfo(np.float64).eps)


class RoundOff:
    """Tells whether what is left of the equations is the round-off of their own terms.

    A row is a sum of terms. Each is known to its last digit at best, and an unknown that is wrong
    in its last digit changes row `i` by `eps |J_ij| size_j`. Where `|r_i|` is no larger than some
    multiple of the sum of these in all rows, the unknowns solve equations whose terms differ from
    the given ones by round-off (the componentwise backward error of W. Oettli and W. Prager,
    Numer. Math. 6 (1964) 405-409), and more iterations only find other such solutions. Near
    singular positions these differ by more than any tolerance in what is badly determined:
    multipliers.

    Args:
        system: The block system.
        convergence: Knows how large unknowns are.

    Attributes:
        found: What changed most in the last update of a solution that ended so, and by how much;
            nothing if it ended otherwise.
    """

    def __init__(self, system: BlockSystem, convergence: Convergence) -> None:
        self._system, self._convergence = system, convergence
        self.begin()

    def begin(self) -> None:
        """A new solution."""
        self.found: tuple[str, float] = ("", 0.0)
        self._best, self._stalled = math.inf, 0

    def is_all(self, update: float, moved: float, b: PETSc.Vec) -> bool:
        """Record an update; whether it and those before are nothing but round-off; collective.

        Args:
            update: Its size, relative to those of the parts.
            moved: How far it moved bodies, relative to their sizes.
            b: Residual at the state that the fields hold.
        """
        self._stalled = self._stalled + 1 if update >= PROGRESS * self._best else 0
        self._best = min(self._best, update)
        if update > WORST or moved > STILL or not self.is_left(b):
            return False
        self.found = self._convergence.worst()
        return True

    def is_left(self, b: PETSc.Vec) -> bool:
        """Decide whether updates make no progress and only round-off is left; collective.

        Args:
            b: Residual at the state that the fields hold.
        """
        return self._stalled >= STALLED and self.left(b) <= NOISE

    def left(self, b: PETSc.Vec) -> float:
        """Largest residual relative to the round-off of the row's terms; collective.

        Args:
            b: Residual at the state that the fields hold.
        """
        system = self._system
        system.jacobian(system.x, system.A)
        sizes, terms = system.A.createVecs()
        sizes.array[:] = self._convergence.typical(system.x.array_r)
        sizes_of(system.A).mult(sizes, terms)
        # rows without terms have none left
        noise = np.maximum(EPS * terms.array_r, np.finfo(float).tiny)
        # what follows from other unknowns, a change of velocities say, has the round-off of these,
        # which its own size does not tell
        rows = self._convergence.judged
        largest = float(np.max((np.abs(b.array_r) / noise)[rows], initial=0.0))
        return float(system.comm.allreduce(largest, op=MPI.MAX))
