"""Weights of a step: what the rows of each scheme are made of, as numbers.

The moments and slopes of `forms.steps.path` are combinations of mean, chord, bow and swing of a
path, which are combinations of the states themselves, so that their derivatives by the unknowns
follow from these tables. All states of a step that is quadratic in time are combinations of four:
`q_i`, `h v_i`, and the unknown `q_f`, `h v_f`. A sub-interval of the paper's schemes, from `a` to
`b`, is a path without bow, its stress the average of eqs. (22) and (32); a single state of statics
has no chord either, and in linear statics measures are replaced by their linear part.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from shellmb.forms.steps.path import PAIRS

Floats = npt.NDArray[np.float64]

# columns of a combination
START, PUSH, END, RATE = range(4)
# the unknown states, in the order of the rows P0 and P1
UNKNOWN = (END, RATE)


class SlopeWeights(NamedTuple):
    """Numbers of a `forms.steps.path.Slope`."""

    c: float
    weights: Floats


class MomentWeights(NamedTuple):
    """Numbers of a `forms.steps.path.Moment`."""

    linear: Floats
    products: Floats

    def by(self, state: Floats) -> SlopeWeights:
        """Derivative by a state of which the states x, D, z, y have the given shares."""
        out = np.zeros(4)
        for (a, b), w in zip(PAIRS, self.products, strict=True):
            out[b] += w * state[a]
            out[a] += w * state[b]
        return SlopeWeights(float(self.linear @ state), out)


class ChangeWeights(NamedTuple):
    """Numbers of a `forms.steps.path.Change`.

    Args:
        states: Shares of the unknown state in the states x, D, z, y.
        held: As of `Change`.
        share: As of `Change`.
        gain: As of `Change`.
    """

    states: Floats
    held: bool
    share: float
    gain: float


class PairWeights(NamedTuple):
    """Numbers of a `forms.steps.path.Pair`.

    Args:
        moment: The moment.
        slope: What its stress acts on.
        own: Whether the row demands the compatibility of the moment.
        changes: Derivatives, by the number of the unknown state.
        ahead: As of `Pair`.
    """

    moment: MomentWeights
    slope: SlopeWeights
    own: bool
    changes: Mapping[int, ChangeWeights]
    ahead: float = 0.0


def path_states(alpha: float) -> Floats:
    """Mean, chord, bow and swing as combinations of the four states, shape (4, 4), eq. (Q1).

    Args:
        alpha: Dissipation.
    """
    chord = np.array([-1.0, 0.0, 1.0, 0.0])
    bow = np.array([0.0, -(1 - alpha), 0.0, 1 + alpha]) / 12 - alpha / 6 * chord
    mean = np.array([0.5, 0.0, 0.5, 0.0]) - bow
    swing = np.array([0.0, 1 - alpha, 0.0, 1 + alpha]) / 4
    return np.array([mean, chord, bow, swing])


def moments(alpha: float) -> tuple[MomentWeights, MomentWeights]:
    """`E_0` and `E_1` of eq. (Q3); `PAIRS` are xx, xD, xz, DD, Dz, zz, Dy."""
    first = MomentWeights(
        np.array([1.0, 0, 0, 0]), np.array([1 / 2, 0, 0, 1 / 8, 0, -1 / 2, -1 / 6])
    )
    half = MomentWeights(np.array([0.0, 1 / 2, 0, 0]), np.array([0, 1 / 2, 0, 0, 1 / 2, 0, 0]))
    return first, combined((1, half), (alpha / 2, BOW))


# what the stresses S_0 and S_1 act on in the rows P0 and P1, eq. (Q2)
SLOPES = (
    (SlopeWeights(1.0, np.array([1.0, 0, 0, 0])), SlopeWeights(0.0, np.array([0, 0, 0, 1 / 3]))),
    (
        SlopeWeights(0.0, np.array([0, 1 / 6, 0, 0])),
        SlopeWeights(1 / 3, np.array([1 / 3, 0, 1 / 3, 0])),
    ),
)

# twice the bow of a measure's own path, by its ends and its rates there
BOW = MomentWeights(np.array([0.0, 0, 2, 0]), np.array([0, 0, 2, 0, 0, 2, 1 / 3]))

# what the only stress of a sub-interval acts on: the strains at its middle, eq. (20)
MIDDLE = SlopeWeights(1.0, np.array([1.0, 0, 0, 0]))
# what it is of where strains are linear
LINEAR = MomentWeights(np.array([1.0, 0, 0, 0]), np.zeros(7))
AT_REFERENCE = SlopeWeights(1.0, np.zeros(4))
# shares of the ends `a` and `b` in the states x, D, z, y, and of a single state
FIRST, LAST = np.array([0.5, -1, 0, 0]), np.array([0.5, 1, 0, 0])
SINGLE = np.array([1.0, 0, 0, 0])


def path_pairs(alpha: float, row: int) -> list[PairWeights]:
    """Both stresses of a step that is quadratic in time, in the rows P0 and P1."""
    shares = path_states(alpha)[:, UNKNOWN].T
    return [
        PairWeights(
            *(moment, slope, k == row),
            {c: ChangeWeights(s, c == k, float(c == k), 1.0) for c, s in enumerate(shares)},
        )
        for k, (moment, slope) in enumerate(zip(moments(alpha), SLOPES[row], strict=True))
    ]


def average(beta: float) -> MomentWeights:
    """`(e_a + e_b)/2 + beta (e_b - e_a)/2`, eq. (32)."""
    products = np.array([1 / 2, beta / 2, 0, 1 / 8, 0, 0, 0])
    return MomentWeights(np.array([1.0, beta / 2, 0, 0]), products)


def single_pair(number: int, linear: bool) -> PairWeights:
    """The stress of a single state, which is the unknown one of that number."""
    moment, slope = (LINEAR, AT_REFERENCE) if linear else (average(0.0), MIDDLE)
    return PairWeights(moment, slope, True, {number: ChangeWeights(SINGLE, True, 1.0, 1.0)})


def interval_pair(beta: float, first: int | None, last: int, linear: bool = False) -> PairWeights:
    """The average stress of a sub-interval, eq. (32), and what it acts on.

    Args:
        beta: Share of the jump.
        first: Number of the unknown state at its start; None where that is known.
        last: That of the one at its end, where strains and resultants are compatible.
        linear: Whether strains are linear.
    """
    ahead = (1 - beta) / 2
    moment, slope = average(beta), MIDDLE
    if linear:
        moment, slope = MomentWeights(moment.linear, np.zeros(7)), AT_REFERENCE
    changes = {last: ChangeWeights(LAST, True, 1 - ahead, 1 / (1 - ahead))}
    if first is not None:
        changes[first] = ChangeWeights(FIRST, False, ahead, 0.0)
    return PairWeights(moment, slope, True, changes, ahead)


def combined(*parts: tuple[float, MomentWeights]) -> MomentWeights:
    """A sum of moments, each times a number."""
    factors = np.array([factor for factor, _ in parts])
    return MomentWeights(
        factors @ np.array([m.linear for _, m in parts]),
        factors @ np.array([m.products for _, m in parts]),
    )


def at_end(sign: float) -> MomentWeights:
    """A measure at the start (-1) or at the end (1) of the step."""
    mean, half = moments(0.0)
    return combined((1, mean), (0.5, BOW), (sign, half))


# Gauss' two points in time by the values of P1 there; both weigh a half
POINTS = (-1 / np.sqrt(3), 1 / np.sqrt(3))


def at_point(p: float) -> MomentWeights:
    """Strain of `forms.steps.pathwork_nonlinear` at a Gauss point, where `P1` is `p`."""
    mean, half = moments(0.0)
    return combined((1, mean), (p, half))


def rate_at_point(p: float) -> MomentWeights:
    """Its rate times the weight of the point."""
    _, half = moments(0.0)
    return combined((1, half), (3 * p / 2, BOW))


def slope_at_point(row: int, p: float) -> SlopeWeights:
    """What the stress at a Gauss point acts on in a row: `S_0` and `S_1` are of both points."""
    first, second = SLOPES[row]
    return SlopeWeights(
        first.c / 2 + 3 * p / 2 * second.c, first.weights / 2 + 3 * p / 2 * second.weights
    )
