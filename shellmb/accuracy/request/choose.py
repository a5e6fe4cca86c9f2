"""The next level: mesh and step that meet an error for the least time."""

from dataclasses import dataclass, replace
from math import ceil, floor, inf, isfinite, log

from shellmb.accuracy.estimates import RATIO
from shellmb.accuracy.family import Change
from shellmb.accuracy.request.levels import Level

# order of a mesh's error that is believed: clamped corners have no more; and what is taken off an
# observed one
MESH_ORDER, CAUTION = 2.0, 0.25
# part of the error requested that predictions are to meet
AIM = 0.8
# part of the error left for steps that larger ones may have, and how much larger they are at most
SURE, LARGER = 0.5, 6.0
# part of the errors of models and contacts down to which mesh and step are refined before these
# count
PART = 0.5
# the largest refinements of one level, as predictions reach no farther
MESH, STEP = 4, 27.0
# how much dearer a level may be for a smaller step
HARDLY = 1.1
# time of a step goes with this power of the number of elements
POWER = 1.1


@dataclass(frozen=True)
class Choice:
    """A level that is not run yet.

    Args:
        change: What is different in it.
        error: Its predicted error, in the unit of the quantity.
        seconds: Its predicted time [s].
    """

    change: Change
    error: float
    seconds: float


def mesh_order(levels: list[Level]) -> float:
    """Order of the error of meshes: as observed between levels, less some caution.

    Args:
        levels: Levels so far.
    """
    last = levels[-1]
    before = next((v for v in reversed(levels) if v.change.mesh < last.change.mesh), None)
    if before is None or not 0 < last.mesh < before.mesh:
        return MESH_ORDER
    found = log(before.mesh / last.mesh) / log(last.change.mesh / before.change.mesh)
    return min(max(found - CAUTION, 1.0), MESH_ORDER)


def choose(levels: list[Level], target: float, farther: bool = False) -> Choice | None:
    """The cheapest level that is predicted to meet an error; None: no mesh and no step does.

    Args:
        levels: Levels so far; the last one tells.
        target: The error, in the unit of the quantity.
        farther: Whether the refinement has no limit, as for what a smaller error would cost.
    """
    last = levels[-1]
    rest = AIM * target - last.others
    if not rest > 0 and not farther and last.step > last.others:
        # companions with larger steps tell the others: while steps are coarse they are not known
        rest = PART * last.others
    if not rest > 0 or not isfinite(last.mesh + last.step + last.others):
        return None
    most = 64 if farther else MESH
    q, p = mesh_order(levels), last.order
    cost = seconds if farther else work
    best: Choice | None = None
    coarse = last.change.mesh
    meshes = range(coarse, most * coarse + 1) if last.mesh > 0 and last.refinable else (coarse,)
    for mesh in meshes:
        of_mesh = last.mesh * (coarse / mesh) ** q
        left = rest - of_mesh
        if left <= 0:
            continue
        step = last.change.step
        if last.step > left:
            step = _rounded(step * (left / last.step) ** (1 / p))
        elif last.step > 0:
            # larger steps, as far as their errors are sure to be small enough
            larger = (SURE * left / last.step) ** (1 / (p + CAUTION))
            step = max(step, _rounded(step * min(larger, LARGER)))
        if not farther:
            step = _shared(last, replace(last.change, mesh=mesh, step=step))
            if step < last.change.step / STEP:
                continue
        change = replace(last.change, mesh=mesh, step=step)
        error = of_mesh + last.step * (step / last.change.step) ** p + last.others
        found = Choice(change, error, seconds(last, change))
        if best is None or cost(last, change) < cost(last, best.change):
            best = found
    if best is None and not farther:
        # as far as predictions reach
        times = MESH if last.mesh > rest / 2 and last.refinable else 1
        step = _rounded(last.change.step / (9.0 if last.step > rest / 2 else 1.0))
        change = replace(last.change, mesh=last.change.mesh * times, step=step)
        if change != last.change:
            return Choice(change, inf, seconds(last, change))
        return None
    if best is not None and best.change == last.change:
        # predictions that do not refine have missed once
        finer = replace(last.change, step=_rounded(last.change.step / 1.5))
        if last.mesh > last.step and last.refinable:
            finer = replace(last.change, mesh=last.change.mesh + 1)
        return Choice(finer, best.error, seconds(last, finer))
    return best


def seconds(level: Level, change: Change) -> float:
    """Time that a level would take [s], from that of another one.

    Args:
        level: The other one.
        change: What is different in the level.
    """
    elements = (change.mesh / level.change.mesh) ** level.dimension
    steps = level.change.step / change.step
    # most of the set-up of meshes that take little time is that of forms, and stays
    setup = max(level.seconds - level.stepping, 0.0)
    return setup + level.stepping * elements**POWER * steps


def work(level: Level, change: Change) -> float:
    """Time that a level and its comparison runs would take [s], from the time of another level.

    Its comparison runs are there: those with its mesh and three times the step, and all
    that tell of the mesh, or of the step, where it stays.

    Args:
        level: The other one.
        change: What is different in the level.
    """
    found = seconds(level, change)
    setup = max(level.seconds - level.stepping, 0.0)
    stepping, same = found - setup, change.mesh == level.change.mesh
    if change.step != level.change.step:
        known = {level.change.step * RATIO**n for n in (0, 1, 2)} if same else set()
        larger = (RATIO, RATIO**2)
        found += sum(stepping / n for n in larger if change.step * n not in known)
    if not same:
        found += setup + stepping * 2 ** (level.dimension * POWER) / RATIO**2
    return found


def _shared(level: Level, change: Change) -> float:
    """The step of a level, or a smaller one that is hardly dearer, as it has comparison runs.

    Args:
        level: The level before it.
        change: What is different in the level.
    """
    third = level.change.step
    while third > change.step:
        third /= RATIO
    smaller = replace(change, step=third)
    allowed = third < level.change.step and _rounded(third) == third
    if allowed and work(level, smaller) <= HARDLY * work(level, change):
        return third
    return change.step


def _rounded(step: float) -> float:
    """A multiple or an integer part of the scene's step, so that steps land where its do."""
    return float(floor(step)) if step >= 1 else 1.0 / ceil(1.0 / step * (1 - 1e-9))
