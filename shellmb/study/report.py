"""What a study prints and writes: table, orders, advice, JSON."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from shellmb.study.advice import Target, find_targets, sentence
from shellmb.study.orders import Order, find_orders
from shellmb.study.points import Judged, Point, judge_points
from shellmb.study.reference import find_reference
from shellmb.study.runner import Measured

# version of the JSON
SCHEMA = 1


@dataclass(frozen=True)
class Finding:
    """What a study found of one quantity.

    Args:
        title: Name of the study, and of the quantity if it has several.
        measured: The study.
        judged: Errors and times.
        orders: Observed orders.
        targets: Errors asked for.
        sentence: The advice.
    """

    title: str
    measured: Measured
    judged: Judged
    orders: list[Order]
    targets: list[Target]
    sentence: str


def evaluate(measured: Measured, clock: str, title: str = "") -> list[Finding]:
    """What a study found, by quantity.

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


def to_json(findings: Sequence[Finding]) -> str:
    """All that was found, as a JSON list: one object for each study and quantity."""
    return json.dumps([_plain(f) for f in findings], indent=1, allow_nan=False)


def _plain(finding: Finding) -> dict[str, Any]:
    measured, judged = finding.measured, finding.judged
    reference = judged.reference
    return {
        "schema": SCHEMA,
        "title": finding.title,
        "scene": measured.name,
        "parameters": dict(measured.sweep.base.parameters),
        "t_end": measured.sweep.base.t_end,
        "quantity": str(judged.quantity),
        "clock": judged.clock,
        "swept": list(judged.swept),
        "reference": {
            "source": reference.source,
            "own": reference.own,
            "value": reference.taken["value"],
            "uncertainty": reference.uncertainty,
            "order": reference.order,
            "differences": list(reference.differences),
        },
        "points": [_plain_point(p, judged) for p in judged.points],
        "left_out": [
            {"choice": c.to_dict(), "reason": reason} for c, reason in measured.grid.left_out
        ],
        "orders": [asdict(o) for o in finding.orders],
        "targets": [
            {
                "error": t.error,
                "known": t.known,
                "offers": [
                    {
                        "family": o.family,
                        "choice": o.point.choice.to_dict(),
                        "time_s": o.time_s,
                        "upper_bound": o.bound,
                    }
                    for o in t.offers
                ],
                "not_reached": list(t.missing),
            }
            for t in finding.targets
        ],
        "sentence": finding.sentence,
    }


def _plain_point(point: Point, judged: Judged) -> dict[str, Any]:
    plain = {**asdict(point), "choice": point.choice.to_dict()}
    if point.failed:
        keep = ("choice", "failed")
        return {k: plain[k] for k in keep}
    # an error below the uncertainty is no number that anybody knows
    plain["error"] = None if point.below else point.error
    plain["error_below"] = judged.reference.uncertainty if plain.pop("below") else None
    return plain


def print_finding(finding: Finding, console: Console) -> None:
    """Table, orders, reference and advice.

    Args:
        finding: What.
        console: Where.
    """
    judged = finding.judged
    console.print(f"[bold]{finding.title}[/]")
    _print_reference(finding, console)
    table = Table(box=None, header_style="bold", pad_edge=False)
    table.add_column("choice", no_wrap=True)
    for title in (
        *("error", "time [s]", "spread", "set-up [s]", "jit [s]"),
        *("steps", "rejected", "it/step", "jump"),
    ):
        # or rich would strike the rest through
        table.add_column(escape(title), justify="right", no_wrap=True)
    for point in judged.points:
        if point.failed:
            table.add_row(judged.name(point), "failed")
            continue
        numbers = (
            _error(point, judged),
            f"{point.time_s:.3g}",
            f"{100 * point.spread:.0f} %",
            f"{point.setup_s:.2g}",
            f"{point.jit_s:.2g}",
            str(point.steps),
            str(point.rejected),
            f"{point.iterations:.1f}",
            "" if point.jump is None else f"{point.jump:.1e}",
        )
        table.add_row(judged.name(point), *numbers)
    console.print(table)
    for point in judged.points:
        if point.failed:
            text = f"failed: {judged.name(point)}: {point.failed}"
            console.print(text, markup=False, soft_wrap=True)
    for choice, reason in finding.measured.grid.left_out:
        text = f"left out: {choice.label()}: {reason}"
        console.print(text, markup=False, soft_wrap=True)
    _print_orders(finding, console)
    console.print(finding.sentence, markup=False, soft_wrap=True)


def _error(point: Point, judged: Judged) -> str:
    if point.below:
        return f"< {100 * judged.reference.uncertainty:.2g} %"
    return f"{100 * (point.error or 0.0):.3g} %"


def _print_reference(finding: Finding, console: Console) -> None:
    reference = finding.judged.reference
    text = f"reference: {reference.taken['value']:.8g} ({reference.source})"
    if finding.judged.quantity.is_curve:
        text = f"reference: the curve of {reference.source}"
    if not reference.own and reference.source != "exact":
        text += f", not a run of ours; known to {100 * reference.uncertainty:.2g} %"
    if reference.own:
        by = "two runs, order 2 assumed"
        if reference.order is not None:
            by = f"three runs, observed order {reference.order:.2g}"
        if reference.order is not None and reference.order <= 0:
            by = "three runs, whose differences do not shrink"
        text += f", a run of our own; known to {100 * reference.uncertainty:.2g} % ({by})"
    console.print(text, markup=False, soft_wrap=True)


def _print_orders(finding: Finding, console: Console) -> None:
    told = []
    for order in finding.orders:
        value = "too few runs tell" if order.order is None else f"{order.order:.2f}"
        where = f" at {order.at}" if order.at else ""
        told.append(f"{order.family or 'all'} in {order.direction}{where}: {value}")
    if told:
        text = "observed orders: " + "; ".join(told)
        console.print(text, markup=False, soft_wrap=True)
