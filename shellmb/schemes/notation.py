"""Notation of the schemes: strains along a path, and what stresses act on.

A path has a mean `x`, a chord `D`, a bow `z` and a mean velocity `y` (`forms.steps.path`). Measures
are quadratic, `e(q) = lin(q) + quad(q, q)/2`. On a page stand

    e(a), lin(a), quad(a, b)      values at combinations of these, as `quad(x, x) + quad(D, D) / 4`
    De(a)                         what a stress acts on, `lin(dq) + quad(a, dq)`
    H(a)                          its part that turns, `quad(a, dq)`

They are numbers: weights of `lin` and `quad` of the four states, with which a few templates are
compiled for all schemes (`residuals.rows`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from shellmb.arrays import Floats
from shellmb.forms.steps.path import PAIRS, Numbers, Path, PathRow

x, D, z, y = np.eye(4)


@dataclass(frozen=True, eq=False)
class SlopeWeights:
    """Virtual strain of a stress, `c lin(dq) + quad(y, dq)` at a combination `y` of the states.

    Args:
        c: Share of the reference configuration.
        weights: Weights of the states x, D, z, y, shape (4,).
    """

    c: float
    weights: Floats

    def __add__(self, other: SlopeWeights) -> SlopeWeights:
        return SlopeWeights(self.c + other.c, self.weights + other.weights)

    def __mul__(self, factor: float) -> SlopeWeights:
        return SlopeWeights(factor * self.c, factor * self.weights)

    def __truediv__(self, divisor: float) -> SlopeWeights:
        return self * (1 / divisor)

    __rmul__ = __mul__


@dataclass(frozen=True, eq=False)
class MomentWeights:
    """A strain over a step, `sum_a l_a lin(s_a) + sum_ab w_ab quad(s_a, s_b)`.

    Args:
        linear: Weights `l` of the states x, D, z, y, shape (4,).
        products: Weights `w` of their pairs, in the order of `PAIRS`.
    """

    linear: Floats
    products: Floats

    def __add__(self, other: MomentWeights) -> MomentWeights:
        return MomentWeights(self.linear + other.linear, self.products + other.products)

    def __sub__(self, other: MomentWeights) -> MomentWeights:
        return self + -1 * other

    def __mul__(self, factor: float) -> MomentWeights:
        return MomentWeights(factor * self.linear, factor * self.products)

    def __truediv__(self, divisor: float) -> MomentWeights:
        return self * (1 / divisor)

    __rmul__ = __mul__

    def __abs__(self) -> MomentWeights:
        return MomentWeights(np.abs(self.linear), np.abs(self.products))

    def by(self, state: Floats) -> SlopeWeights:
        """Derivative by a state of which the states x, D, z, y have the given shares."""
        out = np.zeros(4)
        for (a, b), w in zip(PAIRS, self.products, strict=True):
            out[b] += w * state[a]
            out[a] += w * state[b]
        return SlopeWeights(float(self.linear @ state), out)


def lin(a: Floats) -> MomentWeights:
    """Linear part of a measure at a combination of the states."""
    return MomentWeights(a, np.zeros(len(PAIRS)))


def quad(a: Floats, b: Floats) -> MomentWeights:
    """Bilinear part of a measure at two combinations of the states.

    Raises:
        ValueError: If there is a product of states that no template has.
    """
    both = np.outer(a, b) + np.outer(b, a)
    found = [both[i, j] / (2 if i == j else 1) for i, j in PAIRS]
    rest = np.triu(both) - np.diag(np.diag(both)) / 2
    for (i, j), product in zip(PAIRS, found, strict=True):
        rest[i, j] -= product
    if np.any(rest):
        raise ValueError("products of the mean velocity with other states than the chord have none")
    return MomentWeights(np.zeros(4), np.array(found))


def e(a: Floats) -> MomentWeights:
    """A measure at a combination of the states."""
    return lin(a) + quad(a, a) / 2


def De(a: Floats) -> SlopeWeights:
    """Derivative of a measure at a combination of the states."""
    return SlopeWeights(1.0, a)


def H(a: Floats) -> SlopeWeights:
    """Second derivative of a measure along a combination of the states."""
    return SlopeWeights(0.0, a)


class Acting(NamedTuple):
    """The stress of a strain, and what it acts on in a row.

    Args:
        strain: The strain over the step.
        on: What the stress acts on.
    """

    strain: MomentWeights
    on: SlopeWeights


class PathPage(NamedTuple):
    """The page of a scheme that is quadratic in time.

    Args:
        path_of: Path from the states and scaled velocities at both ends and the dissipation.
        strains: Strains of which both stresses are, from the dissipation.
        bow: Bow of a strain.
        rows: The rows P0 and P1.
    """

    path_of: Callable[[Any, Any, Any, Any, Any], Path]
    strains: Callable[[float], tuple[MomentWeights, MomentWeights]]
    bow: MomentWeights
    rows: tuple[PathRow, PathRow]

    def states(self, alpha: float) -> Floats:
        """States of the path as combinations of `q_i, h v_i, q_f, h v_f`, shape (4, 4)."""
        q_i, hv_i, q_f, hv_f = np.eye(4)
        return np.array(self.path_of(q_i, q_f, hv_i, hv_f, alpha).states)

    @property
    def slopes(self) -> tuple[tuple[Numbers, Numbers], ...]:
        """Virtual strains of each stress, row by row."""
        return tuple(zip(*(row.stresses for row in self.rows), strict=True))
