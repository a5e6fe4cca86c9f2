"""The table of `shellmb verify`."""

from __future__ import annotations

from shellmb.accuracy.measuring import Column, console, line, print_table, to_json
from shellmb.cli.report import say
from shellmb.demos.verification.measuring import verdict
from shellmb.demos.verification.table import Row, run_cases
from shellmb.errors import SceneError


def run_verification(pattern: str | None, slow: bool, as_json: bool) -> bool:
    """Run the cases, print their table, say whether all pass.

    Args:
        pattern: Part of the names of the cases wanted; None: all.
        slow: Whether those that take minutes are among them.
        as_json: Whether a JSON list is printed instead of a table.

    Raises:
        SceneError: If no case has such a name.
    """
    errors = console(stderr=True)

    def report(row: Row) -> None:
        # what has been done so far, while the table waits for all
        mark = "pass" if row.passed else "FAIL"
        line(errors, f"{mark}  {row.case}  ({row.wall_s:.1f} s)")

    rows = run_cases(pattern, slow, report)
    if not rows:
        raise SceneError(f"verify: no case has '{pattern}' in its name")
    if as_json:
        say(to_json(rows, passed="pass"))
    else:
        _print_table(rows)
    return all(row.passed for row in rows)


COLUMNS: tuple[Column[Row], ...] = (
    Column("case", lambda row: row.case, "words"),
    Column("value", lambda row: f"{row.value:.6g}"),
    Column("reference", lambda row: f"{row.reference:.6g}"),
    Column("error", lambda row: f"{row.error:.1e}"),
    Column("allowed", lambda row: f"{row.tolerance:.1e}"),
    Column("wall [s]", lambda row: f"{row.wall_s:.1f}"),
    Column("", lambda row: verdict(row.passed), "words"),
    Column("source", lambda row: row.source, "folded"),
)


def _print_table(rows: list[Row]) -> None:
    print_table(console(220), COLUMNS, rows)
    failed = sum(not row.passed for row in rows)
    say(f"{len(rows) - failed} of {len(rows)} pass" + (f", {failed} fail" if failed else ""))
