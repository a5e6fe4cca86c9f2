"""The distance from several facets: a smooth least one, with mean slopes that are exact.

The least of several distances has a kink where a point is as near to one facet as to the next, in
a fold: forces jump there, and Newton's method finds no end. Its smooth form

    S(g) = -epsilon log sum_k exp(-g_k/epsilon),   w_k = dS/dg_k

is concave, with weights `w` that add up to one. So `w_b.(g_b - g_a) <= S_b - S_a <= w_a.(g_b -
g_a)`, and with some `theta` in [0, 1] the weights `theta w_a + (1 - theta) w_b` work exactly the
change of `S`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from shellmb.arrays import Floats, Ints

# changes of distances in epsilon up to which logarithms of sums are taken by their small parts
SMALL = 1.0
# in epsilon, what is left of a concave function where weights do not change
STILL = 1e-20


class Families(NamedTuple):
    """Pairs of a point and a facet, those of a point one after the other.

    Args:
        owner: Number of the point of each pair, shape (p,).
        first: First pair of each point, shape (n,).
        width: `epsilon`, m.
    """

    owner: Ints
    first: Ints
    width: float

    def sums(self, values: Floats) -> Floats:
        """Sums over the pairs of each point, shape (n,)."""
        return np.asarray(np.add.reduceat(values, self.first))

    def least(self, g: Floats) -> tuple[Floats, Floats]:
        """Smooth least distance of each point, (n,), m, and weights of its pairs, (p,)."""
        lowest = np.minimum.reduceat(g, self.first)
        parts = np.exp((lowest[self.owner] - g) / self.width)
        total = self.sums(parts)
        return lowest - self.width * np.log(total), parts / total[self.owner]

    def relatives(self) -> tuple[Ints, Ints]:
        """All two pairs of a point, itself and itself included."""
        counts = np.bincount(self.owner)
        own = counts[self.owner]
        one = np.repeat(np.arange(len(self.owner)), own)
        place = np.arange(len(one)) - np.repeat(np.cumsum(own) - own, own)
        return one, self.first[self.owner[one]] + place


class Mixed(NamedTuple):
    """Mean weights of the pairs of a step, and what their derivatives are made of.

    Args:
        weights: The mean weights, shape (p,).
        apart: Weights at the first state less those at the second, shape (p,).
        theta: Share of the first state, of each pair's point, shape (p,).
        by_first: Derivative of that share by the distances at the first state, shape (p,).
        by_second: By those at the second state.
        ends: Weights at both states.
        width: `epsilon`, m.
    """

    weights: Floats
    apart: Floats
    theta: Floats
    by_first: Floats
    by_second: Floats
    ends: tuple[Floats, Floats]
    width: float

    def derivatives(self, one: Ints, other: Ints) -> tuple[Floats, Floats]:
        """Of the weight of one pair by the distances of another, at the first and second state."""
        found, shares = [], (self.theta, 1 - self.theta)
        for by, share, w in zip((self.by_first, self.by_second), shares, self.ends, strict=True):
            turned = w[one] * w[other] - np.where(one == other, w[one], 0.0)
            found.append(self.apart[one] * by[other] + share[one] * turned / self.width)
        return found[0], found[1]


def mixed(of: Families, a: Floats, b: Floats) -> Mixed:
    """Mean weights from distances `a` to distances `b` of all pairs, shape (p,) each."""
    (least_a, w_a), (least_b, w_b) = of.least(a), of.least(b)
    change, rise = b - a, least_b - least_a
    mean_a, mean_b = of.sums(w_a * change), of.sums(w_b * change)
    off_a, off_b = change - mean_a[of.owner], change - mean_b[of.owner]
    p_a = _left(of, w_a, off_a, mean_a - rise)
    p_b = _left(of, w_b, -off_b, rise - mean_b)
    total = p_a + p_b
    moves = total > STILL * of.width
    scale = np.where(moves, 1 / np.where(moves, total, 1.0), 0.0)[of.owner]
    theta = np.where(moves, np.clip(p_b / np.where(moves, total, 1.0), 0, 1), 0.5)[of.owner]
    apart = w_a - w_b
    # second derivatives of S times the change
    bend_a, bend_b = (-w * off / of.width for w, off in ((w_a, off_a), (w_b, off_b)))
    by_b = scale * (-(1 - theta) * bend_b - theta * apart)
    by_a = scale * (-(1 - theta) * apart - theta * bend_a)
    weights = theta * w_a + (1 - theta) * w_b
    return Mixed(weights, apart, theta, by_a, by_b, (w_a, w_b), of.width)


def _left(of: Families, w: Floats, off: Floats, plain: Floats) -> Floats:
    """Gap of a concave function below its tangent, shape (n,), m; `plain` is that, rounded."""
    small = np.maximum.reduceat(abs(off), of.first) < SMALL * of.width
    inner = np.where(small[of.owner], off / of.width, 0.0)
    found = of.width * np.log1p(of.sums(w * np.expm1(-inner)))
    return np.maximum(np.where(small, found, plain), 0.0)
