"""Errors and times of the configurations of a study, beside a reference, and who is not beaten."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import log
from statistics import median
from typing import Any

from shellmb.accuracy.measuring import spread, unbeaten
from shellmb.accuracy.studies.choice import REFINED, Choice
from shellmb.accuracy.studies.quantity import Quantity
from shellmb.accuracy.studies.runner import Measured, Record, known_quantity
from shellmb.accuracy.studies.sweep import not_refined
from shellmb.errors import ConvergenceError

# safety factor on the extrapolated error of three runs: P. J. Roache, J. Fluids Eng. 116 (1994)
# 405-413, grid convergence index; with two runs the order is taken to be 2 and the factor is 3
SAFETY, SAFETY_TWO, ORDER_TWO = 1.25, 3.0, 2.0
# a third run farther away tells no order
ASYMPTOTIC = 0.3
# an order is believed between these
LOWEST, HIGHEST = 1.0, 4.0


@dataclass(frozen=True)
class Reference:
    """Reference that errors are measured against.

    Args:
        source: "exact", what it is if it is not ours, or the choice of our run in words.
        taken: Its number, and its curve if curves are compared.
        uncertainty: How far from the limit of ever finer runs it may be, relative.
        order: Observed order of the three runs; None where there are only two, or the exact value.
        differences: Relative differences of each run of the chain from the next finer one, the
            finest pair first.
        refined: In what the runs of the chain differ: "mesh", "dt", "step_error".
    """

    source: str
    taken: dict[str, Any]
    uncertainty: float
    order: float | None = None
    differences: tuple[float, ...] = ()
    refined: tuple[str, ...] = ()

    @property
    def own(self) -> bool:
        """Decide whether the reference is a run of ours."""
        return bool(self.differences)


def find_reference(measured: Measured, quantity: Quantity) -> Reference:
    """The reference of a quantity.

    Raises:
        ConvergenceError: If its run failed.
    """
    exact = measured.sweep.exact
    if exact is not None:
        return Reference("exact", {"value": exact}, 0.0)
    solution = measured.sweep.solution
    if solution is not None:
        return Reference(solution.source, solution.take(quantity), solution.uncertainty)
    records: list[Record] = []
    for choice in measured.chain:
        record = measured.store.find(choice)
        assert record is not None
        if record.failed and len(records) < 2:
            raise ConvergenceError(
                f"study: the reference cannot be computed, its run {measured.name_of(choice)} "
                f"failed: {record.failed}; give --exact, or sweep where the finest run comes "
                "through"
            )
        if record.failed:
            break
        records.append(record)
    kept = [known_quantity(r, quantity) for r in records]
    pairs = list(zip(kept[1:], kept, strict=False))
    differences = [quantity.difference(coarse, fine) for coarse, fine in pairs]
    uncertainty, order = judge(differences, measured.sweep.refine)
    label = measured.name_of(measured.chain[0])
    refined = tuple(a for a in REFINED if len({getattr(c, a) for c in measured.chain}) > 1)
    return Reference(label, kept[0], uncertainty, order, tuple(differences), refined)


def judge(differences: Sequence[float], refine: float) -> tuple[float, float | None]:
    """Uncertainty of the finest of two or three runs, by Richardson's extrapolation.

    Args:
        differences: Of the second finest from the finest, and of the third from the second.
        refine: Ratio of their steps.

    Returns:
        The uncertainty, and the observed order if there are three that are not too far apart. Where
        the differences do not shrink by at least that ratio, the order is taken as 1; where they
        grow, the larger one is the uncertainty.
    """
    fine = differences[0]
    if len(differences) < 2 or differences[1] > ASYMPTOTIC:
        return SAFETY_TWO * fine / (refine**ORDER_TWO - 1), None
    coarse = differences[1]
    if fine == 0.0:
        return 0.0, None
    order = log(coarse / fine) / log(refine) if coarse > 0 else 0.0
    if order <= 0:
        return SAFETY * max(fine, coarse), order
    believed = min(max(order, LOWEST), HIGHEST)
    return SAFETY * fine / (refine**believed - 1), order


@dataclass(frozen=True)
class Point:
    """One configuration, judged.

    Args:
        choice: The configuration.
        error: Relative error; None if the run failed.
        below: Whether the error is below what is known of the reference: then it is no more than
            that uncertainty, and nothing else is known of it.
        time_s: Median time of the steps, s.
        spread: Slowest less fastest round over the median.
        rounds: Number of rounds.
        setup_s: Median time of the set-up without its forms, s.
        jit_s: Time of making the forms ready in the first round, s.
        steps: Accepted steps.
        rejected: Rejected ones.
        iterations: Newton iterations per step.
        jump: Largest jump of ED; None for others.
        failed: Why there is no error; "" if there is one.
        credit: Largest error of it and of the runs that are finer in everything: a number may cross
            the reference before it reaches it, and a small error there is luck. Advice goes by
            this.
    """

    choice: Choice
    error: float | None = None
    below: bool = False
    time_s: float = math.nan
    spread: float = 0.0
    rounds: int = 1
    setup_s: float = 0.0
    jit_s: float = 0.0
    steps: int = 0
    rejected: int = 0
    iterations: float = 0.0
    jump: float | None = None
    failed: str = ""
    credit: float = 0.0

    def bound(self, uncertainty: float) -> float:
        """Bound on the error from `credit`, the reference's uncertainty."""
        assert self.error is not None
        return max(self.error, self.credit, uncertainty)


@dataclass(frozen=True)
class Judged:
    """A quantity of a study.

    Args:
        quantity: What is judged.
        reference: What it is compared with.
        points: All configurations, in the order of the grid.
        swept: Axes with several values.
        clock: "wall" or "cpu": which times they are.
        not_refined: What the study holds fixed, in words: the errors leave out what that costs.
    """

    quantity: Quantity
    reference: Reference
    points: tuple[Point, ...]
    swept: tuple[str, ...]
    clock: str
    not_refined: tuple[str, ...] = ()

    @property
    def good(self) -> list[Point]:
        """Points with an error."""
        return [p for p in self.points if p.error is not None]

    def name(self, point: Point) -> str:
        """Name that distinguishes a point from the others."""
        return point.choice.label(self.swept) or point.choice.label(("mesh", "divide", "dt"))

    def families(self) -> dict[str, list[Point]]:
        """Points with an error by what they have in common beside mesh, step and tolerance."""
        found: dict[str, list[Point]] = {}
        # what a curve of the picture is named after
        axes = tuple(a for a in self.swept if a not in (*REFINED, "newton_tolerance"))
        for point in self.good:
            label = point.choice.label(axes)
            if point.choice.step_error is not None:
                label = f"{label}, controlled" if label else "controlled"
            found.setdefault(label, []).append(point)
        return found


def judge_points(
    measured: Measured, quantity: Quantity, reference: Reference, clock: str
) -> Judged:
    """Errors and times of all configurations."""
    points = [
        _point(c, measured.store.rounds(c)[: measured.sweep.repeat], quantity, reference, clock)
        for c in measured.grid.choices
    ]
    fixed = not_refined(measured.sweep, measured.grid, measured.chain)
    return Judged(quantity, reference, credited(points), measured.grid.swept, clock, fixed)


def credited(points: Sequence[Point]) -> tuple[Point, ...]:
    """The points with their `credit`."""
    good = [p for p in points if p.error is not None]
    return tuple(
        replace(p, credit=max(q.error or 0.0 for q in good if _finer(q.choice, p.choice)))
        if p.error is not None
        else p
        for p in points
    )


def _finer(one: Choice, other: Choice) -> bool:
    """Decide whether one is as fine as the other in all, and the same otherwise."""
    sizes = (*REFINED, "newton_tolerance")
    if one.without(*sizes) != other.without(*sizes):
        return False
    if (one.step_error is None) != (other.step_error is None):
        return False
    counts = zip(one.counts, other.counts, strict=True)
    steps = ((c.dt or 0.0, c.newton_tolerance or 0.0, c.step_error or 0.0) for c in (one, other))
    return all(a >= b for a, b in counts) and all(a <= b for a, b in zip(*steps, strict=True))


def _point(
    choice: Choice, rounds: Sequence[Record], quantity: Quantity, reference: Reference, clock: str
) -> Point:
    first = rounds[0]
    if first.failed:
        return Point(choice, failed=first.failed)
    error = quantity.difference(known_quantity(first, quantity), reference.taken)
    times = [r.wall_s if clock == "wall" else r.cpu_s for r in rounds if not r.failed]
    middle = median(times)
    return Point(
        choice,
        error,
        error < reference.uncertainty,
        middle,
        spread(times, middle),
        len(times),
        median(r.setup_s for r in rounds),
        first.jit_s,
        first.steps,
        first.rejected,
        first.iterations / max(first.steps, 1),
        first.jump,
    )


def front(points: Sequence[Point], uncertainty: float = 0.0) -> list[Point]:
    """Points that no other one beats in both error and time, the fastest first.

    Args:
        points: Points with errors.
        uncertainty: That of the reference: errors below it count as equal to it.
    """
    return unbeaten(points, lambda p: p.time_s, lambda p: p.bound(uncertainty))
