"""A scene run twice, as it is and with effects changed: results beside times."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import count
from statistics import median

from shellmb.demos.effects.stepping import in_turn
from shellmb.errors import ShellmbError
from shellmb.running.execute import RunResult, execute
from shellmb.running.results import Results
from shellmb.scene import Scene


@dataclass(frozen=True)
class Change:
    """A number of both runs.

    Args:
        name: Its name.
        before: As the scene is; None where only the changed one has it.
        after: As it was changed; None where only the scene itself has it.
    """

    name: str
    before: float | None
    after: float | None

    @property
    def relative(self) -> float | None:
        """Change relative to the number before; None where that means nothing."""
        if self.before is None or self.after is None or not self.before:
            return None
        value = self.after / self.before - 1
        return value if math.isfinite(value) else None

    def to_dict(self) -> dict[str, float | str | None]:
        """Plain values."""
        return {**vars(self), "relative": self.relative}


@dataclass(frozen=True)
class Comparison:
    """Both runs.

    Args:
        results: What the scene measures, and its probes.
        times: Steps, iterations, unknowns, and seconds.
    """

    results: tuple[Change, ...]
    times: tuple[Change, ...]


def compare(
    scene: Scene,
    changed: Scene,
    results: Results | None = None,
    repeat: int = 1,
    report: Callable[[str], None] = lambda text: None,
) -> Comparison:
    """Run both scenes in turn; collective.

    Args:
        scene: The scene.
        changed: The same with effects changed.
        results: What the scene measures; None: what it says itself.
        repeat: How often both are run; times are medians.
        report: Callback for progress messages.
    """
    number = count(1)

    def run(name: str, one: Scene) -> RunResult:
        report(f"{name}, run {next(number)} of {2 * repeat}")
        return execute(one, pictures=False)

    pairs = in_turn(repeat, [partial(run, "as it is", scene), partial(run, "changed", changed)])
    first, second = zip(*pairs, strict=True)
    measured = [_measured(run[0], results) for run in (first, second)]
    return Comparison(_changes(*measured), _changes(_times(first), _times(second)))


def _changes(before: dict[str, float], after: dict[str, float]) -> tuple[Change, ...]:
    both = dict.fromkeys([*before, *after])
    return tuple(Change(name, before.get(name), after.get(name)) for name in both)


def _measured(run: RunResult, results: Results | None) -> dict[str, float]:
    """The scene's results, where the changed scene still has them, and its probes."""
    found: dict[str, float] = {}
    measure = results or run.scene.results
    if measure is not None:
        try:
            found |= {name: float(value) for name, value in measure(run).items()}
        except ShellmbError:
            raise
        except Exception:
            # results are a user's code for the scene as it was: of another one it may ask for
            # what is not there, and then the probes tell what there is
            pass
    for probe in run.scene.probes:
        values = run.history[probe.name]
        found[f"{probe.name} at the end"] = float(values.iloc[-1])
        found[f"{probe.name}, largest magnitude"] = float(values.abs().max())
    return found


def _times(runs: Sequence[RunResult]) -> dict[str, float]:
    """Times of a run."""
    last = runs[-1].simulation
    steps, spent = max(last.step, 1), median(run.simulation.step_seconds for run in runs)
    return {
        "unknowns": float(last.problem.system.size),
        "steps": float(last.step),
        "iterations per step": last.iterations / steps,
        "factorisations per step": last.problem.iteration.factorisations / steps,
        "time per step [ms]": 1e3 * spent / steps,
        "time of all steps [s]": spent,
    }
