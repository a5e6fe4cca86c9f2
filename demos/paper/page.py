"""Tables of statements in `demos/README.md`: written from verdicts, and compared with them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from decimal import Decimal
from pathlib import Path

from demos.paper.make import Judged
from shellmb.accuracy.measuring import Column
from shellmb.demos.verification.measuring import markdown, replaced

__all__ = ["PAGE", "differences", "with_table"]

PAGE = Path(__file__).parents[1] / "README.md"
# smaller numbers are round-off, which differs from machine to machine
ROUND_OFF = Decimal("1e-8")
_NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")

COLUMNS: tuple[Column[Judged], ...] = (
    Column("statement", lambda j: j.statement),
    Column("the paper", lambda j: j.paper),
    Column("ours", lambda j: j.ours),
    Column("verdict", lambda j: "pass" if j.passed else f"**FAIL**: {j.why}"),
)


def with_table(text: str, section: str, judged: Sequence[Judged]) -> str:
    """The page with the statements of a section, all of them.

    Args:
        text: The page.
        section: The section of the paper.
        judged: Its statements.
    """
    begin, end = (f"<!-- statements of {section}: {word} -->" for word in ("begin", "end"))
    return replaced(text, begin, end, "\n".join(["", *markdown(COLUMNS, judged), ""]))


def differences(text: str, judged: Sequence[Judged]) -> list[str]:
    """Find statements that the page does not have as they are.

    Numbers agree within one unit of their last digit, and where both are round-off.

    Args:
        text: The page.
        judged: Statements, all or some.
    """
    rows = {line.split(" | ")[0]: line for line in text.splitlines() if line.startswith("| ")}
    found = []
    for one in judged:
        now = markdown(COLUMNS, [one])[-1]
        there = rows.get(now.split(" | ")[0])
        if there is None:
            found.append(f"{one.example}: the page does not have the statement '{one.statement}'")
        elif not _alike(there, now):
            found.append(f"{one.example}: the page has\n  {there}\nand it is now\n  {now}")
    return found


def _alike(there: str, now: str) -> bool:
    """Compare two rows word by word, and number by number."""
    if _NUMBER.sub("#", there) != _NUMBER.sub("#", now):
        return False
    pairs = zip(_NUMBER.findall(there), _NUMBER.findall(now), strict=True)
    return all(_near(Decimal(a), Decimal(b)) for a, b in pairs)


def _near(a: Decimal, b: Decimal) -> bool:
    unit = max(Decimal(1).scaleb(int(number.as_tuple().exponent)) for number in (a, b))
    return abs(a - b) <= unit or max(abs(a), abs(b)) < ROUND_OFF
