"""Mean slopes of distances between two states, exact and free of momenta, with derivatives.

A point `y` and the place of a facet that is nearest to it have the vector `z = C x`, with weights
`C` of the nodes `x` that add up to zero, and the distance `g = |z|`, the least one of all weights.
Between states a and b with the weights `C_a` and `C_b` of either, which may be of two facets,

    h_C = |C x_b|^2 - |C x_a|^2 = 2 (C x_m).(C x_b - C x_a),   x_m = (x_a + x_b)/2

is the change of a square of a length that a common rigid motion leaves as it is. As `g` is the
least length, `h_{C_b} <= g_b^2 - g_a^2 <= h_{C_a}`, so with some `theta` in [0, 1] the slope

    f = 2 [theta C_a^T C_a x_m + (1 - theta) C_b^T C_b x_m]/(g_a + g_b)

has `f.(x_b - x_a) = g_b - g_a` to round-off, whatever the step and however the point slides from
facet to facet; its parts are along lines between the bodies: they have no sum, and no moment about
the positions `x_m`. After O. Gonzalez (J. Nonlinear Sci. 6 (1996) 449-467), without a quotient of
what vanishes.

The distance from several facets: a smooth least one, with mean slopes that are exact.

The least of several distances has a kink where a point is as near to one facet as to the next, in
a fold: forces jump there, and Newton's method finds no end. Its smooth form

    S(g) = -epsilon log sum_k exp(-g_k/epsilon),   w_k = dS/dg_k

is concave, with weights `w` that add up to one. So `w_b.(g_b - g_a) <= S_b - S_a <= w_a.(g_b -
g_a)`, and with some `theta` in [0, 1] the weights `theta w_a + (1 - theta) w_b` work exactly the
change of `S`.
"""

from typing import NamedTuple

import numpy as np

from shellmb.arrays import Floats, Ints

# squares of a slide in squares of distances below which theta is of no importance
STILL = 1e-24


class Places(NamedTuple):
    """Nearest places at one state, of points and nodes in the same slots at all states.

    Args:
        x: Positions in the slots relative to the point, shape (n, k, 3), m.
        weights: Their weights in the vector from the nearest place to the point, shape (n, k).
        turns: Changes of these weights along the facet, shape (n, 2, k).
        inverse: As of `facets.Nearest`.
        distance: Distances, shape (n,), m.
    """

    x: Floats
    weights: Floats
    turns: Floats
    inverse: Floats
    distance: Floats

    @property
    def away(self) -> Floats:
        """Vector from the nearest place to the point, shape (n, 3), m."""
        return vector(self.weights, self.x)

    @property
    def slope(self) -> Floats:
        """Slope of the distance, shape (n, k, 3)."""
        return outer(self.weights, self.away / self.distance[:, None])

    @property
    def slides(self) -> Floats:
        """Change of the parameters of the place with the positions, shape (n, 2, k, 3)."""
        tangents = self.turns @ self.x
        found = np.einsum("nk,nli->nlki", self.weights, tangents)
        found += np.einsum("nlk,ni->nlki", self.turns, self.away)
        return -np.einsum("nml,nlki->nmki", self.inverse, found)


def vector(weights: Floats, x: Floats) -> Floats:
    """Combination of positions, shape (n, 3)."""
    return np.einsum("nk,nki->ni", weights, x)


def outer(weights: Floats, v: Floats) -> Floats:
    """Forces in slots that a force between the place and the point has, shape (n, k, 3)."""
    return weights[:, :, None] * v[:, None, :]


def mean_slope(a: Places, b: Places, derivatives: bool = True) -> tuple[Floats, ...]:
    """Mean slope `f` of the distance from one state to another, and its derivatives by both.

    Args:
        a: Places at the first state.
        b: Places at the second one.
        derivatives: Whether derivatives are requested.

    Returns:
        Shape (n, k, 3), and twice (n, k, 3, k, 3).
    """
    theta = _share(a, b)
    if not derivatives:
        return (_slope(a, b, theta),)
    by_b = _derivative(a, b, theta)
    by_a = _derivative(b, a, 1 - theta)
    return _slope(a, b, theta), by_a, by_b


def _middle(a: Places, b: Places) -> tuple[Floats, Floats, Floats]:
    x = (a.x + b.x) / 2
    return x, vector(a.weights, x), vector(b.weights, x)


def _slope(a: Places, b: Places, theta: Floats) -> Floats:
    _, first, second = _middle(a, b)
    found = outer(theta[:, None] * a.weights, first) + outer(
        (1 - theta)[:, None] * b.weights, second
    )
    return 2 * found / (a.distance + b.distance)[:, None, None]


def _excess(a: Places, b: Places) -> tuple[Floats, Floats]:
    """By how much squares of lengths with the other state's weights are larger, shape (n,) each."""
    slid = b.weights - a.weights
    at_a, at_b = vector(slid, a.x), vector(slid, b.x)
    # as products, since differences of squares would be round-off
    return (np.vecdot(at_b, at_b - 2 * b.away), np.vecdot(at_a, at_a + 2 * a.away))


def _share(a: Places, b: Places) -> Floats:
    first, second = _excess(a, b)
    total = first + second
    moves = total > STILL * (a.distance + b.distance) ** 2
    share = second / np.where(moves, total, 1.0)
    return np.where(moves, np.clip(share, 0.0, 1.0), 0.5)


def _derivative(a: Places, b: Places, theta: Floats) -> Floats:
    """Derivative of the mean slope by the positions at `b`, shape (n, k, 3, k, 3)."""
    x, first, second = _middle(a, b)
    total, rest = a.distance + b.distance, 1 - theta
    slides, eye = b.slides, np.eye(3)
    squares = theta[:, None, None] * a.weights[:, :, None] * a.weights[:, None, :]
    squares += rest[:, None, None] * b.weights[:, :, None] * b.weights[:, None, :]
    found = np.einsum("nkl,ij->nkilj", squares / 2, eye)
    turned = np.einsum("nmk,ni->nmki", b.turns, second)
    turned += np.einsum("nk,nmi->nmki", b.weights, b.turns @ x)
    found += np.einsum("nmki,nmlj->nkilj", rest[:, None, None, None] * turned, slides)
    p_a, p_b = _excess(a, b)
    moves = p_a + p_b > STILL * total**2
    scale = np.where(moves, 1 / np.where(moves, p_a + p_b, 1.0), 0.0)
    across = vector(b.weights, a.x)
    change_b = 2 * np.einsum("ni,nmi,nmlj->nlj", across, b.turns @ a.x, slides)
    change_a = 2 * (outer(a.weights, vector(a.weights, b.x)) - outer(b.weights, b.away))
    share = rest[:, None, None] * change_b - theta[:, None, None] * change_a
    share *= scale[:, None, None]
    apart = outer(a.weights, first) - outer(b.weights, second)
    found += np.einsum("nki,nlj->nkilj", apart, share)
    found = 2 * found - np.einsum("nki,nlj->nkilj", _slope(a, b, theta), b.slope)
    return found / total[:, None, None, None, None]


# changes of distances in epsilon up to which logarithms of sums are taken by their small parts
SMALL = 1.0
# in epsilon, what is left of a concave function where weights do not change
UNCHANGED = 1e-20


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
    moves = total > UNCHANGED * of.width
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
