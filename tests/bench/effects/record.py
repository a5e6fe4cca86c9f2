"""Records of `python -m tests.bench --effects`."""

from __future__ import annotations

from dataclasses import dataclass


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
    """Cost of a step with an effect and without it.

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
