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
STATES = ("rest", "equilibrium")
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


def moment(text: str) -> str | float:
    """A state that a text means: `rest`, `equilibrium`, or a time."""
    try:
        return float(text)
    except ValueError:
        return text


@dataclass(frozen=True)
class LinearOptions:
    """Choices of what a scene is linearised about; without any of them that is rest."""

    at: Literal["rest", "equilibrium"] | float | None = option(
        "State: 'rest' is the reference without loads, 'equilibrium' the static one under the "
        "loads, a number the time of a state [s], up to which the scene is run. Default: rest, or "
        "the last state of the run that is given.",
        metavar="STATE",
        parse=moment,
    )
    state: Path | str | None = option(  # noqa: RUF009 - a field, as the others
        "Directory of a run of the scene, whose state is meant.", metavar="RUN_DIR"
    )
    rate: float | None = option(
        "Rate of a steady rotation [rad/s]; with a state of a run that of its frame, in whose axes "
        "inputs and outputs are.",
        metavar="RATE",
    )
    axis: Sequence[float] | None = option(
        "Direction of the axis of rotation; default: that about which the scene turns.",
        metavar="X,Y,Z",
        parse=numbers("--axis"),
    )
    about: Sequence[float] | None = option(
        "A point of the axis of rotation [m].", metavar="X,Y,Z", parse=numbers("--about")
    )

    def check(self, what: str) -> None:
        """Refuse what does not go together.

        Args:
            what: Who asks, for the error.

        Raises:
            SceneError: Names the options.
        """
        if self.at is not None and not self.timed and self.at not in STATES:
            raise SceneError(
                f"{what}: at is {show(self.at)}; it must be 'rest', 'equilibrium' or a time"
            )
        if self.state is not None and isinstance(self.at, str):
            raise SceneError(
                f"{what}: at is {show(self.at)} and a state is given; give one of them"
            )
        still = self.rate is None and self.state is None and not self.timed
        if still and (self.axis is not None or self.about is not None):
            raise SceneError(f"{what}: axis and about are given without rate; give rate, too")

    @property
    def timed(self) -> bool:
        """Decide whether a time is given."""
        return isinstance(self.at, int | float) and not isinstance(self.at, bool)


@dataclass(frozen=True)
class ResponseOptions:
    """Choices of a response: of what, to what, and how it is found."""

    frequencies: Sequence[float] | None = option(
        "Frequencies [Hz], increasing: numbers, or FROM:TO:COUNT. They have to be given.",
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

    def check(self) -> None:
        """Refuse what makes no sense.

        Raises:
            SceneError: Names the option, its value, and what would be right.
        """
        given = _floats("frequencies", () if self.frequencies is None else self.frequencies)
        if not len(given) or given[0] < 0 or np.any(np.diff(given) <= 0):
            raise SceneError(
                f"response: frequencies are {_some(given) or None}; they must be one or more "
                "numbers in Hz, from 0 on, each larger than the one before"
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


def take[T](kind: type[T], options: dict[str, Any]) -> T:
    """Take the choices of one kind out of the options of a command or function.

    Args:
        kind: The kind.
        options: The options, by their names.

    Raises:
        SceneError: If a text means no value.
    """
    given = read(kind, {one.name: options.pop(one.name, None) for one in options_of(kind)})
    return kind(**{k: v for k, v in given.items() if v is not None})


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
