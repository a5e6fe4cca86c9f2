"""Options of an accuracy on request, for the command line and Python alike."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from shellmb.errors import SceneError
from shellmb.options.described import option, take

# seconds of the units of a budget
UNITS = {"ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0}
AUTO = "auto"
# least relative error that may be requested: round-off of forces, over steps
LEAST = 1e-12
# file of a request in its directory
ACCURACY = "accuracy.json"


def parse_seconds(text: str) -> float:
    """A time from "60s", "5min" or a number of seconds.

    Args:
        text: The text.

    Raises:
        SceneError: If it is none.
    """
    for unit in sorted(UNITS, key=len, reverse=True):
        if text.endswith(unit):
            number, factor = text.removesuffix(unit), UNITS[unit]
            break
    else:
        number, factor = text, 1.0
    try:
        return float(number) * factor
    except ValueError:
        raise SceneError(f"budget is '{text}'; it must be a time as 60s, 5min or 1h") from None


@dataclass(frozen=True, kw_only=True)
class AccuracyOptions:
    """Options of a run with a required accuracy, and what other options say of it.

    Args:
        auto: Whether the scheme is chosen.
        body: The only body whose mesh is refined; None: all.

    Raises:
        SceneError: If a number is not possible, or others are given without an accuracy.
    """

    accuracy: float | None = option(
        "Refine mesh and step until the relative error is at most this, such as 1e-3. "
        "`--scheme auto` also chooses among ep, ed, ep4 and ed3; with `--body` only its mesh is "
        "refined.",
        metavar="ERROR",
    )
    of: str | None = option(
        "Quantity that has to meet it: a result, a probe or COLUMN:NORM; default: the first probe.",
        metavar="NAME",
    )
    budget: float | None = option(
        "Begin no further refinement after this time, such as 60s or 5min.",
        metavar="TIME",
        parse=parse_seconds,
    )

    auto: bool = False
    body: str | None = None

    def __post_init__(self) -> None:
        """Check what no scene checks."""
        if self.accuracy is None:
            for name in ("of", "budget"):
                if getattr(self, name) is not None:
                    raise SceneError(
                        f"{name} is {getattr(self, name)}, and no accuracy is given; give "
                        "accuracy, a relative error as 1e-3"
                    )
        elif not 0.0 < self.accuracy < 1.0:
            raise SceneError(
                f"accuracy is {self.accuracy:g}; it must be a relative error between 0 and 1, as "
                "1e-3"
            )
        elif self.accuracy < LEAST:
            raise SceneError(
                f"accuracy is {self.accuracy:g}; it must be at least {LEAST:g}: results have no "
                "more digits"
            )
        if self.budget is not None and not self.budget > 0.0:
            raise SceneError(f"budget is {self.budget:g} s; it must be a positive time, as 60s")


def take_accuracy(options: dict[str, Any]) -> AccuracyOptions | None:
    """Take what is asked of an accuracy out of the options of a run; None: nothing is.

    Args:
        options: The options, by their names.

    Raises:
        SceneError: If one is impossible, or a scheme is to be chosen without an accuracy.
    """
    auto = options.get("scheme") == AUTO
    own = take(AccuracyOptions, options, auto=auto, body=options.get("body"))
    if auto:
        options["scheme"] = None
        if own.accuracy is None:
            raise SceneError(
                "scheme is 'auto', and no accuracy is given; give accuracy, by which it is chosen"
            )
    return None if own.accuracy is None else own
