"""Derivatives of natural frequencies by parameters of a scene."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from shellmb.api.modal import modes
from shellmb.errors import SceneError, TooFewModesError, warn
from shellmb.options.described import options_of, takes
from shellmb.options.run import ELEMENTS, Options
from shellmb.scene import Scene
from shellmb.sensitivity.parameters import (
    beside,
    differentiated,
    independent,
    parameters_of,
    without_effect,
)

if TYPE_CHECKING:
    import pandas as pd

# relative distance of the scenes at both sides: eigenvalues have twelve digits
APART = 1e-4
# relative distance from the next frequency below which one has no derivative of its own
SIMPLE = 10 * APART


@takes(*options_of(Options, *ELEMENTS))
def frequency_sensitivities(
    scene: Callable[..., Scene] | str,
    parameters: Sequence[str],
    count: int = 6,
    loaded: bool = False,
    *,
    values: Mapping[str, Any] | None = None,
    scales: Mapping[str, float] | None = None,
    **options: Any,
) -> pd.DataFrame:
    """Natural frequencies and their derivatives, by central differences.

    Args:
        scene: A function that makes the scene from its parameters, the name of a bundled scene, or
            the path of a Python file.
        parameters: Names of the parameters.
        count: Number of frequencies; a scene that has fewer has rows for these.
        loaded: Whether about the loaded state, as of `modes`.
        values: Values of parameters of the scene that replace its defaults.
        scales: Sizes of parameters, where their values do not tell.
        **options: Choices that replace the scene's.

    Returns:
        A row for each frequency: the frequency [Hz], and its derivative by each parameter. The
        derivative is NaN, with a warning, where two frequencies nearly coincide.

    Raises:
        SceneError: If the scene or a parameter is impossible.
    """
    import pandas as pd

    if count < 1:
        raise SceneError(f"sensitivities: count is {count}; it must be at least 1")
    made = differentiated(scene, values, **options)
    chosen = [p.apart(APART) for p in parameters_of(made, parameters, scales)]
    base = made.base()
    scenes = {p: beside(made, base, p) for p in chosen}
    # one more tells whether the last one is simple
    here = _frequencies(base, count + 1, loaded)
    known = min(count, len(here))
    gaps = np.abs(np.diff(here)) / np.maximum(np.abs(here[1:]), np.finfo(float).tiny)
    near = np.concatenate([[False], gaps < SIMPLE]) | np.concatenate([gaps < SIMPLE, [False]])
    table = pd.DataFrame(
        {"frequency": here[:known]}, index=pd.RangeIndex(1, known + 1, name="mode")
    )
    for p, (above, below) in scenes.items():
        sides = [_frequencies(s, count + 1, loaded)[: len(here)] for s in (above, below)]
        if any(len(side) < len(here) for side in sides):
            raise SceneError(
                f"sensitivities: parameter '{p.name}' changes how many frequencies there are; it "
                "must not"
            )
        slopes = (sides[0] - sides[1]) / p.width
        table[p.name] = np.where(near, np.nan, slopes)[:known]
        if not slopes.any():
            said = f"no frequency depends on '{p.name}' near {p.value:g}: its derivatives are zero"
            if independent(above, below):
                said = without_effect(p, base, above)
            warn(said)
    if near[:known].any():
        said = ", ".join(str(k + 1) for k in np.flatnonzero(near[:known]))
        warn(
            f"frequencies {said} nearly coincide with others: they have no derivatives of their "
            "own",
        )
    return table


def _frequencies(scene: Scene, count: int, loaded: bool) -> npt.NDArray[np.float64]:
    """Natural frequencies, Hz; fewer where there are fewer."""
    try:
        found = modes(scene, count=count, loaded=loaded, pictures=False)
    except TooFewModesError as error:
        if error.there == 0:
            raise
        found = modes(scene, count=error.there, loaded=loaded, pictures=False)
    return np.array(found.frequencies)
