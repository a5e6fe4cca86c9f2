"""Interface of time schemes: the states that they solve for, and those at which forms are taken.

A scheme is data and a few small functions; it knows no bodies, only their functions at the start
of a step and the unknown functions of its stages. A new scheme is one class with the members of
`Scheme` that have no default, and, to be tested, one line in `registry.py`.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt
from dolfinx import fem
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.forms.constraints.held import VelocityJump
from shellmb.forms.steps.mixed import Interval
from shellmb.model.body import Rates, slope_from
from shellmb.schemes.interval import at_state as at_state
from shellmb.schemes.interval import interval as interval
from shellmb.schemes.notation import PathPage
from shellmb.schemes.pieces import Pieces

Values = npt.NDArray[np.float64]
Motion = Callable[[float], Values]
Tangent = Callable[[Values, Values], Values]
# arrays by the names of rates or stages
type Named = Mapping[str, Values]

# name of the unknown state at the end of a step, in all schemes
END = "f"

# three Gauss points on [0, 1]: time averages of loads exact to degree 5, beyond the order of any
# scheme here
GAUSS_TIMES = np.array([0.5 - np.sqrt(15) / 10, 0.5, 0.5 + np.sqrt(15) / 10])
GAUSS_WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18


@dataclass(frozen=True)
class Levels:
    """Functions of one body at the time levels of a step.

    Args:
        q: State at the start of the step.
        rates: Rates at the start of the step that the scheme keeps ("v", say).
        unknown: Unknown state of each stage, by its name; and "b", the unknown jump of velocities,
            of bodies whose jump is coupled to that of others.
        scaled: Rates at the start times the step, of those in `Scheme.scaled`.
        tangent: Takes a jump of velocities and a state, and returns the jump without what the
            constraints at the nodes forbid at that state; for bodies without an unknown jump.
        reference: Functions that stay zero, at which a linear scheme takes its forms
            (`schemes.linearised`); None for others.
        slides: Whether constraints hold velocities at the end of a step with an unknown jump
            (`forms.constraints.held`).
    """

    q: fem.Function
    rates: Mapping[str, fem.Function]
    unknown: Mapping[str, fem.Function]
    tangent: Callable[[Expr, Expr], Expr] = lambda b, mid: b
    scaled: Mapping[str, fem.Function] = MappingProxyType({})
    reference: "Levels | None" = None
    slides: bool = False


# name of what has a state, the arrays of this by the names of their functions, and their space
type StateArrays = tuple[str, dict[str, Floats], fem.FunctionSpace]


def levels_arrays(levels: Mapping[str, Levels]) -> Iterator[StateArrays]:
    """Arrays of the state at the start of a step, which steps change, body by body.

    Args:
        levels: Functions of the bodies by name.
    """
    for body, each in levels.items():
        arrays = {name: f.x.array for name, f in (("q", each.q), *each.rates.items())}
        yield body, arrays, each.q.function_space


def live_arrays(parts: Iterable[StateArrays]) -> dict[str, Floats]:
    """Arrays of a state by the names of what has it and of their functions.

    Args:
        parts: The arrays, as from `levels_arrays`.
    """
    return {f"{name}/{key}": a for name, arrays, _ in parts for key, a in arrays.items()}


@dataclass(frozen=True)
class Stage:
    """One row of equations of a scheme, tested with the variations of its unknown state.

    Args:
        span: Sub-interval over which forces act, and where constraints hold.
        rate: Rate of the velocities that the inertia sees; None in statics.
        velocity: Velocity that velocity-dependent terms see; None in statics.
        chord: Mean velocity over the whole step, in all stages the same; None: `velocity`.
        weighed: As of `Rates`.
        middle: Middle of the whole step, where stages have intervals of their own; else None.
        share: Of a single state, where between the start (0) and the end (1) of the step forces act
            and loads count, 0.5 to 1; constraints hold at its end.
    """

    span: Interval
    rate: Expr | None = None
    velocity: Expr | None = None
    chord: Expr | None = None
    weighed: Expr | None = None
    middle: Expr | None = None
    share: float = 1.0

    @property
    def single(self) -> bool:
        """Decide whether forces are those of a single state."""
        return self.span.a is self.span.b

    @property
    def rates(self) -> Rates | None:
        """Velocities that forces may depend on; None in statics."""
        if self.velocity is None:
            return None
        chord = self.velocity if self.chord is None else self.chord
        return Rates(self.velocity, chord, self.weighed, self.middle)


@dataclass(frozen=True)
class JumpStage:
    """The row of an unknown jump of velocities, tested with its variations.

    The jump obeys the scheme's equation for it only as far as the constraints allow: the
    difference is `M^-1 Dg^T mu` with `Dg b = 0`. So it does no work on the jump, and the energy law
    is as exact as without constraints.

    Args:
        defect: Rate whose momentum, with the impulses of the constraints, is zero.
        jump: The unknown jump, which holds the constraints' impulses, too.
        mid: State at which the constraints are taken.
        step: The step with it.
    """

    defect: Expr
    jump: Expr
    mid: Expr
    step: VelocityJump


@dataclass(frozen=True)
class Rotations:
    """Accuracy of a scheme for rotating bodies, measured in free rotations.

    Args:
        largest: Angle of a body in a step beyond which the error of the angle is more than five
            per cent, rad. With the linear paths of the paper's schemes a step turns by
            `2 atan(w dt/2)` in place of `w dt`: 5 per cent less at 0.75.
        stiff_loss: Part of its angular momentum that a body which does not stretch loses in a step,
            over the square of its angle in the step; 0 where the scheme does without.
        slows: Whether each step takes of the speed of what spins, stiff or not.
    """

    largest: float
    stiff_loss: float = 0.0
    slows: bool = False


# of all schemes whose positions are linear in a step or its parts, and that do no more about it
LINEAR_PATH = Rotations(0.75)


@dataclass(frozen=True)
class LocalError:
    """Error of a scheme in one step, as a derivative of the motion.

    A scheme of order p is off by `factor * h^(p + 1) * q^(p + 1)` at the end of a step from an
    exact state. In a vibration and in steady rotation of frequency w these are `(w h)^3/12` of the
    amplitude for EP (the mid-point rule), `(w h)^5/720` for EP4 (Gauss' method with two stages),
    and `alpha (w h)^4/72` for ED3 (Radau IIA with alpha = 1).

    Args:
        degree: Derivative of the motion that it is proportional to, and power of the step.
        factor: Of both.
    """

    degree: int
    factor: float

    @property
    def order(self) -> int:
        """Order of the scheme."""
        return self.degree - 1

    def per_radian(self, angle: float) -> float:
        """Error of a motion by the time it has turned by one radian, relative to its amplitude.

        Args:
            angle: By which it turns in a step, rad.
        """
        return float(self.factor * angle**self.order)


class Scheme:
    """A time scheme. Defaults are those of schemes whose only unknown state is that at the end.

    Attributes:
        name: Short name, for results and messages.
        title: Description in words.
        order: Order of accuracy in time, 0 for statics.
        dynamic: Whether there are velocities.
        stages: Names of the unknown states; `END` is the state at the end of the step.
        rates: Names of the rates that are kept from step to step. "v" starts with the initial
            velocities.
        accelerations: Those of them that start with the accelerations of the equations of motion;
            others than these and "v" start with zero.
        scaled: Those of the rates that the rows take multiplied by the step.
        slopes: For a step whose forces are linear in time: change of stresses, and of constraint
            forces, divided by their unknowns beside `scaled`; zeros if there are no such unknowns.
        balance: Stages whose rows balance the momentum of a step: the first with the mean of the
            forces, a second one with their first moment in time.
        conserves: Any of "energy", "momentum", "angular momentum".
        linear: Whether displacements are small: forms are linearised about the reference.
        jumps: Whether the velocity jump is unknown where constraints couple it to that of others.
        rotations: Accuracy for rotating bodies.
        local_error: Error of one step.
        pieces: Straight pieces of a step, for contact between shells; None: not supported.
        page: Equations of steps that are quadratic in time; None: steps are made of the stages.
    """

    scaled: tuple[str, ...] = ()
    slopes: tuple[float, float] = (0.0, 0.0)
    balance: tuple[str, ...] = (END,)
    linear: bool = False
    jumps: bool = False
    name: str
    dynamic: bool
    stages: tuple[str, ...]
    rates: tuple[str, ...]

    @property
    def title(self) -> str:
        """Description in words."""
        raise AttributeError("title")

    @property
    def order(self) -> int:
        """Order of accuracy in time."""
        raise AttributeError("order")

    @property
    def conserves(self) -> frozenset[str]:
        """Quantities that it conserves."""
        raise AttributeError("conserves")

    @property
    def accelerations(self) -> tuple[str, ...]:
        """All rates but the velocities."""
        return tuple(rate for rate in getattr(self, "rates", ()) if rate != "v")

    @property
    def pieces(self) -> Pieces | None:
        """None: which straight pieces the step is made of is not known."""
        return None

    @property
    def page(self) -> PathPage | None:
        """The page of a scheme that is quadratic in time; None: steps are made of the stages."""
        return None

    @property
    def rotations(self) -> Rotations:
        """Accuracy for rotating bodies: that of linear paths."""
        return LINEAR_PATH

    @property
    def local_error(self) -> LocalError:
        """Error of one step: that of the mid-point rule, if nothing else is known."""
        return LocalError(3, 1 / 12) if getattr(self, "order", 2) > 1 else LocalError(2, 1 / 2)

    def expand(self, levels: Levels, dt: fem.Constant) -> dict[str, Stage]:
        """Stages in terms of the functions of one body."""
        raise NotImplementedError

    def jump(self, levels: Levels, dt: fem.Constant) -> JumpStage | None:
        """Row of the unknown jump of velocities; None: velocities do not jump."""
        return None

    def load_weight(self, stage: str, tau: float) -> float:
        """Weight in the stage's load average of the load at the time t + tau dt.

        It is that of the mean over the step, or of the only value that acts
        (`residual.stage_forms`).
        """
        return 1.0

    def prescribed(
        self, stage: str, motion: Motion, t: float, dt: float, rates: Mapping[str, Values]
    ) -> Values:
        """Values at a stage of dofs with a prescribed motion; `rates` are theirs at the start.

        They are those at the end of the step. For the stage "b" their jump of velocities.
        """
        return motion(t + dt)

    def advance(
        self, q: Values, rates: Named, unknown: Named, dt: float, tangent: Tangent
    ) -> dict[str, Values]:
        """Rates at the end of the step; `tangent` is that of `Levels` for arrays."""
        raise NotImplementedError

    def moved(
        self, q: Any, scaled: Mapping[str, Any], unknown: Mapping[str, Any]
    ) -> dict[str, Any]:
        """Displacement on which the forces of each row do work in a step, as arrays or expressions.

        It is the step; work of forces at its end is of first order.

        Args:
            q: State at the start.
            scaled: As of `Levels`.
            unknown: States of the stages.
        """
        return {END: unknown[END] - q}

    def first_guess(self, stage: str, q: Values, scaled: Mapping[str, Values]) -> Values | float:
        """Values of a stage's unknown state before a step: those at its start; as of `moved`."""
        return q

    def resultants(self, start: Values, unknown: Mapping[str, Values]) -> Values:
        """Resultants of the state at the end from those at the start and of the stages."""
        return unknown[END]

    def dissipation(self) -> tuple[float, str | None]:
        """Factor alpha of eq. (33) and the stage whose jump from the start counts; (0, None)."""
        return 0.0, None


def has_energy_law(scheme: Scheme) -> bool:
    """Decide whether "energy change = work - dissipation" is exact: kept, or known to fall."""
    return "energy" in scheme.conserves or scheme.dissipation()[0] > 0


def end_velocity(motion: Motion, t: float, dt: float) -> Values:
    """Velocity of a prescribed motion at the end of a step.

    A one-sided difference of fourth order: the motion need not be defined beyond the end.
    """
    return slope_from(motion, t + dt, -1e-3 * dt)


# second derivative at the first of six points, which is the end of the step
_BACK = np.linalg.solve(np.vander(-np.arange(6.0), increasing=True).T, 2.0 * np.eye(6)[2])


def end_acceleration(motion: Motion, t: float, dt: float) -> Values:
    """Acceleration of a prescribed motion at the end of a step.

    A one-sided difference of fourth order: the motion need not be defined beyond the end. Its
    points are further apart than those of the velocity, because round-off counts by their square.
    """
    h = 0.05 * dt
    samples = [motion(t + dt - k * h) for k in range(6)]
    return np.asarray(np.dot(_BACK / h**2, np.array(samples)))
