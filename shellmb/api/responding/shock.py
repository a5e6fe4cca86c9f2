"""Shock response spectra of accelerations of ground."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.signal

from shellmb.arrays import Floats
from shellmb.errors import SceneError


def shock_spectrum(
    times: Sequence[float] | Floats,
    acceleration: Sequence[float] | Floats,
    frequencies: Sequence[float] | Floats,
    damping: float = 0.05,
) -> Floats:
    """Shock response spectrum: largest absolute accelerations of oscillators on shaken ground.

    Between two times the acceleration is linear, and the oscillators move exactly (Smallwood
    1981). What they do after the last time, with ground at rest, counts, too.

    Args:
        times: Times at equal distances, shape (n,) [s].
        acceleration: Acceleration of ground, shape (n,).
        frequencies: Natural frequencies of the oscillators, positive [Hz].
        damping: Damping ratio of the oscillators, from 0 to below 1.

    Returns:
        Shape (frequencies,), in the unit of the acceleration.

    Raises:
        SceneError: If times do not increase by equal steps, or a number makes no sense.
    """
    t, a, f = (
        np.atleast_1d(np.asarray(v, dtype=float)) for v in (times, acceleration, frequencies)
    )
    h = np.diff(t)
    if len(t) < 2 or len(t) != len(a) or h[0] <= 0 or np.ptp(h) > 1e-6 * h[0]:
        raise SceneError(
            f"shock_spectrum: there are {len(t)} times and {len(a)} accelerations; times must be "
            "as many, at least two, and increase by equal steps"
        )
    if np.any(f <= 0) or not 0 <= damping < 1:
        raise SceneError(
            f"shock_spectrum: frequencies begin at {f.min():g} and damping is {damping:g}; "
            "frequencies must be positive, and damping from 0 to below 1"
        )
    found = np.empty(len(f))
    for k, frequency in enumerate(f):
        w, step = 2 * np.pi * frequency, float(h.mean())
        # a period more, in which ground is at rest
        more = np.zeros(int(np.ceil(1 / (frequency * step))) + 1)
        decay, turn = damping * w * step, w * step * np.sqrt(1 - damping**2)
        e, sine, cosine = np.exp(-decay), np.sin(turn), np.cos(turn)
        share = sine / turn
        b = [
            1 - e * share,
            2 * e * (share - cosine),
            e**2 - e * share,
        ]
        response = scipy.signal.lfilter(b, [1.0, -2 * e * cosine, e**2], [*a, *more])
        found[k] = np.abs(response).max()
    return found
