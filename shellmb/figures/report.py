"""What `shellmb figures` prints: statements with the paper's value and ours, wall times."""

from __future__ import annotations

import json
import sys

from rich.console import Console
from rich.table import Table

from shellmb.figures.make import Judged, Made

__all__ = ["print_made", "to_json"]

# width of the table in a file or pipe
WIDE = 160


def to_json(judged: list[Judged]) -> str:
    """The statements as a JSON list of {example, statement, paper, ours, pass, why}.

    Args:
        judged: The statements.
    """
    rows = [
        {
            "example": j.example,
            "statement": j.statement,
            "paper": j.paper,
            "ours": j.ours,
            "pass": j.passed,
            "why": j.why,
        }
        for j in judged
    ]
    return json.dumps(rows, indent=1)


def print_made(made: Made) -> None:
    """Statements, wall times, pictures of an example.

    Args:
        made: What was made of it.
    """
    console = Console(highlight=False, width=None if sys.stdout.isatty() else WIDE)
    console.print(f"{made.example.section} {made.example.title}", style="bold")
    table = Table(box=None, header_style="bold", pad_edge=False, padding=(0, 2, 0, 0))
    for name in ("statement", "paper", "ours"):
        table.add_column(name, overflow="fold")
    table.add_column("")
    for j in made.judged:
        mark = "[green]pass[/]" if j.passed else "[red bold]FAIL[/]"
        table.add_row(j.statement, j.paper, f"{j.ours}; {j.why}" if j.why else j.ours, mark)
    if made.judged:
        console.print(table)
    for name, seconds in made.wall_s.items():
        summary = made.runs[name].summary
        rejected = summary["rejected_steps"]
        also = f", {rejected} rejected" if rejected else ""
        stopped = ", stopped as expected" if summary["failed"] else ""
        console.print(
            f"run {name}: {seconds:.0f} s, {summary['steps']} steps{also}{stopped}", markup=False
        )
    total = sum(made.wall_s.values()) + made.drawing_s
    console.print(
        f"{len(made.pictures)} pictures in {made.drawing_s:.0f} s; with the runs {total:.0f} s",
        markup=False,
    )
