"""Reports that `python -m tests.bench` prints and writes."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console

from shellmb.accuracy.measuring import Column, console, line, print_table, to_json, write
from shellmb.cli.failures import first_rank, tell
from shellmb.cli.report import say
from shellmb.demos.effects.stepping import WARM, measured_in
from shellmb.demos.verification.measuring import verdict
from shellmb.errors import SceneError
from tests.bench.bars import Bar, bars
from tests.bench.measure import Plan, measure, quick
from tests.bench.pictures import draw
from tests.bench.record import AUTO, PARTS, Measured
from tests.bench.runner import AGAIN
from tests.bench.scenes import STEPS


def plan_of(fast: bool, **chosen: Any) -> Plan:
    """The plan of the options given; None and empty ones stay as they are.

    Args:
        fast: Begin with small meshes and few steps.
        chosen: Members of the plan.

    Raises:
        SceneError: If the plates do not move for so long.
    """
    plan = replace(quick() if fast else Plan(), **{k: v for k, v in chosen.items() if v})
    steps = max(plan.length(kind, mesh, AUTO) for kind, _, mesh in plan.cases())
    most = (STEPS - WARM) // plan.rounds - AGAIN
    if set(plan.scenes) != {"static"} and steps > most:
        raise SceneError(
            f"bench: steps is {steps}; it must be at most {most} in {plan.rounds} rounds: the "
            f"plates move for {STEPS} steps"
        )
    return plan


def run_bench(plan: Plan, out: Path | None, as_json: bool, check: bool) -> bool:
    """Measure, print, draw; say whether all bars are met, or none was asked for.

    Args:
        plan: What is measured.
        out: Folder of the picture and of `bench.json`; None: neither.
        as_json: Whether stdout gets the JSON list, and nothing else.
        check: Whether the bars are judged.
    """
    with measured_in(plan.clock):
        found = measure(plan, tell)
    judged = bars(found) if check else []
    if first_rank():
        text = to_json([m.record for m in found])
        if out is not None:
            write("bench", text, partial(draw, found), out)
        if as_json:
            say(text)
        else:
            _print_records(console(), found, plan)
        if check:
            _print_bars(console(stderr=as_json), judged)
    return all(bar.passed for bar in judged)


def _time(name: str) -> Column[Measured]:
    """A time of the record, in milliseconds of three digits."""

    def cell(m: Measured) -> str:
        value = 1e3 * getattr(m.record, name)
        return f"{value:.3g}" if value < 1000 else f"{value:.0f}"

    return Column("step [ms]" if name == "step_s" else name.removesuffix("_s"), cell)


RECORDS: tuple[Column[Measured], ...] = (
    Column("scene", lambda m: m.record.scene, "words"),
    Column("scheme", lambda m: m.record.scheme, "words"),
    Column("mesh", lambda m: m.record.mesh, "words"),
    Column("path/newton", lambda m: str(m.record.configuration), "words"),
    Column("unknowns", lambda m: str(m.record.unknowns)),
    Column("iterations", lambda m: f"{m.record.iterations_per_step:.2f}"),
    Column("factored", lambda m: f"{m.record.factorisations_per_step:.2f}"),
    *map(_time, ("step_s", *PARTS, "bare_s")),
    Column("spread", lambda m: f"{100 * m.spread:.0f} %"),
    Column("MiB", lambda m: "" if m.record.peak_mib is None else f"{m.record.peak_mib:.0f}"),
)
BARS: tuple[Column[Bar], ...] = (
    Column("bar", lambda bar: bar.name, "words"),
    Column("measured", lambda bar: f"{bar.value:.3g}"),
    Column("asked", lambda bar: f"{'>=' if bar.least else '<='} {bar.bound:g}"),
    Column("", lambda bar: verdict(bar.passed, "MISS"), "words"),
)


def _print_records(to: Console, found: Sequence[Measured], plan: Plan) -> None:
    print_table(to, RECORDS, found)
    clock = "processor" if plan.clock == "cpu" else "wall"
    threads = os.environ.get("OMP_NUM_THREADS", "all")
    line(
        to,
        f"{clock} times per step in ms, threads: {threads}; the round with the median step of "
        f"{plan.rounds}, configurations in turn; spread: slowest less fastest round over the "
        "median. Set-up and first steps excluded. Square plates where the mesh is as wide as "
        "long, else strips of 1 m x 0.08 m.",
    )


def _print_bars(to: Console, judged: Sequence[Bar]) -> None:
    print_table(to, BARS, judged)
    missed = sum(not bar.passed for bar in judged)
    line(to, f"{len(judged) - missed} of {len(judged)} met, {missed} missed")
