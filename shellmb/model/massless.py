"""Base of bodies without mass and elasticity."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.meshes.spaces import MixedSpace
from shellmb.model.body import (
    Constraint,
    Damped,
    Elastic,
    FixedDofs,
    LoadFactors,
    Manifold,
    NodeLink,
    PartScale,
    Rates,
)


@dataclass
class Massless:
    """Base of bodies without mass and elasticity."""

    name: str
    mixed: MixedSpace
    parts: tuple[PartScale, ...]
    links: tuple[NodeLink, ...]
    fixed: list[FixedDofs] = field(default_factory=list)
    kinematic: frozenset[str] = frozenset()
    slenderness: float = 1.0
    jump_parts: frozenset[str] = frozenset()
    damping: Damped | None = None
    manifold: Manifold = Manifold()  # noqa: RUF009 (frozen)

    @property
    def elastic(self) -> Sequence[Elastic]:
        """No elastic parts."""
        return ()

    @property
    def constraints(self) -> Sequence[Constraint]:
        """No constraints."""
        return ()

    def inertia(self, rate: Expr, dq: Expr) -> Form | None:
        """No inertia."""
        return None

    def loads(self) -> LoadFactors | None:
        """No loads."""
        return None

    def applied(self, mid: Expr, rates: Rates | None, dq: Expr, time: fem.Constant) -> Form | None:
        """No added terms."""
        return None
