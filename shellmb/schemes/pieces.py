"""A step in straight pieces: how energies of distances act, which no form of a body knows.

A distance is known at a few states of a step, and from one to the next it has a mean slope that
works exactly its change (`model.touching.pulls`). What a scheme adds are these states, the stress
`S` of each piece, by the averages of `forms.steps.potentials`, and the rows that see it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple, Protocol

import numpy as np

from shellmb.arrays import Floats

# Gauss points on [0, 1] and their weights, as of `forms.constraints.elements.GAUSS`
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(4)
TIMES, WEIGHTS = (POINTS + 1) / 2, WEIGHTS / 2
# changes of distances, in those at which bodies touch, below which a correction is round-off
TINY = 1e-8
# name of the state at the start, and of the velocity there times the step
START, START_RATE = "q", "start v"


class Law(Protocol):
    """An energy of a distance."""

    @property
    def reach(self) -> float:
        """Size of distances, m."""
        ...

    def __call__(self, g: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Energy and three derivatives at distances, shape (n, ...) each."""
        ...


class Stresses(NamedTuple):
    """Stresses of the pieces of a step.

    Args:
        values: Shape (n, pieces), N.
        slopes: Their derivatives by the distances at the states, shape (n, pieces, states), N/m.
        loss: What the step dissipates, shape (n,), J.
    """

    values: Floats
    slopes: Floats
    loss: Floats


class Pieces(NamedTuple):
    """A step in pieces.

    Args:
        states: Each state as a combination of that at the start, the velocity there times the step,
            and unknown ones, by name.
        ends: Numbers of the states at both ends of each piece.
        rows: Shares of the forces of the pieces in each row, by the name of its unknown state.
        stresses: Stresses of the pieces by the distances at the states, shape (n, states).
    """

    states: tuple[Mapping[str, float], ...]
    ends: tuple[tuple[int, int], ...]
    rows: Mapping[str, tuple[float, ...]]
    stresses: Callable[[Law, Floats], Stresses]


def intervals(states: Sequence[str], betas: Sequence[float]) -> Pieces:
    """Sub-intervals of a step, each with a row of its own, eqs. (21), (32).

    Args:
        states: Names of the states in their order; a single one is that of statics.
        betas: Share of the jump of the stress in each sub-interval.
    """
    single, count = len(states) == 1, len(betas)
    ends = ((0, 0),) if single else tuple((k, k + 1) for k in range(count))
    rows = {states[-count + k]: tuple(np.eye(count)[k].tolist()) for k in range(count)}

    def stresses(law: Law, g: Floats) -> Stresses:
        values, slopes = np.zeros((len(g), count)), np.zeros((len(g), count, len(states)))
        loss = np.zeros(len(g))
        for k, ((i, j), beta) in enumerate(zip(ends, betas, strict=True)):
            values[:, k], by_a, by_b = _mean(law, g[:, i], g[:, j])
            (_, at_a, curve_a, _), (_, at_b, curve_b, _) = law(g[:, i]), law(g[:, j])
            values[:, k] += beta / 2 * (at_b - at_a)
            slopes[:, k, i] += by_a - beta / 2 * curve_a
            slopes[:, k, j] += by_b + beta / 2 * curve_b
            loss += beta / 2 * (at_b - at_a) * (g[:, j] - g[:, i])
        return Stresses(values, slopes, loss)

    return Pieces(tuple({name: 1.0} for name in states), ends, rows, stresses)


def _mean(law: Law, a: Floats, b: Floats) -> tuple[Floats, Floats, Floats]:
    """Mean stress from one distance to another, and its derivatives by both, shape (n,) each."""
    change = b - a
    _, slope, curve, _ = law(a[:, None] + change[:, None] * TIMES)
    mean = slope @ WEIGHTS
    by_a, by_b = curve @ (WEIGHTS * (1 - TIMES)), curve @ (WEIGHTS * TIMES)
    (start, at_a, *_), (end, at_b, *_) = law(a), law(b)
    defect = end - start - mean * change
    size = change**2 + (TINY * law.reach) ** 2
    share, turn = change / size, defect * (size - 2 * change**2) / size**2
    # of the correction `defect change/size`
    more_b = (at_b - mean - by_b * change) * share + turn
    more_a = (mean - at_a - by_a * change) * share - turn
    return mean + defect * share, by_a + more_a, by_b + more_b


def halves(middle: Mapping[str, float], end: str, rate: str, alpha: float) -> Pieces:
    """Both halves of a step that is quadratic in time; the distance is taken as quadratic, too.

    With forces `F_1` and `F_2` in the halves the rows P0 and P1 have `(F_1 + F_2)/2` and
    `(F_2 - F_1)/4`; a stress `S_0 + S_1 P1` is `S_0 - 2 S_1/3` and `S_0 + 2 S_1/3` there, as its
    work is `S_0 (g_f - g_i) + S_1 bow` with `bow = 2 (g_i + g_f - 2 g_m)/3`.

    Args:
        middle: State in the middle of the path.
        end: Name of the state at the end.
        rate: Name of the velocity there times the step.
        alpha: Dissipation.
    """

    def stresses(law: Law, g: Floats) -> Stresses:
        start = g[:, 0]
        # chord and bow by the three distances
        by = np.array([[-1.0, 0.0, 1.0], [2 / 3, -4 / 3, 2 / 3]])
        chord, bow = g @ by[0], g @ by[1]
        shares = np.stack([TIMES, 3 * (TIMES**2 - TIMES)], axis=1)
        along = start[:, None] + chord[:, None] * shares[:, 0] + bow[:, None] * shares[:, 1]
        _, slope, curve, _ = law(along)
        tests = np.stack([WEIGHTS, WEIGHTS * 3 * (2 * TIMES - 1)])
        moments = slope @ tests.T
        first = np.eye(3)[0]
        at = first + shares @ by
        turns = np.einsum("ng,sg,gm->nsm", curve, tests, at)
        ends = law(g[:, [0, 2]])
        defect = ends[0][:, 1] - ends[0][:, 0] - moments[:, 0] * chord - moments[:, 1] * bow
        change = -np.einsum("nsm,ns->nm", turns, np.stack([chord, bow], axis=1)) - moments @ by
        change[:, 0] -= ends[1][:, 0]
        change[:, 2] += ends[1][:, 1]
        size = chord**2 + bow**2 + (TINY * law.reach) ** 2
        by_size = 2 * (chord[:, None] * by[0] + bow[:, None] * by[1])
        ratio = defect / size
        by_ratio = change / size[:, None] - (defect / size**2)[:, None] * by_size
        _, _, stiff, bend = law(start + chord / 2)
        damped = alpha / 2 * stiff * bow
        stress = np.stack([moments[:, 0] + ratio * chord, moments[:, 1] + ratio * bow + damped], 1)
        turns[:, 0] += by_ratio * chord[:, None] + ratio[:, None] * by[0]
        turns[:, 1] += by_ratio * bow[:, None] + ratio[:, None] * by[1]
        half = np.array([0.5, 0.0, 0.5])
        turns[:, 1] += alpha / 2 * (stiff[:, None] * by[1] + (bend * bow)[:, None] * half)
        mix = np.array([[1.0, -2 / 3], [1.0, 2 / 3]])
        slopes = np.einsum("ps,nsm->npm", mix, turns)
        return Stresses(stress @ mix.T, slopes, alpha / 2 * stiff * bow**2)

    states = ({START: 1.0}, middle, {end: 1.0})
    rows = {end: (0.5, 0.5), rate: (-0.25, 0.25)}
    return Pieces(states, ((0, 1), (1, 2)), rows, stresses)
