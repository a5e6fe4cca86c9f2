"""Free flight after a pulse: what laws of mechanics say of a body that was thrown.

A pulse is a hat: it rises linearly to its peak in half of its time and falls as it rose. Only
histories of a run enter, no form and no scheme.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from shellmb.arrays import Floats

# names of the components in columns of a history
AXES = "xyz"


def impulse(t: Any, peak: float, duration: float) -> Floats:
    """Time integral of a hat from 0 to `t`, shape of `t`.

    Args:
        t: Times, s.
        peak: Its largest value.
        duration: Its time, s.
    """
    t = np.clip(np.asarray(t, dtype=float), 0.0, duration)
    rising, left = peak / duration * t**2, peak / duration * (duration - t) ** 2
    return np.where(t < duration / 2, rising, peak * duration / 2 - left)


def vectors(history: Any, name: str) -> Floats:
    """A vector over time, from its columns `name` with x, y, z, shape (rows, 3)."""
    return np.stack([np.asarray(history[f"{name}{axis}"], dtype=float) for axis in AXES], axis=1)


def turned(
    history: Any,
    places: Mapping[str, tuple[float, float, float]],
    forces: Mapping[str, tuple[float, float, float]],
    peak: float,
    duration: float,
) -> Floats:
    """Angular momentum that dead forces have given, about the origin, N m s, shape (rows, 3).

    A step gives the moment that the impulse has at the mean of the places at both ends. This is
    what EP gives exactly; other schemes differ by the square of the step.

    Args:
        history: Columns of the run, with displacements `NAME_ux`, `NAME_uy`, `NAME_uz`.
        places: Places of the forces at rest, m.
        forces: The forces for a pulse of 1, N.
        peak: Largest value of the pulse.
        duration: Time of the pulse, s.
    """
    given = np.diff(impulse(history["t"], peak, duration))
    moments = np.zeros((len(given) + 1, 3))
    for name, at in places.items():
        x = np.asarray(at) + vectors(history, f"{name}_u")
        moments[1:] += np.cross((x[1:] + x[:-1]) / 2, given[:, None] * np.asarray(forces[name]))
    return np.cumsum(moments, axis=0)


def distance(value: Any, reference: Any) -> float:
    """Length of the difference of two vectors over that of the reference."""
    difference = np.asarray(value, dtype=float) - np.asarray(reference, dtype=float)
    return float(np.linalg.norm(difference) / np.linalg.norm(reference))


def flight(history: Any, duration: float) -> dict[str, float]:
    """Energy and momenta from the end of the pulse on.

    Args:
        history: Columns of the run.
        duration: Time of the pulse, s.

    Returns:
        `energy` at first [J], `energy_variation` and `energy_left` over it, `energy_rise`: largest
        rise in a step over it, `angular_drift`: largest change of angular momentum over its size,
        `strain_share`: largest share of strain energy. Nothing before the pulse has ended.
    """
    free = np.asarray(history["t"]) > duration * (1 + 1e-9)
    if np.count_nonzero(free) < 2:
        return {}
    energy = np.asarray(history["total_energy"])[free]
    angular = vectors(history, "angular_momentum_")[free]
    return {
        "energy": float(energy[0]),
        "energy_variation": float(np.ptp(energy) / energy[0]),
        "energy_left": float(energy[-1] / energy[0]),
        "energy_rise": float(np.max(np.diff(energy)) / energy[0]),
        "angular_drift": float(
            np.max(np.linalg.norm(angular - angular[0], axis=1)) / np.linalg.norm(angular[0])
        ),
        "strain_share": float(np.max(np.asarray(history["strain_energy"])[free] / energy)),
    }
