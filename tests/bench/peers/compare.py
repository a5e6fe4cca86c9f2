"""Error against time of shellmb and other codes on one problem, run in turn."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from shellmb.accuracy.measuring import spread, unbeaten
from tests.bench.peers.codes import OURS
from tests.bench.peers.dynamics.history import TipHistory, difference
from tests.bench.peers.dynamics.motion import Motion, Runs, title


@dataclass(frozen=True)
class Point:
    """One run of the study.

    Args:
        code: "shellmb" or the name of a peer.
        scheme: "EP", "ED alpha=1", "rho=0.9", with the element where a code has several.
        mesh: Elements, "6x2".
        dt: Time step, s.
        error: L2 norm over time of the error of what is looked at, relative to that of itself;
            as the others infinite if the run ended early.
        largest: Largest error over the largest deflection.
        error_own: As `error`, against the converged answer of the code itself.
        cpu_s: Processor time of the steps, s; the least of all runs.
        wall_s: Wall time of the steps, s; the least of all runs.
        iterations: Newton iterations per step.
        factorisations: Factorisations per step.
        failed: Why it ended early; "" if it did not.
        times: Processor times of all runs, s.
    """

    code: str
    scheme: str
    mesh: str
    dt: float
    error: float
    largest: float
    error_own: float
    cpu_s: float
    wall_s: float
    iterations: float
    factorisations: float
    failed: str
    times: tuple[float, ...] = ()

    @property
    def spread(self) -> float:
        """Difference of the slowest and the fastest run, relative to the fastest."""
        return spread(self.times, self.cpu_s) if self.times else 0.0


@dataclass(frozen=True)
class Comparison:
    """Result of a comparison.

    Args:
        points: All runs.
        checks: Differences of converged answers (L2 norm over time, relative) by what they are of.
        peaks: Largest deflection of the converged answers by code, m.
        asked: Errors that times are compared at.
        apart: Codes that are measured by their own converged answer, because it differs from ours
            by more than half the smallest error asked for.
    """

    points: tuple[Point, ...]
    checks: dict[str, float]
    peaks: dict[str, float]
    apart: tuple[str, ...]
    asked: tuple[float, ...] = (1e-2, 1e-3)

    def judged(self, point: Point) -> float:
        """The error of a run that counts."""
        return point.error_own if point.code in self.apart else point.error

    def best(self, code: str, error: float) -> Point | None:
        """The fastest run of a code with at most that error, by processor time."""
        some = [p for p in self.points if p.code == code and self.judged(p) <= error]
        return min(some, key=lambda p: p.cpu_s, default=None)

    def front(self, code: str) -> list[Point]:
        """Runs that no other one beats in both error and time, the fastest first."""
        own = (p for p in self.points if p.code == code)
        return unbeaten(own, lambda p: p.cpu_s, self.judged)


def in_turn(*lists: Sequence[Motion]) -> list[Motion]:
    """Elements of several lists by turns, spread evenly."""
    placed = [((k + 0.5) / len(some), p) for some in lists for k, p in enumerate(some)]
    return [p for _, p in sorted(placed, key=lambda pair: pair[0])]


def compare(
    runs: Mapping[str, Runs],
    asked: tuple[float, ...],
    again: int,
    report: Callable[[str], None] = lambda text: None,
) -> Comparison:
    """Run the study.

    Args:
        runs: By code, ours first.
        asked: Errors that times are compared at.
        again: How often what may be best is run again, the codes in turn.
        report: Callback for progress messages.
    """
    report("converged answers")
    checks: dict[str, float] = {}
    truth: dict[str, TipHistory] = {}
    for code, some in runs.items():
        found = [motion.run() for motion in some.fine]
        truth[code] = found[0]
        for motion, other in zip(some.fine[1:], found[1:], strict=True):
            name = f"{code}: {title(motion)} against {title(some.fine[0])}"
            checks[name] = difference(other, found[0])[0]
    away = {code: difference(own, truth[OURS])[0] for code, own in truth.items() if code != OURS}
    for code, value in away.items():
        checks[f"{code} against {OURS}, both converged"] = value
    points: dict[Motion, Point] = {}

    def add(motion: Motion) -> None:
        made = _point(motion, motion.run(), truth)
        before = points.get(motion)
        points[motion] = made if before is None else _joined(before, made)

    every = in_turn(*(some.motions for some in runs.values()))
    for n, motion in enumerate(every):
        if n % 10 == 0:
            report(f"run {n + 1} of {len(every)}")
        add(motion)
    peaks = {code: own.peak for code, own in truth.items()}
    apart = tuple(code for code, value in away.items() if value > min(asked) / 2)
    made = Comparison(tuple(points.values()), checks, peaks, apart, asked)
    names = {point: motion for motion, point in points.items()}
    fronts = [[names[p] for p in made.front(code)] for code in runs]
    report(f"the best once more, {again} times in turn")
    for motion in in_turn(*fronts) * again:
        add(motion)
    return replace(made, points=tuple(points.values()))


def _joined(before: Point, again: Point) -> Point:
    """A run that was made once more: the least times of both."""
    return replace(
        again,
        cpu_s=min(again.cpu_s, before.cpu_s),
        wall_s=min(again.wall_s, before.wall_s),
        times=before.times + again.times,
    )


def _point(motion: Motion, history: TipHistory, truth: Mapping[str, TipHistory]) -> Point:
    code = motion.code
    error, largest = difference(history, truth[OURS])
    own_error, _ = difference(history, truth[code])
    return Point(
        code,
        motion.how,
        f"{motion.mesh[0]}x{motion.mesh[1]}",
        motion.dt,
        error,
        largest,
        own_error,
        history.cpu_s,
        history.wall_s,
        history.iterations,
        history.factorisations,
        history.failed,
        (history.cpu_s,),
    )
