"""Options of a response looked through, and curves over frequency: densities, spectra, shocks."""

from collections.abc import Sequence
from typing import Any, get_args

import numpy as np

from shellmb.api.responding.system import GROUND
from shellmb.arrays import Floats, reals_or_nan
from shellmb.errors import SceneError
from shellmb.options.linear import Quantity, ResponseOptions
from shellmb.scene.values.validate import listed, show

# of a period of an oscillator between times that its response is found at
PARTS = 50
SHOCK = "times", "acceleration", "frequencies", "damping"


def check_response(chosen: ResponseOptions) -> None:
    """Refuse options that make no sense.

    Args:
        chosen: The options.

    Raises:
        SceneError: Names the option, its value, and what would be right.
    """
    given = _floats("frequencies", () if chosen.frequencies is None else chosen.frequencies)
    if given.ndim != 1 or not len(given) or given[0] < 0 or np.any(np.diff(given) <= 0):
        raise SceneError(
            f"response: frequencies are {_some(given) or None}; they must be one or more "
            "numbers in Hz, from 0 on, each larger than the one before"
        )
    if chosen.quantity not in get_args(Quantity):
        known = listed(get_args(Quantity))
        raise SceneError(
            f"response: quantity is {show(chosen.quantity)}; it must be one of {known}"
        )
    if chosen.damping is not None:
        ratios = np.atleast_1d(_floats("damping", chosen.damping))
        if chosen.modes is None:
            raise SceneError(
                f"response: damping is {_some(ratios)} without modes; give modes, whose "
                "ratios these are, or leave it out: the scene's own damping acts"
            )
        if np.any(ratios < 0) or np.any(ratios >= 1) or len(ratios) not in (1, chosen.modes):
            raise SceneError(
                f"response: damping is {_some(ratios)}; it must be one ratio from 0 to 1, or "
                f"one for each of the {chosen.modes} modes"
            )
    for what, curves in (("psd", chosen.psd), ("spectrum", chosen.spectrum)):
        for name, curve in (curves or {}).items():
            curve_of(curve, f"{what} of '{name}'")
    if chosen.psd and len(given) < 2:
        raise SceneError("response: psd is given with one frequency; rms is between two or more")
    for name in chosen.spectrum or {}:
        if name not in GROUND:
            raise SceneError(
                f"response: spectrum is given for {name!r}; it must be of base.x, base.y or base.z"
            )
    if chosen.spectrum is not None and chosen.modes is None:
        raise SceneError("response: spectrum is given without modes; give modes, which it acts on")


def curve_of(curve: Any, said: str) -> tuple[Floats, Floats]:
    """Frequencies and values of a curve; a number is one that is the same everywhere.

    Args:
        curve: A number, or frequencies [Hz] and values.
        said: What it is, for messages.

    Raises:
        SceneError: If it is none, values are negative, or frequencies do not increase.
    """
    pair: Any = curve if np.iterable(curve) else ([0.0], [curve])
    if len(pair) != 2:
        raise SceneError(f"response: {said} has {len(pair)} parts; give frequencies and values")
    f, values = (np.atleast_1d(_floats(said, part)) for part in pair)
    if len(f) != len(values) or not len(f):
        raise SceneError(
            f"response: {said} has {len(f)} frequencies and {len(values)} values; give as many"
        )
    if np.any(values < 0):
        raise SceneError(f"response: {said} is {values.min():g} somewhere; it must not be negative")
    if f[0] < 0 or np.any(np.diff(f) <= 0):
        raise SceneError(f"response: frequencies of {said} are {_some(f)}; they must rise from 0")
    return f, values


def at_frequencies(curve: Any, f: Floats, said: str) -> Floats:
    """Values of a curve, in logarithms of both linear, zero outside of it.

    Args:
        curve: As of `curve_of`.
        f: Frequencies, Hz.
        said: What it is, for messages.
    """
    given, values = curve_of(curve, said)
    if not np.iterable(curve):
        return np.full(len(f), values[0])
    tiny = np.finfo(float).tiny
    logs = np.interp(np.log(f + tiny), np.log(given + tiny), np.log(values + tiny))
    inside = (f >= given[0]) & (f <= given[-1])
    return np.where(inside, np.exp(logs), 0.0)


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
    import scipy.signal

    given = zip(SHOCK, (times, acceleration, frequencies, damping), strict=True)
    t, a, f, ratio = (np.atleast_1d(_floats(n, v, "shock_spectrum")) for n, v in given)
    h = np.diff(t)
    if len(t) < 2 or len(t) != len(a) or h[0] <= 0 or np.ptp(h) > 1e-6 * h[0]:
        raise SceneError(
            f"shock_spectrum: there are {len(t)} times and {len(a)} accelerations; times must be "
            "as many, at least two, and increase by equal steps"
        )
    if not len(f) or np.any(f <= 0) or len(ratio) != 1 or not 0 <= ratio[0] < 1:
        raise SceneError(
            f"shock_spectrum: frequencies are {_some(f) or None} and damping is {_some(ratio)}; "
            "frequencies must be positive, and damping from 0 to below 1"
        )
    found, double = np.empty(len(f)), 2 * float(ratio[0])
    # of frequency one; an undamped one has no force by the velocity of ground
    oscillator = [double, 1.0][double == 0 :], [1.0, double, 1.0]
    for k, frequency in enumerate(f):
        # times between those given, so that none is far from a peak
        finer = int(np.ceil(min(frequency * h.mean(), 1.0) * PARTS))
        step = 2 * np.pi * frequency * float(h.mean()) / finer
        # a period more, in which ground is at rest
        more = np.zeros(int(np.ceil(2 * np.pi / step)) + 1)
        b, denominator, _ = scipy.signal.cont2discrete(oscillator, step, "foh")
        between = np.interp(np.arange((len(t) - 1) * finer + 1), finer * np.arange(len(t)), a)
        response = scipy.signal.lfilter(b.ravel(), denominator, [*between, *more])
        found[k] = np.abs(response).max()
    return found


def _floats(name: str, given: Any, what: str = "response") -> Floats:
    found = reals_or_nan(given)
    if not np.all(np.isfinite(found)):
        raise SceneError(f"{what}: {name} is {show(given)}; it must be finite numbers")
    return found


def _some(values: Floats) -> str:
    """Values for a message, not more than a few."""
    few = ", ".join(f"{v:g}" for v in np.ravel(values)[:6])
    return few + (", ..." if np.size(values) > 6 else "")
