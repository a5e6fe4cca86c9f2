"""Schemes of others, for comparison: generalized-alpha, and the paper's energy-decaying one."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from dolfinx import fem

from shellmb.scene.schemes import DISSIPATIVE
from shellmb.schemes.base import END, Levels, Named, Rotations, Scheme, Stage, Tangent, Values
from shellmb.schemes.ed import EnergyDecaying
from shellmb.schemes.interval import at_state

# a free rotation is too slow by `(1 + 10 alpha^2)/12` of its squared angle in a step (measured:
# 0.083, 0.17, 0.89 for alpha = 0, 1/3, 1); 5 per cent of the angle are the bound
TOO_SLOW = 0.05


class Weights(NamedTuple):
    """Weights of a step: floats, or constants in forms.

    Args:
        m: Share of the old acceleration-like variable.
        f: Share of the old acceleration.
        beta: Newmark's weight of positions.
        gamma: Newmark's weight of velocities.
    """

    m: Any
    f: Any
    beta: Any
    gamma: Any

    def end(self, q: Any, rates: Mapping[str, Any], qf: Any, dt: Any) -> tuple[Any, Any, Any]:
        """Velocity, acceleration-like variable and acceleration at the end of a step.

        Args:
            q: State at the start.
            rates: "v", "a" and "acceleration" there.
            qf: State at the end.
            dt: Length of the step.
        """
        v, a = rates["v"], rates["a"]
        end = (qf - q - dt * v) / (self.beta * dt**2) - (0.5 - self.beta) / self.beta * a
        velocity = v + dt * ((1 - self.gamma) * a + self.gamma * end)
        mean = (1 - self.m) * end + self.m * a
        return velocity, end, (mean - self.f * rates["acceleration"]) / (1 - self.f)


@dataclass(frozen=True)
class GeneralizedAlpha(Scheme):
    """Second order, with a chosen spectral radius at infinite frequency; no energy law.

    J. Chung and G. M. Hulbert, J. Appl. Mech. 60 (1993) 371-375, with the constraints of index 3
    and the acceleration-like variable of M. Arnold and O. Bruels, Multibody Syst. Dyn. 18 (2007)
    185-202: all forces and constraints are those at the end of the step,

        M vdot_f + f(q_f, v_f) + Dg(q_f)^T mu = p(t_f),   g(q_f) = 0,
        (1 - m) a_f + m a_i = (1 - f) vdot_f + f vdot_i,
        q_f = q_i + h v_i + h^2 [(1/2 - beta) a_i + beta a_f],
        v_f = v_i + h [(1 - gamma) a_i + gamma a_f]

    Velocities do not obey the constraints exactly. `vdot` at the start solves the equations of
    motion there (`simulate.start.endforces`), and `a` begins with it.

    Args:
        alpha: Dissipation, 0 to 1, as in all schemes here: the spectral radius at infinite
            frequency is `rho = (1 - alpha)/(1 + alpha)`.
    """

    alpha: float = DISSIPATIVE["generalized-alpha"]
    name: str = "generalized-alpha"
    order: int = 2
    dynamic: bool = True
    stages: tuple[str, ...] = (END,)
    rates: tuple[str, ...] = ("v", "a", "acceleration")
    conserves: frozenset[str] = frozenset()

    @property
    def title(self) -> str:
        """Title in words."""
        return f"for comparison: generalized-alpha, rho = {self.rho:.3g}, without an energy law"

    @property
    def rotations(self) -> Rotations:
        """Free rotations become slower, the more the more it dissipates."""
        return Rotations((12 * TOO_SLOW / (1 + 10 * self.alpha**2)) ** 0.5)

    @property
    def rho(self) -> float:
        """Spectral radius at infinite frequency."""
        return (1 - self.alpha) / (1 + self.alpha)

    @property
    def weights(self) -> Weights:
        """Weights of optimal dissipation, eqs. (14), (16), (17) of Chung and Hulbert."""
        rho = self.rho
        m, f = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
        gamma = 0.5 + f - m
        return Weights(m, f, (gamma + 0.5) ** 2 / 4, gamma)

    def expand(self, levels: Levels, dt: fem.Constant) -> dict[str, Stage]:
        """All forces at the end; weights are constants, so that all rho share their kernels."""
        mesh, qf = levels.q.function_space.mesh, levels.unknown[END]
        weights = Weights(*(fem.Constant(mesh, w) for w in self.weights))
        velocity, _, rate = weights.end(levels.q, levels.rates, qf, dt)
        return {END: Stage(at_state(qf), rate=rate, velocity=velocity)}

    def advance(
        self, q: Values, rates: Named, unknown: Named, dt: float, tangent: Tangent
    ) -> dict[str, Values]:
        """Velocity and both accelerations at the end."""
        return dict(zip(self.rates, self.weights.end(q, rates, unknown[END], dt), strict=True))


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
        return super().expand(replace(levels, tangent=lambda b, mid: b), dt)

    def advance(
        self, q: Values, rates: Named, unknown: Named, dt: float, tangent: Tangent
    ) -> dict[str, Values]:
        """Velocity at the end, eq. (31)."""
        return super().advance(q, rates, unknown, dt, lambda b, mid: b)
