"""One method to record, tabulate and compare, for all that measures."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from rich.console import Console
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

from shellmb.files.writing import plain, write_text

if TYPE_CHECKING:
    from mpi4py import MPI

Kind = Literal["number", "words", "folded"]
# wider than any table, and what a column that folds has at least, letters
WIDEST, FOLDED = 10_000, 30


@dataclass(frozen=True)
class Column[R]:
    """A column.

    Args:
        title: Its head.
        cell: What it says of a row.
        kind: "number": to the right; "words": to the left; "folded": likewise, in several lines
            where it is too long.
    """

    title: str
    cell: Callable[[R], str | Text]
    kind: Kind = "number"


def print_table[R](
    to: Console, columns: Sequence[Column[R]], rows: Iterable[R], **options: Any
) -> None:
    """Print a table on a terminal, whole: it runs over a narrow edge before it cuts a number.

    Args:
        to: Where.
        columns: The columns.
        rows: What they are of.
        options: Of rich's table.
    """
    table = _rich_table(columns, rows, **options)
    natural = Measurement.get(to, to.options.update(max_width=WIDEST), table).maximum
    # what folds gives way, down to a few words
    for column in table.columns:
        if not column.no_wrap:
            longest = max(len(str(cell)) for cell in column.cells)
            natural -= max(0, longest - FOLDED)
    if natural > to.width:
        table.width = natural
    to.print(table, crop=False)


def _rich_table[R](columns: Sequence[Column[R]], rows: Iterable[R], **options: Any) -> Table:
    """The table as rich has it; brackets in it are no markup."""
    table = Table(box=None, header_style="bold", pad_edge=False, title_justify="left", **options)
    for column in columns:
        folds = column.kind == "folded"
        table.add_column(
            Text(column.title),
            justify="right" if column.kind == "number" else "left",
            no_wrap=not folds,
            overflow="fold" if folds else "ellipsis",
        )
    for row in rows:
        found = [column.cell(row) for column in columns]
        table.add_row(*(Text(cell) if isinstance(cell, str) else cell for cell in found))
    return table


def console(width: int = 200, stderr: bool = False) -> Console:
    """Console on which tables are printed.

    Args:
        width: Width in a file or pipe, letters: wide enough for all that does not fold.
        stderr: Whether stdout is for something else.
    """
    terminal = (sys.stderr if stderr else sys.stdout).isatty()
    return Console(highlight=False, stderr=stderr, width=None if terminal else width)


def line(to: Console, text: str) -> None:
    """A line of text as it is, however long."""
    to.print(text, markup=False, soft_wrap=True)


def to_json(value: Any, **renamed: str) -> str:
    """Plain values as JSON (`plain`)."""
    return json.dumps(plain(value, **renamed), indent=1, allow_nan=False)


def write(name: str, text: str, draw: Callable[[Path], None] | None, folder: Path) -> None:
    """Write `NAME.json`, and `NAME.png` where there is something to draw; on the first rank.

    Args:
        name: What the files are called.
        text: The JSON.
        draw: Draws the picture into a file.
        folder: Where; made if it is not there.
    """
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / f"{name}.json", text + "\n")
    if draw is not None:
        draw(folder / f"{name}.png")


def slowest(comm: MPI.Comm, seconds: float) -> float:
    """The time of the slowest rank, which the others wait for; collective."""
    return float(max(comm.allgather(seconds)))


def spread(times: Sequence[float], typical: float) -> float:
    """Difference of the slowest and the fastest round, relative to the typical one."""
    return (max(times) - min(times)) / typical if typical > 0 else 0.0


def unbeaten[P](
    points: Iterable[P], time: Callable[[P], float], error: Callable[[P], float]
) -> list[P]:
    """Points that no other one beats in both error and time, the fastest first.

    Args:
        points: Points.
        time: Of a point.
        error: Of a point; infinite ones are left out.
    """
    found: list[P] = []
    least = float("inf")
    for point in sorted(points, key=lambda p: (time(p), error(p))):
        if error(point) < least:
            found.append(point)
            least = error(point)
    return found
