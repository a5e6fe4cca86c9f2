"""The table of `shellmb verify`."""

from __future__ import annotations

import sys

from rich.console import Console
from rich.table import Table

from shellmb.cli.report import say
from shellmb.errors import SceneError
from shellmb.verify.table import Row, run_cases, to_json


def run_verification(pattern: str | None, slow: bool, as_json: bool) -> bool:
    """Run the cases, print their table, say whether all pass.

    Args:
        pattern: Part of the names of the cases wanted; None: all.
        slow: Whether those that take minutes are among them.
        as_json: Whether a JSON list is printed instead of a table.

    Raises:
        SceneError: If no case has such a name.
    """
    errors = Console(stderr=True, highlight=False)

    def report(row: Row) -> None:
        # what has been done so far, while the table waits for all
        mark = "pass" if row.passed else "FAIL"
        errors.print(f"{mark}  {row.case}  ({row.wall_s:.1f} s)", markup=False, soft_wrap=True)

    rows = run_cases(pattern, slow, report)
    if not rows:
        raise SceneError(f"verify: no case has '{pattern}' in its name")
    if as_json:
        say(to_json(rows))
    else:
        _print_table(rows)
    return all(row.passed for row in rows)


def _print_table(rows: list[Row]) -> None:
    table = Table(box=None, header_style="bold", pad_edge=False)
    for title in ("case", "value", "reference", "error", "allowed", "wall [s]", ""):
        table.add_column(title, justify="left" if title in ("case", "") else "right", no_wrap=True)
    table.add_column("source", overflow="fold")
    for row in rows:
        table.add_row(
            row.case,
            f"{row.value:.6g}",
            f"{row.reference:.6g}",
            f"{row.error:.1e}",
            f"{row.tolerance:.1e}",
            f"{row.wall_s:.1f}",
            "[green]pass[/]" if row.passed else "[red bold]FAIL[/]",
            row.source,
        )
    # in a file or pipe the table is as wide as it has to be
    wide = None if sys.stdout.isatty() else 220
    Console(highlight=False, width=wide).print(table)
    failed = sum(not row.passed for row in rows)
    say(f"{len(rows) - failed} of {len(rows)} pass" + (f", {failed} fail" if failed else ""))
