"""Effects and comparisons as tables and JSON."""

from __future__ import annotations

from itertools import groupby
from operator import itemgetter

from rich.text import Text

from shellmb.accuracy.measuring import Column, console, print_table, to_json
from shellmb.demos.effects.compare import Change, Comparison
from shellmb.demos.effects.survey import Row, Survey

# cells of a line
type Line = list[str | Text]

# wide enough for the reasons, also where no terminal says how wide it is
WIDTH = 150


def survey_json(name: str, found: Survey) -> str:
    """A survey for machines."""
    counts = {"total": found.total, "solved": found.solved, "step_s": found.step_seconds}
    return to_json({"scene": name, "effects": found.rows, **counts})


def print_survey(name: str, found: Survey) -> None:
    """The effects of a scene with their costs, then what it does not have, and why."""
    lines: list[Line] = []
    used = (row for row in found.rows if row.used)
    for group, rows in groupby(used, lambda row: row.group):
        lines.append([Text(group, "bold"), *[""] * 7])
        lines += [[f"  {row.effect}", row.why, *_costs(row)] for row in rows]
    if found.total is not None and found.step_seconds is not None:
        counts = [str(value) for value in vars(found.total).values()]
        solved = f"{found.solved} of the unknowns in the linear systems"
        step = f"{1e3 * found.step_seconds:.2f} ms"
        lines.append(["all together", solved, *counts, step])
    to = console(WIDTH)
    numbers = ("unknowns", "stored", "integrals", "coefficients", "kernels", "step time")
    print_table(to, _columns(*numbers), lines, title=f"effects of {name}")
    stuck = [(row.effect, row.needed.partition(": ")[2]) for row in found.rows if row.needed]
    absent = [(row.effect, row.why) for row in found.rows if not row.used]
    for title, reasons in (("cannot be left out", stuck), ("not there", absent)):
        if reasons:
            items: list[Line] = [[f"  {effect}", why] for effect, why in reasons]
            print_table(to, _columns(), items, title=f"\n{title}")


def _columns(*numbers: str) -> list[Column[Line]]:
    """Effects with a reason each, and numbers behind it."""
    reason = Column[Line]("why", itemgetter(1), "folded")
    found = [Column[Line]("effect", itemgetter(0), "words"), reason]
    return found + [Column(title, itemgetter(k)) for k, title in enumerate(numbers, start=2)]


def _costs(row: Row) -> list[str]:
    share = "-" if row.share is None else f"{100 * row.share:.0f} %"
    if row.count is None:
        return ["-"] * 5 + [share]
    return [f"{value:+d}" if value else "0" for value in vars(row.count).values()] + [share]


def comparison_json(name: str, said: dict[str, list[str]], found: Comparison) -> str:
    """A comparison for machines."""
    return to_json({"scene": name, **said, "results": found.results, "times": found.times})


def print_comparison(name: str, said: dict[str, list[str]], found: Comparison) -> None:
    """Results and times of both runs."""
    words = [f"{option} {', '.join(items)}" for option, items in said.items() if items]
    columns: tuple[Column[Change], ...] = (
        Column("", lambda change: change.name, "words"),
        Column("as it is", lambda change: _number(change.before)),
        Column(" and ".join(words), lambda change: _number(change.after)),
        Column("change", _percent),
    )
    print_table(console(WIDTH), columns, (*found.results, *found.times), title=name)


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.6g}"


def _percent(change: Change) -> str:
    """In per cent, small ones with their size, large ones as a factor."""
    relative = change.relative
    if relative is None:
        return "-"
    if change.before == change.after:
        return "0"
    if relative > 9:
        return f"x {1 + relative:.3g}"
    return f"{100 * relative:+.2f} %" if abs(relative) >= 1e-4 else f"{relative:+.1e}"
