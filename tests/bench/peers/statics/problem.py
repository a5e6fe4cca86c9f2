"""A static problem in several codes: its cases, what comes out, and the table of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

from shellmb.accuracy.measuring import Column, spread
from shellmb.arrays import Floats
from shellmb.demos.effects.stepping import in_turn
from tests.bench.peers.codes import OURS
from tests.bench.peers.words import fastest

# of Newton's method
TOLERANCE = 1e-6


@dataclass(frozen=True)
class Static:
    """Settings of the solution.

    Args:
        code: "shellmb" or the name of a peer.
        mesh: Elements along two directions.
        element: Element, where the code has several.
        load_steps: Equal steps of what is prescribed, the load or a displacement.
    """

    code: str
    mesh: tuple[int, int]
    element: str = ""
    load_steps: int = 1


@dataclass(frozen=True)
class Answer:
    """Answer of a code.

    Args:
        moved: Displacements of the points that are looked at, shape (points, 3), m.
        iterations: Newton iterations of all load steps.
        cpu_s: Processor time of the load steps, s.
        failed: Why it ended early; "" if it did not.
    """

    moved: Floats
    iterations: int
    cpu_s: float
    failed: str


@dataclass(frozen=True)
class Solved:
    """Result of a comparison.

    Args:
        case: How it was solved.
        error: Error of the problem; infinite if it failed.
        iterations: Newton iterations of all load steps.
        times: Processor times of all runs, s.
        failed: Why there is no answer; "" if there is.
    """

    case: Static
    error: float
    iterations: int
    times: tuple[float, ...]
    failed: str

    @property
    def cpu_s(self) -> float:
        """Least processor time, s."""
        return min(self.times)


@dataclass(frozen=True)
class Problem:
    """A static problem.

    Args:
        name: Of its table's file.
        title: What it is.
        cases: What is run.
        quick: What a test can wait for.
        solve: How each code does it.
        error: Error of displacements.
        asked: Errors that times are compared at.
    """

    name: str
    title: str
    cases: Sequence[Static]
    quick: Sequence[Static]
    solve: Mapping[str, Callable[[Static], Answer]]
    error: Callable[[Floats], float]
    asked: Sequence[float] = (1e-2, 1e-3)


def compared(
    problem: Problem, cases: Sequence[Static], peers: Collection[str], rounds: int
) -> list[Solved]:
    """Run the cases of some codes, in turn.

    Args:
        problem: The problem.
        cases: What is run.
        peers: Codes beside ours.
        rounds: How often each is run.
    """
    some = [case for case in cases if case.code == OURS or case.code in peers]

    def work(case: Static) -> Callable[[], Answer]:
        return lambda: problem.solve[case.code](case)

    found = zip(*in_turn(rounds, [work(case) for case in some]), strict=True)
    made = []
    for case, answers in zip(some, found, strict=True):
        first = answers[0]
        error = math.inf if first.failed else problem.error(first.moved)
        times = tuple(answer.cpu_s for answer in answers)
        made.append(Solved(case, error, first.iterations, times, first.failed))
    return made


def sentence(problem: Problem, solved: Sequence[Solved]) -> str:
    """Say who takes how long for which error."""

    def best(code: str, error: float) -> tuple[float, str] | None:
        some = [s for s in solved if s.case.code == code and s.error <= error]
        found = min(some, key=lambda s: s.cpu_s, default=None)
        return None if found is None else (found.cpu_s, f"{_element(found)}{_mesh(found)}")

    return fastest(tuple(dict.fromkeys(s.case.code for s in solved)), problem.asked, best)


def _element(solved: Solved) -> str:
    return f"{solved.case.element}, " if solved.case.element else ""


def _mesh(solved: Solved) -> str:
    return "{}x{}".format(*solved.case.mesh)


COLUMNS: tuple[Column[Solved], ...] = (
    Column("code", lambda s: s.case.code, "words"),
    Column("element", lambda s: s.case.element or "-", "words"),
    Column("mesh", _mesh, "words"),
    Column("load steps", lambda s: str(s.case.load_steps)),
    Column("error", lambda s: s.failed or f"{100 * s.error:.2g} %"),
    Column("iterations", lambda s: str(s.iterations)),
    Column("cpu [s]", lambda s: f"{s.cpu_s:.3g}"),
    Column("spread", lambda s: f"{100 * spread(s.times, s.cpu_s):.0f} %"),
)
