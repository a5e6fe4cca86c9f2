"""Steps that are tried, and then accepted or rejected."""

from __future__ import annotations

import math
from numbers import Real
from typing import Any

from shellmb.errors import SceneError
from shellmb.scene.values.validate import show


class Trials:
    """A motion whose steps may be repeated.

    A trial begins with exactly what was saved when the last step was accepted, and with nothing
    else: what was tried before leaves no trace, not in the last bit. Factors of matrices are made
    anew in each trial, because those of a rejected one would be a trace.

    Attributes:
        time: The time, s.
    """

    time: float
    _saved: Any = None
    _tried = False

    def trial(self, dt: float) -> None:
        """Compute a step, which is not accepted yet; a further trial replaces it.

        Args:
            dt: Its length, s.

        Raises:
            ConvergenceError: If it has no solution; the motion is where it was before.
            SceneError: If the length is impossible.
        """
        if isinstance(dt, bool) or not isinstance(dt, Real) or not 0 < dt < math.inf:
            raise SceneError(f"trial: dt is {show(dt)}; it must be finite and greater than 0")
        if self._saved is None:
            self._saved = self.state()
        self._tried = False
        self._restore(self._saved)
        try:
            self._advance(float(dt))
        except BaseException:
            self._restore(self._saved)
            raise
        self._tried = True

    def accept(self) -> None:
        """Make the end of the trial the state from which the motion continues.

        Raises:
            SceneError: If there is no trial.
        """
        self._need_trial("accept")
        self._saved, self._tried = None, False

    def reject(self) -> None:
        """Go back to the start of the trial, bit for bit.

        Raises:
            SceneError: If there is no trial.
        """
        self._need_trial("reject")
        self._restore(self._saved)
        self._tried = False

    def state(self) -> Any:
        """Copy of all that steps change now, for `take_up`."""
        raise NotImplementedError

    def take_up(self, state: Any) -> None:
        """Be at a state again, as often as wanted, bit for bit.

        Args:
            state: As from `state`.
        """
        self._restore(state)
        self._saved, self._tried = None, False

    def _need_trial(self, what: str) -> None:
        if not self._tried:
            raise SceneError(f"{what}: there is no trial; call trial(dt) first, which must succeed")

    def _restore(self, saved: Any) -> None:
        """Take up what was saved, which may be done again."""
        raise NotImplementedError

    def _advance(self, dt: float) -> None:
        """Solve the step."""
        raise NotImplementedError
