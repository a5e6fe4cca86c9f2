"""What a run records at single points."""

from __future__ import annotations

from typing import Annotated, Literal

from shellmb.scene.values.validate import Name, Place, Untrue, described

__all__ = ["Probe"]

Quantity = Literal[
    "displacement",
    "position",
    "velocity",
    "director",
    "rotation",
    "angular_velocity",
    "force",
    "moment",
    "membrane",
    "bending",
    "shear",
]


@described("probe")
class Probe:
    """One number at one point over time.

    Args:
        name: Its column in ``history.csv``.
        point: A named point, or coordinates (x, y, z): of a node of a shell or a beam, of any
            point of a rigid body [m].
        quantity: What is recorded; of a shell ``"director"``, of a beam or a rigid body
            ``"rotation"`` (a rotation vector [rad]) and ``"angular_velocity"``, of a beam the
            resultants ``"force"`` and ``"moment"``; of a shell the resultants ``"membrane"`` [N/m]
            and ``"bending"`` [N] (11, 22, 12) and ``"shear"`` [N/m] (13, 23). In motion resultants
            are means over the step, all others values at its end.
        component: 0, 1, 2 for x, y, z (of resultants: along d1, d2, d3; 11, 22, 12), or
            ``"norm"`` for the magnitude.
        body: Name of the body.
    """

    name: Name
    point: Place
    quantity: Quantity = "displacement"
    component: Annotated[Literal[0, 1, 2, "norm"], Untrue] = 2
    body: Name | None = None
