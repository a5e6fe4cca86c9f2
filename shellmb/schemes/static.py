"""Statics: forces in equilibrium at one state."""

from dataclasses import dataclass

from dolfinx import fem

from shellmb.schemes.base import END, Levels, Named, Scheme, Stage, Tangent, Values
from shellmb.schemes.interval import at_state
from shellmb.schemes.pieces import Pieces, single


@dataclass(frozen=True)
class Static(Scheme):
    """Static equilibrium at the end of each load step."""

    name: str = "static"
    title: str = "static equilibrium"
    order: int = 0
    dynamic: bool = False
    stages: tuple[str, ...] = ("f",)
    rates: tuple[str, ...] = ()
    conserves: frozenset[str] = frozenset()
    linear: bool = False

    def expand(self, levels: Levels, dt: fem.Constant) -> dict[str, Stage]:
        """All forces at the unknown state, `S.De(q_f) dq + lambda.Dg(q_f) dq = p.dq`."""
        return {"f": Stage(at_state(levels.unknown["f"]))}

    @property
    def pieces(self) -> Pieces | None:
        """Forces at the unknown state; none where displacements are small."""
        return None if self.linear else single(END)

    def advance(
        self, q: Values, rates: Named, unknown: Named, dt: float, tangent: Tangent
    ) -> dict[str, Values]:
        """There are no rates."""
        return {}


@dataclass(frozen=True)
class Linear(Static):
    """Linear statics: small displacements from the reference configuration."""

    name: str = "linear-statics"
    title: str = "linear statics (small displacements)"
    linear: bool = True
