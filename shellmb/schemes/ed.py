"""Energy-decaying scheme of section 4 of the paper, eqs. (28)-(32).

The step has two sub-intervals (`interval`), from `q_i` to `q_j` and on to `q_f`. With the changes
of velocities `a = v_f - v_i` and `b = v_j - v_i` eq. (31) is

    a + b = 2 (q_f - q_i)/h - 2 v_i,         a - alpha b = -6 (q_j - q_i)/h                     (31)

and the rows are, with the stress (22) in f and with the jump (32) by alpha in j,

    f:  M a/h dq + S_jf.De(q_jf) dq + lambda_f.Dg(q_jf) dq = <p>.dq                             (29)
    j:  M (a + 3 b)/h dq + S_ij.De(q_ij) dq + lambda_j.Dg(q_ij) dq = <(4 - 6 tau) p>.dq,  (30), (32)

the latter being eq. (29) plus three times eq. (30). The energy falls by `alpha c^2`, (33), (34).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from dolfinx import fem

from shellmb.forms.constraints.held import VelocityJump
from shellmb.forms.steps.discrete import mean
from shellmb.scene.schemes import DISSIPATIVE
from shellmb.schemes.base import (
    END,
    JumpStage,
    Levels,
    LocalError,
    Motion,
    Named,
    Rotations,
    Scheme,
    Stage,
    Tangent,
    Values,
    end_velocity,
)
from shellmb.schemes.interval import interval
from shellmb.schemes.pieces import START, Pieces, intervals

# in large motion, where it is of second order: measured (`docs/theory/stepcontrol.md`)
LOCAL_ERROR = LocalError(3, 1 / 48)


def moved_to_j(a: Any, b: Any, rate: Any, alpha: Any) -> Any:
    """Remainder of the second eq. (31), zero, with the rate `(q_j - q_i)/h`; linear in all."""
    return a - alpha * b + 6 * rate


@dataclass(frozen=True)
class EnergyDecaying(Scheme):
    """Two coupled sub-steps with a jump at the start of the step, eqs. (28)-(32).

    The energy decays by `alpha c^2` in every step, eq. (33); the spectral radius at infinite
    frequency is `(1 - alpha)/(1 + alpha)`. Third order; fourth order and energy preserving for
    `alpha = 0`; in large rotations second order with a smaller error than EP.
    With `a = v_f - v_i` and `b = v_j - v_i`, eq. (31) reads
    `a + b = 2 (q_f - q_i)/dt - 2 v_i` and `a - alpha b = -6 (q_j - q_i)/dt`; the second one across
    the directors only, along them `b` is free of momentum (`forms.shell.tangent_jump` says why).
    In mechanisms the same holds for all constraints at once, and `b` is an unknown (`JumpStage`).

    Args:
        alpha: Dissipation, from 0 (none) to 1 (asymptotic annihilation).
    """

    alpha: float = DISSIPATIVE["ed"]
    name: str = "ed"
    title: str = "energy decaying (ED)"
    dynamic: bool = True
    stages: tuple[str, ...] = ("j", "f")
    rates: tuple[str, ...] = ("v",)
    linear: bool = False
    jumps: bool = True
    local_error: LocalError = LOCAL_ERROR

    @property
    def order(self) -> int:
        """Order of accuracy in time, of vibrations with small rotations."""
        return 3 if self.alpha > 0 else 4

    @property
    def conserves(self) -> frozenset[str]:
        """Linear momentum always, energy without dissipation."""
        return frozenset({"momentum"} | ({"energy"} if self.alpha == 0 else set()))

    @property
    def rotations(self) -> Rotations:
        """Accuracy for rotating bodies."""
        # the state j leaves the circle on which a stiff fibre moves: of the squared angle a stiff
        # plate lost 0.95, 1.02, 1.09, 1.00 times 1/(1 + alpha) with alpha = 1, 0.75, 0.5, 0.25
        # (`tests/hard/test_spins.py`); without dissipation it is less, and forces are as wrong
        return Rotations(0.75, stiff_loss=1 / (1 + self.alpha) if self.alpha > 0 else 0.5)

    @staticmethod
    def _changes(
        q: Any, v: Any, unknown: Mapping[str, Any], dt: Any, alpha: Any, tangent: Callable[..., Any]
    ) -> tuple[Any, Any]:
        """Changes of velocities `a` and `b` by eq. (31), of expressions or of numbers."""
        both = 2 * (unknown["f"] - q) / dt - 2 * v
        if "b" in unknown:
            return both - unknown["b"], unknown["b"]
        left = moved_to_j(both, 0 * both, (unknown["j"] - q) / dt, alpha)
        free = left / moved_to_j(1, -1, 0, alpha)
        b = tangent(free, (q + unknown["j"]) / 2)
        return both - b, b

    def _factor(self, levels: Levels) -> fem.Constant:
        """Alpha as a Constant, so that another alpha is no other form."""
        return fem.Constant(levels.q.function_space.mesh, float(self.alpha))

    def expand(self, levels: Levels, dt: fem.Constant) -> dict[str, Stage]:
        """Row j is eq. (29) plus three times eq. (30), row f is eq. (29)."""
        q, v = levels.q, levels.rates["v"]
        qj, qf = levels.unknown["j"], levels.unknown["f"]
        alpha = self._factor(levels)
        a, b = self._changes(q, v, levels.unknown, dt, alpha, levels.tangent)
        # the velocity at j with the average of eq. (32), as loads and stresses are taken
        v_j = v + b / 2 + alpha * b / 2
        whole = {"chord": (qf - q) / dt, "middle": mean(q, qf)}
        # the velocity of the path, q' = chord - 3 (q_j - q_i) P1/dt, in the row of P0 - 3 P1
        weighed = whole["chord"] + 3 * (qj - q) / dt
        inertia = (a + 3 * b) / dt
        first = Stage(interval(q, qj, alpha), inertia, v_j, weighed=weighed, **whole)
        last = Stage(interval(qj, qf), rate=a / dt, velocity=whole["chord"], **whole)
        return {"j": first, "f": last}

    @property
    def pieces(self) -> Pieces | None:
        """Both sub-intervals, the stress of the first one with the jump (32)."""
        return intervals((START, "j", END), (True, False), self.alpha)

    def jump(self, levels: Levels, dt: fem.Constant) -> JumpStage | None:
        """Eq. (31) solved for the jump of velocities, as far as constraints allow."""
        q, qj, v = levels.q, levels.unknown["j"], levels.rates["v"]
        alpha = self._factor(levels)
        a, b = self._changes(q, v, levels.unknown, dt, alpha, levels.tangent)
        step = VelocityJump(q, qj, levels.unknown["f"], b, a, v + a, dt)
        return JumpStage(-moved_to_j(a, b, (qj - q) / dt, alpha), b, mean(q, qj), step)

    def load_weight(self, stage: str, tau: float) -> float:
        """Row f: the mean; row j: with the first moment that eq. (30) stands for."""
        return 1.0 if stage == "f" else 4.0 - 6.0 * tau

    def prescribed(
        self, stage: str, motion: Motion, t: float, dt: float, rates: Mapping[str, Values]
    ) -> Values:
        """The motion at f; at j the state that makes the velocity at the end that of the motion."""
        end = motion(t + dt)
        if stage == "f":
            return end
        start, v = motion(t), rates["v"]
        a = end_velocity(motion, t, dt) - v
        b = 2 * (end - start) / dt - 2 * v - a
        if stage == "b":
            return b
        return start - dt * moved_to_j(a, b, 0, self.alpha) / moved_to_j(0, 0, 1, self.alpha)

    def advance(
        self, q: Values, rates: Named, unknown: Named, dt: float, tangent: Tangent
    ) -> dict[str, Values]:
        """Velocity at the end, `v + a` with `a` of eq. (31)."""
        v = rates["v"]
        return {"v": v + self._changes(q, v, unknown, dt, self.alpha, tangent)[0]}

    def moved(
        self, q: Any, scaled: Mapping[str, Any], unknown: Mapping[str, Any]
    ) -> dict[str, Any]:
        """The two sub-intervals, and half of a jump that is prescribed."""
        return {
            "j": unknown["j"] - q,
            END: unknown[END] - unknown["j"],
            # the impulses that hold a prescribed jump work on half of it: with the equation of
            # the jump the kinetic energy changes by the work of the rows j and f, less
            # `alpha b.Mb/2`, plus `b.M defect/2`
            **({"b": unknown["b"] / 2} if "b" in unknown else {}),
        }

    def first_guess(self, stage: str, q: Values, scaled: Mapping[str, Values]) -> Values | float:
        """The state at the start of the step; velocities do not jump."""
        return 0.0 if stage == "b" else q

    def dissipation(self) -> tuple[float, str | None]:
        """`alpha` times the energy of the jump at j, eqs. (33), (34)."""
        return self.alpha, "j"
