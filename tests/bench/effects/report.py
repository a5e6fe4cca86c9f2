"""Reports that `python -m tests.bench --effects` prints and writes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from shellmb.accuracy.measuring import Column, console, line, print_table, to_json, write
from shellmb.cli.failures import first_rank, tell
from shellmb.cli.report import say
from shellmb.errors import SceneError
from tests.bench.effects.picture import draw
from tests.bench.effects.record import EffectRecord, Side
from tests.bench.effects.rows import NO_ROW, EffectPlan, measure_effects


def effect_plan_of(fast: bool, refused: Sequence[str], **chosen: Any) -> EffectPlan:
    """The plan of the options given; None and empty ones stay as they are.

    Args:
        fast: Begin with a small mesh and few steps.
        refused: Options that were given and mean nothing here.
        chosen: Members of the plan.

    Raises:
        SceneError: If there are such options.
    """
    if refused:
        raise SceneError(f"bench: {', '.join(refused)} must be left out beside effects")
    begin = EffectPlan(meshes=((2, 1),), steps=4, rounds=2) if fast else EffectPlan()
    return replace(begin, **{k: v for k, v in chosen.items() if v})


def run_effects(plan: EffectPlan, out: Path | None, as_json: bool) -> None:
    """Measure, print, draw.

    Args:
        plan: What is measured.
        out: Folder of the picture and of `effects.json`; None: neither.
        as_json: Whether stdout gets the JSON list, and nothing else.
    """
    found = measure_effects(plan, tell)
    if not first_rank():
        return
    text = to_json(found, having="with", lacking="without")
    if out is not None:
        write("effects", text, partial(draw, found), out)
    if as_json:
        say(text)
    else:
        _print(found, plan)


def _both(title: str, value: Callable[[Side], str]) -> Column[EffectRecord]:
    """A number with and without the effect; one where both are the same."""

    def cell(r: EffectRecord) -> str:
        return " / ".join(dict.fromkeys((value(r.having), value(r.lacking))))

    return Column(title, cell)


COLUMNS: tuple[Column[EffectRecord], ...] = (
    Column("effect", lambda r: r.effect, "words"),
    Column("scheme", lambda r: r.scheme, "words"),
    Column("mesh", lambda r: r.mesh, "words"),
    _both("unknowns", lambda side: str(side.unknowns)),
    _both("solved", lambda side: str(side.solved)),
    _both("stored", lambda side: str(side.stored)),
    _both("coefficients", lambda side: str(side.coefficients)),
    _both("integrals", lambda side: str(side.integrals)),
    _both("kernels", lambda side: str(side.kernels)),
    _both("iterations", lambda side: f"{side.iterations_per_step:.2f}"),
    _both("factored", lambda side: f"{side.factorisations_per_step:.2f}"),
    Column("step [ms]", lambda r: f"{1e3 * r.having.step_s:.3g} / {1e3 * r.lacking.step_s:.3g}"),
    Column("saved", lambda r: f"{100 * r.saved:.0f} %"),
    Column("spread", lambda r: f"{100 * r.spread:.0f} %"),
)


def _print(found: Sequence[EffectRecord], plan: EffectPlan) -> None:
    to = console()
    print_table(to, COLUMNS, found)
    line(
        to,
        "with / without the effect, one number where both are the same. Processor times of a step "
        f"with the observers of every run, medians of {plan.rounds} rounds of {plan.steps} steps "
        "in turn; saved: share of the step that goes without the effect, median over the rounds; "
        "spread: width of the middle half of them. What an observer takes is timed inside the "
        "steps. Set-up and compilation excluded. Plates as in `tests/bench/scenes.py`, mesh '-': "
        "two rigid rods.",
    )
    without = "; ".join(f"{name}, which {why}" for name, why in NO_ROW.items())
    line(to, f"without a row: {without}.")
