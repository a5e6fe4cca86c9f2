"""What bodies without mass and elasticity have in common."""

from dataclasses import dataclass, field

from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.forms.constraints.leap import Leap
from shellmb.forms.steps.mixed import Interval
from shellmb.forms.steps.path import Step
from shellmb.meshes.spaces import MixedSpace
from shellmb.model.body import (
    Damped,
    FixedDofs,
    Leaping,
    LoadFactors,
    NodeLink,
    PartScale,
    Rates,
    SubInterval,
    Term,
    Values,
)


@dataclass
class Massless:
    """What bodies without mass and elasticity have in common: nothing of either."""

    name: str
    mixed: MixedSpace
    parts: tuple[PartScale, ...]
    links: tuple[NodeLink, ...]
    fixed: list[FixedDofs] = field(default_factory=list)
    kinematic: frozenset[str] = frozenset()
    coupled: bool = False
    leaps: bool = False
    slenderness: float = 1.0
    inertialess: bool = False
    jump_parts: frozenset[str] = frozenset()
    damping: Damped | None = None

    def velocity_constraint(self, v: Expr, mid: Expr, dv: Expr) -> Form | None:
        """No constraints."""
        return None

    def leaping(self, leap: Leap, dq: Expr) -> Leaping:
        """No constraints."""
        return None

    def internal(self, span: Interval, dq: Expr) -> Form | None:
        """No internal forces."""
        return None

    def within(self, sub: SubInterval, dq: Expr, trial: Expr) -> tuple[Form | None, list[Term]]:
        """Nothing that has terms."""
        return self.internal(sub.span, dq), []

    def along(self, step: Step, k: int, dq: Expr) -> Form | None:
        """No internal forces."""
        return None

    def stressed(self, step: Step) -> list[Term]:
        """No strains."""
        return []

    def lost(self, step: Step, bow: Expr) -> Form | None:
        """No strains."""
        return None

    def inertia(self, rate: Expr, dq: Expr) -> Form | None:
        """No inertia."""
        return None

    def tangent(self, b: Expr, mid: Expr) -> Expr:
        """Nothing of its own moves."""
        return b

    def tangent_values(self, b: Values, mid: Values) -> Values:
        """Nothing of its own moves."""
        return b

    def loads(self) -> LoadFactors | None:
        """No loads."""
        return None

    def extra(self, mid: Expr, rates: Rates | None, dq: Expr, time: fem.Constant) -> Form | None:
        """No added terms."""
        return None

    def strain_energy(self, q: Expr) -> Form | None:
        """No strain energy."""
        return None

    def kinetic_energy(self, v: Expr) -> Form | None:
        """No kinetic energy."""
        return None

    def jump(self, a: Expr, b: Expr) -> Form | None:
        """No dissipation."""
        return None

    def reference_directors(self) -> Values | None:
        """No directors."""
        return None

    def constraint_error(self, q: fem.Function) -> float:
        """No constraints."""
        return 0.0
