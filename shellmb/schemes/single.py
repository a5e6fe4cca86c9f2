"""What schemes have in common whose only unknown state is that at the end of the step."""

from collections.abc import Mapping
from typing import Any

from dolfinx import fem

from shellmb.schemes.base import END, JumpStage, Levels, Motion, Values


class SingleStage:
    """A scheme without states in between: no jump, and nothing known of a dissipation."""

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

    def moved(self, q: Any, push: Any, unknown: Mapping[str, Any]) -> dict[str, Any]:
        """The step; work of forces at its end is of first order."""
        return {END: unknown[END] - q}

    def dissipation(self) -> tuple[float, str | None]:
        """Nothing is dissipated, or it is not known."""
        return 0.0, None
