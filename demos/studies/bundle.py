"""Definition of a bundled study."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from shellmb.accuracy.studies.quantity import Quantity, parse_quantity
from shellmb.accuracy.studies.sweep import Sweep


@dataclass(frozen=True)
class Part:
    """One scene of a bundled study, with a reference of its own.

    Args:
        title: What it is.
        sweep: What is run.
    """

    title: str
    sweep: Sweep


@dataclass(frozen=True)
class Bundled:
    """A study that comes with shellmb.

    Args:
        name: Its name, and that of its files in `demos/studies`.
        what: What is swept, and how far it goes, in one sentence.
        parts: Its scenes.
    """

    name: str
    what: str
    parts: tuple[Part, ...]


def quantities(*texts: str) -> tuple[Quantity, ...]:
    """Quantities that are judged."""
    return tuple(parse_quantity(t) for t in texts)


SCHEMES = ("ep", "ed", "ep4", "ed3")
# all of them, beside rivals, with dissipations that differ; rho = 0.6 for generalized-alpha
ALL: dict[str, Any] = {
    "scheme": (*SCHEMES, "generalized-alpha", "ed-printed"),
    "alpha": (0.0, 0.25, 0.5, 1.0),
    "dissipations": {
        "ed": (0.0, 1.0),
        "ed3": (0.5, 1.0),
        "generalized-alpha": (0.25,),
        "ed-printed": (1.0,),
    },
}
