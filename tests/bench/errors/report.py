"""The bench of errors: cases run one by one, records kept, the table of the documentation."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Sequence
from pathlib import Path
from statistics import median

from shellmb.accuracy.measuring import to_json
from shellmb.demos.verification.measuring import replaced
from shellmb.errors import SceneError
from tests.bench.errors.bodies import MOTIONS, OTHERS, STATICS
from tests.bench.errors.case import Case
from tests.bench.errors.compare import Compared, Row, compare
from tests.bench.errors.mechanisms import MECHANISMS
from tests.bench.errors.points import POINTS
from tests.bench.errors.second import SECOND

CASES: tuple[Case, ...] = (*STATICS, *MOTIONS, *MECHANISMS, *OTHERS, *SECOND, *POINTS)
ROOT = Path(__file__).parents[3]
PAGE = ROOT / "docs" / "evidence" / "stated_errors.md"
RECORDS = ROOT / "demos" / "studies" / "errors.json"
BEGIN, END = "<!-- errors: begin -->", "<!-- errors: end -->"
# of prose in the documentation
WIDTH = 118
# what is promised
COVERED, MEDIAN, LARGEST, COST = 0.95, 3.0, 20.0, 1.9


def run_errors(names: Sequence[str], out: Path | None, again: bool, docs: bool) -> bool:
    """Run cases that have no record yet, and print the table of all that have one.

    Args:
        names: Parts of names of cases; none: all.
        out: File of the records; None: `RECORDS`.
        again: Whether cases that have a record are run again.
        docs: Whether the table is written into the documentation.

    Returns:
        Whether what is promised is kept by the cases with a record.

    Raises:
        SceneError: If no case has such a name.
    """
    file = out or RECORDS
    found = read(file)
    chosen = [c for c in CASES if not names or any(n.lower() in c.name.lower() for n in names)]
    if not chosen:
        raise SceneError(
            f"errors: case is '{names[0]}'; it must be a part of one of "
            + ", ".join(f"'{c.name}'" for c in CASES)
        )
    for case in chosen:
        if case.name in found and not again:
            continue
        found[case.name] = done = compare(case)
        print(f"{case.name}: {done.bare_s:.2f} s, with errors {done.errors_s:.2f} s", flush=True)
        for row in done.rows:
            print(f"  {line(row)}", flush=True)
        found = {c.name: found[c.name] for c in CASES if c.name in found}
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(to_json(found) + "\n")
    print(table(found))
    if docs:
        PAGE.write_text(replaced(PAGE.read_text(), BEGIN, END, table(found)))
    return kept(found)


def read(file: Path) -> dict[str, Compared]:
    """The records of a file; none if it is not there.

    Args:
        file: The file.
    """
    stored = json.loads(file.read_text()) if file.exists() else {}
    return {name: Compared.from_dict(values) for name, values in stored.items()}


def line(row: Row) -> str:
    """A quantity as a row of the table.

    Args:
        row: It.
    """
    stated = "not known" if row.stated is None else f"{row.stated:.1e}"
    ratio = "-" if row.ratio is None else f"{row.ratio:.2g}"
    miss = " **miss**" if row.ratio is not None and row.ratio < 1 else ""
    said = " (remark)" if row.said and (row.ratio is None or row.ratio > LARGEST) else ""
    return (
        f"| {row.case} | `{row.quantity}` | {row.value:.4g} | {stated} | {row.true:.1e} | "
        f"{ratio}{miss}{said} |"
    )


def table(found: dict[str, Compared]) -> str:
    """Table and summary in Markdown.

    Args:
        found: Records by case.
    """
    rows = [row for case in found.values() for row in case.rows]
    head = ["| case | quantity | value | stated error | true error | stated/true |"]
    head.append("| --- | --- | --- | --- | --- | --- |")
    return "\n".join([summary(found), "", *head, *map(line, rows)])


def summary(found: dict[str, Compared]) -> str:
    """Summarise the table in words.

    Args:
        found: Records by case.
    """
    rows = [row for case in found.values() for row in case.rows]
    ratios = [row.ratio for row in rows if row.ratio is not None]
    costs = [case.errors_s / case.bare_s for case in found.values()]
    covered = sum(r >= 1 for r in ratios) / len(ratios)
    return textwrap.fill(
        f"{len(rows)} quantities of {len(found)} scenes: the true error is at most the stated one "
        f"in {100 * covered:.0f} % of {len(ratios)} with a stated error; stated over true is "
        f"{median(ratios):.2g} in the median, {min(ratios):.2g} at least, {max(ratios):.3g} at "
        f"most. Runs with errors take {median(costs):.2g} times the processor time of runs without "
        f"(median; {min(costs):.2g} to {max(costs):.2g}; these scenes are small).",
        WIDTH,
    )


def kept(found: dict[str, Compared]) -> bool:
    """Decide whether coverage, median and largest ratio are as promised.

    Args:
        found: Records by case.
    """
    rows = [row for case in found.values() for row in case.rows]
    known = [(row.ratio, row.said) for row in rows if row.ratio is not None]
    ratios = [ratio for ratio, _ in known]
    covered = sum(r >= 1 for r in ratios) / len(ratios)
    silent = any(ratio > LARGEST and not said for ratio, said in known)
    return covered >= COVERED and median(ratios) <= MEDIAN and not silent
