"""Templates of the rows of a step, as numbers that follow from the pages of the schemes.

A page says of which strains stresses are, and what these act on (`schemes.notation`), at mean,
chord, bow and mean velocity of a path. All states of a step that is quadratic in time are
combinations of four: `q_i`, `h v_i`, and the unknown `q_f`, `h v_f`. A sub-interval has neither bow
nor mean velocity, a single state of statics no chord either, and in linear statics measures are
replaced by their linear part.
"""

from typing import NamedTuple

import numpy as np

from shellmb.schemes.interval import AT_STATE, acting
from shellmb.schemes.notation import Acting, D, MomentWeights, PathPage, SlopeWeights, lin, x


class PairWeights(NamedTuple):
    """Numbers of a stress in one row.

    Args:
        moment: The moment.
        slope: What its stress acts on.
        own: Whether the row demands the compatibility of the moment.
        ahead: As of `forms.steps.path.Stress`.
    """

    moment: MomentWeights
    slope: SlopeWeights
    own: bool
    ahead: float = 0.0


# what stresses act on where strains are linear
AT_REFERENCE = SlopeWeights(1.0, np.zeros(4))
# shares of the ends `a` and `b` of a sub-interval in the states x, D, z, y, and of a single state
FIRST, LAST, SINGLE = x / 2 - D, x / 2 + D, x


def path_pairs(page: PathPage, alpha: float, row: int) -> list[PairWeights]:
    """Both stresses of a step that is quadratic in time, in the rows P0 and P1."""
    both = zip(page.strains(alpha), page.slopes(row), strict=True)
    return [PairWeights(*pair, k == row) for k, pair in enumerate(both)]


def linearised(row: Acting) -> Acting:
    """The stress of the linear part of a strain, and what it acts on at the reference."""
    return Acting(lin(row.strain.linear), AT_REFERENCE)


def single_pair(linear: bool) -> PairWeights:
    """The stress of a single state."""
    return PairWeights(*(linearised(AT_STATE) if linear else AT_STATE), True)


def interval_pair(beta: float, linear: bool) -> PairWeights:
    """The average stress of a sub-interval, eq. (32), and what it acts on.

    Strains and resultants are compatible at its end.

    Args:
        beta: Share of the jump.
        linear: Whether strains are linear.
    """
    moment, slope = linearised(acting(beta)) if linear else acting(beta)
    # by the chord: the end is the mean and half of it
    return PairWeights(moment, slope, True, 0.5 - float(moment.linear @ D))


def at_end(page: PathPage, sign: float) -> MomentWeights:
    """A measure at the start (-1) or at the end (1) of the step."""
    mean, half = page.strains(0.0)
    return mean + page.bow / 2 + sign * half


# Gauss' two points in time by the values of P1 there; both weigh a half
POINTS = (-1 / np.sqrt(3), 1 / np.sqrt(3))


def at_point(page: PathPage, p: float) -> MomentWeights:
    """Strain of `forms.steps.stress_work_nonlinear` at a Gauss point, where `P1` is `p`."""
    mean, half = page.strains(0.0)
    return mean + p * half


def rate_at_point(page: PathPage, p: float) -> MomentWeights:
    """Rate times the weight of the point."""
    _, half = page.strains(0.0)
    return half + 3 * p / 2 * page.bow


def slope_at_point(page: PathPage, row: int, p: float) -> SlopeWeights:
    """Virtual strain of the stress at a Gauss point in a row; `S_0` and `S_1` are of both."""
    first, second = page.slopes(row)
    return first / 2 + 3 * p / 2 * second
