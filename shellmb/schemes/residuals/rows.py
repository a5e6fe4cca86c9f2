"""Rows of a step with their weights as Constants, and the states that they are taken at.

A page says of which strains stresses are, and what these act on (`schemes.notation`), at mean,
chord, bow and mean velocity of a path. All states of a step that is quadratic in time are
combinations of four: `q_i`, `h v_i`, and the unknown `q_f`, `h v_f`. A sub-interval has neither bow
nor mean velocity, a single state of statics no chord either, and in linear statics measures are
replaced by their linear part.

Rates of strains over a step are those of eq. (D1) in `forms.steps.damping`; stresses of other
combinations of the same two are those of (V3) in `forms.steps.damping`.
"""

from collections.abc import Iterable, Sequence
from functools import cached_property, reduce
from operator import add
from typing import Any

import numpy as np
from dolfinx import fem
from ufl.algorithms.renumbering import renumber_indices
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.forms.steps.damping import Straining
from shellmb.forms.steps.discrete import mean
from shellmb.forms.steps.mixed import Interval
from shellmb.forms.steps.path import Moment, Rows, Slope, Stress
from shellmb.schemes.interval import AT_STATE, A, B, acting
from shellmb.schemes.notation import Acting, D, De, PathPage, e, lin, x, z

# shares of the ends `a` and `b` of a sub-interval in the states x, D, z, y, and of a single state
FIRST, LAST, SINGLE = x / 2 - D, x / 2 + D, x


def linearised(row: Acting) -> Acting:
    """The stress of the linear part of a strain, and what it acts on at the reference."""
    return Acting(lin(row.strain[:4]), De(np.zeros(4)))


NAMES = ("mean", "chord", "bow", "mean_velocity")


class PathStates:
    """States of a body's path as functions that follow the unknown ones: `NAMES`.

    Args:
        sources: Functions whose combinations they are.
        weights: The combinations, shape (4, number of sources).
    """

    def __init__(self, sources: Sequence[fem.Function], weights: Floats) -> None:
        self.sources, self.weights = sources, weights
        space = sources[0].function_space
        mean, chord, bow, velocity = (fem.Function(space, name=name) for name in NAMES)
        self.functions = mean, chord, bow, velocity


def constants(mesh: Any, values: object) -> tuple[Expr, ...]:
    """Components of a Constant."""
    array = np.atleast_1d(np.asarray(values, dtype=float))
    constant = fem.Constant(mesh, array)
    return tuple(constant[k] for k in range(len(array)))


def moment(mesh: Any, weights: Floats, holder: Expr, like: Floats | None = None) -> Moment:
    """A moment with its numbers as Constants, without what is zero.

    Args:
        mesh: Mesh of the body.
        weights: The numbers.
        holder: State that holds the resultants.
        like: What is not zero where the moment of some scheme is not: another dissipation is no
            other form; None: the moment itself.
    """
    like = weights if like is None else like
    linear = _without_zeros(mesh, weights[:4], like[:4])
    return Moment(linear, _without_zeros(mesh, weights[4:], like[4:]), holder)


def slope(mesh: Any, weights: Floats) -> Slope:
    """A slope with its numbers as Constants, without what is zero."""
    c, *found = _without_zeros(mesh, weights, weights)
    return Slope(c, tuple(found))


def _without_zeros(mesh: Any, values: Floats, like: Floats) -> tuple[Expr | None, ...]:
    return tuple(c if t else None for c, t in zip(constants(mesh, values), like != 0, strict=True))


def path_stresses(
    mesh: Any, page: PathPage, alpha: float, holders: Sequence[Expr]
) -> tuple[Stress, ...]:
    """Stresses of a step that is quadratic in time, in its rows.

    Args:
        mesh: Mesh of the body.
        page: The page of the scheme.
        alpha: Dissipation.
        holders: States that hold the resultants of the stresses.
    """
    each = zip(page.strains(alpha), holders, page.strains(1.0), page.slopes, strict=True)
    return tuple(
        Stress(moment(mesh, strain, holder, like), tuple(slope(mesh, on) for on in rows), own)
        for own, (strain, holder, like, rows) in enumerate(each)
    )


class Span:
    """A sub-interval of a step, or a single state, eqs. (20)-(22), (32).

    Args:
        span: Its states as expressions.
        unknown: Unknown states of the step.
        number: Number of the one whose row it is.
        reference: The same at the reference, where forms are linearised; None: they are not.
        before: State at the start of the step, where strains of the whole step are requested.

    Attributes:
        linear: Whether forms are linearised.
    """

    def __init__(
        self,
        span: Interval,
        unknown: Sequence[fem.Function],
        number: int,
        reference: Interval | None = None,
        before: fem.Function | None = None,
    ) -> None:
        self.span = span if reference is None else reference
        self._of, self.linear = span, reference is not None
        self._unknown, self._number, self._before = unknown, number, before
        self.states: PathStates | None = None

    @cached_property
    def rows(self) -> Rows | None:
        """States as functions; None where it is none between two of them."""
        unknown, number = self._unknown, self._number
        a, b, mid, held, beta, _ = self._of
        holder = unknown[number]
        mesh = holder.function_space.mesh
        if a is b is mid is held is holder:
            self.states = PathStates([holder], SINGLE.reshape(4, 1))
            states: tuple[Expr, ...] = self.states.functions
            row, like, ahead = AT_STATE, None, None
        elif self.between is not None:
            # a Constant is a number here: it is given once
            states, row, like = self.between, acting(float(beta)), acting(1.0).strain
            # strains and resultants are compatible at the end: it is the mean and half of the chord
            (ahead,) = constants(mesh, 0.5 - float(row.strain[:4] @ D))
        else:
            return None
        if self.linear:
            row, like = linearised(row), None if like is None else lin(like[:4])
        strain, on = moment(mesh, row.strain, holder, like), slope(mesh, row.on)
        return Rows(states, (Stress(strain, (on,), 0, ahead),), (number,), 2)

    @cached_property
    def between(self) -> tuple[fem.Function, ...] | None:
        """Mean and chord of a sub-interval, as functions that follow its ends.

        And the chord of the other one, where there are two and the step is requested; None where it
        is none between two states.
        """
        a, b, mid, held, *_ = self._of
        middle = renumber_indices(mid) == renumber_indices(mean(a, b))
        holder = self._unknown[self._number]
        if not (middle and isinstance(a, fem.Function) and b is held is holder):
            return None
        sources, weights = [a, holder], np.array([FIRST, LAST]).T
        others = [q for q in (self._before, *self._unknown) if q is not None and q not in sources]
        if self._before is not None and others:
            # before the start, or behind the end
            (other,) = others
            z = (1.0, 0.0, -1.0) if other is self._before else (0.0, -1.0, 1.0)
            weights = np.column_stack([weights, np.zeros(4)])
            sources, weights[2] = [*sources, other], z
        self.states = PathStates(sources, weights)
        return self.states.functions


# changes of a strain over a sub-interval, and over the one before and behind it, whose chord is z
CHANGE = e(B) - e(A)
BEFORE = e(A) - e(A - z)
BEHIND = e(B + z) - e(B)

# state at the start, and the unknown ones of the rows P0 and P1
type Sources = tuple[Expr, Expr, Expr]

# shares of the stresses S_0 and S_1 in the rows of a scheme of one and of two sub-intervals, and
# the change of the strain over the step with its bow
ROWS: dict[tuple[int, int], tuple[float, ...]] = {(1, 0): (1,), (2, 0): (1, -1), (2, 1): (1, 0)}
CHANGES: dict[tuple[int, int], list[Floats]] = {
    (1, 0): [CHANGE],
    (2, 0): [CHANGE + BEHIND, -1 * CHANGE],
    (2, 1): [CHANGE + BEFORE, -1 * BEFORE],
}


# strains of the stresses S_0 and S_1: weights of the change of the strain and of its bow, of which
# these are the rate times the step, eq. (D1)
RATE = np.diag([1.0, 3.0])


def over_interval(
    mesh: Any,
    states: tuple[Expr, ...],
    place: tuple[int, int],
    dt: Expr,
    linear: bool,
    mixed: Floats = RATE,
    given: Sequence[Expr] = (),
) -> Straining:
    """The row of a sub-interval.

    Args:
        mesh: Mesh of the body.
        states: Mean and chord of the sub-interval, and the chord of the other one.
        place: Number of sub-intervals, and which of them it is.
        dt: Length of the step.
        linear: Whether strains are linear.
        mixed: Strains of the stresses, shape (2, 2).
        given: Strains that are added; none: nothing is.
    """
    n, row = 1 + place[0], ROWS[place]
    changes = [lin(m[:4]) if linear else m for m in CHANGES[place]]
    # resultants of states change as strains do
    held = np.array([m[1:n] for m in changes]), states[1:n]
    on = De(np.zeros(4) if linear else x)
    weights = np.array([row]) @ mixed[: len(row), : len(changes)]
    added = [_sum(row, given)] if given else ()
    stresses, works = _rates(mesh, changes, weights, [(on,)], held, added)
    return Straining(Rows(states, stresses, place[1:], n), works, dt)


def over_path(
    page: PathPage,
    mesh: Any,
    alpha: float,
    states: tuple[Expr, ...],
    sources: Sources,
    dt: Expr,
    mixed: Floats = RATE,
    given: Sequence[Expr] = (),
) -> Straining:
    """The rows of a step that is quadratic in time.

    Args:
        page: The page of the scheme.
        mesh: Mesh of the body.
        alpha: Dissipation.
        states: Mean, chord, bow and mean velocity of the path.
        sources: State at the start, and the unknown ones of both rows.
        dt: Length of the step.
        mixed: Strains of the stresses, shape (2, 2).
        given: Strains that are added; none: nothing is.
    """
    changes = 2.0 * page.strains(0.0)[1], page.bow
    # resultants are S_0 and S_1 of (Q3): what of S_i and of them the bow and the change are
    bow = np.array([1.0, -1, 1]) * 2 / (1 + alpha)
    held = np.array([np.array([0.0, 0, 2]) - alpha * bow, bow])
    both = _rates(mesh, changes, mixed, page.slopes, (held, sources), given)
    return Straining(Rows(states, both[0], (0, 1)), both[1], dt)


def _rates(
    mesh: Any,
    changes: Sequence[Floats],
    weights: Floats,
    slopes: Sequence[Sequence[Floats]],
    held: tuple[Floats, Sequence[Expr]],
    given: Sequence[Expr],
) -> tuple[tuple[Stress, ...], tuple[Moment, ...]]:
    """Stresses of combinations of changes of a strain, and the changes themselves.

    Args:
        mesh: Mesh of the body.
        changes: Change of the strain and its bow.
        weights: Their weights in the strain of each stress, shape (stresses, changes).
        slopes: What each stress acts on, row by row.
        held: Weights of states, shape (changes, states), whose resultants belong to the changes;
            and the states.
        given: Strains that are added, one for each stress; none: nothing is.
    """

    def moved(shares: Floats, like: Floats | None = None) -> Moment:
        holder = _sum(constants(mesh, shares @ held[0]), held[1])
        return moment(mesh, _sum(shares.tolist(), changes), holder, like)

    stresses = []
    for k, (shares, on) in enumerate(zip(weights, slopes, strict=True)):
        # a share of branches that is zero for one step by round-off is not for another one
        strain = moved(shares, _sum([bool(given or w) for w in shares], map(abs, changes)))
        if given:
            strain = strain._replace(given=given[k])
        stresses.append(Stress(strain, tuple(slope(mesh, one) for one in on), None))
    return tuple(stresses), tuple(moved(unit) for unit in np.eye(len(changes)))


def _sum(weights: Iterable[Any], items: Iterable[Any]) -> Any:
    """Sum of items with weights, whichever these are."""
    return reduce(add, [w * item for w, item in zip(weights, items, strict=False)])
