"""Tangents: the derivatives of each step of a run, found beside it while it runs.

With the residual `R(u; s, p)` of a step, `u` being its unknowns, `s` the state at its start and `p`
a parameter, the derivatives `s' = ds/dp` and `u' = du/dp` obey

    J u' = -[R(u; s + eps s', p + eps) - R(u; s - eps s', p - eps)] / (2 eps),   J = dR/du

and the state at the end is that which the scheme makes of both. The residuals are those of two
scenes beside the run (`PerturbedRun`): constants, loads and positions differ, kernels do not.
Nothing has to be differentiated by hand, so that all that a residual may hold has derivatives.

Factors of `J` that the run has may be those of an earlier state. So the equation is solved by
iteration, `u'` being moved within the differences, too: what is left contracts as the run's own
iteration does. Directors are brought back to their constraints at both sides before each residual,
finitely; the difference is the derivative of that retraction.
"""

import math
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import ConvergenceError
from shellmb.observers.files.checkpoint import Checkpoint
from shellmb.sensitivity.events import Corners, check_begun, ends
from shellmb.sensitivity.parameters import STEP, Parameter
from shellmb.sensitivity.perturbed_run import PerturbedRun, check_alike
from shellmb.simulate.simulation import BaseObserver, Simulation
from shellmb.system.direct.linear import Linear
from shellmb.system.direct.solver import Purpose
from shellmb.system.newton.iteration import Iteration
from shellmb.system.two_sided import Kind, Sizes, two_sided

# change of derivatives relative to them at which the iteration ends if it goes on contracting.
# Errors of steps add up: with `newton="auto"` columns are off by up to 3e-7 of the derivative after
# 200 steps (6x2 elements, EP, EP4), and by 6e-6 with 1e-8
TOLERANCE = 1e-9
# and beyond which derivatives are no good where it ends without progress
USELESS = 1e-5
# with old factors both sides are evaluated once, when the derivatives will change by so little, or
# after so many iterations: before and after that one side tells the difference, to `STEP` of it
NEAR, ROUGH = 1e-3, 3
# iterations in all, and those that are left with old factors beyond which new ones are made, if
# these do not cost more: they take two
MOST, PATIENCE, AFRESH = 30, 12.0, 2.0
# contraction that is none any more
STALLED = 0.5
# updates up to so many times those that round-off has left before are round-off, too
ALIKE = 2.0
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
        past: Derivatives of the last two steps, the last one first, each with the length of its
            step, s.
        contraction: Last one that was measured.
        floor: Last relative update that was round-off.
        kinks: Times of steps at which both sides do not mirror each other, s.
        both: Unknowns at both sides, from `begin` on.
        vectors: Right-hand side of the next update, and place for it.
        corners: Looks for corners of functions of time.
    """

    parameter: Parameter
    above: PerturbedRun
    below: PerturbedRun
    past: list[tuple[Floats, float]] = field(default_factory=list)
    contraction: float = 1.0
    floor: float = 0.0
    kinks: list[float] = field(default_factory=list)
    corners: Corners = field(init=False)

    def begin(self, run: Simulation, u: Floats, sizes: Sizes) -> None:
        """Take the unknowns of the run, whose values change, and how their sizes are compared."""
        x = run.problem.system.x
        self.both = two_sided(self.sides, u, sizes, STEP)
        self.vectors = x.duplicate(), x.duplicate()
        simulations = run, *(side.simulation for side in self.sides)
        self._live = [*zip(*(s.live().values() for s in simulations), strict=True)]

    def guess(self, dt: float) -> Floats:
        """Derivatives of the unknowns at the end of a step, along a line through those before.

        Derivatives of motions are so known to a tenth. Those of forces are not at all, as they
        vibrate, whatever the degree: the degree that did best so far saves no iteration beside
        this one (EP, ED, EP4 with 6x2 elements; with 32x32 it takes 4.85 in place of 4.7 of EP).

        Args:
            dt: Its length, s.
        """
        if not self.past:
            return np.zeros(len(self.both.d))
        (last, length), (before, _) = self.past[0], self.past[-1]
        return np.asarray(last + (dt / length) * (last - before))

    @property
    def kinked(self) -> str:
        """Warning about the `kinks`."""
        first, more = self.kinks[0], len(self.kinks) - 1
        return (
            f"the motion has a kink in '{self.parameter.name}' at t = {first:g}"
            + (f" and in {more} more steps" if more else "")
            + ": contact, a stop or friction changes within the distance of the differences; "
            "derivatives after it are those of one side at best"
        )

    def centre(self) -> None:
        """Move the states of both sides so that their mean is the state of the run."""
        for own, above, below in self._live:
            half = 0.5 * (above - below)
            np.add(own, half, out=above)
            np.subtract(own, half, out=below)

    @cached_property
    def sides(self) -> tuple[PerturbedRun, PerturbedRun]:
        """Both of them."""
        return self.above, self.below


class Tangents(BaseObserver):
    """Finds derivatives step by step, as an observer of the run.

    Unknowns at both sides are `u + d` and `u - d`; the derivative is `d` over half the distance of
    the values, so that `d` is as small as the step whatever the units of the parameter.

    Args:
        make: Makes the scenes beside the run.

    Attributes:
        pairs: They, as soon as the run begins.
        iterations: Number of iterations so far.
        said: Warnings about what has no derivative.
    """

    def __init__(self, make: Callable[[Simulation], Sequence[Pair]]) -> None:
        self._make = make
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
            scenes = pair.above.simulation.scene, pair.below.simulation.scene
            pair.corners = Corners(simulation, pair.parameter, scenes)
        system, scene = simulation.problem.system, simulation.scene
        self._kinked = bool(scene.contacts or scene.force_elements or scene.controllers)
        # lengths and angles of directors have multipliers on which nothing that is found depends
        parts = (part for body in simulation.model.bodies for part in body.parts)
        sizes = Sizes(system, frozenset(part.title for part in parts if part.name == "lam"))
        self._now = np.array(system.x.array_r)
        for pair in self.pairs:
            for side in pair.sides:
                check_alike(simulation, side.simulation, pair.parameter.name)
            pair.begin(simulation, self._now, sizes)
            pair.centre()
            for side in pair.sides:
                side.start()

    @property
    def _saved(self) -> Iterator[tuple[Checkpoint, Simulation]]:
        """States of both sides of all pairs that are saved, with their simulations."""
        sides = (side for pair in self.pairs for side in pair.sides)
        return ((side.saved, side.simulation) for side in sides if side.saved is not None)

    def solved(self, simulation: Simulation) -> None:
        """Find the derivatives of the step that the run has just solved."""
        step, others = simulation.solved, []
        self._now[:] = simulation.problem.system.x.array_r
        for pair in self.pairs:
            self.said += pair.corners.met(step.t, step.dt)
            for side in pair.sides:
                side.begin(step.t, step.dt)
                side.take_pairs(simulation)
            if simulation.control.watches and self._between_events(simulation, pair):
                continue
            others.append(pair)
        for pair, found in zip(others, self._solve(simulation, others), strict=True):
            pair.past = [(found, step.dt), *pair.past[:1]]
            for side in pair.sides:
                side.solved(step)

    def _between_events(self, simulation: Simulation, pair: Pair) -> bool:
        """Take a step whose length depends on the parameter; whether it does."""
        if simulation.step == 0:
            check_begun(simulation, pair.sides, pair.parameter.name)
        if not (simulation.control.crossed or pair.above.since):
            return False
        step, kinks = simulation.solved, len(pair.kinks)

        def prepare(until: float) -> None:
            for side, later in zip(pair.sides, (until, -until), strict=True):
                side.prepare(step.t, step.dt, later)
                side.take_pairs(simulation)

        def solve(until: float) -> Floats:
            prepare(until)
            del pair.kinks[kinks:]
            # that of a step of another length tells nothing
            pair.contraction = 1.0
            return self._solve(simulation, [pair])[0]

        found = ends(simulation, pair.sides, pair.parameter.name, solve)
        prepare(found.until)
        for side, sign, states in zip(pair.sides, (1, -1), found.states, strict=True):
            # what observers read of forces is evaluated there, too
            side.residual(self._now + sign * STEP * found.found)
            side.solved(step, states)
        self.said += found.said
        # steps of other lengths tell little
        pair.past, pair.contraction = [], 1.0
        return True

    def _solve(self, simulation: Simulation, pairs: Sequence[Pair]) -> list[Floats]:
        """Derivatives of the unknowns by some parameters, times the sizes of these.

        All parameters whose iteration goes on have their next update from one solution.
        """
        linear = simulation.problem.iteration.linear
        # factors of a state that the run has left behind; new ones serve all parameters
        self._old = simulation.problem.iteration.refresh.purpose is Purpose.LAGGED
        going = [(pair, self._updates(simulation, pair)) for pair in pairs]
        wanted = [next(updates) for _, updates in going]
        while going:
            shares = _updated(linear, [pair for pair, _ in going], wanted)
            went, going, wanted = zip(going, shares, strict=True), [], []
            for (pair, updates), share in went:
                try:
                    wanted.append(updates.send(share))
                except StopIteration:
                    continue
                going.append((pair, updates))
        return [pair.both.d / STEP for pair in pairs]

    def _updates(
        self, simulation: Simulation, pair: Pair
    ) -> Generator[tuple[Kind, bool], float, None]:
        """Iteration of one parameter: asks for updates, and gets their relative sizes."""
        both = pair.both
        last, iteration = simulation.solved, simulation.problem.iteration
        both.d[:] = STEP * pair.guess(last.dt)
        lags, now = iteration.refresh.purpose is Purpose.LAGGED, 1.0
        # old factors contract about as they did, which tells of which sides an update is; whether
        # they do is measured in each step, as a contact may have begun in it
        contraction = pair.contraction
        if not lags and contraction < 1.0:
            contraction = _by_run(iteration)
        rough, central, sizes = lags, False, list[float]()
        for count in range(1, MOST + 1):
            rough = rough and count <= ROUGH and now * min(1.0, contraction) > NEAR
            # or of both once more, where it was not
            central = central and now <= NEAR
            # beside a kink sides differ, and both are evaluated each time
            kind = Kind.ABOVE if rough else Kind.SINCE if central else Kind.BETWEEN
            if kind is Kind.BETWEEN:
                both.keep()
                central = lags and not self._kinked
            now = yield kind, True
            self.iterations += 1
            if math.isinf(now):
                raise _no_number(pair.parameter, last.t)
            sizes.append(now)
            if len(sizes) > 1:
                contraction = now / (sizes[-2] or 1.0)
                # round-off does not contract
                pair.contraction = contraction if sizes[-2] > TOLERANCE else pair.contraction
            measured = not lags or len(sizes) > 1
            if measured and now * min(1.0, contraction) <= TOLERANCE and not rough:
                break
            # every other contraction of old factors may be another one: two in a row tell
            mean = math.sqrt(now / (sizes[-3] or 1.0)) if len(sizes) > 2 else contraction
            stalled = len(sizes) > 1 and min(mean, contraction) > STALLED
            if stalled and not rough and now <= (ALIKE * pair.floor if self._old else USELESS):
                pair.floor = now
                break
            if (
                self._old
                and len(sizes) > 1
                and _left(now, mean) > min(iteration.linear.cost, PATIENCE) + AFRESH
            ):
                check_solution(iteration.linear.factorise())
                self._old, sizes = False, []
        else:
            why = self.said[-1] if self.said else "use smaller steps"
            raise ConvergenceError(
                f"sensitivities: the derivatives by '{pair.parameter.name}' do not converge at "
                f"t = {last.t:g} (last relative change {now:.1e}); {why}"
            )
        both.keep()
        if not (pair.above.forces or self._kinked):
            both.hold()
            return
        if not self._kinked:
            # what observers read of forces is evaluated
            both.rest(Kind.SUM, pair.vectors[0])
        elif (yield Kind.SUM, False) > KINK:
            pair.kinks.append(last.t)

    def accepted(self, simulation: Simulation) -> None:
        """Go to the end of the step."""
        for pair in self.pairs:
            pair.centre()
            for side in pair.sides:
                side.accepted(simulation)

    def state(self) -> dict[str, Any]:
        """Record the warnings so far; the sides take down their states, too."""
        for saved, own in self._saved:
            saved.remember(own)
        kinks = {pair.parameter.name: list(pair.kinks) for pair in self.pairs}
        return {"iterations": self.iterations, "kinks": kinks, "said": list(self.said)}

    def restore(self, state: dict[str, Any]) -> None:
        """Take up what was found so far; the scenes take up their states when they are made."""
        self.iterations, self._kinks = int(state["iterations"]), state["kinks"]
        self.said = list(state["said"])

    def write(self) -> None:
        """Write the states of both sides that were taken down last."""
        for saved, _ in self._saved:
            saved.write()

    def sealed(self, state: Mapping[str, Any]) -> dict[str, Any]:
        """The saved state; the scenes beside the run have files of their own."""
        return dict(state)

    def finish(self, simulation: Simulation, error: BaseException | None) -> None:
        """End with the run."""
        for pair in self.pairs:
            for side in pair.sides:
                side.finish(simulation, error)


def _by_run(iteration: Iteration) -> float:
    """Contraction by factors of the run that are not old, as its own last updates tell it.

    Where all is linear, they are exact. Else they are those of the state before the last update,
    from which the solution is as far as that.
    """
    if iteration.refresh.purpose is Purpose.EXACT:
        return 0.0
    return 2.0 * iteration.convergence.ratio**2


def _left(update: float, contraction: float) -> float:
    """Number of updates that are left until the derivatives are known."""
    if contraction >= 1.0:
        return math.inf
    return math.log(TOLERANCE / update) / math.log(contraction) if contraction > 0.0 else 0.0


def _no_number(parameter: Parameter, t: float) -> ConvergenceError:
    """Error of a scene beside the run whose forces are no numbers."""
    above, below = parameter.sides
    return ConvergenceError(
        f"sensitivities: a force is no finite number in the step from t = {t:g} with "
        f"'{parameter.name}' = {below:.9g} or {above:.9g}; differentiate at a value on both sides "
        "of which it is one"
    )


def _updated(
    linear: Linear, pairs: Sequence[Pair], wanted: Sequence[tuple[Kind, bool]]
) -> list[float]:
    """Update all pairs; relative sizes of the updates.

    Args:
        linear: What solves.
        pairs: They.
        wanted: Of each the difference of residuals, and whether the update is taken.
    """
    solution = linear.in_c() if all(pair.both.is_one for pair in pairs) else None
    if solution is not None:
        shares = [p.both.update(*how, solution) for p, how in zip(pairs, wanted, strict=True)]
        check_solution("the direct solver failed" if min(shares) < 0.0 else None)
        return shares
    given, found = zip(*(pair.vectors for pair in pairs), strict=True)
    for pair, rest, (kind, _) in zip(pairs, given, wanted, strict=True):
        pair.both.rest(kind, rest)
    check_solution(linear.solve_many(given, found))
    moves = zip(pairs, found, wanted, strict=True)
    return [pair.both.move(change, taken) for pair, change, (_, taken) in moves]


def check_solution(reason: str | None) -> None:
    """Raise an error if the linear solution failed."""
    if reason is not None:
        raise ConvergenceError(f"sensitivities: {reason}")
