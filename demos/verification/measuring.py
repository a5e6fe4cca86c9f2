"""Clocks, verdicts and tables in pages, for all evidence."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence

from rich.text import Text

from shellmb.accuracy.measuring import Column


class Stopwatch:
    """Times since it was made, or started anew: wall times tell how busy the machine is, too."""

    def __init__(self) -> None:
        self.start()

    def start(self) -> None:
        """Start anew."""
        self._cpu, self._wall = time.process_time(), time.perf_counter()

    @property
    def cpu(self) -> float:
        """Processor time, s."""
        return time.process_time() - self._cpu

    @property
    def wall(self) -> float:
        """Wall time, s."""
        return time.perf_counter() - self._wall


def markdown[R](columns: Sequence[Column[R]], rows: Iterable[R]) -> list[str]:
    """The lines of the table in Markdown."""
    cells = [[column.title for column in columns], ["---"] * len(columns)]
    cells += [[str(column.cell(row)) for column in columns] for row in rows]
    return ["| " + " | ".join(line) + " |" for line in cells]


def replaced(text: str, begin: str, end: str, made: str) -> str:
    """A page with what was made between its marks.

    Args:
        text: The page.
        begin: The mark before it.
        end: The mark behind it.
        made: What is put there.

    Raises:
        ValueError: If the page has no such marks.
    """
    before, found, rest = text.partition(begin)
    _, last, after = rest.partition(end)
    if not found or not last:
        raise ValueError(f"the page has no lines '{begin}' and '{end}'")
    return f"{before}{begin}\n{made}\n{end}{after}"


def verdict(passed: bool, otherwise: str = "FAIL") -> Text:
    """Verdict on whether something passes, in colour.

    Args:
        passed: Whether.
        otherwise: The word where it does not.
    """
    return Text("pass", "green") if passed else Text(otherwise, "red bold")
