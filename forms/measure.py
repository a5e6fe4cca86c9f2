"""Measures of a state: strains and constraints, each written once, and what follows from that.

A measure that is quadratic is written as one symmetric bilinear form `b(T, T')` of vectors that are
linear in the state (tangents, directors). With `T_0` at rest and the change `t` from there

    e = b(T_0, t) + b(t, t)/2,      De dq = b(T_0 + t, dt),      D^2e(dq, dq') = b(dt, dt'),

so that nothing cancels in thin bodies. Any other measure is a function of the state, of which UFL
takes the derivatives.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import ufl
from ufl.core.expr import Expr

from shellmb.forms.steps.discrete import at_rest, second_variation, variation


class Measure(NamedTuple):
    """A measure and its derivatives.

    Args:
        value: Value at a state.
        change: Derivative at a state, the first argument, in a direction, the second one.
        slope: Of a quadratic one `c lin(dq) + sum_a w_a quad(s_a, dq)` from `c`, pairs `(w_a, s_a)`
            and `dq`; `c` is None where there is no linear part.
        rest: Value at rest, of any state of the space; zero where that is symbolic. None: zero.
    """

    value: Callable[[Expr], Expr]
    change: Callable[[Expr, Expr], Expr]
    slope: Callable[[Any, Sequence[tuple[Any, Expr]], Expr], Expr]
    rest: Callable[[Expr], Expr] | None = None

    def quad(self, a: Expr, b: Expr) -> Expr:
        """Bilinear part."""
        return self.slope(None, ((1, a),), b)

    def beside(
        self, linear: Callable[[Expr], Expr], join: Callable[[Expr, Expr], Expr]
    ) -> "Measure":
        """A linear function of it and of the state.

        Args:
            linear: A linear function of the state.
            join: A linear function of its value and of the measure's.
        """

        def slope(c: Any, pairs: Sequence[tuple[Any, Expr]], dq: Expr) -> Expr:
            return join((0 if c is None else c) * linear(dq), self.slope(c, pairs, dq))

        return Measure(
            lambda q: join(linear(q), self.value(q)),
            lambda q, dq: join(linear(dq), self.change(q, dq)),
            slope,
        )


def quadratic(
    form: Callable[[Any, Any], Expr], rest: Any, vectors: Callable[[Expr], Any]
) -> Measure:
    """A measure from its symmetric bilinear form.

    Args:
        form: The form `b`, of two sets of vectors.
        rest: These vectors `T_0` at rest.
        vectors: Their changes `t` in a state, from which they are linear.
    """

    def slope(c: Any, pairs: Sequence[tuple[Any, Expr]], dq: Expr) -> Expr:
        parts = [(weight, vectors(state)) for weight, state in pairs]
        if c is not None:
            parts.append((c, rest))
        return form(combined(parts), vectors(dq))

    return Measure(
        lambda q: value(form, rest, vectors(q)), lambda q, dq: slope(1, ((1, q),), dq), slope
    )


def value(form: Callable[[Any, Any], Expr], rest: Any, change: Any) -> Expr:
    """Value `b(T_0, t) + b(t, t)/2` of a quadratic measure; arguments as of `quadratic`."""
    return form(combined([(1, rest), (0.5, change)]), change)


def combined(parts: Sequence[tuple[Any, Any]]) -> Any:
    """Weighted sum of sets of vectors, which may be tuples of sets.

    Args:
        parts: Weights and sets that are made alike.
    """
    (weight, first), *others = parts
    if not isinstance(first, tuple):
        return sum((w * vector for w, vector in others), weight * first)
    members = [combined([(w, vectors[k]) for w, vectors in parts]) for k in range(len(first))]
    return type(first)(*members) if hasattr(first, "_fields") else tuple(members)


def linear(function: Callable[[Expr], Expr]) -> Measure:
    """A measure that is linear in the state."""
    return Measure(
        function,
        lambda q, dq: function(dq),
        lambda c, pairs, dq: (0 if c is None else c) * function(dq),
    )


def measure(function: Callable[[Expr], Expr]) -> Measure:
    """A measure from its value as a function of the state; its slope if that is quadratic."""

    def slope(c: Any, pairs: Sequence[tuple[Any, Expr]], dq: Expr) -> Expr:
        found, states = [], [state for _, state in pairs]
        if c is not None:
            found.append(c * variation(function, 0 * dq, dq, *states))
        if pairs:
            y = sum((w * s for w, s in pairs[1:]), pairs[0][0] * pairs[0][1])
            found.append(second_variation(function, 0 * dq, dq, y))
        return sum(found[1:], found[0])

    return Measure(
        function, lambda q, dq: variation(function, q, dq), slope, lambda q: at_rest(function, q)
    )


# what a stress has in a row, and how that follows from a strain, two states and their middle
Works = Callable[[Expr], Expr]
Acting = Callable[[Measure, Expr, Expr, Expr, Expr], Works]


def at_middle(strain: Measure, a: Expr, b: Expr, mid: Expr, dq: Expr) -> Works:
    """Work of a stress over a sub-interval from `a` to `b`, on the strain at its middle, eq. (20).

    On the motion it is that on the change of the strain if that is at most quadratic.
    """
    de = strain.change(mid, dq)
    return lambda stress: ufl.dot(stress, de)
