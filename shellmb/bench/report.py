"""What `shellmb bench` prints and writes."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from shellmb.bench.bars import Bar, bars
from shellmb.bench.measure import Plan, measure, quick
from shellmb.bench.record import PARTS, Measured, measured_in, to_json
from shellmb.cli.failures import first_rank, tell
from shellmb.cli.report import say
from shellmb.errors import SceneError

PICTURE = "bench.png"


def plan_of(fast: bool, **chosen: Any) -> Plan:
    """The plan of the options given; None and empty ones stay as they are.

    Args:
        fast: Begin with small meshes and few steps.
        chosen: Members of the plan.

    Raises:
        SceneError: If a number is not possible.
    """
    for name in ("steps", "rounds"):
        if chosen.get(name) is not None and chosen[name] < 1:
            raise SceneError(f"bench: {name} is {chosen[name]}; it must be at least 1")
    return replace(quick() if fast else Plan(), **{k: v for k, v in chosen.items() if v})


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
    if not first_rank():
        return all(bar.passed for bar in judged)
    text = to_json([m.record for m in found])
    if out is not None:
        from shellmb.bench.pictures import draw

        out.mkdir(parents=True, exist_ok=True)
        (out / "bench.json").write_text(text + "\n")
        draw(found, out / PICTURE)
    if as_json:
        say(text)
        console = Console(stderr=True, highlight=False, width=width(sys.stderr.isatty()))
    else:
        console = Console(highlight=False, width=width(sys.stdout.isatty()))
        _print_records(console, found, plan)
    if check:
        _print_bars(console, judged)
    return all(bar.passed for bar in judged)


def width(terminal: bool) -> int | None:
    """Width of a table: in a file or pipe it is as wide as it has to be.

    Args:
        terminal: Whether it is printed to one.
    """
    return None if terminal else 200


def _print_records(console: Console, found: Sequence[Measured], plan: Plan) -> None:
    table = Table(box=None, header_style="bold", pad_edge=False)
    for title in ("scene", "scheme", "mesh", "path/newton"):
        table.add_column(title, no_wrap=True)
    parts = [part.removesuffix("_s") for part in PARTS]
    numbers = ("unknowns", "iterations", "factored", "step [ms]", *parts, "bare", "spread", "MiB")
    for title in numbers:
        table.add_column(title, justify="right", no_wrap=True)
    for m in found:
        r = m.record
        times = [1e3 * getattr(r, name) for name in ("step_s", *PARTS, "bare_s")]
        table.add_row(
            r.scene,
            r.scheme,
            r.mesh,
            str(r.configuration),
            str(r.unknowns),
            f"{r.iterations_per_step:.2f}",
            f"{r.factorisations_per_step:.2f}",
            *(f"{t:.3g}" if t < 1000 else f"{t:.0f}" for t in times),
            f"{100 * m.spread:.0f} %",
            "" if r.peak_mib is None else f"{r.peak_mib:.0f}",
        )
    console.print(table)
    clock = "processor" if plan.clock == "cpu" else "wall"
    threads = os.environ.get("OMP_NUM_THREADS", "all")
    console.print(
        f"{clock} times per step in ms, threads: {threads}; the round with the median step of "
        f"{plan.rounds}, configurations in turn; spread: slowest less fastest round over the "
        "median. Set-up and first steps excluded. Square plates where the mesh is as wide as "
        "long, else strips of 1 m x 0.08 m.",
        soft_wrap=True,
    )


def _print_bars(console: Console, judged: Sequence[Bar]) -> None:
    table = Table(box=None, header_style="bold", pad_edge=False)
    for title in ("bar", "measured", "asked", ""):
        table.add_column(title, justify="left" if title in ("bar", "") else "right", no_wrap=True)
    for bar in judged:
        sign = ">=" if bar.least else "<="
        mark = "[green]pass[/]" if bar.passed else "[red bold]MISS[/]"
        table.add_row(bar.name, f"{bar.value:.3g}", f"{sign} {bar.bound:g}", mark)
    console.print(table)
    missed = sum(not bar.passed for bar in judged)
    console.print(f"{len(judged) - missed} of {len(judged)} met, {missed} missed")
