"""Sentences on modes: of bodies that are too stiff or too soft, by model, state, and modes."""

from collections.abc import Callable, Sequence

import numpy as np

from shellmb.arrays import Floats
from shellmb.diagnostics.base import Motion
from shellmb.diagnostics.elements.coarse import Signs
from shellmb.diagnostics.elements.finer import BOUND, REMEDY, beyond, by_better, by_wider
from shellmb.diagnostics.elements.wrinkled import wrinkled_modes
from shellmb.diagnostics.stiffened_modes import stiffened_modes
from shellmb.model.model import Model
from shellmb.scene import Scene

SECTIONS = stiffened_modes, wrinkled_modes
# part of a frequency that loads change at most where it is compared without them
CHANGED = 0.2


def beside_better(
    model: Model,
    modes: Sequence[Motion],
    unknowns: int,
    values: Floats,
    better: Callable[[Scene], Floats],
    what: str,
    loaded: bool = False,
) -> list[str]:
    """Sentences on modes that are not those of better elements; collective.

    Args:
        model: The model.
        modes: Its modes about the reference.
        unknowns: Number of unknowns.
        values: What is compared of all modes, frequencies or load factors.
        better: Gives the same of a scene, without loads.
        what: What it is called.
        loaded: Whether loads act on the modes, which better elements are compared without; where
            these change a frequency much, nothing is known of it.
    """
    # those of bodies in modes without loads may be singular
    if (loaded and model.modal) or not any(_doubtful(model, name, modes) for name in model.shells):
        return []
    here = better(model.scene) if loaded else values
    # eigenproblems cost more than linear responses
    if found := by_better(model.scene, 2 * unknowns, better):
        right, how = found
        parts = np.abs(here[: len(right)] / right[: len(here)] - 1)
    elif wider := by_wider(model.scene, better):
        how = wider[1]
        count = min(len(here), *map(len, wider[0]))
        parts = beyond(*(each[:count] for each in (here, *wider[0])))
    else:
        return []
    bare = np.abs(here - values) < CHANGED * np.abs(values)
    off = {n: parts[n - 1] for n, *_ in modes if n <= len(parts) and bare[n - 1]}
    far = [n for n in off if off[n] > BOUND]
    if not far:
        return []
    most = max(far, key=lambda n: off[n])
    which = f"mode {most} is off in its {what}"
    if len(far) > 1:
        listed = ", ".join(map(str, far))
        which = f"modes {listed} are off in their {what}, mode {most} most of all"
    named = ", ".join(f"shell '{name}'" for name in model.shells)
    return [f"{which}, by about {100 * off[most]:.0f} %, beside {how}; {named}: {REMEDY}"]


def _doubtful(model: Model, name: str, modes: Sequence[Motion]) -> bool:
    signs = Signs(model, name)
    shapes = ((part(name), energy) for _, energy, (part, *_) in modes)
    return any(signs.doubtful(q, 0 * q, energy) for q, energy in shapes)
