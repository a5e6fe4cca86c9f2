"""Energies of scalar coordinates: springs, and amplitudes of modes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import ufl
from ufl import Form
from ufl.core.expr import Expr

from shellmb.forms.constraints import elements as forms
from shellmb.forms.steps.mixed import Interval
from shellmb.forms.steps.path import Step
from shellmb.model.potentials.exact import WithoutTerms

Scalars = Callable[[Expr], list[Expr]]


@dataclass(frozen=True)
class LinearSprings(WithoutTerms):
    """Linear springs on coordinates.

    Args:
        stiffness: Stiffness of each.
        extension: Extensions of a state.
        moved: Changes of the coordinates in a state, which is without the rest lengths.
        dx: Measure whose points are the places.
    """

    stiffness: Sequence[Expr]
    extension: Scalars
    moved: Scalars
    dx: ufl.Measure

    def _sum(self, products: Sequence[Expr]) -> Form:
        return sum(products[1:], products[0]) * self.dx

    def _work(self, forces: Sequence[Expr], dq: Expr) -> Form:
        return self._sum([f * d for f, d in zip(forces, self.moved(dq), strict=True)])

    def interval(self, span: Interval, dq: Expr) -> Form:
        """Average forces over the sub-interval."""
        ends = zip(self.stiffness, self.extension(span.a), self.extension(span.b), strict=True)
        if span.a is span.b:
            return self._work([forms.slope(forms.linear_potential(k), a) for k, a, _ in ends], dq)
        return self._work([forms.linear_force(k, a, b, span.beta) for k, a, b in ends], dq)

    def _stretches(self, step: Step) -> list[forms.Stretch]:
        p = step.path
        parts = self.extension(p.start), self.moved(p.chord), self.moved(p.bow)
        return [forms.Stretch(a, d, 2 * z) for a, d, z in zip(*parts, strict=True)]

    def row(self, step: Step, k: int, dq: Expr) -> Form:
        """Forces over a step, linear in time."""
        pairs = zip(self.stiffness, self._stretches(step), strict=True)
        moments = [forms.linear_forces(c, e, step.path.alpha)[k] for c, e in pairs]
        return self._work(moments if k == 0 else [f / 3 for f in moments], dq)

    def bow(self, step: Step, held: Expr) -> Form:
        """Energy of the bows of the extensions, J."""
        pairs = zip(self.stiffness, self._stretches(step), strict=True)
        return self._sum([forms.linear_potential(k)(e.bow) for k, e in pairs])

    def energy(self, q: Expr) -> Form:
        """The energy, J."""
        pairs = zip(self.stiffness, self.extension(q), strict=True)
        return self._sum([forms.linear_potential(k)(e) for k, e in pairs])

    def jump(self, a: Expr, b: Expr) -> Form:
        """Elastic part of eq. (34)."""
        ends = zip(self.stiffness, self.extension(a), self.extension(b), strict=True)
        return self._sum([forms.linear_jump(k, first, last) for k, first, last in ends])


@dataclass(frozen=True)
class LawSprings(WithoutTerms):
    """Springs with a potential of any form on one coordinate each.

    Args:
        potential: Energy of an extension.
        extension: Extension of a state.
        moved: Change of the coordinate in a state, which is without the rest length.
        size: Characteristic magnitude of the coordinate.
        dx: Measure whose points are the places.
    """

    potential: forms.Potential
    extension: Callable[[Expr], Expr]
    moved: Callable[[Expr], Expr]
    size: Expr
    dx: ufl.Measure

    def interval(self, span: Interval, dq: Expr) -> Form:
        """Average force over the sub-interval."""
        a, b = self.extension(span.a), self.extension(span.b)
        if span.a is span.b:
            force = forms.slope(self.potential, a)
        else:
            force = forms.spring_force(self.potential, a, b, span.beta, self.size)
        return force * self.moved(dq) * self.dx

    def _stretch(self, step: Step) -> forms.Stretch:
        p = step.path
        return forms.Stretch(self.extension(p.start), self.moved(p.chord), 2 * self.moved(p.bow))

    def row(self, step: Step, k: int, dq: Expr) -> Form:
        """Force over a step, linear in time."""
        both = forms.spring_forces(self.potential, self._stretch(step), step.path.alpha, self.size)
        return (both[0] if k == 0 else both[1] / 3) * self.moved(dq) * self.dx

    def bow(self, step: Step, held: Expr) -> Form:
        """Energy of the bow of the extension, J."""
        e = self._stretch(step)
        return forms.stiffness(self.potential, e) * e.bow**2 / 2 * self.dx

    def energy(self, q: Expr) -> Form:
        """The energy, J."""
        return self.potential(self.extension(q)) * self.dx

    def jump(self, a: Expr, b: Expr) -> Form:
        """Elastic part of eq. (34)."""
        return forms.spring_jump(self.potential, self.extension(a), self.extension(b)) * self.dx
