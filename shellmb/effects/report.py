"""Effects and comparisons as tables and JSON."""

from __future__ import annotations

import json
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from shellmb.effects.compare import Change, Comparison
from shellmb.effects.survey import Row, Survey

# wide enough for the reasons, also where no terminal says how wide it is
WIDTH = 150


def survey_json(name: str, found: Survey) -> str:
    """A survey for machines.

    Args:
        name: Name of the scene.
        found: The survey.
    """
    content = {
        "scene": name,
        "effects": [row.to_dict() for row in found.rows],
        "total": None if found.total is None else vars(found.total),
        "solved": found.solved,
        "step_s": found.step_seconds,
    }
    return json.dumps(content, indent=2, allow_nan=False)


def print_survey(name: str, found: Survey) -> None:
    """The effects of a scene with their costs, then what it does not have, and why.

    Args:
        name: Name of the scene.
        found: The survey.
    """
    table = Table(title=f"effects of {name}", box=None, title_justify="left", pad_edge=False)
    table.add_column("effect", no_wrap=True)
    table.add_column("why", max_width=58)
    for column in ("unknowns", "stored", "integrals", "coefficients", "kernels", "step time"):
        table.add_column(column, justify="right")
    group = ""
    for row in (row for row in found.rows if row.used):
        if row.group != group:
            group = row.group
            table.add_row(Text(group, style="bold"))
        table.add_row(f"  {row.effect}", Text(row.why), *_costs(row))
    if found.total is not None and found.step_seconds is not None:
        counts = [str(value) for value in vars(found.total).values()]
        solved = f"{found.solved} of the unknowns in the linear systems"
        table.add_row("all together", solved, *counts, f"{1e3 * found.step_seconds:.2f} ms")
    console = Console(highlight=False, width=WIDTH)
    console.print(table)
    stuck = [(row.effect, row.needed.partition(": ")[2]) for row in found.rows if row.needed]
    if stuck:
        console.print(_reasons("cannot be left out", stuck))
    absent = [(row.effect, row.why) for row in found.rows if not row.used]
    console.print(_reasons("not there", absent))


def _reasons(title: str, items: list[tuple[str, str]]) -> Table:
    """Effects with a reason each."""
    table = Table(title=f"\n{title}", box=None, title_justify="left", pad_edge=False)
    table.add_column("effect", no_wrap=True)
    table.add_column("why")
    for effect, why in items:
        table.add_row(f"  {effect}", Text(why))
    return table


def _costs(row: Row) -> list[str]:
    share = "-" if row.share is None else f"{100 * row.share:.0f} %"
    if row.count is None:
        return ["-"] * 5 + [share]
    return [f"{value:+d}" if value else "0" for value in vars(row.count).values()] + [share]


def comparison_json(name: str, said: dict[str, list[str]], found: Comparison) -> str:
    """A comparison for machines.

    Args:
        name: Name of the scene.
        said: What was left out and taken in.
        found: The comparison.
    """
    content: dict[str, Any] = {"scene": name, **said}
    content["results"] = [change.to_dict() for change in found.results]
    content["times"] = [change.to_dict() for change in found.times]
    return json.dumps(content, indent=2)


def print_comparison(name: str, said: dict[str, list[str]], found: Comparison) -> None:
    """Results and times of both runs.

    Args:
        name: Name of the scene.
        said: What was left out and taken in.
        found: The comparison.
    """
    words = [f"{option} {', '.join(items)}" for option, items in said.items() if items]
    table = Table(title=name, box=None, title_justify="left", pad_edge=False)
    table.add_column("", no_wrap=True)
    for column in ("as it is", " and ".join(words), "change"):
        table.add_column(column, justify="right")
    for change in (*found.results, *found.times):
        relative = change.relative
        table.add_row(
            Text(change.name),
            _number(change.before),
            _number(change.after),
            "-" if relative is None else _percent(relative, change),
        )
    Console(highlight=False, width=WIDTH).print(table)


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.6g}"


def _percent(relative: float, change: Change) -> str:
    """In per cent, small ones with their size, large ones as a factor."""
    if change.before == change.after:
        return "0"
    if relative > 9:
        return f"x {1 + relative:.3g}"
    return f"{100 * relative:+.2f} %" if abs(relative) >= 1e-4 else f"{relative:+.1e}"
