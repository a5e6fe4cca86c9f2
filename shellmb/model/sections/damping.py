"""Damping of a body: of its strains, and in proportion to its mass."""

from collections.abc import Callable, Sequence
from functools import partial, reduce
from typing import Any, NamedTuple, Protocol

from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.forms.measure import Measure
from shellmb.forms.state import Layout
from shellmb.forms.steps.damping import Resistance, Straining, at_state, taken
from shellmb.model.body import Rates, Term
from shellmb.model.row_terms import path_terms
from shellmb.model.row_terms import together as joined
from shellmb.scene import BeamSection, Section


class Resisting(NamedTuple):
    """Resistance to the rate of a strain.

    Args:
        section: Its stresses.
        strain: The strain.
        integrate: Integral of densities, one for each quadrature rule.
    """

    section: Resistance
    strain: Measure
    integrate: Callable[[Sequence[Expr]], Form]


class StrainDamping:
    """Damping of a body's strains, eq. (D1).

    Args:
        layout: Parts of the state.
        parts: What resists.
        rates: Makes `following`; None: forces follow from strains point by point.
    """

    def __init__(
        self,
        layout: Layout,
        parts: Sequence[Resisting],
        rates: Callable[[fem.Function, fem.Function], Callable[[], None]] | None = None,
    ) -> None:
        self._layout, self._parts, self._rates = layout, parts, rates

    def following(self, q: fem.Function, v: fem.Function) -> Callable[[], None] | None:
        """Function that gives a velocity at a state rates of resultants; None: none needs them."""
        return None if self._rates is None else self._rates(q, v)

    def term(self, along: Straining, tests: Sequence[Expr], trial: Expr) -> Term:
        """Forces in the rows of a step, with their derivatives."""
        terms = []
        for section, strain, integrate in self._parts:
            common = section, self._layout, strain
            over_time = partial(_over_time, integrate, along.dt)
            terms.append(path_terms(*common, along.rows, tests, trial, over_time))
        return reduce(joined, terms)

    def work(self, along: Straining) -> Form:
        """Work over the step, eq. (D2); never positive."""
        forms = [_work(part, self._layout, along) for part in self._parts]
        return sum(forms[1:], forms[0])

    def at(self, q: Expr, v: Expr, dq: Expr) -> Form:
        """Virtual work of the forces at a state with a velocity."""
        layout = self._layout
        forms = [on(at_state(section, layout, e, q, v, dq)) for section, e, on in self._parts]
        return sum(forms[1:], forms[0])


def _work(part: Resisting, layout: Layout, along: Straining) -> Form:
    densities = taken(part.section, layout, part.strain, along)
    return part.integrate([-density / along.dt for density in densities])


def _over_time(
    integrate: Callable[[Sequence[Expr]], Form], dt: Expr, densities: Sequence[Expr]
) -> Form:
    """Integral of densities over a time.

    Args:
        integrate: Their integral over the body.
        dt: The time.
        densities: The densities.
    """
    return integrate([density / dt for density in densities])


def slowing(section: Section | BeamSection, mesh: Any) -> fem.Constant | None:
    """Rate of a section's damping in proportion to its mass, 1/s; None without any."""
    rate = float(section.mass_damping)
    return fem.Constant(mesh, rate) if rate else None


class Inert(Protocol):
    """A body with mass."""

    def inertia(self, rate: Expr, dq: Expr) -> Form | None:
        """Virtual work of the inertia forces."""
        ...


def mass_damping(
    body: Inert, rate: fem.Constant | None, rates: Rates | None, dq: Expr
) -> Form | None:
    """Virtual work of forces in proportion to the momentum; None without any.

    Args:
        body: The body.
        rate: Of the proportion, 1/s; None: none.
        rates: Velocities; None in statics.
        dq: Virtual displacement.
    """
    if rate is None or rates is None:
        return None
    form = body.inertia(rates.chord if rates.weighed is None else rates.weighed, dq)
    return None if form is None else -rate * form
