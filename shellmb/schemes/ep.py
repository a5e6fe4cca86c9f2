"""Energy-preserving scheme of section 3 of the paper."""

from collections.abc import Mapping
from dataclasses import dataclass

from dolfinx import fem

from shellmb.schemes.base import (
    LINEAR_PATH,
    Levels,
    Rotations,
    Stage,
    Tangent,
    Values,
    interval,
)
from shellmb.schemes.single import SingleStage


@dataclass(frozen=True)
class EnergyPreserving(SingleStage):
    """Mid-point forces with averaged stresses, eqs. (23), (26), (27); second order.

    Energy and both momenta are conserved whatever the step.
    """

    name: str = "ep"
    title: str = "energy preserving (EP)"
    order: int = 2
    dynamic: bool = True
    stages: tuple[str, ...] = ("f",)
    rates: tuple[str, ...] = ("v",)
    conserves: frozenset[str] = frozenset({"energy", "momentum", "angular momentum"})
    linear: bool = False
    jumps: bool = False
    rotations: Rotations = LINEAR_PATH

    def expand(self, levels: Levels, dt: fem.Constant) -> dict[str, Stage]:
        """Eq. (23) gives `v_f = 2 (q_f - q_i)/dt - v_i`; `(v_f - v_i)/dt` is the rate."""
        q, v, qf = levels.q, levels.rates["v"], levels.unknown["f"]
        velocity = (qf - q) / dt
        return {
            "f": Stage(
                interval(q, qf), rate=2 * (velocity - v) / dt, velocity=velocity, chord=velocity
            )
        }

    def advance(
        self,
        q: Values,
        rates: Mapping[str, Values],
        unknown: Mapping[str, Values],
        dt: float,
        tangent: Tangent,
    ) -> dict[str, Values]:
        """Velocity at the end, eq. (23)."""
        return {"v": 2 * (unknown["f"] - q) / dt - rates["v"]}


@dataclass(frozen=True)
class LinearDynamics(EnergyPreserving):
    """Small displacements in time: EP is the mid-point rule there, Newmark's average acceleration.

    The matrix is the same in all steps of one length. The energy that is conserved is the quadratic
    one, the angular momentum that about the reference positions.
    """

    name: str = "linear-dynamics"
    title: str = "linear dynamics (small displacements)"
    linear: bool = True
