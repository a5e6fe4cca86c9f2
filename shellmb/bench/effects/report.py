"""What `shellmb bench --effects` prints and writes."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from shellmb.bench.effects.record import EffectRecord, to_json
from shellmb.bench.effects.rows import NO_ROW, EffectPlan, measure_effects
from shellmb.bench.report import width
from shellmb.cli.failures import first_rank, tell
from shellmb.cli.report import say
from shellmb.errors import SceneError

PICTURE = "effects.png"
NUMBERS = ("unknowns", "solved", "stored", "coefficients", "integrals", "kernels")


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
    text = to_json(found)
    if out is not None:
        from shellmb.bench.effects.picture import draw

        out.mkdir(parents=True, exist_ok=True)
        (out / "effects.json").write_text(text + "\n")
        draw(found, out / PICTURE)
    if as_json:
        say(text)
    else:
        _print(Console(highlight=False, width=width(sys.stdout.isatty())), found, plan)


def _print(console: Console, found: Sequence[EffectRecord], plan: EffectPlan) -> None:
    table = Table(box=None, header_style="bold", pad_edge=False)
    for title in ("effect", "scheme", "mesh"):
        table.add_column(title, no_wrap=True)
    for title in (*NUMBERS, "iterations", "factored", "step [ms]", "saved", "spread"):
        # in brackets there is markup otherwise
        table.add_column(escape(title), justify="right", no_wrap=True)
    for r in found:
        a, b = r.having, r.lacking
        table.add_row(
            r.effect,
            r.scheme,
            r.mesh,
            *(_both(str(getattr(a, name)), str(getattr(b, name))) for name in NUMBERS),
            _both(f"{a.iterations_per_step:.2f}", f"{b.iterations_per_step:.2f}"),
            _both(f"{a.factorisations_per_step:.2f}", f"{b.factorisations_per_step:.2f}"),
            f"{1e3 * a.step_s:.3g} / {1e3 * b.step_s:.3g}",
            f"{100 * r.saved:.0f} %",
            f"{100 * r.spread:.0f} %",
        )
    console.print(table)
    without = "; ".join(f"{name}, which {why}" for name, why in NO_ROW.items())
    console.print(
        "with / without the effect, one number where both are the same. Processor times of a step "
        f"with the observers of every run, medians of {plan.rounds} rounds of {plan.steps} steps "
        "in turn; saved: share of the step that goes without the effect, median over the rounds; "
        "spread: width of the middle half of them. What an observer takes is timed inside the "
        "steps. Set-up and compilation excluded. Plates as in `shellmb bench`, mesh '-': two "
        "rigid rods.",
        soft_wrap=True,
    )
    console.print(f"without a row: {without}.", soft_wrap=True)


def _both(having: str, lacking: str) -> str:
    return having if having == lacking else f"{having} / {lacking}"
