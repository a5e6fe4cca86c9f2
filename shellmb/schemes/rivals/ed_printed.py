"""The paper's energy-decaying scheme literally, for comparison: what our change of it gains."""

from dataclasses import dataclass, replace

from dolfinx import fem
from ufl.core.expr import Expr

from shellmb.schemes.base import Levels, Named, Stage, Tangent, Values
from shellmb.schemes.ed import EnergyDecaying


def _as_it_is(b: Expr, mid: Expr) -> Expr:
    return b


@dataclass(frozen=True)
class EnergyDecayingAsPrinted(EnergyDecaying):
    """ED with eq. (31) for all velocities, also along directors and constraints.

    Its energy law is as exact. But eq. (31) ties velocities that constraints determine to a chord
    that has no component along them (`forms.shell.tangent_jump` says why), which spoils the order:
    wherever directors have inertia, or joints act.
    """

    name: str = "ed-printed"
    title: str = "for comparison: energy decaying with eq. (31) everywhere, as printed"
    jumps: bool = False

    @property
    def order(self) -> int:
        """Order of accuracy in time; without dissipation it does not converge at all."""
        return 1 if self.alpha > 0 else 0

    def expand(self, levels: Levels, dt: fem.Constant) -> dict[str, Stage]:
        """The rows of ED, with the jump of eq. (31) as it is."""
        return super().expand(replace(levels, tangent=_as_it_is), dt)

    def advance(
        self, q: Values, rates: Named, unknown: Named, dt: float, tangent: Tangent
    ) -> dict[str, Values]:
        """Velocity at the end, eq. (31)."""
        return super().advance(q, rates, unknown, dt, lambda b, mid: b)
