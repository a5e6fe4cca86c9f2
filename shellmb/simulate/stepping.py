"""Stepping from one accepted state to the next, for the loop of a simulation; errors of steps.

Rotations of drivers and joints are looked at before and behind a step. Positions and directors tell
an angle up to whole turns only. A driver that turns by half a turn or more in a step, or in one of
its sub-intervals, would do another work than its torque does over the way that the bodies take
(`forms.constraints.coordinates`), and they would turn the other way round. A joint whose rate is
half a turn a step or more would lose whole turns.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from mpi4py import MPI

import numpy as np
from dolfinx import fem

from shellmb.arrays import Floats, Int32s
from shellmb.errors import ConvergenceError
from shellmb.model.body import FixedDofs, PrescribedTurn
from shellmb.model.joints.coordinates import CoordinateGroup
from shellmb.model.joints.joints import JointGroup
from shellmb.model.massless import gathered
from shellmb.model.rank_consistency import TimesAlike
from shellmb.preprocessing.bodyfields import body_directors
from shellmb.preprocessing.constraint_analysis.redundancy import worst_of
from shellmb.restart import Restartable, constant
from shellmb.schemes.base import END, Levels, LocalError
from shellmb.simulate.predictor import Predictor, hermite_weights
from shellmb.simulate.problem import Problem

# parts of a body that tell where it is
PLACES = ("u", "w")
# angle by which a load turns a director [rad], and iterations that it takes, beyond which Newton's
# method may have come to an equilibrium that the body does not come to: a strip that is rolled up
# at once may leave its plane. Loads that end in the same one take up to 18
SAFE_TURN, SAFE_ITERATIONS = 2.5, 24
# a joint whose constraint is implied by others stays closed to round-off: positions relative to the
# scene's length, directions by the sine of their angle
OPENED = 1e-6


class StepErrors(Restartable):
    """Estimates the error of each step, relative to the size of bodies.

    A scheme of order p is off in a step by `C h^(p+1) q^(p+1)` (`schemes.base.LocalError`). That
    derivative is a divided difference of the last p + 2 states, the new one among them: what the
    polynomial through the states before misses the new state by, up to a factor. A motion as large
    as the body with this derivative turns by the *equivalent angle*

        theta = (h^(p+1) |q^(p+1)| / L)^(1/(p+1))

    in the step, and has gathered the error `C theta^p` when it has turned by one radian. This is
    what is reported and controlled: all steps of a run with the same one are off by the same
    amount, and the error of the run is proportional to it.

    Only positions and directors enter. Velocities of stiff bodies, and of EP along constraints,
    alternate; times the step they would count as errors that positions do not have. Directors count
    as the positions of material points across the thickness.

    After a start, or a jump of velocities, there are no states before. Then the velocity there is
    known, and derivatives of lower degree k tell the angle, `(h^k q^(k) / L)^(1/k)`.

    Args:
        problem: The functions of all bodies.
    """

    remembered = ("_states", "_times", "_velocity")

    def __init__(self, problem: Problem) -> None:
        self._problem, self._comm = problem, problem.model.comm
        self._law: LocalError = problem.scheme.local_error
        self._where: list[tuple[str, Int32s]] = []
        scales: list[Floats] = []
        for body in problem.model.bodies:
            for part in body.parts:
                if part.name in PLACES and part.name in body.kinematic:
                    dofs = body.mixed.dofs[part.name]
                    self._where.append((body.name, dofs))
                    thin = body.slenderness if part.name == "w" else 1.0
                    scales.append(np.full(len(dofs), part.scale / thin))
        self._scales = np.concatenate([*scales, np.zeros(0)])
        self.forget()

    def forget(self) -> None:
        """Begin anew at the accepted state: velocities jumped, or forces."""
        # states before the next one, shape (k, n), and their times from it [s], the newest first
        self._states = constant(np.zeros((0, len(self._scales))))
        self._times: list[float] = []
        self._velocity: Floats | None = None

    def _taken(self, kind: str) -> Floats:
        """Entries of "q" or a rate at the accepted state, or of an unknown state."""
        found = []
        for name, dofs in self._where:
            levels = self._problem.levels[name]
            every = {**levels.unknown, "q": levels.q, **levels.rates}
            found.append(every[kind].x.array[dofs])
        return np.concatenate([*found, np.zeros(0)])

    def _begin(self) -> None:
        """Take the accepted state as the first one."""
        self._states, self._times = constant(self._taken("q")[None]), [0.0]
        self._velocity = constant(self._taken("v")) if "v" in self._problem.scheme.rates else None

    def estimate(self, dt: float) -> float:
        """Error of the step just solved; collective.

        Args:
            dt: Its length, s.

        Returns:
            `C theta^p` of the node that moves worst.
        """
        if not self._times:
            self._begin()
        data = np.stack([self._taken(self._problem.last), *self._states])
        times = np.array([0.0, *(t - dt for t in self._times)]) / dt
        confluent = self._velocity is not None and len(data) <= self._law.degree
        degree = min(len(data) - 1 + confluent, self._law.degree)
        if degree < 1:
            return 0.0
        weights = difference(times, degree, confluent)
        change = weights[: len(data)] @ data
        if confluent:
            change += weights[-1] * dt * self._velocity
        here = float(np.max(np.abs(change) / self._scales, initial=0.0))
        largest = float(self._comm.allreduce(here, op=MPI.MAX)) if self._comm.size > 1 else here
        return self._law.per_radian(largest ** (1 / degree))

    def accept(self, dt: float) -> None:
        """Keep the accepted state; the functions hold it."""
        if not self._times:
            return
        kept = self._law.degree
        self._times = [0.0, *(t - dt for t in self._times)][:kept]
        self._states = constant(np.stack([self._taken("q"), *self._states][:kept]))
        if len(self._states) == kept:
            self._velocity = None


def difference(times: Floats, degree: int, confluent: bool) -> Floats:
    """Weights of a derivative of the polynomial through values at some times.

    Args:
        times: The times, the newest first, shape (n,).
        degree: Of the derivative, which is constant: as many data as it has coefficients.
        confluent: Whether the last datum is the rate at the oldest time.

    Returns:
        Shape (n,), or (n + 1,) with the rate; zero where there are more values than it takes.
    """
    used = degree + 1 - confluent
    # the last coefficient, times the factorial, is the derivative
    unit = np.zeros(degree + 1)
    unit[-1] = math.factorial(degree)
    weights = hermite_weights(times[:used], times[used - confluent : used], unit)
    full = np.zeros(len(times) + confluent)
    full[:used] = weights[:used]
    if confluent:
        full[-1] = weights[-1]
    return full


Arrays = dict[str, Floats]


class StepInfo(NamedTuple):
    """A step that is solved.

    Args:
        t: Time at its start, s.
        dt: Its length, s; shorter than requested if an event lies within it.
        iterations: Newton iterations.
        error: Estimate of its error (`StepErrors`), where the scene has a tolerance for it; of a
            load how far it is from where Newton's method is sure to end, one being safe.
        jump: Largest jump between the states j and i relative to the parts' scales; None where the
            scheme has none, and before the step is accepted.
    """

    t: float
    dt: float
    iterations: int
    error: float | None = None
    jump: float | None = None

    @property
    def measured(self) -> float | None:
        """Error that the size of steps follows, or else the jump."""
        return self.jump if self.error is None else self.error


class TimeSteps(Restartable):
    """Steps in time, or in the load parameter of statics.

    Args:
        problem: The system of one step.

    Attributes:
        finished: Whether the end is reached before the last time.
    """

    remembered = ("_guesses", "_errors")
    finished = False

    def __init__(self, problem: Problem) -> None:
        self._problem, self._turns = problem, RotationPerStep(problem)
        self._loads = not problem.scheme.dynamic and not problem.scheme.linear
        self._times = TimesAlike(problem.model.scene, problem.model.comm)
        controlled = problem.model.scene.step_control.step_error is not None
        self._errors = StepErrors(problem) if controlled else None

    def attempt(self, t: float, dt: float) -> StepInfo:
        """Solve for the state a step ahead; the accepted state stays as it is.

        Args:
            t: Time of the accepted state, s.
            dt: Length of the step, s.

        Raises:
            ConvergenceError: If there is no solution.
        """
        self._times.check(t, dt)
        self._turns.check(t, dt)
        self._problem.prepare(t, dt)
        iterations = self._problem.solve(dt)
        self._turns.followed(dt)
        if self._loads:
            # how far off Newton's method may have gone, in parts of what is safe
            astray = max(turned(self._problem) / SAFE_TURN, iterations / SAFE_ITERATIONS)
            return StepInfo(t, dt, iterations, astray)
        error = None if self._errors is None else self._errors.estimate(dt)
        return StepInfo(t, dt, iterations, error)

    def accept(self, dt: float) -> None:
        """Make the solved state the accepted one."""
        self._problem.accept(dt)
        if self._errors is not None:
            self._errors.accept(dt)

    def forget(self, velocities: bool) -> None:
        """The motion does not continue smoothly: what went before tells nothing.

        Args:
            velocities: Whether they have jumped; if not, forces or their rates have.
        """
        if velocities:
            self._problem.predictor.clear()
        if self._errors is not None:
            self._errors.forget()

    @property
    def _guesses(self) -> Predictor:
        return self._problem.predictor

    def restore(self, state: Any | None) -> None:
        """Take up states of earlier steps; with None they begin anew."""
        if state is None:
            self.forget(velocities=True)
            return
        self._guesses.restore(state["guesses"])
        self._guesses.key = self._problem.switches
        if self._errors is not None and state["errors"] is not None:
            self._errors.restore(state["errors"])


class DroppedConstraints:
    """Watches constraints that were left out as redundant: they have to hold all the same.

    Which constraints others imply follows from the velocities that they allow at the start. At a
    singular position, the change point of a parallelogram say, that is more of them than anywhere
    else: what was left out there is missing as soon as the bodies have moved.

    Args:
        problem: The functions of all bodies.
    """

    def __init__(self, problem: Problem) -> None:
        self._problem, self._comm = problem, problem.model.comm
        groups = problem.model.mechanism.groups
        # in linear statics and dynamics positions close joints to first order only
        self._watched = [
            group for group in groups if not (problem.scheme.linear or np.all(group.allowed))
        ]

    def check(self, t: float) -> None:
        """Look at the state at the end of the step just solved; collective.

        Args:
            t: Time at its start, s.

        Raises:
            ConvergenceError: If a joint opens; names it.
        """
        if not self._watched:
            return
        last, levels = self._problem.last, self._problem.levels
        worst = max(_worst(group, levels[group.name].unknown[last]) for group in self._watched)
        apart, joint, said = max(self._comm.allgather(worst)) if self._comm.size > 1 else worst
        if apart > OPENED:
            raise ConvergenceError(
                f"t = {t:g}: joint '{joint}' opens by {said}: one of its constraints "
                "was left out as redundant, which it is at the position of the start only, a "
                "singular one; begin at another position, or use joints with fewer constraints"
            )


def _worst(group: JointGroup, q: fem.Function) -> tuple[float, str, str]:
    """Largest violation of what was left out of the joints that act, on this rank."""
    return worst_of(group, np.where(group.allowed[group.nodes.item], 0.0, group.apart(q)))


def turned(problem: Problem) -> float:
    """Largest angle by which the step just solved turns a director, rad; collective.

    Args:
        problem: The functions of all bodies.
    """
    least = 1.0
    for body in problem.model.bodies:
        found, levels = body_directors(body), problem.levels[body.name]
        if found is None:
            continue
        before, now = (
            (found.reference + f.x.array[found.dofs].reshape(found.reference.shape))
            for f in (levels.q, levels.unknown[END])
        )
        least = min(least, float(np.min(np.vecdot(before, now), initial=1.0)))
    return math.acos(max(problem.model.comm.allreduce(least, op=MPI.MIN), -1.0))


class RotationPerStep:
    """Looks at drivers, driven supports, and rotations of joints before each step.

    Args:
        problem: The functions of all bodies.
    """

    def __init__(self, problem: Problem) -> None:
        self._scheme, self._comm = problem.scheme, problem.model.comm
        self._turns: list[tuple[PrescribedTurn, FixedDofs, Levels]] = [
            (fixed.turn, fixed, problem.levels[body.name])
            for body in problem.model.bodies
            for fixed in body.fixed
            if fixed.turn is not None and not problem.scheme.linear
        ]
        mechanism, scheme = problem.model.mechanism, problem.scheme
        follows = scheme.dynamic and not scheme.linear
        driven = {(c.name, c.kind) for c in mechanism.drivers.values()}
        self._free: list[tuple[CoordinateGroup, Levels, Floats]] = []
        self._names = list[str]()
        for group in mechanism.coordinate_groups:
            # of joints with several angles the mean: single directors tremble after an impact
            owners = [c.joint or c.name for c in group.coordinates]
            names = [n for n in dict.fromkeys(owners) if (n, group.kind) not in driven]
            if group.kind == "rotation" and names and follows:
                shares = [
                    [c.share * (o == n) for n in names]
                    for c, o in zip(group.coordinates, owners, strict=True)
                ]
                self._free.append((group, problem.levels[group.name], np.array(shares)))
                self._names += names

    def check(self, t: float, dt: float) -> None:
        """See whether a step can be made; collective.

        Args:
            t: Time at its start, s.
            dt: Its length, s.

        Raises:
            ConvergenceError: If something turns too far; names it, its angle and the step for it.
        """
        if self._free:
            self._follow(dt)
        for turn, fixed, levels in self._turns:
            angle = abs(float(turn.angle(t + dt)) - float(turn.angle(t)))
            if turn.unknown:
                angle = max(angle, self._inside(fixed, levels, t, dt))
            if angle >= math.pi:
                raise ConvergenceError(
                    f"{turn.who} turns by {angle:.4g} rad in a step of {dt:.3g} s; it must be less "
                    f"than pi: use dt < {dt * math.pi / angle:.2g} s if it turns steadily; a jump "
                    "of its angle no step can follow"
                )

    def _follow(self, dt: float) -> None:
        """See whether joints turn slowly enough to tell by how much; collective."""
        self._before = self._read(lambda levels: levels.q)
        self._rates = self._read(lambda levels: levels.rates["v"])
        fastest = int(np.argmax(np.abs(self._rates)))
        rate = abs(float(self._rates[fastest]))
        if rate * dt >= math.pi:
            raise ConvergenceError(
                f"joint '{self._names[fastest]}' turns by {rate * dt:.4g} rad in a step of "
                f"{dt:.3g} s; it must be less than pi: use dt < {math.pi / rate:.2g} s"
            )

    def followed(self, dt: float) -> None:
        """See whether joints have turned as they were about to; collective.

        Beyond what a scheme follows its equations have other solutions, which turn bodies back.

        Args:
            dt: Length of the step that is solved, s.

        Raises:
            ConvergenceError: If one differs by half a turn; names it.
        """
        if not self._free:
            return
        made = self._read(lambda levels: levels.unknown[END]) - self._before
        wrong = np.abs(made - dt * self._rates)
        worst = int(np.argmax(wrong))
        if wrong[worst] >= math.pi:
            raise ConvergenceError(
                f"joint '{self._names[worst]}' turns by {made[worst]:.4g} rad in a step of "
                f"{dt:.3g} s, where its rate at the start makes {dt * self._rates[worst]:.4g} rad; "
                "they must differ by less than pi: use a smaller dt"
            )

    def _read(self, function: Callable[[Levels], fem.Function]) -> Floats:
        """Values of the rotations of joints that are not driven, the same on all ranks."""
        found = []
        for group, levels, shares in self._free:
            values = function(levels).x.array[group.mixed.dofs["x"]]
            found.append(gathered(group.nodes, values) @ shares)
        return np.concatenate(found)

    def _inside(self, fixed: FixedDofs, levels: Levels, t: float, dt: float) -> float:
        """Largest angle of the sub-intervals before and after a jump, rad."""
        stage = self._scheme.dissipation()[1]
        if stage is None:
            return 0.0
        rates = {name: function.x.array[fixed.dofs] for name, function in levels.rates.items()}
        middle = self._scheme.prescribed(stage, fixed.value, t, dt, rates)
        states = [fixed.value(t), middle, fixed.value(t + dt)]
        largest = float(np.max(np.abs(np.diff(states, axis=0)), initial=0.0))
        return largest if self._comm.size == 1 else self._comm.allreduce(largest, op=MPI.MAX)
