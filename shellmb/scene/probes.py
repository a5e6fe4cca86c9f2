"""What a run records at single points."""

from __future__ import annotations

from typing import Literal

from shellmb.scene.validate import Name, Place, described

__all__ = ["Probe"]


@described("probe")
class Probe:
    """One number at one point over time.

    Args:
        name: Its column in ``history.csv``.
        point: A named point, or the coordinates (x, y, z) of a node [m].
        quantity: What is recorded.
        component: 0, 1, 2 for x, y, z, or ``"norm"`` for the magnitude.
        body: Name of the shell.
    """

    name: Name
    point: Place
    quantity: Literal["displacement", "position", "velocity", "director"] = "displacement"
    component: Literal[0, 1, 2, "norm"] = 2
    body: Name | None = None
