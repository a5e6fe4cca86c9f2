"""Options of modes, for the command line and Python alike."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

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
class ModesOptions:
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
    axis: Sequence[float] | None = option(
        "Direction of the axis of rotation; default: that about which the scene turns.",
        metavar="X,Y,Z",
        parse=numbers("--axis"),
    )
    about: Sequence[float] | None = option(
        "A point of the axis of rotation.", metavar="X,Y,Z", parse=numbers("--about")
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

    def check_errors(self) -> None:
        """Refuse errors of other modes than natural ones.

        Raises:
            SceneError: If rates, a state or buckling are given.
        """
        if self.moving or self.buckling or self.rates is not None:
            raise SceneError(NATURAL)

    def check(self) -> None:
        """Refuse what does not go together.

        Raises:
            SceneError: If an option has no effect beside the others.
        """
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
