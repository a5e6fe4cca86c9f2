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
        # the last states, the newest first; an array of its own after each step, so that who was
        # given them may keep them
        self._past = np.zeros((0, self._nodes.system.numbering.owned))
        self._errors: list[float] = []
        self._key: Hashable = None

    def guess(self, key: Hashable) -> PETSc.Vec | None:
        """Unknowns at the end of the next step; None if the past does not tell.

        Args:
            key: What steps have in common that continue one another.
        """
        known = len(self._past)
        if not known or key != self._key:
            return None
        degree = int(np.argmin(self._errors)) if self._errors else 0
        self._guess.array[:] = WEIGHTS[degree, :known] @ self._past
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
        new, known = x.array_r, len(self._past)
        if known:
            guesses = WEIGHTS[:known, :known] @ self._past
            found = self._convergence.sizes(new, new - guesses).tolist()
            old = self._errors
            self._errors = [
                MEMORY * error + (1 - MEMORY) * before
                for error, before in zip(found, old, strict=False)
            ]
            self._errors += found[len(old) :]
        self._past = np.concatenate([new[None], self._past[: len(WEIGHTS) - 1]])

    def arrays(self) -> dict[str, Floats]:
        """What a restart needs of the past: unknowns that this rank owns."""
        return {str(k): state for k, state in enumerate(self._past)}

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
        states = [arrays[str(k)] for k in range(len(arrays))]
        self._past = np.reshape(states, (len(arrays), self._past.shape[1]))
        self._errors, self._key = list(errors), key
