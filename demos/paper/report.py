"""Report of `python -m demos.paper`: statements with the paper's value and ours, times."""

from __future__ import annotations

from demos.paper.make import Judged, Made
from shellmb.accuracy.measuring import Column, console, line, print_table
from shellmb.demos.verification.measuring import verdict

__all__ = ["print_made"]

COLUMNS: tuple[Column[Judged], ...] = (
    Column("statement", lambda j: j.statement, "folded"),
    Column("paper", lambda j: j.paper, "folded"),
    Column("ours", lambda j: f"{j.ours}; {j.why}" if j.why else j.ours, "folded"),
    Column("", lambda j: verdict(j.passed), "words"),
)


def print_made(made: Made) -> None:
    """Statements, wall times, pictures of an example."""
    to = console(160)
    to.print(f"{made.example.section} {made.example.title}", style="bold")
    if made.judged:
        print_table(to, COLUMNS, made.judged, padding=(0, 2, 0, 0))
    for name, seconds in made.wall_s.items():
        summary = made.runs[name].summary
        rejected = summary["rejected_steps"]
        also = f", {rejected} rejected" if rejected else ""
        stopped = ", stopped as expected" if summary["failed"] else ""
        line(to, f"run {name}: {seconds:.0f} s, {summary['steps']} steps{also}{stopped}")
    total = sum(made.wall_s.values()) + made.drawing_s
    drawing = f"{len(made.pictures)} pictures in {made.drawing_s:.0f} s"
    line(to, f"{drawing}; with the runs {total:.0f} s")
