"""Schemes quadratic in time: energy preserving of order 4, energy decaying of order 3."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from dolfinx import fem

from shellmb.forms.steps.path import Path, path_of
from shellmb.schemes.base import (
    END,
    JumpStage,
    Levels,
    Motion,
    Rotations,
    Stage,
    Tangent,
    Values,
    end_velocity,
)

# unknown velocities at the end, times the step
RATE = "v"


@dataclass(frozen=True)
class QuadraticInTime:
    """State and velocity quadratic over a step, stresses linear, eqs. (Q1)-(Q5).

    Unknown are the state and the velocity at the end of a step, `q_f` and `h v_f`. Energy is kept
    exactly for `alpha = 0`, and falls in every step for `alpha > 0` by

        alpha [ 2 v_2.M v_2 + (e_i + e_f - 2<s>).C (e_i + e_f - 2<s>)/2 ]                    (Q5)

    with the mean `<s>` of the path that a strain is assumed to take (`forms.steps.path`), which is
    not the mean of the strain of the path of the state.

    Constraints hold at the end of a step for positions and velocities. For linear systems this is
    the family of the paper's energy decaying scheme (Gauss' method with two stages, Radau IIA); in
    large motions it keeps its order, and stiff strains do not hinder a spinning body.

    Args:
        alpha: Dissipation, from 0 (none) to 1 (asymptotic annihilation).
        name: Name in the registry.
    """

    alpha: float = 0.0
    name: str = "ep4"
    dynamic: bool = True
    stages: tuple[str, ...] = (END, RATE)
    rates: tuple[str, ...] = ("v",)
    linear: bool = False
    jumps: bool = False

    @property
    def title(self) -> str:
        """What it is, in words."""
        kind = "decaying (ED3)" if self.alpha > 0 else "preserving (EP4)"
        return f"energy {kind}, quadratic in time"

    @property
    def rotations(self) -> Rotations:
        """How well it follows bodies that turn."""
        # 1.5 rad: rational functions that vibrations are multiplied by turn by 0.6 % less (alpha =
        # 0) to 1.6 % less there, and lose 5 % (alpha = 1)
        return Rotations(1.5)

    @property
    def order(self) -> int:
        """Order of accuracy in time, also in large motions."""
        return 3 if self.alpha > 0 else 4

    @property
    def conserves(self) -> frozenset[str]:
        """Linear momentum always, energy without dissipation, angular momentum to the order."""
        return frozenset({"momentum"} | ({"energy"} if self.alpha == 0 else set()))

    def expand(self, levels: Levels, dt: fem.Constant) -> dict[str, Stage]:
        """Rows are no sub-intervals here: see `path`."""
        return {}

    def path(self, levels: Levels) -> Path:
        """The step of one body."""
        assert levels.push is not None
        alpha = fem.Constant(levels.q.function_space.mesh, float(self.alpha))
        unknown = levels.unknown
        return path_of(levels.q, unknown[END], levels.push, unknown[RATE], alpha)

    def jump(self, levels: Levels, dt: fem.Constant) -> JumpStage | None:
        """Velocities do not jump."""
        return None

    def load_weight(self, stage: str, tau: float) -> float:
        """The test functions P0 and P1."""
        return 1.0 if stage == END else 2 * tau - 1

    def prescribed(
        self, stage: str, motion: Motion, t: float, dt: float, rates: Mapping[str, Values]
    ) -> Values:
        """The motion at the end, and its velocity there times the step."""
        if stage == END:
            return motion(t + dt)
        return dt * end_velocity(motion, t, dt)

    def advance(
        self,
        q: Values,
        rates: Mapping[str, Values],
        unknown: Mapping[str, Values],
        dt: float,
        tangent: Tangent,
    ) -> dict[str, Values]:
        """Velocity at the end."""
        return {"v": unknown[RATE] / dt}

    def resultants(self, start: Values, unknown: Mapping[str, Values]) -> Values:
        """Resultants of the state at the end from those at the start and of the rows, eq. (Q3)."""
        a = self.alpha
        return (2 * unknown[RATE] + (1 - a) * start + 2 * a * unknown[END]) / (1 + a)

    def mean(self, q: Any, push: Any, unknown: Mapping[str, Any]) -> Any:
        """Mean of the path; arguments as of `moved`."""
        bow = self.moved(q, push, unknown)[RATE] / 6
        return (q + unknown[END]) / 2 - bow

    def moved(self, q: Any, push: Any, unknown: Mapping[str, Any]) -> dict[str, Any]:
        """What forces of each row work on over a step: the chord, and six times the bow."""
        chord = unknown[END] - q
        a = self.alpha
        bow = ((1 + a) * unknown[RATE] - (1 - a) * push) / 2 - a * chord
        return {END: chord, RATE: bow}

    def dissipation(self) -> tuple[float, str | None]:
        """There is no jump; what alpha damps is in `path`."""
        return self.alpha, None


def energy_decaying_3(alpha: float) -> QuadraticInTime:
    """ED3 with a dissipation; without any it is the scheme that preserves energy."""
    return QuadraticInTime(alpha, "ed3")
