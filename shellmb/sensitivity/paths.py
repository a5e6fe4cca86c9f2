"""Tangents of static paths: the derivative of each point of a path by a parameter.

A point of a path is its unknowns `u` and its load factor `f`. With the residual `R(u, f; p)` and
the plane in which the step ends, `n.(u - u0) = h`,

    J u' + R_f f' = -dR/dp,        n.(u' - u0') = -n'.(u - u0)

where `h`, the arc length of the step, is that of the run, and `n` belongs to the tangent at its
start, whose derivative follows from `J v = -R_f`:

    J v' = -d/dp (J(u, f; p) v + R_f(u, f; p))        with `v` held.

Both right-hand sides are differences of the scenes beside the run. The equations are solved in all
unknowns: multipliers of directors are part of the tangent.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import ConvergenceError
from shellmb.sensitivity.parameters import STEP
from shellmb.sensitivity.perturbed_run import PerturbedRun
from shellmb.sensitivity.tangent import KINK, MOST, STALLED, TOLERANCE, USELESS, Pair, Tangents
from shellmb.simulate.paths.arclength import PathSteps
from shellmb.simulate.paths.branches import PathState
from shellmb.simulate.simulation import Simulation

# cosine between the tangent of the run and that of the equations, below which the former is that
# of a branch or of a null vector: its plane is held
ALONG = 1.0 - 1e-6
# rate of the load by the arc length, relative to that at the start, below which a load factor that
# is held has no derivative
FLAT = 1e-6
# change of the load rate within the distance of the sides, relative to it, beyond which derivatives
# at a given load are named: their error is the square of it
NEAR = 1e-2
# part of the residual's derivative along a null vector, relative to both, beyond which the
# parameter is an imperfection; null vectors are found beside the bifurcation, and 3e-6 was seen by
# symmetry
BREAKS = 1e-4
# both sides: above and below
SIGNS = 1.0, -1.0
# relative distance for derivatives along the path, in steps
APART = 1e-3


class PathTangents(Tangents):
    """Finds derivatives of the points of a path, as an observer of the run.

    Args:
        make: Makes the scenes beside the run.
        at_load: Whether derivatives are those at the load factors of the run.
    """

    def __init__(self, make: Callable[[Simulation], Sequence[Pair]], at_load: bool = False) -> None:
        super().__init__(make)
        self._at_load = at_load
        self._ahead: dict[str, tuple[PathState, PathState]] = {}
        # null vector, at a bifurcation
        self._null: Floats | None = None
        # half the difference of the load factors of bifurcations at both sides
        self._slope: dict[str, float] = {}
        self._scales: dict[int, float] = {}

    def start(self, simulation: Simulation) -> None:
        """Start both sides with tangents that mirror each other about that of the run."""
        super().start(simulation)
        system = simulation.problem.system
        self._whole = _path(simulation).whole
        # sum of the residuals at both sides
        self._sum = np.zeros(0)
        self._moved = _path(simulation).moved
        self._begun = simulation.step > 0
        for pair in self.pairs:
            for side in pair.sides:
                self._scales[id(side)] = _path(side.simulation).scale
        if self._begun:
            # both sides go on with what they have saved
            return
        path = _path(simulation)
        system.gather()
        self._linearise(simulation, np.array(system.x.array_r), path.here.factor)
        for pair in self.pairs:
            for side in pair.sides:
                side.begin(simulation.t, simulation.size.dt)
            d = _between(pair)[1]
            self._follow(pair, path, self._look(pair, d, path.here, 0.0, 0.0, path))
        self._begun = True

    def solved(self, simulation: Simulation) -> None:
        """Find the derivatives of the point that the run has just solved for."""
        path = _path(simulation)
        u = np.array(simulation.problem.system.x.array_r)
        self._null = None
        if path.turned:
            self._differentiate_limit(simulation, u)
        if path.bifurcation is not None:
            self._null = path.branches.null_vector()
        self._linearise(simulation, u, path.ahead.factor)
        super().solved(simulation)

    def _linearise(self, simulation: Simulation, u: Floats, factor: float) -> None:
        """Factorise at a state of the run, and find how it moves with the load factor."""
        self._u, self._fixed = u, simulation.problem.system.fixed
        _, v = self._whole.linearise(u, factor)
        self._v = self._without_null(v)

    def _differentiate_limit(self, simulation: Simulation, u: Floats) -> None:
        """Find how the load of the limit point in the solved step depends on each parameter.

        It moves by `f' = -(x.dR/dp) / (x.dR/df)`, `x` being the left null vector of the Jacobian
        there, whose factors are those that the run made last: how the point moves does not matter.
        """
        path, last = _path(simulation), simulation.solved
        found = path.limit
        normal, dot = path.normal, path.bordered.dot
        if found is not None:
            self._u = found.unknowns
        for pair in self.pairs:
            name = pair.parameter.name
            self._slope[name] = math.nan
            if found is None:
                self.said.append(
                    f"the limit point near the load factor {path.ahead.factor:g} was not found, "
                    f"and so no derivative of its load by '{name}'; use smaller steps"
                )
                continue
            for side in pair.sides:
                side.begin(last.t, last.dt)
                side.take_pairs(simulation)
            rest = self._difference(pair, np.zeros(len(u)), found.factor, 0.0)
            self._slope[name] = dot(normal, self._inverse(rest)) / dot(normal, found.along)

    def _inverse(self, b: Floats) -> Floats:
        """`J^-1 b` with all unknowns."""
        return self._without_null(self._whole.inverse(b))

    def _without_null(self, change: Floats) -> Floats:
        """A change without the null vector at a bifurcation.

        This part is round-off there, over an eigenvalue next to zero.
        """
        null = self._null
        return change if null is None else change - self._moved(null, change) * null

    def _solve(self, simulation: Simulation, pairs: Sequence[Pair]) -> list[Floats]:
        """Half the differences of the unknowns at both sides of each parameter."""
        return [self._solve_one(simulation, pair, self._now) for pair in pairs]

    def _solve_one(self, simulation: Simulation, pair: Pair, u: Floats) -> Floats:
        """Half the difference of the unknowns at both sides."""
        path, name = _path(simulation), pair.parameter.name
        ahead, dot = path.ahead, path.bordered.dot
        u_start, d_start = _between(pair)
        above, below = (_path(side.simulation) for side in pair.sides)
        normal, tilt = path.normal, 0.5 * (above.normal - below.normal)
        held, size = path.on_level or self._holds(ahead), path.branches.size_of
        # derivatives smaller than this are round-off of displacements
        least = STEP * size(u)
        d, delta, now = STEP * pair.guess(simulation.solved.dt), 0.0, np.inf
        for _ in range(MOST):
            a = self._inverse(self._difference(pair, d, ahead.factor, delta))
            if held:
                factor = -delta
            else:
                missing = dot(normal, d_start - d + a) - dot(tilt, u - u_start)
                factor = missing / dot(normal, self._v)
            change = factor * self._v - a
            d, delta = d + change, delta + factor
            self.iterations += 1
            before, now = now, size(change) / max(size(d), least)
            if now <= TOLERANCE or not now < np.inf or STALLED * before < now <= USELESS:
                break
        if not now <= USELESS:
            raise ConvergenceError(
                f"sensitivities: the derivatives by '{name}' do not converge at the load factor "
                f"{ahead.factor:g} (last relative change {now:.1e}); use smaller steps"
            )
        if path.bifurcation is not None:
            shift = self._shift(pair, path, d, delta)
            self._slope[name] = delta + shift * ahead.rate
            if math.isfinite(shift) and not held:
                d, delta = d + shift * ahead.tangent, delta + shift * ahead.rate
        pair.both.d[:] = d
        pair.both.keep()
        d = pair.both.d
        t = 0.5 * (above.here.t - below.here.t)
        t += dot(normal, d - d_start) + dot(tilt, u - u_start)
        self._ahead[name] = states = self._look(pair, d, ahead, t, delta, path)
        curved = abs(0.5 * (states[0].rate - states[1].rate) / ahead.rate) if ahead.rate else 0.0
        if held and curved > NEAR:
            self.said.append(
                f"the load factor {ahead.factor:g} is next to a limit point: derivatives by "
                f"'{name}' at that load are known to {curved**2:.0e} of them"
            )
        if self._kinked:
            same = self._inverse(self._sum)
            same = same - (dot(normal, same) / dot(normal, self._v)) * self._v
            if size(same) > KINK * max(size(d), least):
                pair.kinks.append(simulation.t)
        return d / STEP

    def _holds(self, state: PathState) -> bool:
        """Decide whether the load factor of a point is fixed."""
        if self._at_load and abs(state.rate) < FLAT:
            self.said.append(
                f"the load stands still at the load factor {state.factor:g}: derivatives at that "
                "load do not exist; there they are at the same arc length"
            )
        return self._at_load and abs(state.rate) >= FLAT

    def _difference(self, pair: Pair, d: Floats, factor: float, delta: float) -> Floats:
        """Half the difference of the residuals at both sides."""
        above, below = (
            _path(side.simulation).bordered.hold(self._u + sign * d, factor + sign * delta)
            for side, sign in zip(pair.sides, SIGNS, strict=True)
        )
        return np.asarray(0.5 * (above - below))

    def _look(
        self, pair: Pair, d: Floats, state: PathState, t: float, delta: float, path: PathSteps
    ) -> tuple[PathState, PathState]:
        """States of both sides on their paths.

        Args:
            pair: The sides.
            d: Half the difference of their unknowns.
            state: That of the run.
            t: Half the difference of their arc lengths.
            delta: Half the difference of their load factors.
            path: The path of the run.
        """
        v, dot, weight = self._v, path.bordered.dot, path.moving
        sides = [_path(side.simulation) for side in pair.sides]
        (rest, g, whole), (rest_below, g_below, whole_below) = (
            side.bordered.along(self._u + sign * d, state.factor + sign * delta, v)
            for side, sign in zip(sides, SIGNS, strict=True)
        )
        self._sum = rest + rest_below
        change = 0.5 * (whole - whole_below)
        # what is given moves the rest
        given = np.zeros(len(v))
        given[self._fixed] = change[self._fixed]
        change = given - self._inverse(0.5 * (g - g_below))
        square = dot(weight * v, v)
        cosine = dot(weight * state.tangent, v) / (path.scale * math.sqrt(square))
        # relative changes: of the displacement for a change of the load, and of what measures arc
        # lengths, which is that displacement in the unloaded state
        moves = dot(weight * v, change) / square
        scaled = moves
        if self._begun:
            scaled = 0.5 * (sides[0].scale - sides[1].scale) / path.scale
        tangent, rate = scaled * state.tangent, scaled * state.rate
        if abs(cosine) > ALONG:
            tangent = (scaled - moves) * state.tangent + state.rate * change
            rate = (scaled - moves) * state.rate
        found = []
        for side, sign in zip(pair.sides, SIGNS, strict=True):
            self._scales[id(side)] = path.scale * (1.0 + sign * scaled)
            found.append(
                replace(
                    state,
                    t=state.t + sign * t,
                    factor=state.factor + sign * delta,
                    tangent=state.tangent + sign * tangent,
                    rate=state.rate + sign * rate,
                )
            )
        return found[0], found[1]

    def _shift(self, pair: Pair, path: PathSteps, d: Floats, delta: float) -> float:
        """Half the difference of the arc lengths to the bifurcations at both sides.

        The eigenvalue next to zero, `x.Kx`, is zero on both paths. NaN where there is none.
        """
        point, state, x = path.bifurcation, path.ahead, self._null
        assert point is not None and x is not None
        name, none = pair.parameter.name, np.zeros(len(d))
        where = f"the bifurcation at the load factor {point.load_factor:g}"
        if point.before == point.after:
            self.said.append(
                f"{where}, where a branch comes back, has no derivative here; differentiate the "
                "path that it comes back to, with branches='detect'"
            )
            return math.nan
        rest = self._difference(pair, none, state.factor, 0.0)
        dot = path.bordered.dot
        if abs(dot(x, rest)) > BREAKS * math.sqrt(dot(x, x) * dot(rest, rest)):
            self.said.append(
                f"{where} has no derivative by '{name}', which is an imperfection: paths beside it "
                "have a limit point there, or none; compare runs (`sweep`)"
            )
            return math.nan
        step = APART * (state.t - path.here.t)

        def value(side: PerturbedRun, sign: float, along: float) -> float:
            bordered = _path(side.simulation).bordered
            unknowns = self._u + sign * d + along * state.tangent
            bordered.hold(unknowns, state.factor + sign * delta + along * state.rate)
            return dot(x, bordered.multiply(x))

        signs = list(zip(pair.sides, SIGNS, strict=True))
        changed = 0.5 * sum(sign * value(side, sign, 0.0) for side, sign in signs)
        slopes = [value(*both, step) - value(*both, -step) for both in signs]
        return -changed / (sum(slopes) / (4.0 * step))

    def accepted(self, simulation: Simulation) -> None:
        """Go to the point, and past what lies between."""
        path = _path(simulation)
        for pair in self.pairs:
            self._follow(pair, path, self._ahead[pair.parameter.name])
        super().accepted(simulation)

    def _follow(self, pair: Pair, path: PathSteps, states: Sequence[PathState]) -> None:
        """Be at the states of both sides, which count what the run counts."""
        here, slope = path.here, self._slope.get(pair.parameter.name, 0.0)
        for side, state, sign in zip(pair.sides, states, SIGNS, strict=True):
            own, scale = _path(side.simulation), self._scales[id(side)]
            points = [
                replace(p, t=p.t + state.t - here.t, load_factor=p.load_factor + sign * slope)
                for p in path.points[len(own.points) :]
            ]
            if points and points[-1].switched:
                # the branch begins along the null vector
                tangent = here.tangent * (scale / path.scale)
                state = replace(state, tangent=tangent, rate=here.rate)
            own.follow(replace(state, negative=here.negative, sense=here.sense), scale, points)

    @property
    def points(self) -> dict[str, list[float | None]]:
        """Derivatives of the load factors of limit points and bifurcations by each parameter."""
        found: dict[str, list[float | None]] = {}
        for pair in self.pairs:
            both = zip(*(_path(side.simulation).points for side in pair.sides), strict=True)
            slopes = [(a.load_factor - b.load_factor) / pair.parameter.width for a, b in both]
            found[pair.parameter.name] = [s if math.isfinite(s) else None for s in slopes]
        return found


def _between(pair: Pair) -> tuple[Floats, Floats]:
    """Mean of the states at both sides before the step, and half their difference."""
    held = []
    for side in pair.sides:
        side.system.gather()
        held.append(np.array(side.system.x.array_r))
    return 0.5 * (held[0] + held[1]), 0.5 * (held[0] - held[1])


def _path(simulation: Simulation) -> PathSteps:
    """The path that it follows."""
    assert simulation.path is not None
    return simulation.path
