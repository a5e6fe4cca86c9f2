"""Weights of a step as Constants: pairs of moments and slopes, closed and at Gauss' points."""

from collections.abc import Sequence

import numpy as np
from dolfinx import fem, mesh
from ufl.core.expr import Expr

from shellmb.forms.path import Change, Moment, Pair, Points, Slope
from shellmb.schemes.weights import (
    BOW,
    POINTS,
    SLOPES,
    UNKNOWN,
    MomentWeights,
    SlopeWeights,
    at_end,
    at_point,
    combined,
    moments,
    path_states,
    rate_at_point,
    slope_at_point,
)


class PathWeights:
    """Makes what the rows of one body consist of.

    Args:
        domain: Mesh of the body.
        alpha: Dissipation.
        unknown: Unknown states of the rows P0 and P1.
    """

    def __init__(self, domain: mesh.Mesh, alpha: float, unknown: Sequence[Expr]) -> None:
        self._mesh, self._alpha, self._unknown = domain, alpha, tuple(unknown)

    def constants(self, values: object) -> tuple[Expr, ...]:
        """Numbers as Constants."""
        array = np.atleast_1d(np.asarray(values, dtype=float))
        constant = fem.Constant(self._mesh, array)
        return tuple(constant[k] for k in range(len(array)))

    def _slope(self, weights: SlopeWeights) -> Slope:
        (c,), (x, D, z) = self.constants(weights.c), self.constants(weights.weights)
        return Slope(c, (x, D, z))

    def _moment(self, weights: MomentWeights, held: Expr) -> Moment:
        linear, products = (self.constants(w) for w in weights)
        return Moment(linear, products, held)

    def _pair(
        self,
        moment: Moment,
        weights: MomentWeights,
        slope: SlopeWeights,
        shares: Sequence[float],
        own: float,
    ) -> Pair:
        """A moment and a slope; `shares` are those of the unknown states in its resultants."""
        states, changes = path_states(self._alpha), []
        for column, share in zip(UNKNOWN, shares, strict=True):
            by = states[:, column]
            (of_held,) = self.constants(share)
            (turn,) = self.constants(float(slope.weights @ by))
            changes.append(Change(self._slope(weights.by(by)), of_held, turn))
        (mine,) = self.constants(own)
        return Pair(moment, self._slope(slope), mine, tuple(changes))

    def closed(self, row: int) -> tuple[Pair, Pair]:
        """Both stresses in one row, with their derivatives."""
        found = []
        for k, (weights, slope) in enumerate(zip(moments(self._alpha), SLOPES[row], strict=True)):
            shares = [float(c == k) for c in range(len(UNKNOWN))]
            moment = self._moment(weights, self._unknown[k])
            found.append(self._pair(moment, weights, slope, shares, float(k == row)))
        return found[0], found[1]

    def at_points(self) -> Points:
        """The step at Gauss' points in time."""
        first, second = self._unknown
        held = []
        for p in POINTS:
            (place,) = self.constants(p)
            held.append(self._moment(at_point(p), first + place * second))

        def row(k: int) -> tuple[Pair, Pair]:
            a, b = (
                self._pair(m, at_point(p), slope_at_point(k, p), (1.0, p), 1.0)
                for p, m in zip(POINTS, held, strict=True)
            )
            return a, b

        def free(weights: MomentWeights) -> Moment:
            return self._moment(weights, first)

        start, end = free(at_end(-1)), free(at_end(1))
        chord = free(combined((2.0, moments(0.0)[1])))
        rates = [free(rate_at_point(p)) for p in POINTS]
        half = combined((self._alpha / 2, BOW))
        damped = free(half)
        damping = [self._pair(damped, half, SLOPES[k][1], (0.0, 0.0), 0.0) for k in range(2)]
        return Points(
            (row(0), row(1)),
            (rates[0], rates[1]),
            start,
            end,
            chord,
            free(BOW),
            (self._slope(SLOPES[0][0]), self._slope(SLOPES[1][0])),
            (damping[0], damping[1]),
            self._alpha > 0,
        )
