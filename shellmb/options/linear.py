"""Options of modes, linear systems and responses, for the command line and Python alike."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from shellmb.errors import SceneError
from shellmb.options.described import option

NATURAL = (
    "modes: errors are estimated of natural modes at rest only; leave out errors and accuracy, or "
    "the rates, the state and buckling. Load factors have no errors: a buckle too short for the "
    "mesh is missing in the comparison run as well; compare the factors with divide=2"
)


def numbers(name: str) -> Callable[[str], list[float]]:
    """Parser of numbers separated by commas.

    Args:
        name: Name of the option.
    """

    def parse(text: str) -> list[float]:
        try:
            return [float(part) for part in text.split(",")]
        except ValueError:
            raise SceneError(f"{name} is {text!r}; it must be numbers as 0,5,10") from None

    return parse


@dataclass(frozen=True)
class AxisOptions:
    """The axis of a rotation."""

    axis: Sequence[float] | None = option(
        "Direction of the axis of rotation; default: that about which the scene turns.",
        metavar="X,Y,Z",
        parse=numbers("--axis"),
    )
    about: Sequence[float] | None = option(
        "A point of the axis of rotation [m].", metavar="X,Y,Z", parse=numbers("--about")
    )


@dataclass(frozen=True)
class ModesOptions(AxisOptions):
    """Choices of what modes are about; without any of them that is rest, without damping."""

    loaded: bool = option(
        "Linearise about the static equilibrium under the loads, with dampers and the damping of "
        "sections.",
        default=False,
    )
    rates: Sequence[float] | None = option(
        "Linearise about steady rotations at these rates, ascending [rad/s], such as 0,5,10: "
        "complex modes.",
        flag="--rate",
        metavar="RATES",
        parse=numbers("--rate"),
    )
    state: Path | str | None = option(  # noqa: RUF009 - a field, as the others
        "Linearise about the last state of this run of the scene, frozen in time, in a frame that "
        "turns as the state does, or with the one rate that is given: complex modes.",
        metavar="RUN_DIR",
    )
    at: float | None = option(
        "Linearise about the state at this time [s]. The scene is run up to this time first.",
        metavar="TIME",
    )
    buckling: bool = option("Load factors of linear buckling under the loads.", default=False)

    @property
    def moving(self) -> bool:
        """Decide whether modes are about a state of a run."""
        return self.state is not None or self.at is not None

    def check(self, errors: bool) -> None:
        """Refuse what does not go together.

        Args:
            errors: Whether errors are estimated, which natural modes have only.

        Raises:
            SceneError: If an option has no effect beside the others.
        """
        if errors and (self.moving or self.buckling or self.rates is not None):
            raise SceneError(NATURAL)
        line = self.axis is not None or self.about is not None
        if self.buckling and (self.loaded or self.moving or self.rates is not None or line):
            raise SceneError(
                "modes: buckling is about the reference; loaded, rates, axis, about, state and at "
                "must be left out"
            )
        if self.moving and self.loaded:
            raise SceneError("modes: loaded is given with a state, whose loads act; leave it out")
        if line and self.rates is None and not self.moving:
            raise SceneError("modes: axis and about are given without rates; give rates, too")


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
        low, high, steps = float(first), float(last), int(count) - 1
        return [low + (high - low) * k / max(steps, 1) for k in range(steps + 1)]
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
    import numpy as np

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
class LinearOptions(AxisOptions):
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

    def check(self, what: str) -> None:
        """Refuse what does not go together.

        Args:
            what: Who asks, for the error.

        Raises:
            SceneError: Names the options.
        """
        if self.at is not None and not self.timed and self.at not in STATES:
            raise SceneError(
                f"{what}: at is {self.at!r}; it must be 'rest', 'equilibrium' or a time"
            )
        if self.state is not None and isinstance(self.at, str):
            raise SceneError(f"{what}: at is {self.at!r} and a state is given; give one of them")
        if self.rate is not None and not math.isfinite(self.rate):
            raise SceneError(f"{what}: rate is {self.rate}; it must be finite, in rad/s")
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
    modes: int | None = option("Number of undamped modes to reduce to; none: all unknowns.")
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
