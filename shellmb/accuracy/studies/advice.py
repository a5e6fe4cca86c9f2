"""Findings of a study: observed orders, and the configuration for each error with its cost."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, log, prod
from typing import Any

import numpy as np

from shellmb.accuracy.studies.points import Judged, Point, front

# errors that are requested
TARGETS = (1e-2, 1e-3, 1e-4)
# finer runs with errors larger by this factor are told
LUCK = 1.05


@dataclass(frozen=True)
class Offer:
    """Cost of a family of runs for an error.

    Args:
        family: The family.
        point: The fastest run of it that has at most that error, as finer ones have.
        time_s: Time for just that error, by interpolation along the family's front in logarithms;
            that of the point where all its runs are better.
        bound: Whether a coarser run would do: the time is an upper bound.
    """

    family: str
    point: Point
    time_s: float
    bound: bool = False

    def to_dict(self) -> dict[str, Any]:
        """For machines."""
        said = {"family": self.family, "choice": self.point.choice}
        return {**said, "time_s": self.time_s, "upper_bound": self.bound}


@dataclass(frozen=True)
class Target:
    """An error requested.

    Args:
        error: It, relative.
        offers: Of the families that reach it, the fastest first.
        missing: Families that do not.
        known: Whether the reference is known well enough to tell.
    """

    error: float
    offers: tuple[Offer, ...]
    missing: tuple[str, ...]
    known: bool

    def to_dict(self) -> dict[str, Any]:
        """For machines."""
        said = {"error": self.error, "known": self.known}
        return {**said, "offers": self.offers, "not_reached": self.missing}


def find_targets(judged: Judged, errors: Sequence[float] = TARGETS) -> list[Target]:
    """Offers for each error."""
    return [_target(judged, error) for error in errors]


def _target(judged: Judged, error: float) -> Target:
    uncertainty = judged.reference.uncertainty
    offers, missing = [], []
    for family, points in judged.families().items():
        offer = _offer(family, front(points, uncertainty), error, uncertainty)
        if offer is None:
            missing.append(family)
        else:
            offers.append(offer)
    offers.sort(key=lambda o: o.time_s)
    return Target(error, tuple(offers), tuple(missing), error >= uncertainty)


def _offer(family: str, line: Sequence[Point], error: float, uncertainty: float) -> Offer | None:
    for before, point in zip([None, *line], line, strict=False):
        reached = point.bound(uncertainty)
        if reached > error:
            continue
        if before is None or before.time_s <= 0 or reached <= 0:
            return Offer(family, point, point.time_s, bound=before is None)
        worse = before.bound(uncertainty)
        part = log(worse / error) / log(worse / reached)
        time = exp((1 - part) * log(before.time_s) + part * log(point.time_s))
        return Offer(family, point, time)
    return None


def sentence(judged: Judged, targets: Sequence[Target]) -> str:
    """Advice for each error: the choice, its cost, and that of others, also if it is not reached.

    Args:
        judged: The quantity.
        targets: Its targets, the largest error first.
    """
    if not judged.good:
        return f"No run succeeded: nothing is known about {judged.quantity}."
    parts: list[str] = []
    base: Offer | None = None
    alone = f" from {_refined(judged)} alone" if judged.not_refined else ""
    for target in targets:
        requested = f"{100 * target.error:g} % error in {judged.quantity}{alone}"
        if not target.known:
            known = f"{100 * judged.reference.uncertainty:.2g} %"
            parts.append(
                f"{requested} cannot be determined: the reference is accurate to {known} only."
            )
        elif not target.offers:
            parts.append(f"{requested} is not reached: {_best(judged)}.")
        else:
            parts.append(_reached(judged, target, requested, base))
            base = base or target.offers[0]
    if judged.not_refined:
        fixed = " and ".join(judged.not_refined)
        parts.append(
            f"These errors leave out {fixed}: that was not refined, and its error comes on top. "
            "Sweep it, too."
        )
    elif len(judged.reference.refined) > 1:
        parts.append(f"These errors are of {_refined(judged)} together.")
    return " ".join(parts)


def _refined(judged: Judged) -> str:
    """Say what the study refines."""
    refined = set(judged.reference.refined)
    told = [("the mesh", {"mesh", "divide"}), ("the step", {"dt", "step_error"})]
    return " and ".join(said for said, axes in told if axes & refined)


def _reached(judged: Judged, target: Target, requested: str, base: Offer | None) -> str:
    best = target.offers[0]
    name, error = judged.name(best.point), _error(judged, best.point)
    told = f"For {requested} choose {name} (its error is {error}): {_cost(best)}"
    if base is not None and best.point != base.point:
        told += f", {_times(best.time_s / base.time_s)} as much"
    others = []
    for offer in target.offers[1:]:
        ratio = offer.time_s / best.time_s if best.time_s > 0 else 1.0
        unclear = best.point.spread + offer.point.spread > 2 * (ratio - 1)
        noise = ", within the noise" if unclear else ""
        others.append(f"{offer.family} takes {_seconds(offer.time_s)} ({_times(ratio)}{noise})")
    others += [f"{family} does not reach it" for family in target.missing]
    return told + (f"; {', '.join(others)}." if others else ".")


def _times(ratio: float) -> str:
    return f"{ratio:.1f} times" if ratio < 10 else f"{ratio:.0f} times"


def _cost(offer: Offer) -> str:
    """The time, and how it is known."""
    if offer.bound:
        return f"at most {_seconds(offer.time_s)} (no cheaper one was run)"
    run = _seconds(offer.point.time_s)
    told = _seconds(offer.time_s)
    return told if told == run else f"{told} by interpolation ({run} as run)"


def _best(judged: Judged) -> str:
    uncertainty = judged.reference.uncertainty
    best = min(judged.good, key=lambda p: (p.bound(uncertainty), p.time_s))
    took = _seconds(best.time_s)
    return f"the best is {judged.name(best)} with {_error(judged, best)} in {took}"


def _error(judged: Judged, point: Point) -> str:
    if point.below:
        return f"below {100 * judged.reference.uncertainty:.2g} %"
    told = f"{100 * (point.error or 0.0):.2g} %"
    # a number that has crossed the reference on its way
    if point.credit > LUCK * (point.error or 0.0):
        told += f", finer runs have up to {100 * point.credit:.2g} %"
    return told


def _seconds(time: float) -> str:
    return f"{time:.3g} s" if time >= 0.1 else f"{1000 * time:.3g} ms"


# beyond this error nothing is asymptotic; below so many uncertainties the reference is seen
COARSE, CLEAR = 0.3, 3.0
# axes that change the size of elements
MESHES = ("mesh", "divide")


@dataclass(frozen=True)
class Order:
    """A slope in the logarithms of error and step or element size.

    Args:
        family: What the runs have in common.
        direction: "dt", "h", or "step_error".
        order: The slope; None if fewer than two runs tell.
        points: Number of runs that tell.
        at: The other size, at which it was found: that of the finest runs.
    """

    family: str
    direction: str
    order: float | None
    points: int
    at: str


def find_orders(judged: Judged) -> list[Order]:
    """Orders in time and in space of each family.

    Where both step and mesh are swept, that in time is found at the finest mesh, that in space with
    the smallest step: the other error limits it there as little as it can. Runs with errors above
    30 %, or below three times what is known of the reference, tell nothing.
    """
    found = []
    for family, points in judged.families().items():
        # of several tolerances the tightest
        tight = min(p.choice.newton_tolerance or 0.0 for p in points)
        some = [p for p in points if (p.choice.newton_tolerance or 0.0) == tight]
        if some[0].choice.step_error is not None:
            allowed = [p.choice.step_error or 1.0 for p in some]
            found.append(_order(judged, family, "step_error", some, allowed, ""))
            continue
        if "dt" in judged.swept:
            finest = max((p.choice for p in some), key=lambda c: prod(c.counts))
            line = [p for p in some if p.choice.counts == finest.counts]
            sizes = [p.choice.dt or 1.0 for p in line]
            at = finest.label(tuple(axis for axis in MESHES if axis in judged.swept))
            found.append(_order(judged, family, "dt", line, sizes, at))
        if set(MESHES) & set(judged.swept):
            least = min(p.choice.dt or 0.0 for p in some)
            line = [p for p in some if (p.choice.dt or 0.0) == least]
            at = f"dt = {least:g} s" if "dt" in judged.swept else ""
            found.append(_order(judged, family, "h", line, element_sizes(line), at))
    return found


def element_sizes(points: Sequence[Point]) -> list[float]:
    """Sizes of elements, relative: from the counts that are not the same in all meshes."""
    meshes = [p.choice.counts for p in points]
    moving = [k for k in (0, 1) if len({m[k] for m in meshes}) > 1] or [0]
    return [float(prod(m[k] for k in moving)) ** (-1 / len(moving)) for m in meshes]


def _order(
    judged: Judged,
    family: str,
    direction: str,
    points: Sequence[Point],
    sizes: Sequence[float],
    at: str,
) -> Order:
    least = CLEAR * judged.reference.uncertainty
    telling = [
        (size, point.error)
        for size, point in zip(sizes, points, strict=True)
        if point.error is not None and max(least, 1e-14) < point.error < COARSE
    ]
    if len({size for size, _ in telling}) < 2:
        return Order(family, direction, None, len(telling), at)
    x, y = np.log(np.array(telling)).T
    return Order(family, direction, float(np.polyfit(x, y, 1)[0]), len(telling), at)
