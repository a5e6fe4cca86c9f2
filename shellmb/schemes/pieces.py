"""A step in straight pieces: how energies of distances act, which no form of a body knows.

A distance is known at a few states of a step, and from one to the next it has a mean slope that
works exactly its change (`model.shell_contact.mean_distance_slopes`). What a scheme adds are
these states, the stress of each piece, which is that of all potentials
(`forms.steps.potentials`), and the rows that see it.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from ufl.core.expr import Expr

from shellmb.forms.steps.discrete import gradient
from shellmb.forms.steps.potentials import (
    Potential,
    interval_jump,
    interval_stress,
    path_loss,
    path_stresses,
    through,
)

# name of the state at the start, and of the velocity there times the step
START, START_RATE = "q", "start v"


class Stresses(NamedTuple):
    """Stresses of the pieces of a step.

    Args:
        values: Stress of each piece on the measure, shape (1,).
        loss: What the step dissipates.
    """

    values: Sequence[Expr]
    loss: Expr


class Pieces(NamedTuple):
    """A step in pieces.

    Args:
        states: Each state as a combination of that at the start, the velocity there times the step,
            and unknown ones, by name.
        ends: Numbers of the states at both ends of each piece.
        rows: Shares of the forces of the pieces in each row, by the name of its unknown state.
        stresses: Stresses of an energy of a measure of order one, shape (1,), by its values at the
            states and the dissipation.
        alpha: Dissipation.
    """

    states: tuple[Mapping[str, float], ...]
    ends: tuple[tuple[int, int], ...]
    rows: Mapping[str, tuple[float, ...]]
    stresses: Callable[[Potential, Sequence[Expr], Expr], Stresses]
    alpha: float = 0.0

    @property
    def total(self) -> Mapping[str, float]:
        """Share in each row of a force that is constant over the whole step."""
        return {name: sum(shares) for name, shares in self.rows.items()}

    @property
    def mean(self) -> tuple[float, ...]:
        """Shares of the forces of the pieces in their mean over the step: those of the last row."""
        return next(shares for name, shares in self.rows.items() if name in self.states[-1])


def single(state: str) -> Pieces:
    """Statics: the stress at the unknown state.

    Args:
        state: Its name.
    """

    def stresses(U: Potential, e: Sequence[Expr], alpha: Expr) -> Stresses:
        return Stresses([gradient(U, e[0])], 0 * alpha)

    return Pieces(({state: 1.0},), ((0, 0),), {state: (1.0,)}, stresses)


def intervals(states: Sequence[str], jumps: Sequence[bool], alpha: float = 0.0) -> Pieces:
    """Sub-intervals of a step, each with a row of its own, eqs. (21), (32).

    Args:
        states: Names of the states in their order.
        jumps: Whether the stress of each sub-interval has the jump of (32).
        alpha: Dissipation.
    """
    count = len(jumps)
    ends = tuple((k, k + 1) for k in range(count))
    rows = {states[1 + k]: tuple(np.eye(count)[k].tolist()) for k in range(count)}

    def stresses(U: Potential, e: Sequence[Expr], alpha: Expr) -> Stresses:
        pairs = [(e[i], e[j], jump) for (i, j), jump in zip(ends, jumps, strict=True)]
        values = [interval_stress(U, a, b, alpha if jump else 0.0) for a, b, jump in pairs]
        loss = sum((alpha * interval_jump(U, a, b) for a, b, jump in pairs if jump), 0 * alpha)
        return Stresses(values, loss)

    return Pieces(tuple({name: 1.0} for name in states), ends, rows, stresses, alpha)


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

    def stresses(U: Potential, e: Sequence[Expr], alpha: Expr) -> Stresses:
        stretch = through(*e)
        mean, first = path_stresses(U, stretch, alpha)
        values = [mean - 2 * first / 3, mean + 2 * first / 3]
        return Stresses(values, alpha * path_loss(U, stretch))

    states = ({START: 1.0}, middle, {end: 1.0})
    rows = {end: (0.5, 0.5), rate: (-0.25, 0.25)}
    return Pieces(states, ((0, 1), (1, 2)), rows, stresses, alpha)
