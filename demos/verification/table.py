"""The table of `shellmb verify`: cases run one after another, one row per number compared."""

import importlib
import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fnmatch import fnmatch

from shellmb.demos.verification.cases import CASES, Case, Check
from shellmb.errors import ShellmbError

# the modules that register cases, in the order of the table
MODULES = (
    "plates",
    "laminates",
    "rates",
    "forced",
    "frequencies",
    "modes",
    "linear_shells",
    "elements.plane",
    "elements.beams",
    "elements.curved",
    "elements.vibrating",
    "large_displacements",
    "membranes",
    "motion.dynamics",
    "motion.in_time",
    "mechanisms",
    "beams.exact",
    "beams.tension",
)


@dataclass(frozen=True)
class Row:
    """A line of the table.

    Args:
        case: Name of the case and of what is compared.
        value: Our number.
        reference: What it should be.
        source: Where the reference comes from; after a failed run, what failed.
        error: Relative error, or the amount by which a bound is missed.
        wall_s: Wall time since the previous row, s.
        passed: Whether the error is within the tolerance.
        tolerance: Largest error that passes.
    """

    case: str
    value: float
    reference: float
    source: str
    error: float
    wall_s: float
    passed: bool
    tolerance: float


def find_cases(pattern: str | None = None, slow: bool = False) -> list[Case]:
    """The registered cases.

    Args:
        pattern: Part of the name, or a shell pattern for the whole of it; None: all.
        slow: Whether those that take long are among them; a case named in full always is.
    """
    for module in MODULES:
        importlib.import_module(f"{__package__}.problems.{module}")
    return [
        case
        for case in CASES.values()
        if (pattern is None or pattern in case.name or fnmatch(case.name, pattern))
        and (slow or not case.slow or case.name == pattern)
    ]


def rows_of(case: Case) -> Iterator[Row]:
    """Run a case; a run that fails makes a row that fails and ends the case."""
    begin = time.perf_counter()
    checks = iter(case.checks())
    while True:
        try:
            check = next(checks, None)
        except ShellmbError as error:
            check = Check("run", math.nan, 0.0, f"{type(error).__name__}: {error}")
        if check is None:
            return
        now = time.perf_counter()
        yield Row(
            f"{case.name}: {check.name}",
            float(check.value),
            float(check.reference),
            check.source,
            float(check.error),
            now - begin,
            check.passed,
            check.tolerance,
        )
        begin = now


def run_cases(
    pattern: str | None = None,
    slow: bool = False,
    report: Callable[[Row], None] | None = None,
) -> list[Row]:
    """Run cases.

    Args:
        pattern: As for `find_cases`.
        slow: As for `find_cases`.
        report: Called with each row as soon as it is known.

    Returns:
        All rows.
    """
    rows = []
    for case in find_cases(pattern, slow):
        for row in rows_of(case):
            rows.append(row)
            if report is not None:
                report(row)
    return rows
