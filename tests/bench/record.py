"""Records of `python -m tests.bench`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median_low

from shellmb.accuracy.measuring import spread

# the parts of a step that are measured inside it, in the order in which they are drawn
PARTS = ("residual_s", "jacobian_s", "reduction_s", "factor_s", "solve_s", "observers_s")


@dataclass(frozen=True)
class Configuration:
    """A way to solve.

    Args:
        path: Unknowns of the linear systems: "full" or "reduced".
        newton: When to factorise: "full", "modified" or "auto".
    """

    path: str
    newton: str

    def __str__(self) -> str:
        return f"{self.path}/{self.newton}"


# the yardstick first, the default last
CONFIGURATIONS = (
    Configuration("full", "full"),
    Configuration("reduced", "full"),
    Configuration("reduced", "modified"),
    Configuration("reduced", "auto"),
)
UNREDUCED, FULL, MODIFIED, AUTO = CONFIGURATIONS


@dataclass(frozen=True)
class Record:
    """Cost of one configuration; all times in seconds per step.

    Args:
        scene: "dynamic", "triangles" or "static".
        scheme: Time scheme.
        path: "full" or "reduced".
        newton: When it factorises.
        mesh: Elements along the two sides, "6x2".
        elements: Their number.
        unknowns: Number of unknowns of the linear system.
        iterations_per_step: Newton iterations.
        factorisations_per_step: Factorisations.
        step_s: A whole step with the observers of `shellmb run`.
        residual_s: Residuals.
        jacobian_s: Jacobians; in the reduced path with what is reduced cell by cell.
        reduction_s: What else the reduction takes.
        factor_s: Factorisations.
        solve_s: Solutions with them.
        observers_s: Observers and output.
        bare_s: Assembly kernels, factorisation and solution, each timed alone, times how often each
            ran.
        peak_mib: Peak of the resident memory of a process of its own, MiB; None: not measured.
        ranks: Number of processes.
    """

    scene: str
    scheme: str
    path: str
    newton: str
    mesh: str
    elements: int
    unknowns: int
    iterations_per_step: float
    factorisations_per_step: float
    step_s: float
    residual_s: float
    jacobian_s: float
    reduction_s: float
    factor_s: float
    solve_s: float
    observers_s: float
    bare_s: float
    peak_mib: float | None
    ranks: int

    @property
    def configuration(self) -> Configuration:
        """The way it was solved."""
        return Configuration(self.path, self.newton)

    @property
    def case(self) -> tuple[str, str, str]:
        """Case that was solved: scene, scheme, mesh."""
        return self.scene, self.scheme, self.mesh


@dataclass(frozen=True)
class Round:
    """One turn of a configuration, seconds and numbers per step.

    Args:
        steps: Number of steps.
        iterations: Newton iterations.
        factorisations: Factorisations.
        step_s: Whole steps.
        bare_s: Bare work.
        parts: Seconds by the names in `PARTS`.
    """

    steps: int
    iterations: float
    factorisations: float
    step_s: float
    bare_s: float
    parts: dict[str, float]


@dataclass(frozen=True)
class Measured:
    """A configuration's record, with the rounds it comes from.

    Args:
        record: Of the round whose step time is the median.
        rounds: All of them, in their order; those of other configurations were run in between.
    """

    record: Record
    rounds: tuple[Round, ...]

    @property
    def spread(self) -> float:
        """Difference of the slowest and the fastest round, relative to the median."""
        return spread([r.step_s for r in self.rounds], self.record.step_s)


def typical(rounds: Sequence[Round]) -> Round:
    """The round with the median of the step times; of two, the faster one."""
    wanted = median_low([r.step_s for r in rounds])
    return next(r for r in rounds if r.step_s == wanted)
