"""Weights of a step that is quadratic in time: what its rows are made of, as numbers.

All states of a step are combinations of four: `q_i`, `h v_i`, and the unknown `q_f`, `h v_f`. The
moments and slopes of `forms.path` are combinations of the mean, the chord and the bow of the path,
which are such combinations themselves, so that their derivatives by the unknowns follow from these
tables.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from shellmb.forms.path import PAIRS

Floats = npt.NDArray[np.float64]

# columns of a combination
START, PUSH, END, RATE = range(4)
# the unknown states, in the order of the rows P0 and P1
UNKNOWN = (END, RATE)


class SlopeWeights(NamedTuple):
    """Numbers of a `forms.path.Slope`."""

    c: float
    weights: Floats


class MomentWeights(NamedTuple):
    """Numbers of a `forms.path.Moment`."""

    linear: Floats
    products: Floats

    def by(self, state: Floats) -> SlopeWeights:
        """Derivative by a state of which the states x, D, z have the given shares."""
        out = np.zeros(3)
        for (a, b), w in zip(PAIRS, self.products, strict=True):
            out[b] += w * state[a]
            out[a] += w * state[b]
        return SlopeWeights(float(self.linear @ state), out)


def path_states(alpha: float) -> Floats:
    """Mean, chord and bow of the path as combinations of the four states, shape (3, 4), eq. (Q1).

    Args:
        alpha: Dissipation.
    """
    chord = np.array([-1.0, 0.0, 1.0, 0.0])
    bow = np.array([0.0, -(1 - alpha), 0.0, 1 + alpha]) / 12 - alpha / 6 * chord
    mean = np.array([0.5, 0.0, 0.5, 0.0]) - bow
    return np.array([mean, chord, bow])


def moments(alpha: float) -> tuple[MomentWeights, MomentWeights]:
    """`E_0` and `E_1` of eq. (Q3) in closed form; `PAIRS` are xx, xD, xz, DD, Dz, zz."""
    first = MomentWeights(np.array([1.0, 0, 0]), np.array([1 / 2, 0, 0, 1 / 24, 0, 1 / 10]))
    second = MomentWeights(
        np.array([0.0, 1 / 2, alpha]),
        np.array([0, 1 / 2, alpha, alpha / 12, 1 / 2, 2 * alpha / 5]),
    )
    return first, second


# what the stresses S_0 and S_1 act on in the rows P0 and P1, eq. (Q2)
SLOPES = (
    (SlopeWeights(1.0, np.array([1.0, 0, 0])), SlopeWeights(0.0, np.array([0, 1 / 6, 0]))),
    (
        SlopeWeights(0.0, np.array([0, 1 / 6, 0])),
        SlopeWeights(1 / 3, np.array([1 / 3, 0, 2 / 15])),
    ),
)

# bow of a measure, `e_i + e_f - 2 <e>`
BOW = MomentWeights(np.array([0.0, 0, 2]), np.array([0, 0, 2, 1 / 6, 0, 4 / 5]))


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
    """Strain of `forms.pathwork_nonlinear` at a Gauss point, where `P1` is `p`."""
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
