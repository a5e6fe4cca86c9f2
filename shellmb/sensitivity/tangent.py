"""Tangents: the derivatives of each step of a run, found beside it while it runs.

With the residual `R(u; s, p)` of a step, `u` being its unknowns, `s` the state at its start and `p`
a parameter, the derivatives `s' = ds/dp` and `u' = du/dp` obey

    J u' = -[R(u; s + eps s', p + eps) - R(u; s - eps s', p - eps)] / (2 eps),   J = dR/du

and the state at the end is that which the scheme makes of both. The residuals are those of two
scenes beside the run (`Shadow`): constants, loads and positions differ, kernels do not. Nothing has
to be differentiated by hand, so that all that a residual may hold has derivatives.

Factors of `J` that the run has may be those of an earlier state. So the equation is solved by
iteration, `u'` being moved within the differences, too: what is left contracts as the run's own
iteration does. Directors are brought back to their constraints at both sides before each residual,
finitely; the difference is the derivative of that retraction.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from shellmb.errors import ConvergenceError
from shellmb.sensitivity.events import check_begun, ends
from shellmb.sensitivity.guess import Guess
from shellmb.sensitivity.parameters import STEP, Parameter
from shellmb.sensitivity.saved import SavedSide
from shellmb.sensitivity.shadow import Shadow, check_alike
from shellmb.sensitivity.sizes import Sizes
from shellmb.simulate.simulation import Silent, Simulation

Floats = npt.NDArray[np.float64]

# change of derivatives relative to them at which the iteration ends if it goes on contracting.
# Errors of steps add up: with `newton="auto"` columns are off by up to 3e-7 of the derivative after
# 200 steps (6x2 elements, EP, EP4), and by 6e-6 with 1e-8
TOLERANCE = 1e-9
# and beyond which derivatives are no good where it ends without progress
USELESS = 1e-5
# with old factors both sides are evaluated once, when the derivatives change by so little, or after
# so many iterations: before and after that one side tells the difference, to `STEP` of it
NEAR, ROUGH = 1e-3, 3
# iterations with old factors, and with new ones
PATIENCE, MOST = 12, 30
# steps for which the contraction of new factors is trusted
TRUSTED = 10
# contraction that is none any more
STALLED = 0.5
# change of the unknowns by which both sides do not mirror each other, relative to the derivative,
# beyond which the run has a kink between them: what is smooth leaves `STEP` times its curvature
KINK = 0.05


@dataclass
class Pair:
    """The scenes at both sides of a parameter.

    Args:
        parameter: The parameter.
        above: The scene with the larger value.
        below: The scene with the smaller one.

    Attributes:
        guess: Extrapolates the derivatives of the steps before.
        contraction: Last one that was measured.
        kinks: Times of steps at which both sides do not mirror each other, s.
    """

    parameter: Parameter
    above: Shadow
    below: Shadow
    guess: Guess = field(default_factory=Guess)
    contraction: float = 1.0
    kinks: list[float] = field(default_factory=list)

    @property
    def sides(self) -> tuple[Shadow, Shadow]:
        """Both of them."""
        return self.above, self.below


class Tangents(Silent):
    """Finds derivatives step by step, as an observer of the run.

    Unknowns at both sides are `u + d` and `u - d`; the derivative is `d` over half the distance of
    the values, so that `d` is as small as the step whatever the units of the parameter.

    Args:
        make: Makes the scenes beside the run.
        saved: Their states, which are written with that of the run; it grows when they are made.

    Attributes:
        pairs: They, as soon as the run begins.
        iterations: Number of iterations so far.
        said: Sentences about what has no derivative.
    """

    def __init__(
        self, make: Callable[[Simulation], Sequence[Pair]], saved: Sequence[SavedSide] = ()
    ) -> None:
        self._make, self._saved = make, saved
        self.pairs: list[Pair] = []
        self.iterations = 0
        self.said: list[str] = []
        self._kinks: dict[str, list[float]] = {}

    @property
    def points(self) -> dict[str, list[float | None]]:
        """Derivatives of load factors of special points on a path; motions have no such points."""
        return {}

    def start(self, simulation: Simulation) -> None:
        """Start both sides at states that mirror each other about that of the run."""
        self.pairs = list(self._make(simulation))
        for pair in self.pairs:
            pair.kinks += self._kinks.get(pair.parameter.name, [])
        system, scene = simulation.problem.system, simulation.scene
        self._kinked = bool(scene.contacts or scene.force_elements or scene.controllers)
        self._sizes = Sizes(system, _of_lengths(simulation))
        self._vectors = [(system.x.duplicate(), system.x.duplicate()) for _ in self.pairs]
        self._states = list(simulation.live().values())
        self._both = {
            id(pair): [list(s.simulation.live().values()) for s in pair.sides]
            for pair in self.pairs
        }
        for pair in self.pairs:
            for side in pair.sides:
                check_alike(simulation, side.simulation, pair.parameter.name)
            self._centre(pair)
            for side in pair.sides:
                side.start()

    def _centre(self, pair: Pair) -> None:
        """Move the states of both sides so that their mean is the state of the run."""
        for own, above, below in zip(self._states, *self._both[id(pair)], strict=True):
            half = 0.5 * (above - below)
            np.add(own, half, out=above)
            np.subtract(own, half, out=below)

    def solved(self, simulation: Simulation) -> None:
        """Find the derivatives of the step that the run has just solved."""
        assert simulation.last is not None
        step, unknowns = simulation.last, np.array(simulation.problem.system.x.array_r)
        others = []
        for pair in self.pairs:
            for side in pair.sides:
                side.begin(step.t, step.dt)
                side.take_pairs(simulation)
            if simulation.control.watches and self._between_events(simulation, pair, unknowns):
                continue
            others.append(pair)
        for pair, found in zip(others, self._solve(simulation, others, unknowns), strict=True):
            pair.guess.found(found, step.dt)
            for side in pair.sides:
                side.solved(step)

    def _between_events(self, simulation: Simulation, pair: Pair, u: Floats) -> bool:
        """Take a step whose length depends on the parameter; whether it does."""
        if simulation.step == 0:
            check_begun(simulation, pair)
        if not (simulation.control.crossed or pair.above.since):
            return False
        step, kinks = simulation.last, len(pair.kinks)
        assert step is not None

        def prepare(until: float) -> None:
            for side, later in zip(pair.sides, (until, -until), strict=True):
                side.prepare(step.t, step.dt, later)
                side.take_pairs(simulation)

        def solve(until: float) -> Floats:
            prepare(until)
            del pair.kinks[kinks:]
            # that of a step of another length tells nothing
            pair.contraction = 1.0
            return self._solve(simulation, [pair], u)[0]

        found = ends(simulation, pair, solve)
        prepare(found.until)
        for side, sign, states in zip(pair.sides, (1, -1), found.states, strict=True):
            # what observers read of forces is evaluated there, too
            side.residual(u + sign * STEP * found.found)
            side.solved(step, states)
        self.said += found.said
        # steps of other lengths tell little
        pair.guess, pair.contraction = Guess(), 1.0
        return True

    def _solve(self, simulation: Simulation, pairs: Sequence[Pair], u: Floats) -> list[Floats]:
        """Derivatives of the unknowns by some parameters, times the sizes of these.

        All parameters whose iteration goes on have their next update from one solution.
        """
        found = {}
        updates = [self._updates(simulation, pair, u) for pair in pairs]
        rests = {k: next(each) for k, each in enumerate(updates)}
        while rests:
            changes = self._solutions(simulation, list(rests.values()))
            for k, change in zip(list(rests), changes, strict=True):
                try:
                    rests[k] = updates[k].send(change)
                except StopIteration as end:
                    found[k] = end.value
                    del rests[k]
        return [found[k] for k in range(len(updates))]

    def _updates(
        self, simulation: Simulation, pair: Pair, u: Floats
    ) -> Generator[Floats, Floats, Floats]:
        """Iteration of one parameter: yields differences of residuals, and gets solutions."""
        assert simulation.last is not None
        linear, last = simulation.problem.iteration.linear, simulation.last
        above, below = pair.sides
        lags = simulation.problem.iteration.lags
        d = STEP * pair.guess.next(len(u), last.dt)
        # new factors contract in this step as in the last ones; once in a while that is measured
        known = 1.0 if lags or simulation.step % TRUSTED == 0 else pair.contraction
        before = now = 1.0
        central: tuple[Floats, Floats] | None = None
        contraction, rough = known, lags
        for count in range(1, MOST + 1):
            if count == PATIENCE:
                # the run itself goes on with them
                check_solution(linear.factorise())
            rough = rough and count <= ROUGH and now * min(1.0, contraction) > NEAR
            if not (rough or central):
                d = self._mirrored(pair, u, d)
            rest = above.residual(u + d)
            if rough:
                # that of the run is zero: one side tells the difference to first order
                rest = 2.0 * rest
            elif central is not None:
                # and how it changes in small updates
                rest = central[1] + 2.0 * (rest - central[0])
            else:
                one = rest.copy()
                rest = one - below.residual(u - d)
                # beside a kink sides differ
                central = (one, rest) if lags and not self._kinked else None
            change = STEP * (yield rest)
            d = d - change
            self.iterations += 1
            now = self._sizes.relative(change, d)
            if np.isinf(now):
                raise _no_number(pair.parameter, last.t)
            if count > 1:
                contraction = pair.contraction = now / before
            if now * min(1.0, contraction) <= TOLERANCE and not rough:
                break
            if not rough and contraction > STALLED and now <= USELESS:
                break
            before = now or 1.0
        else:
            raise ConvergenceError(
                f"sensitivities: the derivatives by '{pair.parameter.name}' do not converge at "
                f"t = {last.t:g} (last relative change {now:.1e}); use smaller steps",
                None,
                {},
            )
        d = self._mirrored(pair, u, d)
        if not (above.forces or self._kinked):
            above.hold(u + d)
            below.hold(u - d)
            return d / STEP
        same = above.residual(u + d) + below.residual(u - d)
        if self._kinked:
            if self._sizes.relative(STEP * (yield same), d) > KINK:
                pair.kinks.append(last.t)
        return d / STEP

    def _mirrored(self, pair: Pair, u: Floats, d: Floats) -> Floats:
        """A change of the unknowns that keeps the constraints of both sides to first order."""
        return np.asarray(0.5 * (pair.above.project(u + d) - pair.below.project(u - d)))

    def _solutions(self, simulation: Simulation, rests: Sequence[Floats]) -> list[Floats]:
        """`J^-1` times differences of residuals, over twice the relative distance of the sides."""
        given, found = zip(*self._vectors[: len(rests)], strict=True)
        for b, rest in zip(given, rests, strict=True):
            # of the size of the unknowns: what the run corrects by the way is round-off of these
            b.array[:] = rest * (0.5 / STEP)
        check_solution(simulation.problem.iteration.linear.solve_many(given, found))
        return [dx.array_r for dx in found]

    def accepted(self, simulation: Simulation) -> None:
        """Go to the end of the step."""
        for pair in self.pairs:
            self._centre(pair)
            for side in pair.sides:
                side.accepted(simulation)

    def state(self) -> dict[str, Any]:
        """Record what was said so far; the sides take down their states, too."""
        for saved in self._saved:
            saved.remember()
        kinks = {pair.parameter.name: list(pair.kinks) for pair in self.pairs}
        return {"iterations": self.iterations, "kinks": kinks, "said": list(self.said)}

    def restore(self, state: dict[str, Any]) -> None:
        """Take up what was found so far; the scenes take up their states when they are made."""
        self.iterations, self._kinks = int(state["iterations"]), state["kinks"]
        self.said = list(state["said"])

    def write(self) -> None:
        """Write the states of both sides that were taken down last."""
        for saved in self._saved:
            saved.write()

    def sealed(self, state: Mapping[str, Any]) -> dict[str, Any]:
        """The saved state; the scenes beside the run have files of their own."""
        return dict(state)

    def finish(self, simulation: Simulation, error: BaseException | None) -> None:
        """End with the run."""
        for pair in self.pairs:
            for side in pair.sides:
                side.finish(simulation, error)


def _of_lengths(simulation: Simulation) -> frozenset[str]:
    """Multipliers of lengths and angles of directors, which nothing that is found depends on."""
    bodies = simulation.model.bodies
    return frozenset(part.title for body in bodies for part in body.parts if part.name == "lam")


def _no_number(parameter: Parameter, t: float) -> ConvergenceError:
    """Error of a scene beside the run whose forces are no numbers."""
    above, below = parameter.sides
    return ConvergenceError(
        f"sensitivities: a force is no finite number in the step from t = {t:g} with "
        f"'{parameter.name}' = {below:.9g} or {above:.9g}; differentiate at a value on both sides "
        "of which it is one",
        None,
        {},
    )


def check_solution(reason: str | None) -> None:
    """Raise an error if the linear solution failed."""
    if reason is not None:
        raise ConvergenceError(f"sensitivities: {reason}", None, {})
