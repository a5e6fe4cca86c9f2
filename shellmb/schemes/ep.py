"""Energy-preserving scheme of section 3 of the paper, eqs. (19), (23), (25)-(27).

The step is one sub-interval (`interval`) from `q_i` to `q_f`. With `D = q_f - q_i` and
`q_m = (q_i + q_f)/2`

    (v_i + v_f)/2 = D/h                                                                        (23)
    M (v_f - v_i)/h dq + C (e_i + e_f)/2.De(q_m) dq + lambda.Dg(q_m) dq = p.dq           (25)-(27)
    g(q_f) = 0                                                                               (19)
"""

from dataclasses import dataclass

from dolfinx import fem

from shellmb.schemes.base import END, Levels, Named, Scheme, Stage, Tangent, Values
from shellmb.schemes.interval import interval
from shellmb.schemes.pieces import START, Pieces, intervals


@dataclass(frozen=True)
class EnergyPreserving(Scheme):
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

    def expand(self, levels: Levels, dt: fem.Constant) -> dict[str, Stage]:
        """The only row: the rate of the velocities is `(v_f - v_i)/h = 2 (D/h - v_i)/h`, (23)."""
        q_i, v_i, q_f = levels.q, levels.rates["v"], levels.unknown["f"]
        v = (q_f - q_i) / dt
        return {"f": Stage(interval(q_i, q_f), rate=2 * (v - v_i) / dt, velocity=v, chord=v)}

    @property
    def pieces(self) -> Pieces | None:
        """The step; none where displacements are small."""
        return None if self.linear else intervals((START, END), (False,))

    def advance(
        self, q: Values, rates: Named, unknown: Named, dt: float, tangent: Tangent
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
