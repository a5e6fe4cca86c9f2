"""Steps of a run as they are needed backwards: kept, or solved again from states that are kept."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from checkpoint_schedules import (  # type: ignore[import-untyped]
    Copy,
    EndReverse,
    Forward,
    Move,
    MultistageCheckpointSchedule,
    Reverse,
)

from shellmb.arrays import Floats
from shellmb.simulate.problem import Problem
from shellmb.simulate.simulation import BaseObserver, Simulation

# functions of a body by name; of all bodies by theirs
State = dict[tuple[str, str], Floats]


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
        self.times.append((simulation.solved.t, simulation.solved.dt))
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
