"""What `shellmb bench --effects` records."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from statistics import quantiles
from typing import Any


@dataclass(frozen=True)
class Side:
    """A scene, with an effect or without it.

    Args:
        unknowns: Unknowns of the block system.
        solved: Unknowns of the linear systems.
        stored: Numbers that are kept from step to step.
        coefficients: Functions and constants in the residuals.
        integrals: Integrals of the residuals.
        kernels: Compiled residuals and Jacobians; of an observer its own, too.
        iterations_per_step: Newton iterations.
        factorisations_per_step: Factorisations.
        step_s: Processor time of a step, the median of the rounds, s.
    """

    unknowns: int
    solved: int
    stored: int
    coefficients: int
    integrals: int
    kernels: int
    iterations_per_step: float
    factorisations_per_step: float
    step_s: float


@dataclass(frozen=True)
class EffectRecord:
    """What a step costs with an effect and without it.

    Args:
        effect: Name of the effect.
        group: Its group.
        scheme: Time scheme of the scene that has it.
        mesh: Elements of the plate along its sides, "16x4"; "-" for rigid bodies.
        having: The scene with it.
        lacking: The scene without it.
        saved: Share of the step time that goes without it, the median over the rounds; negative
            where steps then take longer.
        spread: Width of the middle half of these shares.
        rounds: Number of rounds; in each both scenes were run.
        ranks: Number of processes.
    """

    effect: str
    group: str
    scheme: str
    mesh: str
    having: Side
    lacking: Side
    saved: float
    spread: float
    rounds: int
    ranks: int

    def to_dict(self) -> dict[str, Any]:
        """Plain values."""
        values = asdict(self)
        return {
            {"having": "with", "lacking": "without"}.get(name, name): value
            for name, value in values.items()
        }


def shares(pairs: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Median share of the time that is saved, and the width of the middle half of the shares.

    The extremes of many short rounds tell what else the machine did.

    Args:
        pairs: Times with and without, of each round.
    """
    found = [1 - less / own for own, less in pairs]
    if len(found) == 1:
        return found[0], 0.0
    lower, middle, upper = quantiles(found, n=4, method="inclusive")
    return middle, upper - lower


def to_json(records: Sequence[EffectRecord]) -> str:
    """Records as a JSON list."""
    return json.dumps([r.to_dict() for r in records], indent=1)
