"""Static path following: arc length of the displacements, step by iterations and by curvature.

The load factor is one more unknown, and a plane across the tangent one more equation (E. Riks, Int.
J. Solids Struct. 15 (1979) 529-551; E. Ramm, in: Nonlinear Finite Element Analysis in Structural
Mechanics, Springer 1981, 63-89). Length is measured by displacements alone: resultants and
multipliers have other units, directors follow. It is scaled such that the unloaded structure moves
by one unit of it per unit of the load factor.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import ConvergenceError, SceneError
from shellmb.restart import Restartable
from shellmb.scene import PathFollowing
from shellmb.simulate.paths.branches import (
    Branches,
    PathState,
    PointOnPath,
    limit_point,
    sense,
    turned,
)
from shellmb.simulate.paths.levels import Limit, Whole, crossings, land, locate, reached
from shellmb.simulate.problem import Problem
from shellmb.simulate.stepping import RotationPerStep, StepInfo
from shellmb.simulate.stepsize import StepSize
from shellmb.system.newton.bordered import Bordered

# Largest step, where the scene does not say: relative to the first one; or, if that is more, the
# displacement relative to the size of the scene. A column moves by `(thickness/length)^2` along its
# axis before it buckles, and by its length behind that
LARGEST, FARTHEST = 10.0, 0.05
# The first step along another branch moves as far as this, relative to the size of the scene. Next
# to the bifurcation the stiffness grows with the square of it, and is round-off to begin with
AWAY = 0.005
# a step that turns by this part of what is allowed is as long as it should be
WANTED_TURN = 0.4
# motions that begin by less than this part of what the first step moves are round-off
FLAT = 1e-6


class ArcSize(StepSize):
    """The step of a path: it follows what the last one took, up and down.

    Attributes:
        factor: What the next step is to be, relative to the last one.
        farthest: Arc length in which the structure moves as far as it may in a step.
    """

    factor: float = 1.0
    farthest: float = 0.0
    remembered = (*StepSize.remembered, "factor")

    @property
    def largest(self) -> float:
        """Largest step."""
        return self.settings.max_dt or max(LARGEST * self.nominal, self.farthest)

    def accept(self, measured: float | None, dt: float = 0.0) -> None:
        """Change the step by the factor that the last one suggests."""
        self.good += 1
        self.dt = self._within(self.factor * self.dt)

    def suggest(self, iterations: int, turned: float, path: PathFollowing) -> None:
        """Take down what the last step took.

        Args:
            iterations: Newton iterations.
            turned: Angle between the tangents at its ends, rad.
            path: What is wanted.
        """
        by_iterations = math.sqrt(path.iterations / max(iterations, 1))
        by_turn = WANTED_TURN * math.radians(path.turn_deg) / max(turned, 1e-12)
        self.factor = self._moderate(min(by_iterations, by_turn))


@dataclass
class _Arrived:
    """A solution a step ahead.

    Args:
        state: What is known of it.
        iterations: Newton iterations.
        turned: Angle between the tangents, rad.
        dt: Arc length.
    """

    state: PathState
    iterations: int
    turned: float
    dt: float


class PathSteps(Restartable):
    """Steps along a path of equilibria.

    Args:
        problem: The system of one step.
        path: Settings of the scene.
        size: The step size.

    Attributes:
        size: The step size.
        here: The accepted state.
        scale: Displacement of a unit of arc length, m.
        unstable: Number of directions in which the accepted state is unstable; None where the
            stiffness matrix is not symmetric, or nobody asked.
        bordered: Newton's method with the load factor as one more unknown.
        moving: Weights of displacements among owned unknowns.
        branches: What is passed on the path.
        points: Limit points and bifurcations passed so far.
        limit: The limit point in the step last solved for; None: there is none, or not found.
        unsure: Load factors of limit points that were not found; theirs is that of a cubic.
    """

    remembered = ("here", "scale", "unstable", "unsure", "branches")

    def __init__(self, problem: Problem, path: PathFollowing, size: ArcSize) -> None:
        self._problem, self._path, self.size = problem, path, size
        # whether something prescribed depends on the load factor
        moving = any(fixed.moving for body in problem.model.bodies for fixed in body.fixed)
        self._given = any(problem.model.comm.allgather(moving))
        follow = problem.follow_given if self._given else None
        self.bordered = Bordered(problem.iteration, self._set_factor, follow)
        self._turns = RotationPerStep(problem)
        self.moving = self._displacements()
        self.branches = Branches(problem, self.bordered, self.moving, path)
        self.points = self.branches.points
        self._next: _Arrived
        self._cut = False
        self.limit: Limit | None = None
        self.unsure: list[float] = []
        self.scale = 0.0
        problem.load_factor = 0.0
        # the functions hold the unloaded state
        self.here = self._look(0.0, None, 0.0)
        self.unstable = self.here.negative
        size.farthest = FARTHEST * problem.model.length / self.scale

    @property
    def factor(self) -> float:
        """Load factor of the accepted state."""
        return self.here.factor

    @property
    def ahead(self) -> PathState:
        """The state last solved for."""
        return self._next.state

    @cached_property
    def whole(self) -> Whole:
        """All unknowns in one matrix, at states that are looked at more closely."""
        return Whole(self.bordered)

    @property
    def turned(self) -> bool:
        """Decide whether the load turns round in the solved step, at a limit point."""
        return self.bifurcation is None and turned(self.here, self.ahead)

    @property
    def bifurcation(self) -> PointOnPath | None:
        """The bifurcation at which the solved step ends; None: it ends elsewhere."""
        return self.branches.found

    @property
    def normal(self) -> Floats:
        """Normal of the plane in which the step from the accepted state ends."""
        return np.asarray(self.moving * self.here.tangent / self.scale**2)

    @property
    def on_level(self) -> bool:
        """Decide whether the solved step ends at a load level."""
        return any(reached(self.ahead.factor, level) for level in self._levels)

    @property
    def _levels(self) -> tuple[float, ...]:
        """Load factors at which steps end."""
        path = self._path
        return path.load_levels if path.load_end is None else (*path.load_levels, path.load_end)

    def follow(self, state: PathState, scale: float, points: Sequence[PointOnPath]) -> None:
        """Be at a state that another path tells.

        Args:
            state: The state.
            scale: Displacement of a unit of arc length, m.
            points: Limit points and bifurcations found.
        """
        self.here, self.scale, self.unstable = state, scale, state.negative
        self.points.extend(points)
        self._problem.load_factor = state.factor

    def _displacements(self) -> Floats:
        """One over the number of nodes at unknown displacements on this rank, else zero."""
        system = self._problem.system
        marks = np.zeros(system.numbering.owned)
        for body in self._problem.model.bodies:
            if "u" in body.kinematic:
                k = self._problem.number(body.name, self._problem.last)
                marks[system.numbering.own(k, body.mixed.dofs["u"])] = 1.0
        number = system.comm.allreduce(int(np.sum(marks)))
        return np.asarray(marks * 3.0 / max(number, 1))

    def _set_factor(self, factor: float) -> None:
        """Give all loads another factor."""
        self._problem.load_factor = factor
        for stages in self._problem.forms.values():
            for forms in stages.values():
                for sample in forms.samples:
                    if sample.loads is not None:
                        sample.loads.update(lambda function: factor)
        self._problem.system.residuals.refresh()

    def _unit(self, change: Floats) -> Floats:
        """A change of unit arc length."""
        return change * (self.scale / self.branches.size_of(change))

    def moved(self, vector: Floats, change: Floats) -> float:
        """Part of a change along a vector of unit displacement."""
        return self.bordered.dot(self.moving * vector, change)

    def _dot(self, a: Floats, b: Floats) -> float:
        """Scalar product of changes in terms of arc length."""
        return self.bordered.dot(self.moving * a, b) / self.scale**2

    def _angle(self, a: Floats, b: Floats) -> float:
        """Angle between two directions, whichever way they point, rad."""
        sizes = self.branches.size_of(a) * self.branches.size_of(b)
        cosine = self.bordered.dot(self.moving * a, b) / sizes if sizes > 0 else math.nan
        return math.acos(min(abs(cosine), 1.0)) if math.isfinite(cosine) else math.pi

    def _look(self, factor: float, before: Floats | None, t: float) -> PathState:
        """Find what is known of the state that the functions hold: tangent and stability.

        Args:
            factor: Its load factor.
            before: Direction in which the path went; None at the start, where the load grows.
            t: Its arc length.

        Raises:
            ConvergenceError: If the stiffness matrix is singular.
            SceneError: If the loads move nothing.
        """
        self.bordered.take_load(factor)
        negative = self.branches.negative()
        if negative is None:
            self.bordered.factorise()
        # else, of thin bodies the reduced matrix does not know where a flat branch goes, and the
        # factors of the count are at hand
        derivative = self.bordered.derivative(self.branches.apply_inverse)
        if before is None and factor == 0.0 and self._given:
            derivative = self._begun(derivative)
        sharp = math.radians(self._path.turn_deg)
        if before is not None and self._angle(before, derivative) > sharp:
            # next to a bifurcation round-off along the null vector swamps the path's own direction;
            # or that is the null vector, where a branch comes back to the path that it left
            null = self.branches.null_vector()
            if self._angle(before, null) < sharp:
                along = self._unit(null) * math.copysign(1.0, self._dot(null, before))
                return PathState(t, factor, along, 0.0, negative, self.here.sense)
            derivative = derivative - self.moved(null, derivative) * null
        size = self.branches.size_of(derivative)
        if not size > 0:
            raise SceneError(
                "path following: the loads move nothing; give a load that does, or what is "
                "prescribed a function that grows from the load factor 0 on"
            )
        self.scale = self.scale or size
        rate = self.scale / size
        if before is not None and self._dot(derivative, before) < 0:
            rate = -rate
        grows = 1 if before is None else sense(factor, rate, t - self.here.t, self.here.sense)
        return PathState(t, factor, derivative * rate, rate, negative, grows)

    def _begun(self, derivative: Floats) -> Floats:
        """Derivative at the start, or the way of the first step where it leads there too sharply.

        What is prescribed as `0.01 t^2` does not move at first, and yet leads along a path.

        Args:
            derivative: The derivative there.
        """
        begun, whole = (self._way(over) for over in (self.size.nominal, self._path.load_end or 1.0))
        size, far = self.branches.size_of(derivative), self.branches.size_of(begun)
        sharp = far > 0 and self._angle(derivative, begun) > math.radians(self._path.turn_deg)
        if size > far or not (sharp or size < FLAT * far):
            return derivative
        # a structure that stays linear reaches its full load at time 1
        self.scale = self.branches.size_of(whole)
        return begun

    def _way(self, over: float) -> Floats:
        """Derivative at the start, prescribed values told by what they do over a change of load."""
        self.bordered.take_load(0.0, over)
        return self.bordered.derivative(self.branches.apply_inverse)

    def _arrive(self, t: float, dt: float) -> _Arrived:
        """Solve for the state at the arc length `dt` behind the accepted one.

        Raises:
            ConvergenceError: If there is none near by, or the path turns too sharply.
        """
        problem, start = self._problem, self.here
        problem.load_factor = self.factor
        problem.prepare(t, dt)
        problem.start_from_state()
        system = problem.system
        system.gather()
        x = np.array(system.x.array_r)
        normal = self.normal
        given = self.bordered.dot(normal, x) + dt
        self.bordered.move(dt * start.tangent)
        factor = self.factor + dt * start.rate
        iterations, factor = self.bordered.solve(factor, normal, given)
        self._turns.check(self.factor, factor - self.factor)
        # the secant tells better than the tangent at the start where the path goes on
        state = self._look(factor, system.x.array_r - x, t + dt)
        cosine = self._dot(start.tangent, state.tangent)
        turned = math.acos(min(max(cosine, -1.0), 1.0))
        if not turned <= math.radians(self._path.turn_deg):
            raise ConvergenceError(
                f"the path turns by {math.degrees(turned):.0f} degrees in one step; try a smaller "
                "first step, or a larger turn_deg"
            )
        return _Arrived(state, iterations, turned, dt)

    @property
    def finished(self) -> bool:
        """Decide whether the load factor is the scene's last one."""
        end = self._path.load_end
        return end is not None and reached(self.factor, end)

    def attempt(self, t: float, dt: float) -> StepInfo:
        """Solve for the state at the arc length `t + dt`.

        Or before it, at a load level or a bifurcation.

        Raises:
            ConvergenceError: If there is none near by, or the path turns too sharply.
        """
        iterations = 0

        def shorter(length: float) -> PathState:
            nonlocal iterations
            self._next = self._arrive(t, length)
            iterations += self._next.iterations
            return self._next.state

        try:
            end = shorter(dt)
            found = crossings(self.here, end, self._levels)
            # the load may turn round before the first of them
            if found and not any(land(self.here, end, crossing, shorter) for crossing in found):
                shorter(end.t - self.here.t)
        except ConvergenceError as error:
            raise self._turning_given(error, dt) from error
        self._next.state = self.branches.sure(self.here, self._next.state)
        if self.branches.passed(self.here, self._next.state):
            self.branches.locate(self.here, self._next.state, shorter)
        self._cut = self._next.dt < dt
        self.limit = self._locate_limit() if self.turned else None
        return StepInfo(t, self._next.dt, iterations)

    def _turning_given(self, error: ConvergenceError, dt: float) -> ConvergenceError:
        """Say that a step failed where what is prescribed turns round, if it does there."""
        if not self._given:
            return error
        # along a parabola twice as far as the tangent tells, where the step would just end
        ends = self.factor, self.factor + 2.5 * dt * self.here.rate
        here, there = (self._problem.follow_given(factor) for factor in ends)
        if self.bordered.dot(here, there) >= 0:
            return error
        return error.reworded(
            f"a prescribed motion reverses between the load factors {ends[0]:.4g} and "
            f"{ends[1]:.4g}, where the path, parametrised by displacements, ends; end it earlier "
            f"with load_end, or prescribe a motion without reversal ({error})"
        )

    def _locate_limit(self) -> Limit | None:
        """Locate where the load turns round in the step solved for, and come back to its end."""
        problem, system = self._problem, self._problem.system
        held = [problem.state(body.name).x.array for body in problem.model.bodies]
        system.gather()
        unknowns = system.global_values(held), np.array(system.x.array_r)
        ends, metric = (self.here, self.ahead), self.moving / self.scale**2
        try:
            found = locate(ends, unknowns, metric, self.whole)
        except ConvergenceError:
            found = None
        self.bordered.hold(unknowns[1], self.ahead.factor)
        return found

    def accept(self, dt: float) -> None:
        """Go there; at a bifurcation choose the branch."""
        found = self._next
        self._problem.accept(dt)
        if self._cut:
            # it ended early, which says nothing about the next one
            self.size.factor = 1.0
        else:
            self.size.suggest(found.iterations, found.turned, self._path)
        if self.turned and self.limit is None:
            self.unsure.append(limit_point(self.here, found.state).load_factor)
        factor = None if self.limit is None else self.limit.factor
        state, direction = self.branches.accept(self.here, found.state, factor)
        if direction is not None:
            # along the null vector the load does not change, to first order
            state = PathState(state.t, state.factor, self._unit(direction), 0.0, None)
            self.size.factor = max(1.0, AWAY / FARTHEST * self.size.farthest / self.size.dt)
        self.here = state
        self.unstable = found.state.negative

    def forget(self, velocities: bool) -> None:
        """Forget the past."""

    def restore(self, state: Any) -> None:
        """Take up a saved state."""
        super().restore(state)
        self.size.farthest = FARTHEST * self._problem.model.length / self.scale
        self._problem.load_factor = self.factor
