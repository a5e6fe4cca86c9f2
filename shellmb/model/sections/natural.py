"""Strains that a body has without stress: what they add to its forces, energy and resultants.

With `e - theta e*` in place of the strain `e` of a linear section the forces are those of `e` less
`theta S*`, `S* = C e*`: a stress that is given, and that acts on the same strains, at the same
points. So it is a load, of which the schemes take means and work as of any other, and the mixed
form stays what it is. What is reported is of `e - theta e*`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import ufl
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.forms.measure import Measure
from shellmb.model.body import TimeFunction
from shellmb.scene import BeamNaturalStrain, NaturalStrain
from shellmb.scene.loads.loads import Load

# what a set of loads of a body may have
Distributed = Load | NaturalStrain | BeamNaturalStrain


@dataclass(frozen=True)
class NaturalStress:
    """The stress `C e*` of a natural strain `e*`.

    Args:
        strain: `e*`.
        stresses: `S*` for each quadrature rule.
        resultants: What of it is reported, for a factor of one.
        measure: Strains of the body.
        integrate: Integral of densities, one for each rule.
        time: Factor `theta` over time.
        now: That factor at the state which was accepted last.
        mean: Its mean over the step that was solved last.
    """

    strain: Expr
    stresses: tuple[Expr, ...]
    resultants: Expr
    measure: Measure
    integrate: Callable[[Sequence[Expr]], Form]
    time: TimeFunction | None = field(compare=False)
    now: fem.Constant
    mean: fem.Constant

    def work(self, mid: Expr, dq: Expr) -> Form:
        """Virtual work of the stress at a state, for a factor of one."""
        change = self.measure.change(mid, dq)
        return self.integrate([ufl.dot(stress, change) for stress in self.stresses])

    def energy(self, q: Expr) -> Form:
        """Elastic energy of `e - theta e*` less that of `e`."""
        e = self.measure.value(q)
        shift = self.now * self.strain / 2 - e
        return self.integrate([self.now * ufl.dot(stress, shift) for stress in self.stresses])
