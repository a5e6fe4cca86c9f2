"""Energy-preserving scheme of section 3 of the paper."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from dolfinx import fem

from shellmb.schemes.base import (
    END,
    LINEAR_PATH,
    JumpStage,
    Levels,
    Motion,
    Rotations,
    Stage,
    Tangent,
    Values,
    interval,
)


@dataclass(frozen=True)
class EnergyPreserving:
    """Mid-point forces with averaged stresses, eqs. (23), (26), (27); second order.

    Energy and both momenta are conserved whatever the step.
    """

    name: str = "ep"
    title: str = "energy preserving (EP)"
    order: int = 2
    dynamic: bool = True
    stages: tuple[str, ...] = ("f",)
    rates: tuple[str, ...] = ("v",)
    conserves: frozenset[str] = frozenset({"energy", "momentum", "angular momentum"})
    linear: bool = False
    jumps: bool = False
    rotations: Rotations = LINEAR_PATH

    def expand(self, levels: Levels, dt: fem.Constant) -> dict[str, Stage]:
        """Eq. (23) gives `v_f = 2 (q_f - q_i)/dt - v_i`; `(v_f - v_i)/dt` is the rate."""
        q, v, qf = levels.q, levels.rates["v"], levels.unknown["f"]
        velocity = (qf - q) / dt
        return {
            "f": Stage(
                interval(q, qf), rate=2 * (velocity - v) / dt, velocity=velocity, chord=velocity
            )
        }

    def jump(self, levels: Levels, dt: fem.Constant) -> JumpStage | None:
        """Velocities do not jump."""
        return None

    def load_weight(self, stage: str, tau: float) -> float:
        """The mean over the step."""
        return 1.0

    def prescribed(
        self, stage: str, motion: Motion, t: float, dt: float, rates: Mapping[str, Values]
    ) -> Values:
        """The motion at the end of the step."""
        return motion(t + dt)

    def advance(
        self,
        q: Values,
        rates: Mapping[str, Values],
        unknown: Mapping[str, Values],
        dt: float,
        tangent: Tangent,
    ) -> dict[str, Values]:
        """Velocity at the end, eq. (23)."""
        return {"v": 2 * (unknown["f"] - q) / dt - rates["v"]}

    def moved(self, q: Any, push: Any, unknown: Mapping[str, Any]) -> dict[str, Any]:
        """The step."""
        return {END: unknown[END] - q}

    def dissipation(self) -> tuple[float, str | None]:
        """Nothing is dissipated."""
        return 0.0, None
