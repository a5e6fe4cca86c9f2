"""A step over which the state is quadratic in time, and quadratic measures along it.

With the mean `x` of the path, its chord `D = q_f - q_i` and its bow `z` (the coefficient of the
second Legendre polynomial) the path is

    q(tau) = x + D (tau - 1/2) + z (6 tau^2 - 6 tau + 1),     q'(tau) = D + 6 z P1,   P1 = 2 tau - 1

Measures are `e(q) = lin(q) + quad(q, q)/2` (strains, constraints), and strains of a user's own have
a constant part, which goes with `lin(x)`; `<.>` is the integral over a
step. The velocity is quadratic, too, and with a dissipation `alpha`

    <q' - h v> = 0,   <P1 (q' - h v)> = alpha h v_2/3,   z = [(1 + alpha) h v_f - (1 - alpha) h v_i
                                                              - 2 alpha D]/12               (Q1)

Constraints `g(q_f) = 0`, `Dg(q_f) v_f = 0` hold by forces that do no work (`H` is g's Hessian):

    P0:  lambda_0 <Dg> + lambda_1 H y,   y = [(1 - alpha) h v_i + (1 + alpha) h v_f]/4         (Q4)
    P1:  lambda_0 H D/6 + lambda_1 Dg((q_i + q_f)/2)

A strain is a coordinate `s` without mass that is tied to `e(q)` so. Its path is that of (Q1) with
the ends `e_i, e_f` and the rates `De v` there,

    e_f - e_i              = lin(D) + quad(x + z, D)
    <s>                    = lin(x) + [quad(x, x) - quad(z, z) + quad(D, D)/4]/2 - quad(D, y)/6
    bow, s_i + s_f - 2 <s> = 2 lin(z) + 2 quad(x + z, z) + quad(D, y)/3

and a stress `S_0 + S_1 P1` acts on it by the forces (Q4) with `lambda_0 = S_0, lambda_1 = S_1/3`,

    P0:  S_0.[lin(dq) + quad(x, dq)] + S_1.quad(y, dq)/3                                        (Q2)
    P1:  S_0.quad(D, dq)/6 + S_1.[lin(dq) + quad(x + z, dq)]/3

whose work is `S_0.(e_f - e_i) + S_1.bow`, that of the stress on `s'`. Exactly,

    E_f - E_i = work - alpha [2 v_2.M v_2 + bow.C bow/2].                                      (Q5)

Infinitely stiff strains are constraints by (Q4), for positions and velocities; with `<e>` in place
of `<s>` they would be for positions alone, and velocities along stiff fibres would grow.

So a row is a sum of `stress of a moment . slope`, a moment is `lin` and `quad` of the four states
with some weights, a slope that with the direction for one of them. The weights are Constants
(`shellmb/schemes/residuals`). In the paper's schemes a sub-interval is a path without bow, its
stress the average of (22), (32) at the middle:

    E = lin(x) + [quad(x, x) + quad(D, D)/4]/2 + beta/2 [lin(D) + quad(x, D)]             (20), (32)

============  =====================================================================  ====
symbol        name                                                                   eq.
============  =====================================================================  ====
`x, D, z, y`  mean, chord, bow and mean velocity of the path                         -
`S_0, S_1`    stress `C E_0`, `C E_1`: `E_0 = <s>`, `2 E_1 = e_f - e_i + alpha bow`  (Q3)
============  =====================================================================  ====
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import ufl
from ufl.classes import Abs, Condition, MaxValue, MinValue
from ufl.core.expr import Expr
from ufl.corealg.traversal import unique_pre_traversal

from shellmb.forms.measure import Measure
from shellmb.forms.steps.discrete import derivatives

# what differs on both sides of a state, while its derivatives vanish there
KINKED = (Condition, Abs, MinValue, MaxValue)
# pairs of the states x, D, z, y in the order of a moment's weights
PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2), (1, 3))


class Slope(NamedTuple):
    """Derivative of a measure, `c lin(dq) + quad(y, dq)` with `y = sum_a w_a s_a`.

    Args:
        c: Share of the reference configuration; None: none, as of the weights.
        weights: Those of the states x, D, z, y.
    """

    c: Expr | None
    weights: tuple[Expr | None, ...]


class Moment(NamedTuple):
    """A moment of a measure over the step, `sum_a l_a lin(s_a) + sum_ab w_ab quad(s_a, s_b)`.

    Args:
        linear: Weights `l` of the states x, D, z, y; None: none.
        products: Weights `w` of their pairs, in the order of `PAIRS`.
        held: State that holds the resultants that belong to it.
        given: Strain that is added and does not depend on the states of the step; None: none.
    """

    linear: tuple[Expr | None, ...]
    products: tuple[Expr | None, ...]
    held: Expr
    given: Expr | None = None


class Stress(NamedTuple):
    """The stress of one moment and what it acts on.

    Args:
        moment: The moment.
        slopes: What the stress acts on in each row.
        own: Number of the row that demands the compatibility of the moment; None: none does.
        ahead: What the end of a sub-interval is ahead of the moment, as a share of the measure's
            change: resultants are those of the end, and compatible there; None: nothing.
    """

    moment: Moment
    slopes: tuple[Slope, ...]
    own: int | None
    ahead: Expr | None = None

    def in_row(self, k: int) -> "Stress":
        """The stress in one row alone."""
        own = 0 if self.own == k else None
        return self._replace(slopes=(self.slopes[k],), own=own)


class Rows(NamedTuple):
    """Weights of the rows of a step that depend on the same strains.

    Args:
        states: Mean, chord, bow and mean velocity of the path as functions that the scheme fills.
        stresses: Stresses with what they act on in all of the rows.
        numbers: Numbers of the unknown states whose rows they are.
        moving: Number of the states that are not always zero: of a sub-interval two.
    """

    states: tuple[Expr, ...]
    stresses: tuple[Stress, ...]
    numbers: tuple[int, ...]
    moving: int = 4


# a slope as numbers, `c lin(dq) + quad(y, dq)`: `c` and the weights of the states x, D, z, y
Numbers = Any


class Holding(NamedTuple):
    """Quadratic constraints in a row.

    Args:
        own: What the multipliers of the row itself act on.
        other: What those of the other row act on.
        vanishes: What the row demands to vanish, of the constraints as a measure and the step.
    """

    own: Numbers
    other: Numbers
    vanishes: Callable[[Measure, "Path"], Expr]


class PathRow(NamedTuple):
    """A row of a step that is quadratic in time.

    Args:
        stresses: What `S_0` and `S_1` act on.
        holding: Constraints of what has inertia.
        massless: Constraints of what has none.
        inertia: What the inertia sees of the step, times the square of its length.
        works: What forces of the row work on.
        load: Weight of a load at a time in [0, 1].
    """

    stresses: tuple[Numbers, Numbers]
    holding: Holding
    massless: Holding
    inertia: Callable[["Path"], Any]
    works: Callable[["Path"], Any]
    load: Callable[[float], float]


class Path(NamedTuple):
    """A step; its states are expressions of the unknown ones, or functions that follow these.

    Args:
        start: State at the start, `q_i`.
        end: Unknown state at the end, `q_f`; its resultants and multipliers are those of P0.
        start_velocity: Velocity at the start times the step, `h v_i`.
        end_velocity: Unknown velocity at the end times the step; its resultants are those of P1.
        alpha: Dissipation.
        mean: `x`.
        chord: `D = q_f - q_i`.
        bow: `z`, by eq. (Q1).
        mean_velocity: `y`, what the second stress and multiplier turn with in row P0, eqs. (Q2),
            (Q4): half of a mean of the velocities, times the step.
        rows: The rows P0 and P1.
    """

    start: Any
    end: Any
    start_velocity: Any
    end_velocity: Any
    alpha: Any
    mean: Any
    chord: Any
    bow: Any
    mean_velocity: Any
    rows: tuple[PathRow, PathRow]

    @property
    def states(self) -> tuple[Any, Any, Any, Any]:
        """Mean, chord, bow and mean velocity."""
        return self.mean, self.chord, self.bow, self.mean_velocity

    @property
    def middle(self) -> Any:
        """`(q_i + q_f)/2`."""
        return self.mean + self.bow

    @property
    def acceleration(self) -> list[Any]:
        """Accelerations in the rows P0 and P1, times the square of the step, eq. (Q2)."""
        return [row.inertia(self) for row in self.rows]

    @property
    def moved(self) -> list[Any]:
        """Displacements on which forces of the rows P0 and P1 do work."""
        return [row.works(self) for row in self.rows]

    @property
    def shake(self) -> Any:
        """Second coefficient of the velocity times the step, `h v_2`: what alpha damps, (Q5)."""
        return (self.start_velocity + self.end_velocity) / 2 - self.chord

    def at(self, tau: Any) -> Any:
        """State at a time in [0, 1]."""
        return self.mean + (tau - 0.5) * self.chord + (6 * tau**2 - 6 * tau + 1) * self.bow

    def velocity(self, tau: Any) -> Any:
        """Rate of the state, times the step."""
        return self.chord + 6 * (2 * tau - 1) * self.bow

    def slope(self, measure: Measure, numbers: Numbers, dq: Expr) -> Expr:
        """Virtual change of a measure that its multiplier acts on."""
        share, *weights = map(float, numbers)
        c, parts = share or 1.0, zip(weights, self.states, strict=True)
        found = [q if w == c else w / c * q for w, q in parts if w != 0]
        state = sum(found[1:], found[0])
        if share == 0:
            return measure.quad(state, dq)
        slope = measure.change(state, dq)
        return slope if c == 1 else c * slope


def slope_at(measure: Measure, slope: Slope, states: Sequence[Expr], dq: Expr) -> Expr:
    """Derivative of a measure at the weighted states, or at the first few of them."""
    weighed = zip(slope.weights, states, strict=False)
    return measure.slope(slope.c, [(w, s) for w, s in weighed if w is not None], dq)


def across(
    measure: Measure, slopes: Sequence[Slope], states: Sequence[Expr], tests: Sequence[Expr]
) -> Expr:
    """Virtual strain of a stress in all rows, with the virtual displacement of each."""
    rows = [slope_at(measure, slope, states, dq) for slope, dq in zip(slopes, tests, strict=True)]
    return sum(rows[1:], rows[0])


def moment_of(measure: Measure, m: Moment, states: Sequence[Expr]) -> Expr:
    """Moment of a measure over the step."""
    parts = []
    for b, state in enumerate(states):
        weighed = zip(PAIRS, m.products, strict=True)
        pairs = [(w, states[a]) for (a, c), w in weighed if c == b and w is not None]
        if pairs or m.linear[b] is not None:
            parts.append(measure.slope(m.linear[b], pairs, state))
    # the mean is a sum of states with weights that add up to one, the others are differences
    if m.linear[0] is not None and measure.rest is not None:
        parts.append(m.linear[0] * measure.rest(states[0]))
    if m.given is not None:
        parts.append(m.given)
    return sum(parts[1:], parts[0])


def is_quadratic(function: Callable[[Expr], Expr], state: Any) -> bool:
    """Decide whether a measure is at most quadratic, and the same function everywhere.

    Its third derivative vanishes, and nothing in it has a kink or a jump that the state moves.

    Args:
        function: The measure.
        state: A function of the state's space.
    """
    third, (z, *directions) = derivatives(function, state.ufl_function_space(), 3)
    bent = (node for node in unique_pre_traversal(function(z)) if isinstance(node, KINKED))
    return directions[-1] not in ufl.algorithms.extract_coefficients(third) and not any(
        z in ufl.algorithms.extract_coefficients(node) for node in bent
    )


class Step(NamedTuple):
    """A step as bodies see it: its states as expressions, and what rows of mixed sections need.

    Args:
        path: The states as expressions.
        rows: The rows P0 and P1.
        chord: Difference of a measure's ends.
        bow: Bow of a measure's own path.
        dissipates: Whether there is a dissipation.
    """

    path: Path
    rows: Rows
    chord: Moment
    bow: Moment
    dissipates: bool

    @property
    def states(self) -> tuple[Expr, ...]:
        """Mean, chord, bow and mean velocity of the path as functions that the scheme fills."""
        return self.rows.states

    def bow_of(self, strain: Measure) -> Expr:
        """Bow of a strain's own path, of which the dissipation takes the energy (Q5)."""
        p = self.path
        return moment_of(strain, self.bow, p.states)
