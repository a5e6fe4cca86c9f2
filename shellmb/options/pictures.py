"""Options of pictures for the command line: what they show, and how it looks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from shellmb.options.described import option
from shellmb.options.linear import numbers


@dataclass(frozen=True)
class PictureOptions:
    """Choices of a picture of a run; from Python they are arguments of `Run.picture`."""

    field: str | None = option("Field that the colours show: N, force, velocity, deformation, ...")
    component: str | None = option("Component of the field, such as 11, z or norm (magnitude).")
    t: float | None = option("Time; default: the last state.")
    camera: Sequence[float] | None = option(
        "Direction towards the eye, degrees, such as 30,-60.",
        metavar="ELEVATION,AZIMUTH",
        parse=numbers("--camera"),
    )
    width: int | None = option("Width of pictures in space, pixels.")
    theme: Literal["light", "dark"] | None = option("Background: light (default) or dark.")
    enlarge: float | None = option("Factor by which displacements are shown.")
    axes: bool = option("Draw a box of axes with numbers and units.", default=False)
