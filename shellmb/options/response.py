"""Options of responses, for the command line and Python alike."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.options.described import option, options_of, read
from shellmb.options.modes import numbers
from shellmb.scene.values.validate import show

Quantity = Literal["displacement", "velocity", "acceleration"]
Rule = Literal["srss", "cqc"]
RANGE = "frequencies: FROM:TO:COUNT has three numbers, as 1:100:200"


def grid(text: str) -> list[float]:
    """Frequencies that a text means: numbers with commas, or FROM:TO:COUNT.

    Raises:
        SceneError: If it means none.
    """
    if ":" not in text:
        return numbers("--frequencies")(text)
    try:
        first, last, count = text.split(":")
        return [float(f) for f in np.linspace(float(first), float(last), int(count))]
    except ValueError:
        raise SceneError(f"{RANGE}; it is {text!r}") from None


def names(text: str) -> list[str]:
    """Names with commas between them."""
    return [name.strip() for name in text.split(",")]


def curves(text: str) -> dict[str, Any]:
    """Curves by input: `NAME=VALUE`, or `NAME=FILE` with rows of frequency and value, with commas.

    Raises:
        SceneError: If there is no such file, or it holds no two columns.
    """
    found: dict[str, Any] = {}
    for part in names(text):
        name, _, value = part.partition("=")
        try:
            found[name] = float(value)
        except ValueError:
            try:
                read_in = np.loadtxt(value, delimiter=",", comments="#", ndmin=2)
                frequency, density = read_in.T
            except (OSError, ValueError) as error:
                raise SceneError(
                    f"{part!r} means no curve ({error}); it must be INPUT=NUMBER, or INPUT=FILE "
                    "with two columns and commas: frequency [Hz], value"
                ) from None
            found[name] = (frequency, density)
    return found


@dataclass(frozen=True)
class ResponseOptions:
    """Choices of a response: of what, to what, and how it is found."""

    frequencies: Sequence[float] = option(
        "Frequencies [Hz], increasing: numbers, or FROM:TO:COUNT.",
        metavar="FREQUENCIES",
        parse=grid,
    )
    inputs: Sequence[str] | None = option(
        "Inputs that act, such as load1, base.z or a motor's name; default: all loads and motors, "
        "or those with a density.",
        flag="--input",
        metavar="NAMES",
        parse=names,
    )
    outputs: Sequence[str] | None = option(
        "Outputs, such as a probe's name or JOINT.F1; default: all.",
        flag="--output",
        metavar="NAMES",
        parse=names,
    )
    modes: int | None = option(
        "Number of undamped modes to reduce to; default: none, all unknowns."
    )
    damping: Sequence[float] | float | None = option(
        "Damping ratio of each mode in place of the scene's damping: one for all, or one each.",
        metavar="RATIOS",
        parse=numbers("--damping"),
    )
    quantity: Quantity = option(  # noqa: RUF009 - a field, as the others
        "Displacement: outputs as they are; velocity or acceleration: their derivatives.",
        default="displacement",
    )
    absolute: bool = option(
        "Outputs in space, not relative to ground that inputs base.x, base.y, base.z accelerate.",
        default=False,
    )
    psd: Mapping[str, Any] | None = option(
        "One-sided power spectral densities of inputs [unit^2/Hz], as INPUT=VALUE or INPUT=FILE: "
        "densities and RMS of outputs.",
        metavar="INPUT=PSD",
        parse=curves,
    )
    spectrum: Mapping[str, Any] | None = option(
        "Response spectra of accelerations of ground [m/s^2], as base.z=VALUE or base.z=FILE: "
        "largest outputs.",
        metavar="INPUT=SPECTRUM",
        parse=curves,
    )
    rule: Rule = option(  # noqa: RUF009 - a field, as the others
        "How largest outputs of modes are combined.", default="cqc"
    )

    def check(self) -> None:
        """Refuse what makes no sense.

        Raises:
            SceneError: Names the option, its value, and what would be right.
        """
        given = _floats("frequencies", self.frequencies)
        if not len(given) or given[0] < 0 or np.any(np.diff(given) <= 0):
            raise SceneError(
                f"response: frequencies are {_some(given)}; they must be one or more numbers in "
                "Hz, from 0 on, each larger than the one before"
            )
        if self.damping is not None:
            ratios = np.atleast_1d(_floats("damping", self.damping))
            if self.modes is None:
                raise SceneError(
                    f"response: damping is {_some(ratios)} without modes; give modes, whose "
                    "ratios these are, or leave it out: the scene's own damping acts"
                )
            if np.any(ratios < 0) or np.any(ratios >= 1) or len(ratios) not in (1, self.modes):
                raise SceneError(
                    f"response: damping is {_some(ratios)}; it must be one ratio from 0 to 1, or "
                    f"one for each of the {self.modes} modes"
                )
        for name, curve in (self.psd or {}).items():
            curve_of(curve, f"psd of '{name}'")
        for name, curve in (self.spectrum or {}).items():
            curve_of(curve, f"spectrum of '{name}'")
            if not name.startswith("base."):
                raise SceneError(
                    f"response: spectrum is given for {name!r}; it must be of base.x, base.y or "
                    "base.z"
                )
        if self.spectrum is not None and self.modes is None:
            raise SceneError(
                "response: spectrum is given without modes; give modes, which it acts on"
            )


def curve_of(curve: Any, said: str) -> tuple[Floats, Floats]:
    """Frequencies and values of a curve; a number is one that is the same everywhere.

    Args:
        curve: A number, or frequencies [Hz] and values.
        said: What it is, for messages.

    Raises:
        SceneError: If it is none, values are negative, or frequencies do not increase.
    """
    pair: Any = ([0.0], [curve]) if np.ndim(curve) == 0 else curve
    if len(pair) != 2:
        raise SceneError(
            f"response: {said} has {len(pair)} parts; it must be frequencies and values"
        )
    f, values = (np.atleast_1d(_floats(said, part)) for part in pair)
    if len(f) != len(values):
        raise SceneError(
            f"response: {said} has {len(f)} frequencies and {len(values)} values; there must be "
            "as many"
        )
    if np.any(values < 0):
        raise SceneError(f"response: {said} is {values.min():g} somewhere; it must not be negative")
    if f[0] < 0 or np.any(np.diff(f) <= 0):
        raise SceneError(
            f"response: frequencies of {said} are {_some(f)}; they must increase from 0"
        )
    return f, values


def at_frequencies(curve: Any, f: Floats, said: str) -> Floats:
    """Values of a curve, in logarithms of both linear, zero outside of it.

    Args:
        curve: As of `curve_of`.
        f: Frequencies, Hz.
        said: What it is, for messages.
    """
    given, values = curve_of(curve, said)
    if np.ndim(curve) == 0:
        return np.full(len(f), values[0])
    tiny = np.finfo(float).tiny
    logs = np.interp(np.log(f + tiny), np.log(given + tiny), np.log(values + tiny))
    inside = (f >= given[0]) & (f <= given[-1])
    return np.where(inside, np.exp(logs), 0.0)


def take_response(options: dict[str, Any]) -> ResponseOptions:
    """Take the choices of a response out of the options of a command or function.

    Args:
        options: The options, by their names.

    Raises:
        SceneError: If a text means no value, or something makes no sense.
    """
    found = {one.name: options.pop(one.name, None) for one in options_of(ResponseOptions)}
    if found["frequencies"] is None:
        raise SceneError("response: frequencies are missing; give them in Hz, such as 1:100:200")
    given = {k: v for k, v in read(ResponseOptions, found).items() if v is not None}
    made = ResponseOptions(**given)
    made.check()
    return made


def _floats(name: str, given: Any) -> Floats:
    try:
        found = np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        found = np.array([np.nan])
    if not np.all(np.isfinite(found)):
        raise SceneError(f"response: {name} is {show(given)}; it must be finite numbers")
    return found


def _some(values: Floats) -> str:
    """Values for a message, not more than a few."""
    few = ", ".join(f"{v:g}" for v in np.ravel(values)[:6])
    return few + (", ..." if np.size(values) > 6 else "")


def directory_of(state: Any) -> Path | None:
    """Directory of a run that is given as one, or by its name."""
    return None if state is None else Path(getattr(state, "directory", state))
