"""First guess of a step: the steps before it, extrapolated; directors stay on the sphere."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence

from petsc4py import PETSc

import numpy as np
import numpy.typing as npt

from shellmb.system.convergence import Convergence
from shellmb.system.nodes import SystemNodes

Floats = npt.NDArray[np.float64]

# weights of the last states, the newest first, of polynomials of degree 0, 1, 2, 3 in the step
WEIGHTS = np.array([[1, 0, 0, 0], [2, -1, 0, 0], [3, -3, 1, 0], [4, -6, 4, -1]], dtype=float)
# share of the last error in the mean that tells which degree does best
MEMORY = 0.5


class Predictor:
    """Extrapolates the unknowns of steps that continue one another, of equal length first of all.

    Which degree does best depends on the motion: high degrees do for smooth ones, low degrees where
    stiff parts oscillate. The one with the smallest error in the steps before is taken.

    Args:
        nodes: Nodes of the system that carry directors.
        convergence: Measures errors as it measures updates.
    """

    def __init__(self, nodes: SystemNodes, convergence: Convergence) -> None:
        self._nodes, self._convergence = nodes, convergence
        self._guess = nodes.system.x.duplicate()
        self.clear()

    def clear(self) -> None:
        """Forget the past: motion does not continue smoothly."""
        self._states: list[Floats] = []
        self._errors: list[float] = []
        self._key: Hashable = None

    def guess(self, key: Hashable) -> PETSc.Vec | None:
        """Unknowns at the end of the next step; None if the past does not tell.

        Args:
            key: What steps have in common that continue one another.
        """
        if not self._states or key != self._key:
            return None
        degree = int(np.argmin(self._errors)) if self._errors else 0
        self._guess.array[:] = self._extrapolations()[degree]
        self._nodes.normalise(self._guess)
        return self._guess

    def accept(self, x: PETSc.Vec, key: Hashable) -> None:
        """Remember the solution of a step.

        Args:
            x: Unknowns.
            key: What steps have in common that continue one another.
        """
        if key != self._key:
            self.clear()
        self._key = key
        new = np.array(x.array_r)
        guesses = self._extrapolations()
        for degree, guess in enumerate(guesses):
            error = self._convergence.size(new, new - guess)
            if degree < len(self._errors):
                error = MEMORY * error + (1 - MEMORY) * self._errors[degree]
                self._errors[degree] = error
            else:
                self._errors.append(error)
        self._states = [new, *self._states[: len(WEIGHTS) - 1]]

    def arrays(self) -> dict[str, Floats]:
        """What a restart needs of the past: unknowns that this rank owns."""
        return {str(k): state for k, state in enumerate(self._states)}

    def state(self) -> list[float]:
        """The other part of it: how each degree has done."""
        return list(self._errors)

    def restore(self, arrays: Mapping[str, Floats], errors: Sequence[float], key: Hashable) -> None:
        """Take up a saved past.

        Args:
            arrays: As from `arrays`.
            errors: As from `state`.
            key: That of the step to come.
        """
        self._states = [arrays[str(k)] for k in range(len(arrays))]
        self._errors, self._key = list(errors), key

    def _extrapolations(self) -> Floats:
        """Of all degrees that the past allows, shape (degrees, n)."""
        known = len(self._states)
        if not known:
            return np.zeros((0, 0))
        return np.asarray(WEIGHTS[:known, :known] @ np.stack(self._states))
