"""Statics: forces in equilibrium at one state."""

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
    at_state,
)


@dataclass(frozen=True)
class Static:
    """Static equilibrium at the end of each load step."""

    name: str = "static"
    title: str = "static equilibrium"
    order: int = 0
    dynamic: bool = False
    stages: tuple[str, ...] = ("f",)
    rates: tuple[str, ...] = ()
    conserves: frozenset[str] = frozenset()
    linear: bool = False
    jumps: bool = False
    rotations: Rotations = LINEAR_PATH

    def expand(self, levels: Levels, dt: fem.Constant) -> dict[str, Stage]:
        """All forces at the unknown state."""
        return {"f": Stage(at_state(levels.unknown["f"]))}

    def jump(self, levels: Levels, dt: fem.Constant) -> JumpStage | None:
        """There are no velocities."""
        return None

    def load_weight(self, stage: str, tau: float) -> float:
        """Loads act with their value at the end of the load step."""
        return 1.0

    def prescribed(
        self, stage: str, motion: Motion, t: float, dt: float, rates: Mapping[str, Values]
    ) -> Values:
        """Prescribed values at the end of the load step."""
        return motion(t + dt)

    def advance(
        self,
        q: Values,
        rates: Mapping[str, Values],
        unknown: Mapping[str, Values],
        dt: float,
        tangent: Tangent,
    ) -> dict[str, Values]:
        """There are no rates."""
        return {}

    def moved(self, q: Any, push: Any, unknown: Mapping[str, Any]) -> dict[str, Any]:
        """The load step."""
        return {END: unknown[END] - q}

    def dissipation(self) -> tuple[float, str | None]:
        """Nothing is dissipated."""
        return 0.0, None


@dataclass(frozen=True)
class Linear(Static):
    """Linear statics: internal forces linearised about the undeformed state.

    The start of the step serves as the state of linearisation and stays undeformed.
    """

    name: str = "linear"
    title: str = "linear statics (small displacements)"
    linear: bool = True

    def expand(self, levels: Levels, dt: fem.Constant) -> dict[str, Stage]:
        """All forces at the undeformed state."""
        return {"f": Stage(at_state(levels.q))}
