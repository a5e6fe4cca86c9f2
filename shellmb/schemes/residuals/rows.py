"""Rows of a step with their weights as Constants, and the states that they are taken at.

A page says of which strains stresses are, and what these act on (`schemes.notation`), at mean,
chord, bow and mean velocity of a path. All states of a step that is quadratic in time are
combinations of four: `q_i`, `h v_i`, and the unknown `q_f`, `h v_f`. A sub-interval has neither bow
nor mean velocity, a single state of statics no chord either, and in linear statics measures are
replaced by their linear part.
"""

from collections.abc import Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from dolfinx import fem
from ufl.algorithms.renumbering import renumber_indices
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.forms.steps.discrete import mean
from shellmb.forms.steps.mixed import Interval
from shellmb.forms.steps.path import Moment, Rows, Slope, Stress
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


def slope_of(mesh: Any, weights: SlopeWeights) -> Slope:
    """A slope with its numbers as Constants."""
    (c,) = constants(mesh, weights.c)
    return Slope(c, constants(mesh, weights.weights))


def moment_of(mesh: Any, weights: MomentWeights, holder: Expr) -> Moment:
    """A moment with its numbers as Constants; `holder` is the state that holds its resultants."""
    linear, products = (constants(mesh, w) for w in (weights.linear, weights.products))
    return Moment(linear, products, holder)


def bare_slope(mesh: Any, weights: SlopeWeights) -> Slope:
    """A slope without what is zero."""
    c, *found = _bare(mesh, [weights.c, *weights.weights])
    return Slope(c, tuple(found))


def bare_moment(
    mesh: Any, weights: MomentWeights, holder: Expr, like: MomentWeights | None = None
) -> Moment:
    """A moment without what is zero, there or in another one that is `like` it."""
    like = like or weights
    linear = _bare(mesh, weights.linear, like.linear)
    return Moment(linear, _bare(mesh, weights.products, like.products), holder)


def _bare(mesh: Any, values: object, like: object | None = None) -> tuple[Expr | None, ...]:
    there = np.asarray(values if like is None else like) != 0
    return tuple(c if t else None for c, t in zip(constants(mesh, values), there, strict=True))


def both_rows(
    mesh: Any,
    rows: Sequence[Sequence[PairWeights]],
    holders: Sequence[Expr],
    like: Sequence[MomentWeights | None] = (None, None),
) -> tuple[Stress, ...]:
    """Stresses in the rows P0 and P1.

    Residuals, whose kernels are those of all schemes that are quadratic in time, leave out what is
    zero in all of these: they take less time.

    Args:
        mesh: Mesh of the body.
        rows: Stresses of each row, the same ones in both.
        holders: States that hold the resultants of the stresses.
        like: Moments that are not zero where those of some scheme are not; None: these themselves.
    """
    stresses = []
    for holder, model, pairs in zip(holders, like, zip(*rows, strict=True), strict=False):
        moment = bare_moment(mesh, pairs[0].moment, holder, model)
        own = next((k for k, pair in enumerate(pairs) if pair.own), None)
        stresses.append(Stress(moment, tuple(bare_slope(mesh, p.slope) for p in pairs), own))
    return tuple(stresses)


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
        a, b, mid, at, held, beta, _ = self._of
        holder = unknown[number]
        if a is b is mid is at is held is holder:
            self.states = PathStates([holder], SINGLE.reshape(4, 1))
            states: tuple[Expr, ...] = self.states.functions
            weights = single_pair(self.linear)
        elif self.between is not None:
            states = self.between
            # a Constant is a number here: it is given once
            weights = interval_pair(float(beta), self.linear)
        else:
            return None
        mesh = holder.function_space.mesh
        moment, slope = moment_of(mesh, weights.moment, holder), slope_of(mesh, weights.slope)
        stress = Stress(moment, (slope,), 0, *constants(mesh, weights.ahead))
        return Rows(states, (stress,), (number,), 2)

    @cached_property
    def between(self) -> tuple[fem.Function, ...] | None:
        """Mean and chord of a sub-interval, as functions that follow its ends.

        And the chord of the other one, where there are two and the step is requested; None where it
        is none between two states.
        """
        a, b, mid, at, held, *_ = self._of
        middle = renumber_indices(mid) == renumber_indices(mean(a, b))
        holder = self._unknown[self._number]
        if not (middle and isinstance(a, fem.Function) and b is at is held is holder):
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
