"""All effects of a scene: used or not, why, and what each costs."""

from __future__ import annotations

import gc
import tempfile
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from mpi4py import MPI

from shellmb.effects.catalogue.registry import EFFECTS
from shellmb.effects.count import Count, count, count_bodies
from shellmb.effects.effect import Effect
from shellmb.effects.measure import Stepping, share
from shellmb.errors import ConvergenceError, SceneError
from shellmb.scene import Scene

# steps before those that are measured: the predictor needs four
WARM = 5


@dataclass(frozen=True)
class Row:
    """An effect of a scene.

    Args:
        effect: Its name.
        group: Its group.
        title: What it is.
        used: Whether the scene has it.
        why: The field of the scene that decides.
        count: What it adds to the problem of a step; None where that cannot be told.
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
    """What a scene simulates, and what it costs; collective.

    Args:
        scene: The scene.
        steps: Steps of each round; 0: nothing is built, run or counted.
        rounds: Rounds of each scene with and without an effect.
        report: Is told what is going on.
    """
    used = {name: effect.use(scene) for name, effect in EFFECTS.items()}
    if not steps:
        plain = (Row(e.name, e.group, e.title, *used[e.name]) for e in EFFECTS.values())
        return Survey(tuple(plain))
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(MPI.COMM_WORLD.bcast(scratch))
        report("the scene as it is")
        base = Stepping(scene, folder / "base")
        base.begin(WARM, 2 * steps)
        problem = base.simulation.problem
        total = count(problem)
        rows = []
        for effect in EFFECTS.values():
            use = used[effect.name]
            row = Row(effect.name, effect.group, effect.title, *use)
            if use.used:
                row = _costed(row, effect, base, total, (folder, steps, rounds), report)
            rows.append(row)
        if not base.seconds:
            base.round(steps)
        rows = [_observed(row, EFFECTS[row.effect], base) for row in rows]
        found = Survey(tuple(rows), total, problem.iteration.linear.size, base.step_seconds)
        base.finish()
        MPI.COMM_WORLD.Barrier()
    return found


def _costed(
    row: Row,
    effect: Effect,
    base: Stepping,
    total: Count,
    how: tuple[Path, int, int],
    report: Callable[[str], None],
) -> Row:
    """The row with what the effect costs, by leaving it out where that is possible."""
    folder, steps, rounds = how
    scene, problem = base.simulation.scene, base.simulation.problem
    own = count_bodies(problem, effect.bodies) if effect.bodies else None
    if effect.observer is not None:
        return row
    try:
        changed = effect.without(scene)
        report(f"without {effect.name}")
        other = Stepping(changed, folder / effect.name)
    except SceneError as error:
        return replace(row, count=own, needed=str(error))
    found: dict[str, Any] = {"count": total - count(other.simulation.problem)}
    if not effect.motion:
        try:
            other.begin(WARM, 0)
            found["share"] = share(base, other, steps, rounds)
        except ConvergenceError as error:
            found["needed"] = f"without it a step does not converge: {error}"
    other.finish()
    del other
    # meshes and matrices are freed collectively
    gc.collect()
    return replace(row, **found)


def _observed(row: Row, effect: Effect, base: Stepping) -> Row:
    """The row of an observer, with its kernels and its share of the time."""
    if not row.used or effect.observer is None:
        return row
    own = Count(0, 0, 0, 0, len(base.kernels[effect.observer]))
    return replace(row, count=own, share=base.observer_share(effect.observer))
