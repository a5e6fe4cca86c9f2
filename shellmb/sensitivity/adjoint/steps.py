"""Steps of a run as they are needed backwards, kept or solved again, and advances transposed.

Advance of a scheme after a solved step, transposed.

States and rates at the end of a step are combinations of those at its start and of the unknown
states, number by number; what jumps of velocities leave out along directors (ED) depends on the
state, node by node. The combinations are found by asking the scheme for units.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from checkpoint_schedules import (  # type: ignore[import-untyped]
    Copy,
    EndReverse,
    Forward,
    Move,
    MultistageCheckpointSchedule,
    Reverse,
)

from shellmb.arrays import Floats
from shellmb.model.body import Body
from shellmb.preprocessing.bodyfields import kinematic_dofs, resultant_dofs
from shellmb.schemes.base import END
from shellmb.sensitivity.adjoint.transposed import Covector
from shellmb.simulate.problem import Problem
from shellmb.simulate.simulation import BaseObserver, Simulation

# functions of a body by name; of all bodies by theirs
State = dict[tuple[str, str], Floats]

# states by kind and name: "q", a "rate", or an "unknown" one
States = dict[tuple[str, str], Floats]
# shares of these in a rate at the end, in the jump and in the middle state of that
Shares = dict[tuple[str, str], tuple[Floats, Floats, Floats]]


class Step(NamedTuple):
    """A solved step.

    Args:
        number: Its number, from 0.
        start: State and rates at its start, by body and name.
        unknown: Unknown states, by body and stage.
    """

    number: int
    start: State
    unknown: State


def starts(problem: Problem) -> State:
    """Arrays of the states and rates at the start of a step, which live on."""
    functions = {
        (body, name): function.x.array
        for body, levels in problem.levels.items()
        for name, function in {"q": levels.q, **levels.rates}.items()
    }
    return functions | {key: group.values for key, group in relaxing(problem).items()}


def relaxing(problem: Problem) -> dict[tuple[str, str], Any]:
    """Maxwell branches of each strain, by the keys of their strains in a state."""
    return {
        (body, f"{branches.name} {k}"): group
        for body, branches in problem.branches.items()
        for k, group in enumerate(branches)
    }


def unknowns(problem: Problem) -> State:
    """Arrays of the unknown states, which live on."""
    return {
        (body, stage): function.x.array
        for body, levels in problem.levels.items()
        for stage, function in levels.unknown.items()
    }


def copied(state: State) -> State:
    """A copy."""
    return {key: array.copy() for key, array in state.items()}


def put(values: State, into: State) -> None:
    """Give arrays their values."""
    for key, array in into.items():
        array[:] = values[key]


@dataclass
class Steps(BaseObserver):
    """Keeps the steps of a run, as an observer.

    Args:
        states: Number of states that are kept at most; None: all steps are.

    Attributes:
        times: Start and length of each step, s.
        first: State at the start of the run.
    """

    states: int | None = None
    times: list[tuple[float, float]] = field(default_factory=list)
    _kept: list[Step] = field(default_factory=list)

    def start(self, simulation: Simulation) -> None:
        """The state at the start is kept in any case."""
        self.first = copied(starts(simulation.problem))

    def solved(self, simulation: Simulation) -> None:
        """Keep a step."""
        assert simulation.last is not None
        self.times.append((simulation.last.t, simulation.last.dt))
        if self.states is None:
            self._kept.append(_step(len(self._kept), simulation.problem))

    def backwards(self, simulation: Simulation) -> Iterator[Step]:
        """Steps from the last one to the first.

        Where states are few, steps between them are solved again, by the schedule with the fewest
        of such solutions (Griewank and Walther's, of `checkpoint_schedules`).

        Args:
            simulation: The run at its end.
        """
        if self.states is None:
            while self._kept:
                yield self._kept.pop()
            return
        problem, live = simulation.problem, starts(simulation.problem)
        put(self.first, live)
        problem.predictor.clear()
        states: dict[int, State] = {}
        steps: dict[int, Step] = {}
        for action in MultistageCheckpointSchedule(len(self.times), self.states, 0):
            match action:
                case Forward():
                    if action.write_ics:
                        states[action.n0] = copied(live)
                    for n in range(action.n0, action.n1):
                        simulation.model.mechanism.refresh(problem.levels)
                        problem.prepare(*self.times[n])
                        problem.solve(self.times[n][1])
                        if action.write_adj_deps:
                            steps[n] = _step(n, problem)
                        problem.accept(self.times[n][1])
                case Copy() | Move():
                    kept = states[action.n] if isinstance(action, Copy) else states.pop(action.n)
                    put(kept, live)
                    problem.predictor.clear()
                case Reverse():
                    for n in reversed(range(action.n0, action.n1)):
                        yield steps.pop(n)
                case EndReverse():
                    return


def _step(number: int, problem: Problem) -> Step:
    return Step(number, copied(starts(problem)), copied(unknowns(problem)))


class Advance:
    """The end of a step of one body, transposed.

    Args:
        problem: The problem.
        body: The body.
    """

    def __init__(self, problem: Problem, body: Body) -> None:
        self._name, self._levels = body.name, problem.levels[body.name]
        self._scheme, self._forms = problem.scheme, problem.steps[body.name]
        self._kinematic, self._resultants = kinematic_dofs(body), resultant_dofs(body)
        self._tangent_back = body.manifold.tangent_back
        levels, self._states = self._levels, States()
        self._states["q", "q"] = levels.q.x.array
        self._states |= {("rate", k): f.x.array for k, f in levels.rates.items()}
        self._states |= {("unknown", k): f.x.array for k, f in levels.unknown.items()}
        # of each rate the length of the step, the shares, and that of the jump
        self._kept: dict[str, tuple[float, Shares, Floats]] = {}

    def __call__(
        self, ends: Covector, starts: Covector, unknown: dict[str, Floats], dt: float
    ) -> None:
        """Add what covectors of the end are at the start and in the unknown states.

        Args:
            ends: Of the end of the step.
            starts: Of its start.
            unknown: Of the unknown states, by stage.
            dt: Length of the step, s.
        """
        name, levels = self._name, self._levels
        of_q = ends[name, "q"].copy()
        rows, of_rows = self._resultants, of_q[self._resultants].copy()
        of_q[rows] = 0.0
        unknown[END] += of_q
        one, zero = np.ones(len(rows)), np.zeros(len(rows))
        zeros = {stage: zero for stage in levels.unknown}
        starts[name, "q"][rows] += self._scheme.resultants(one, zeros) * of_rows
        for stage in levels.unknown:
            unknown[stage][rows] += self._scheme.resultants(zero, zeros | {stage: one}) * of_rows
        for rate in levels.rates:
            w = np.zeros_like(of_q)
            w[self._kinematic] = ends[name, rate][self._kinematic]
            self._of_rate(rate, w, starts, unknown, dt)

    def _of_rate(
        self, rate: str, w: Floats, starts: Covector, unknown: dict[str, Floats], dt: float
    ) -> None:
        shares, weight = self._shares(rate, dt)
        jumps, by_jump, by_middle = weight.any(), w, w
        if jumps:
            _, b, middle = self._advanced(rate, self._states, dt)
            by_jump, by_middle = self._tangent_back(b, middle, weight * w)
        for (kind, name), (plain, jump, middle) in shares.items():
            target = unknown[name] if kind == "unknown" else starts[self._name, name]
            target += plain * w
            if jumps:
                target += jump * by_jump + middle * by_middle

    def _advanced(
        self, rate: str, given: States, dt: float, unit: float = 0.0
    ) -> tuple[Floats, Floats, Floats]:
        """A rate at the end with a given size of what jumps leave; the jump, and its middle state.

        Both are zero where velocities do not jump.
        """
        seen = [np.zeros_like(given["q", "q"])] * 2

        def left(b: Floats, middle: Floats) -> Floats:
            seen[:] = b, middle
            return np.full_like(b, unit)

        rates, unknown = (
            {k: v for (kind, k), v in given.items() if kind == of} for of in ("rate", "unknown")
        )
        made = self._forms.advance(given["q", "q"], rates, unknown, dt, left)
        return np.asarray(made[rate]), seen[0], seen[1]

    def _shares(self, rate: str, dt: float) -> tuple[Shares, Floats]:
        """Shares of all states, and of a jump, in a rate at the end; zero where there is no jump.

        They are linear combinations, of which units tell the shares; kept as long as the step is.
        """
        kept = self._kept.get(rate)
        if kept is None or kept[0] != dt:
            zeros = {key: np.zeros_like(values) for key, values in self._states.items()}
            units = {key: zeros | {key: np.ones_like(values)} for key, values in zeros.items()}
            shares = {key: self._advanced(rate, unit, dt) for key, unit in units.items()}
            kept = self._kept[rate] = dt, shares, self._advanced(rate, zeros, dt, 1.0)[0]
        return kept[1:]
