"""Work of stresses on strains that are not quadratic in the unknowns, exact over a step.

Eq. (20), and (Q2) of `forms.steps.path`, need strains that are at most quadratic: only then is the
derivative at the middle times the chord the change of the strain. Strains of a user may be of any
form (stretches, logarithms). What their derivatives lack of that change is of higher order in the
step, and is made good; what is left of both is the same for quadratic strains.

Over a sub-interval (`ExactInterval`) the stress `S` is changed along the change that the middle
sees, `c = De(q_m) D`,

    S' = S + S.(e_b - e_a - c) c/(c . c),   S'.c = S.(e_b - e_a),

of second order in the step. A strain that does not see rigid rotations is a function of the
quadratic ones: `c` vanishes only where its change does, and both momenta are kept.

Over a step that is quadratic in time (`GeneralStrain`) bow and ends of a strain are, with
`m = (q_i + q_f)/2` and `H = D^2 e(m)`,

    bow = [6 De(m) z + H(D, y)]/3,   <s> = (e_i + e_f - bow)/2,   S_0 = C <s>,
    S_1 = C (e_f - e_i + alpha bow)/2                                                          (Q3)

and the stresses act, at Gauss' two points `q_k` in time where `P1` is `p_k`, on

    P0:  S_0.[De(q_1) + De(q_2)] dq/2 + S_1.H(y, dq)/3 + S_0.delta (D . dq)/(D . D)
    P1:  S_0.[p_1 De(q_1) + p_2 De(q_2)] dq/2 + S_1.De(m) dq/3                                 (Q2)

The energy law (Q5) asks for the work `S_0.(e_f - e_i) + S_1.bow`: that of `S_1` is so by what the
bow is; that of `S_0` lacks `delta = e_f - e_i - [De(q_1) q'_1 + De(q_2) q'_2]/2`, of fifth order,
which acts along the chord of gradients and directors in a product `(a . b)` of these (after
O. Gonzalez, J. Nonlinear Sci. 6 (1996) 449-467): not along the chord of the strain, because that of
a stiff body that spins is zero. Where strains are functions of quadratic ones, stiff ones are the
same constraints on positions and velocities as these are. Derivatives leave `delta` out.

===========  =====================================================================  ====
symbol       name                                                                   eq.
===========  =====================================================================  ====
`c`          change of the strain as the derivative at the middle sees it           (20)
`delta`      what Gauss' points lack of the change of the strain                    (Q5)
===========  =====================================================================  ====
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import ufl
from ufl.core.expr import Expr

from shellmb.forms.measure import Measure, Works
from shellmb.forms.steps.discrete import second_variation

# squares of changes, of strains and of gradients, below which round-off of strains, 1e-16, over
# them would be more than 1e-8 of a stress
TINY_STRAIN, TINY_CHORD = 1e-16, 1e-18


class ExactInterval:
    """Virtual strains of the stresses over a sub-interval, instead of `measure.at_middle`.

    Args:
        weight: Scales of the strains' squares, by which unlike units become comparable.
    """

    def __init__(self, weight: Sequence[Any]) -> None:
        self._weight = weight

    def __call__(self, strain: Measure, a: Expr, b: Expr, mid: Expr, dq: Expr) -> Works:
        """Work of a stress from `a` to `b` on a virtual displacement."""
        de = strain.change(mid, dq)
        if a is b:
            return lambda stress: ufl.dot(stress, de)
        change, seen = strain.value(b) - strain.value(a), strain.change(mid, b - a)
        scaled = ufl.as_vector([w * s for w, s in zip(self._weight, seen, strict=True)])
        square = ufl.dot(scaled, seen)
        # falls off fast, so that it is not seen in the energy at steps that are small and no more
        along = ufl.dot(scaled, de) * square / (square**2 + TINY_STRAIN**2)
        return lambda stress: ufl.dot(stress, de) + ufl.dot(stress, change - seen) * along


class GeneralRow(NamedTuple):
    """Weights of the stresses in a row of a step.

    Args:
        points: Share of each Gauss point in what `S_0` acts on, `1/2` or `p_k/2`.
        middle: Share of `De(m)` in what `S_1` acts on.
        by_velocity: Share of `H(y, dq)` in it.
        own: Which of the moments has its compatibility in the row, (1, 0) or (0, 1).
    """

    points: tuple[Expr, Expr]
    middle: Expr
    by_velocity: Expr
    own: tuple[Expr, Expr]


class GeneralStep(NamedTuple):
    """A step as strains of any form need it, its numbers as Constants.

    Args:
        places: `P1` at Gauss' points.
        rows: What the rows P0 and P1 have of the stresses.
    """

    places: tuple[Expr, Expr]
    rows: tuple[GeneralRow, GeneralRow]


class GeneralStrain:
    """A strain of any form over a step that is quadratic in time.

    Args:
        strain: The strain.
        states: Mean, chord, bow and mean velocity of the path.
        places: `P1` at Gauss' points.
    """

    def __init__(self, strain: Measure, states: Sequence[Expr], places: tuple[Expr, Expr]) -> None:
        self._strain, (x, D, z, y) = strain, states
        self._chord, self._velocity = D, y
        self._middle = m = x + z
        self._points = [x + p / 2 * D for p in places]
        self._rates = [D + 6 * p * z for p in places]
        self.first, self.last = first, last = strain.value(m - D / 2), strain.value(m + D / 2)
        self.change = last - first
        self.bow = (strain.change(m, 6 * z) + self._second(D)) / 3
        self.mean = (first + last - self.bow) / 2

    def _second(self, dq: Expr) -> Expr:
        """`H(y, dq)`."""
        return second_variation(self._strain.value, self._middle, self._velocity, dq)

    def moments(self, alpha: Expr) -> tuple[Expr, Expr]:
        """Strains of which `S_0` and `S_1` are the stresses."""
        return self.mean, (self.change + alpha * self.bow) / 2

    def work(self, stresses: tuple[Expr, Expr], row: GeneralRow, dq: Expr) -> Expr:
        """Work of `S_0` and `S_1` in a row, without `delta`."""
        first, second = stresses
        strain, parts = self._strain, zip(row.points, self._points, strict=True)
        seen = sum(w * strain.change(q, dq) for w, q in parts)
        turned = row.middle * strain.change(self._middle, dq) + row.by_velocity * self._second(dq)
        return ufl.dot(first, seen) + ufl.dot(second, turned)

    def rest(self, stress: Expr, product: Callable[[Expr, Expr], Expr], dq: Expr) -> Expr:
        """Correction of Gauss' points for the work of `S_0`, in the row P0.

        Args:
            stress: The stress.
            product: Product of two states, by their gradients and directors.
            dq: Virtual displacement.
        """
        pairs, D = zip(self._points, self._rates, strict=True), self._chord
        seen = [self._strain.change(q, rate) for q, rate in pairs]
        lacking = ufl.dot(stress, self.change - (seen[0] + seen[1]) / 2)
        return lacking * product(D, dq) / (product(D, D) + TINY_CHORD)
