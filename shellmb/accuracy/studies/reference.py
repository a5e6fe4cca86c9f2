"""The reference of a study, and how well it is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import log
from typing import Any

from shellmb.accuracy.studies.choice import REFINED
from shellmb.accuracy.studies.quantity import Quantity
from shellmb.accuracy.studies.records import Record
from shellmb.accuracy.studies.runner import Measured, known_quantity
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
