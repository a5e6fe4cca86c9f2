"""The bars of `python -m tests.bench --check`: ratios within one run."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from statistics import median

import numpy as np

from tests.bench.record import AUTO, FULL, UNREDUCED, Configuration, Measured

# at least so many times faster than the unreduced path with full Newton: reduced, and by default
# (as times what OVERHEAD asked for when it was set, docs/theory/linear_systems.md: bare work
# becomes cheaper, too)
FASTER = (
    (FULL, {"6x2": 2.0, "32x32": 3.0}),
    (AUTO, {"6x2": 12.0, "32x32": 16.0}),
)
# the default against full Newton
RARELY = {"6x2": 2.0}
# step over bare work
OVERHEAD = {"6x2": 2.0, "32x32": 1.3}
# a step over one of another scheme, in some of the ways to solve
OVER = (("ed", "ep", (FULL, AUTO), 3.0), ("ep4", "ed", (AUTO,), 1.5))
EXPONENT = 1.25
OBSERVERS = 0.10
PEAK_MIB = 2048.0


@dataclass(frozen=True)
class Bar:
    """Bar with its measured value.

    Args:
        name: What, of which case.
        value: Measured.
        bound: Asked.
        least: Whether the value must reach the bound, or stay below it.
    """

    name: str
    value: float
    bound: float
    least: bool = False

    @property
    def passed(self) -> bool:
        """Decide whether the bar is met."""
        return self.value >= self.bound if self.least else self.value <= self.bound


def bars(measured: Sequence[Measured]) -> list[Bar]:
    """All bars that the measurements decide.

    Ratios of configurations are medians over the rounds, in which they took turns.
    """
    by: dict[tuple[str, str, str], dict[Configuration, Measured]] = {}
    for m in measured:
        by.setdefault(m.record.case, {})[m.record.configuration] = m
    found = [bar for case, some in by.items() for bar in _of_case(case, some)]
    for (scene, scheme, mesh), some in by.items():
        for one, other, ways, bound in OVER:
            there = by.get((scene, other, mesh), {})
            for how in ways:
                if scheme == one and how in some and how in there:
                    ratio = some[how].record.step_s / there[how].record.step_s
                    names = f"{one.upper()} step over {other.upper()} step"
                    found.append(Bar(f"{names}, {how}, {mesh}", ratio, bound))
    for scheme in ("ep", "ed"):
        growth = exponents(measured, scheme)
        if growth is not None:
            sizes = f"{scheme}, {growth.first} to {growth.last} elements"
            found.append(
                Bar(f"growth exponent of an iteration, fit, {sizes}", growth.fit, EXPONENT)
            )
            steepest = f"growth exponent of an iteration, steepest, {sizes}"
            found.append(Bar(steepest, growth.steepest, EXPONENT))
    return found


def _of_case(case: tuple[str, str, str], some: dict[Configuration, Measured]) -> Iterator[Bar]:
    name, mesh, dynamic = " ".join(case), case[2], case[0] == "dynamic"
    for how, least in FASTER:
        if dynamic and mesh in least and UNREDUCED in some and how in some:
            ratio = _ratio(some[UNREDUCED], some[how])
            yield Bar(f"{UNREDUCED} over {how}, {name}", ratio, least[mesh], True)
    if dynamic and mesh in RARELY and FULL in some and AUTO in some:
        ratio = _ratio(some[FULL], some[AUTO])
        yield Bar(f"{FULL} over {AUTO}, {name}", ratio, RARELY[mesh], True)
    for how, m in some.items():
        if dynamic and mesh in OVERHEAD and how.path == "reduced":
            value = median(r.step_s / r.bare_s for r in m.rounds)
            yield Bar(f"step over bare work, {how}, {name}", value, OVERHEAD[mesh])
        if dynamic and how == AUTO:
            # the mean over the rounds: a frame is not written in each
            share = np.sum([r.parts["observers_s"] for r in m.rounds])
            share /= np.sum([r.step_s for r in m.rounds])
            yield Bar(f"share of observers, {how}, {name}", float(share), OBSERVERS)
        if m.record.peak_mib is not None and how == AUTO:
            yield Bar(f"peak memory [MiB], {how}, {name}", m.record.peak_mib, PEAK_MIB)


def _ratio(slow: Measured, fast: Measured) -> float:
    pairs = zip(slow.rounds, fast.rounds, strict=True)
    return median(a.step_s / b.step_s for a, b in pairs)


@dataclass(frozen=True)
class Growth:
    """Growth of the time of a full Newton iteration with the number of elements.

    Args:
        elements: Numbers of elements.
        seconds: Time of one iteration of each, s.
        fit: Exponent by least squares.
        constant: Time at one element of the fitted law, s.
    """

    elements: tuple[int, ...]
    seconds: tuple[float, ...]
    fit: float
    constant: float

    @property
    def first(self) -> int:
        """Smallest number of elements."""
        return self.elements[0]

    @property
    def last(self) -> int:
        """Largest one."""
        return self.elements[-1]

    @property
    def steepest(self) -> float:
        """Largest exponent between neighbours."""
        slopes = np.diff(np.log(self.seconds)) / np.diff(np.log(self.elements))
        return float(slopes.max())


def exponents(measured: Sequence[Measured], scheme: str) -> Growth | None:
    """Growth of a full Newton iteration of the reduced path; None for less than three meshes."""
    times: dict[int, float] = {}
    for m in measured:
        r = m.record
        if (r.scheme, r.configuration) == (scheme, FULL):
            times[r.elements] = (r.step_s - r.observers_s) / r.iterations_per_step
    if len(times) < 3:
        return None
    elements = tuple(sorted(times))
    seconds = tuple(times[n] for n in elements)
    fit, constant = np.polyfit(np.log(elements), np.log(seconds), 1)
    return Growth(elements, seconds, float(fit), float(np.exp(constant)))
