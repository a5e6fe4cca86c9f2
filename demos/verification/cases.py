"""Verification cases: functions that yield checks, registered under a name."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Literal

Kind = Literal["relative", "at most", "at least"]


@dataclass(frozen=True)
class Check:
    """A number compared with a reference.

    Args:
        name: What is compared; with the case's name it makes the name of the row.
        value: Our number.
        reference: What it should be.
        source: Where the reference comes from.
        tolerance: Largest error that passes.
        kind: How the error is measured. "relative": distance over the size of the reference;
            "at most": what the value exceeds the reference by; "at least": what it falls short by.
    """

    name: str
    value: float
    reference: float
    source: str
    tolerance: float = 0.01
    kind: Kind = "relative"

    @property
    def error(self) -> float:
        """The error, in the measure of `kind`; infinite where the value is not a number."""
        if not math.isfinite(self.value):
            return math.inf
        difference = self.value - self.reference
        if self.kind == "at most":
            return max(0.0, difference)
        if self.kind == "at least":
            return max(0.0, -difference)
        return abs(difference) / abs(self.reference) if self.reference else abs(difference)

    @property
    def passed(self) -> bool:
        """Decide whether the error is within the tolerance."""
        return self.error <= self.tolerance


@dataclass(frozen=True)
class Case:
    """A group of checks that share their set-up, and so their forms.

    Args:
        name: Name, as in "plates/square".
        checks: Runs the case.
        slow: Whether it takes more than half a minute with the loops compiled.
    """

    name: str
    checks: Callable[[], Iterator[Check]] = field(repr=False)
    slow: bool = False


CASES: dict[str, Case] = {}


def case(
    name: str, slow: bool = False
) -> Callable[[Callable[[], Iterator[Check]]], Callable[[], Iterator[Check]]]:
    """Register a function that yields checks.

    Args:
        name: Name of the case.
        slow: Whether it is left out unless requested.
    """

    def register(checks: Callable[[], Iterator[Check]]) -> Callable[[], Iterator[Check]]:
        assert name not in CASES, f"two cases are named '{name}'"
        CASES[name] = Case(name, checks, slow)
        return checks

    return register
