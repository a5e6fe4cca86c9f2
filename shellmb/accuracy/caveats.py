"""Remarks on why estimated errors are unreliable, or what they omit."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from math import isinf

from shellmb.accuracy.estimates import RATIO, ErrorEstimate
from shellmb.accuracy.family import SHAPELESS, Change
from shellmb.accuracy.run_record import RunRecord, difference
from shellmb.accuracy.studies.quantity import Quantity, parse_quantity
from shellmb.scene import Scene

# a difference between companions of so many times the quantity: nothing is resolved
UNRESOLVED = 0.5
# an order below which smaller steps hardly help
CHAOS = 0.2
# so many quantities are named
NAMED = 4


def remarks(
    mine: RunRecord,
    steps: Sequence[RunRecord],
    mesh: tuple[RunRecord, RunRecord] | None,
    failures: Mapping[Change, str],
    scene: Scene,
    found: Mapping[str, ErrorEstimate],
) -> tuple[str, ...]:
    """Remarks on the errors, a sentence each.

    Args:
        mine: The run.
        steps: It and those with larger steps.
        mesh: Two comparison runs that differ in their elements.
        failures: Why comparison runs failed.
        scene: The scene.
        found: Quantities with their errors.
    """
    said = [f"the run with {change.words()} fails: {why}" for change, why in failures.items()]
    if not any(isinf(f.error) for f in found.values()):
        # others tell in their place
        said = []
    unknown = {
        name: [k for k, f in found.items() if name in f.parts and isinf(f.parts[name].error)]
        for name in ("mesh", "step", "newton", "model", "contact")
    }
    for part, names in unknown.items():
        if names:
            said.append(f"the error of the {WORDS[part]} is not known of {_listed(names)}")
    others = {id(k): k for k in (*steps, *(mesh or ())) if k is not mine}
    for name, count in mine.events.items():
        counts = {other.events.get(name, 0) for other in others.values()} - {count}
        if counts:
            said.append(
                f"event '{name}' occurs {count} times in the run and {min(counts)} times in "
                "a comparison run: errors after it are not known"
            )
    named = {k: Quantity(k) if k in mine.results else parse_quantity(k) for k in found}
    for part, words in LEVELS.items():
        stay = [named[k] for k, f in found.items() if not f.parts[part].converges]
        if stay:
            said.append(f"{_by_name(stay)}: {NO_LIMIT} with {words}")
    wild = [
        named[k] for k, f in found.items() if f.step.converges and _unresolved(f, named[k], steps)
    ]
    if wild:
        said.append(
            f"{_by_name(wild)}: comparison runs with larger steps are far from the run: an "
            "instability, an event, chaos, or too large steps; errors are rough"
        )
    still = [named[k] for k, f in found.items() if f.step.damped]
    if still:
        said.append(
            f"{_by_name(still)}: comparison runs agree better than the energy that the scheme "
            "damps allows; errors are rough: they are those of vibrations that it may have damped"
        )
    short = mine.steps <= SHAPELESS * RATIO**2
    if len(steps) == 2 and steps[0] is mine and short and scene.path is None:
        said.append(
            f"the run has {mine.steps} steps, and in a ninth of them no motion has a shape: errors "
            "of the step are taken as of first order, and are rough"
        )
    read = [shell.name for shell in scene.shells if shell.refined_times is not None]
    if read:
        said.append(
            f"meshes of files ({_listed(read)}) are refined as they are: where edges are chords of "
            "curved ones, they stay chords, and the errors do not contain that"
        )
    said += of_own(scene)
    if scene.path is not None:
        said.append("histories along a path have no errors: points of two runs differ")
    return tuple(said)


def of_own(scene: Scene) -> list[str]:
    """Remark on the meshes of bodies of the user's own, which nothing refines.

    Args:
        scene: The scene.
    """
    names = _listed([body.name for body in scene.own_bodies])
    what = "own bodies have the same mesh in all comparison runs; the errors do not contain its"
    return [f"{names}: {what}"] if names else []


# what is said of levels whose differences do not fall, and of the parts that they differ in
NO_LIMIT = "does not converge"
LEVELS = {
    "mesh": (
        "finer meshes: each level changes it by as much as the one before. At a point under a "
        "point force, at a support or joint at a point, at the end of a clamped edge or in a "
        "re-entrant corner resultants have no limit: read them at a distance from it, or spread "
        "the load"
    ),
    "step": (
        "smaller steps: each level changes it by as much as the one before, as of chaos, after an "
        "instability, under a blow that steps do not resolve, or where steps are far too large"
    ),
}

WORDS = {
    "mesh": "mesh",
    "step": "step",
    "newton": "tolerance of Newton's method",
    "model": "reduced model",
    "contact": "contact stiffness",
}


def _unresolved(found: ErrorEstimate, quantity: Quantity, steps: Sequence[RunRecord]) -> bool:
    """Decide whether a curve is unresolved, or comparison runs are as far off as the number."""
    order = found.step.order
    if found.step.rough or not found.step.resolved:
        return True
    if order is None or len(steps) < 2:
        return False
    away = [d for d in (difference(a, b, quantity) for a, b in pairwise(steps)) if d is not None]
    far = [d > UNRESOLVED * abs(found.value) for d in away]
    # the largest steps tell nothing where they are as far off as two motions are apart
    return bool(far) and (far[-1] or (far[0] and order <= CHAOS))


def _by_name(quantities: Sequence[Quantity]) -> str:
    """Quantities in words, all of them: norms of a curve behind its name."""
    norms: dict[str, list[str]] = {}
    for each in quantities:
        norms.setdefault(each.name, []).extend([each.norm] if each.norm else [])
    return ", ".join(f"{name} ({', '.join(n)})" if n else name for name, n in norms.items())


def _listed(names: Sequence[str]) -> str:
    shown = ", ".join(names[:NAMED])
    return shown if len(names) <= NAMED else f"{shown} and {len(names) - NAMED} more"
