"""Errors of natural frequencies, from a model with better elements."""

from collections.abc import Callable, Sequence
from math import isfinite

from shellmb.accuracy.caveats import of_own
from shellmb.accuracy.estimates import (
    NONE,
    ErrorEstimate,
    Errors,
    Estimate,
    mesh_error,
    model_error,
)
from shellmb.accuracy.family import Change, degree_of, prefers_degree, reduced
from shellmb.errors import ShellmbError, unsaid
from shellmb.running.natural_modes.vibration import Modes, natural_modes
from shellmb.running.results import measured
from shellmb.scene import Scene

# relative error up to which elements follow the waves of a mode, and the share of it that higher
# modes have then at least
FOLLOWED, SHARE = 0.02, 0.5
# how much larger than what its companion tells an error is taken without a word
ROUGH = 4.0

type ModeResults = Callable[[Modes], dict[str, float]]


def mode_errors(
    scene: Scene,
    modes: Modes,
    numbers: dict[str, float],
    loaded: bool,
    results: ModeResults | None,
    body: str | None = None,
) -> Errors:
    """Errors of frequencies, "f1", and results of modes; collective.

    Args:
        scene: The scene.
        modes: Its modes.
        numbers: Its results.
        loaded: Whether they are about the static equilibrium.
        results: What gave the results.
        body: The only body whose mesh is judged; None: all.
    """
    mine = frequencies(modes) | numbers
    parts: dict[str, list[Change]] = {}
    if degree_of(scene) is not None:
        parts["mesh"] = [Change(mesh=2, body=body)]
    if degree_of(scene) == 2:
        parts["mesh"].insert(0 if prefers_degree(scene) else 1, Change(degree=3, body=body))
    if reduced(scene):
        parts["model"] = [Change(exact=True)]
    errors: dict[str, dict[str, Estimate]] = {name: {"mesh": NONE, "step": NONE} for name in mine}
    remarks = of_own(scene)
    for part, changes in parts.items():
        there, why = _companion(scene, modes, changes, loaded, results)
        if there is None:
            remarks.append(f"the error of the {part} is not known: {why}")
        for name, value in mine.items():
            away = abs(value - there[name]) if there is not None and name in there else None
            errors[name][part] = mesh_error(away) if part == "mesh" else model_error(away)
    elastic = [f"f{k + 1}" for k in range(modes.rigid, len(modes.omega2))]
    for k in range(modes.rigid):
        # these are zero, and their values round-off
        errors[f"f{k + 1}"] = {"mesh": Estimate(abs(mine[f"f{k + 1}"])), "step": NONE}
    raised = _as_lower_ones([(abs(mine[n]), errors[n]["mesh"].error) for n in elastic])
    doubtful = []
    for name, error in zip(elastic, raised, strict=True):
        if error > ROUGH * errors[name]["mesh"].error:
            doubtful.append(name)
        errors[name]["mesh"] = Estimate(error)
    if doubtful:
        remarks.append(
            f"{', '.join(doubtful)}: the run on another mesh agrees much better than for "
            "lower frequencies, by chance or because the modes differ in kind; their errors are "
            "rough estimates from the lower ones"
        )
    found = {name: ErrorEstimate(value, errors[name]) for name, value in mine.items()}
    measures = {name: found.pop(name) for name in numbers}
    return Errors(measures, found, tuple(remarks), "modes")


def _as_lower_ones(found: Sequence[tuple[float, float]]) -> list[float]:
    """Errors of frequencies, none relatively smaller than a share of those of lower ones.

    Shapes of higher modes have shorter waves, which fewer elements follow. That a comparison run
    agrees on them is chance where it does not follow them either.

    Args:
        found: Frequencies [Hz] with the errors by the comparison run, from the lowest one up.
    """
    largest, errors = 0.0, []
    for value, error in found:
        share = 1.0 if largest > FOLLOWED else SHARE
        errors.append(max(error, share * largest * value))
        if value > 0 and isfinite(error):
            largest = max(largest, error / value)
    return errors


def frequencies(modes: Modes) -> dict[str, float]:
    """Frequencies [Hz] by the names "f1", "f2", ...

    Args:
        modes: The modes.
    """
    return {f"f{k}": float(f) for k, f in enumerate(modes.frequencies, start=1)}


@unsaid()
def _companion(
    scene: Scene, modes: Modes, changes: Sequence[Change], loaded: bool, results: ModeResults | None
) -> tuple[dict[str, float] | None, str]:
    """Numbers of the first comparison run that works, and why others do not."""
    comm, why = modes.model.comm, ""
    for change in changes:
        try:
            found = natural_modes(change.apply(scene), comm, len(modes.omega2), loaded)
            numbers = {} if results is None else measured(results, found, comm, "mode_results")
        except ShellmbError as error:
            why = str(error)
        else:
            return frequencies(found) | numbers, why
    return None, why
