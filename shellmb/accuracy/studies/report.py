"""Output of a study: table, orders, advice, JSON."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rich.console import Console

from shellmb.accuracy.measuring import Column, line, print_table
from shellmb.accuracy.studies.advice import Order, Target, find_orders, find_targets, sentence
from shellmb.accuracy.studies.points import Judged, Point, find_reference, judge_points
from shellmb.accuracy.studies.runner import Measured

# version of the JSON
SCHEMA = 1


@dataclass(frozen=True)
class Finding:
    """Results of a study for one quantity.

    Args:
        title: Name of the study, and of the quantity if it has several.
        measured: The study.
        judged: Errors and times.
        orders: Observed orders.
        targets: Errors requested.
        sentence: The advice.
    """

    title: str
    measured: Measured
    judged: Judged
    orders: list[Order]
    targets: list[Target]
    sentence: str

    def to_dict(self) -> dict[str, Any]:
        """All that was found, for machines."""
        measured, judged = self.measured, self.judged
        reference, base = judged.reference, measured.sweep.base
        return {
            "schema": SCHEMA,
            "title": self.title,
            "scene": measured.name,
            "parameters": dict(base.parameters),
            "t_end": base.t_end,
            "quantity": str(judged.quantity),
            "clock": judged.clock,
            "swept": judged.swept,
            "not_refined": judged.not_refined,
            "reference": {
                "source": reference.source,
                "own": reference.own,
                "value": reference.taken["value"],
                "uncertainty": reference.uncertainty,
                "order": reference.order,
                "differences": reference.differences,
            },
            "points": [_plain_point(p, judged) for p in judged.points],
            "left_out": [{"choice": c, "reason": reason} for c, reason in measured.grid.left_out],
            "orders": self.orders,
            "targets": self.targets,
            "sentence": self.sentence,
        }


def evaluate(measured: Measured, clock: str, title: str = "") -> list[Finding]:
    """Results of a study by quantity.

    Args:
        measured: The study.
        clock: "wall" or "cpu".
        title: What it is called; "": the name of its scene.

    Raises:
        ConvergenceError: If the reference failed.
    """
    found = []
    for quantity in measured.quantities:
        judged = judge_points(measured, quantity, find_reference(measured, quantity), clock)
        targets = find_targets(judged)
        name = f"{title or measured.name}: {quantity}"
        told = sentence(judged, targets)
        found.append(Finding(name, measured, judged, find_orders(judged), targets, told))
    return found


def _plain_point(point: Point, judged: Judged) -> dict[str, Any]:
    if point.failed:
        return {"choice": point.choice, "failed": point.failed}
    # an error below the uncertainty is no number that anybody knows
    error = None if point.below else point.error
    below = judged.reference.uncertainty if point.below else None
    values = {**vars(point), "error": error, "error_below": below}
    del values["below"]
    return values


def print_finding(finding: Finding, to: Console) -> None:
    """Table, orders, reference and advice."""
    judged = finding.judged
    to.print(f"[bold]{finding.title}[/]")
    _print_reference(finding, to)
    print_table(to, _columns(judged), judged.points)
    for point in judged.points:
        if point.failed:
            line(to, f"failed: {judged.name(point)}: {point.failed}")
    for choice, reason in finding.measured.grid.left_out:
        line(to, f"left out: {choice.label()}: {reason}")
    _print_orders(finding, to)
    line(to, finding.sentence)


def _columns(judged: Judged) -> tuple[Column[Point], ...]:
    def number(title: str, said: Callable[[Point], str]) -> Column[Point]:
        return Column(title, lambda p: "" if p.failed else said(p))

    return (
        Column("choice", judged.name, "words"),
        Column("error", lambda p: "failed" if p.failed else _error(p, judged)),
        number("time [s]", lambda p: f"{p.time_s:.3g}"),
        number("spread", lambda p: f"{100 * p.spread:.0f} %"),
        number("set-up [s]", lambda p: f"{p.setup_s:.2g}"),
        number("jit [s]", lambda p: f"{p.jit_s:.2g}"),
        number("steps", lambda p: str(p.steps)),
        number("rejected", lambda p: str(p.rejected)),
        number("it/step", lambda p: f"{p.iterations:.1f}"),
        number("jump", lambda p: "" if p.jump is None else f"{p.jump:.1e}"),
    )


def _error(point: Point, judged: Judged) -> str:
    if point.below:
        return f"< {100 * judged.reference.uncertainty:.2g} %"
    return f"{100 * (point.error or 0.0):.3g} %"


def _print_reference(finding: Finding, to: Console) -> None:
    reference = finding.judged.reference
    text = f"reference: {reference.taken['value']:.8g} ({reference.source})"
    if finding.judged.quantity.is_curve:
        text = f"reference: the curve of {reference.source}"
    if not reference.own and reference.source != "exact":
        text += f", not one of our runs; accurate to {100 * reference.uncertainty:.2g} %"
    if reference.own:
        by = "two runs, order 2 assumed"
        if reference.order is not None:
            by = f"three runs, observed order {reference.order:.2g}"
        if reference.order is not None and reference.order <= 0:
            by = "three runs, whose differences do not shrink"
        text += f", one of our runs; accurate to {100 * reference.uncertainty:.2g} % ({by})"
    line(to, text)


def _print_orders(finding: Finding, to: Console) -> None:
    told = []
    for order in finding.orders:
        value = "too few runs tell" if order.order is None else f"{order.order:.2f}"
        where = f" at {order.at}" if order.at else ""
        told.append(f"{order.family or 'all'} in {order.direction}{where}: {value}")
    if told:
        line(to, "observed orders: " + "; ".join(told))
