"""All effects of a scene: used or not, why, and what each costs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

from shellmb.demos.effects.catalogue.registry import EFFECTS
from shellmb.demos.effects.count import Count, count, count_bodies
from shellmb.demos.effects.effect import Effect
from shellmb.demos.effects.stepping import WARM, Stepping, in_turn, observer_shares, scratch, shares
from shellmb.errors import ConvergenceError, SceneError
from shellmb.meshes.lifetime import free
from shellmb.scene import Scene


@dataclass(frozen=True)
class Row:
    """An effect of a scene.

    Args:
        effect: Its name.
        group: Its group.
        title: What it is.
        used: Whether the scene has it.
        why: The field of the scene that decides.
        count: What it adds to the problem of a step; None if unknown.
        share: Share of the step time that goes without it (negative where steps then take longer);
            None where it cannot be left out, or was not measured.
        needed: Why it cannot be left out; None where it can, or is not there.
    """

    effect: str
    group: str
    title: str
    used: bool
    why: str
    count: Count | None = None
    share: float | None = None
    needed: str | None = None

    def to_dict(self) -> dict[str, Any]:
        """Plain values, the counts beside the others."""
        values = asdict(self)
        counts = values.pop("count") or dict.fromkeys(
            ("unknowns", "stored", "integrals", "coefficients", "kernels")
        )
        return values | counts


@dataclass(frozen=True)
class Survey:
    """The effects of a scene.

    Args:
        rows: All effects.
        total: What the whole problem is made of; None if nothing was built.
        solved: Unknowns of the linear systems.
        step_seconds: Processor time of a step, observers included, s.
    """

    rows: tuple[Row, ...]
    total: Count | None = None
    solved: int | None = None
    step_seconds: float | None = None


def survey(
    scene: Scene,
    steps: int = 10,
    rounds: int = 3,
    report: Callable[[str], None] = lambda text: None,
) -> Survey:
    """Effects that a scene simulates, with their costs; collective.

    Args:
        scene: The scene.
        steps: Steps of each round; 0: nothing is built, run or counted.
        rounds: Rounds of each scene with and without an effect.
        report: Callback for progress messages.
    """
    used = {name: effect.use(scene) for name, effect in EFFECTS.items()}
    if not steps:
        plain = (Row(e.name, e.group, e.title, *used[e.name]) for e in EFFECTS.values())
        return Survey(tuple(plain))
    with scratch() as folder:
        report("the scene as it is")
        base = Stepping(scene, folder / "base")
        first = observer_shares(base, WARM)
        # of a scene that is over better the first steps than none
        observers = observer_shares(base, 2 * steps) or first
        problem = base.simulation.problem
        total = count(problem)
        rows, times = [], []
        for effect in EFFECTS.values():
            row = Row(effect.name, effect.group, effect.title, *used[effect.name])
            if row.used and effect.observer is not None:
                own = len(base.observers[effect.observer].kernels)
                part = observers.get(effect.observer)
                row = replace(row, count=Count(0, 0, 0, 0, own), share=part)
            elif row.used:
                cost, pairs = _cost(effect, base, total, (folder, steps, rounds), report)
                row = replace(row, **cost)
                times += [own for own, _ in pairs]
                free()
            rows.append(row)
        step = median(times or [base.round(steps)])
        found = Survey(tuple(rows), total, problem.iteration.linear.size, step)
        base.finish()
    return found


def _cost(
    effect: Effect,
    base: Stepping,
    total: Count,
    how: tuple[Path, int, int],
    report: Callable[[str], None],
) -> tuple[dict[str, Any], list[tuple[float, ...]]]:
    """Measure what an effect costs, by leaving it out where possible; times with and without it."""
    folder, steps, rounds = how
    scene, problem = base.simulation.scene, base.simulation.problem
    try:
        changed = effect.without(scene)
        report(f"without {effect.name}")
        other = Stepping(changed, folder / effect.name)
    except SceneError as error:
        own = count_bodies(problem, effect.bodies) if effect.bodies else None
        return {"count": own, "needed": str(error)}, []
    found: dict[str, Any] = {"count": total - count(other.simulation.problem)}
    pairs: list[tuple[float, ...]] = []
    if not effect.motion:
        try:
            other.advance(WARM)
            pairs = in_turn(rounds, [partial(s.round, steps) for s in (base, other)])
            found["share"] = shares(pairs)[0]
        except ConvergenceError as error:
            found["needed"] = f"without it a step does not converge: {error}"
    other.finish()
    return found, pairs
