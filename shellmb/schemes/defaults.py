"""Defaults for schemes whose only unknown state is the one at the end of a step."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from dolfinx import fem

from shellmb.model.body import Body
from shellmb.schemes.base import (
    END,
    LINEAR_PATH,
    JumpStage,
    Levels,
    LocalError,
    Motion,
    Rotations,
    StepForms,
    Values,
)
from shellmb.schemes.pieces import Pieces
from shellmb.schemes.residuals.residual import IntervalForms


class Defaults:
    """Members of `Scheme` that a scheme without states in between need not write.

    Velocities do not jump, and nothing is known of a dissipation.
    """

    scaled: tuple[str, ...] = ()
    slopes: tuple[float, float] = (0.0, 0.0)
    balance: tuple[str, ...] = (END,)
    linear: bool = False
    jumps: bool = False

    @property
    def accelerations(self) -> tuple[str, ...]:
        """All rates but the velocities."""
        return tuple(rate for rate in getattr(self, "rates", ()) if rate != "v")

    @property
    def pieces(self) -> Pieces | None:
        """None: which straight pieces the step is made of is not known."""
        return None

    @property
    def rotations(self) -> Rotations:
        """Accuracy for rotating bodies: that of linear paths."""
        return LINEAR_PATH

    @property
    def local_error(self) -> LocalError:
        """Error of one step: that of the mid-point rule, if nothing else is known."""
        return LocalError(3, 1 / 12) if getattr(self, "order", 2) > 1 else LocalError(2, 1 / 2)

    def forms(self, body: Body, levels: Levels, dt: fem.Constant) -> StepForms:
        """Residuals of one body by the sub-intervals of the stages."""
        return IntervalForms(body, self, levels, dt)  # type: ignore[arg-type]

    def jump(self, levels: Levels, dt: fem.Constant) -> JumpStage | None:
        """Velocities do not jump, if there are any."""
        return None

    def load_weight(self, stage: str, tau: float) -> float:
        """The mean over the step, or the only value that acts (`residual.stage_forms`)."""
        return 1.0

    def prescribed(
        self, stage: str, motion: Motion, t: float, dt: float, rates: Mapping[str, Values]
    ) -> Values:
        """The motion at the end of the step."""
        return motion(t + dt)

    def moved(
        self, q: Any, scaled: Mapping[str, Any], unknown: Mapping[str, Any]
    ) -> dict[str, Any]:
        """The step; work of forces at its end is of first order."""
        return {END: unknown[END] - q}

    def first_guess(self, stage: str, q: Values, scaled: Mapping[str, Values]) -> Values | float:
        """The state at the start of the step."""
        return q

    def resultants(self, start: Values, unknown: Mapping[str, Values]) -> Values:
        """Resultants of the unknown state."""
        return unknown[END]

    def dissipation(self) -> tuple[float, str | None]:
        """Dissipation: none, or unknown."""
        return 0.0, None
