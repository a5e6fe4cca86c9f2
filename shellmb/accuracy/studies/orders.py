"""Observed orders of convergence, by regression."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import prod

import numpy as np

from shellmb.accuracy.studies.points import Judged, Point

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
