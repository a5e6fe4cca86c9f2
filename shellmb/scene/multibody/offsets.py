"""Points off a node, at the end of a rigid arm."""

from typing import Annotated, Any

import numpy as np
from pydantic import InstanceOf

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.scene.types import Finite, Name, Spot, Vec3, explained
from shellmb.scene.values.validate import described, show

# a vector off a shell's director by more than this part of it is not along it
ALONG = 1e-6


Arm = Annotated[
    Vec3 | Finite, explained("it must be a vector of three finite numbers, or one number")
]


@described("offset point")
class Offset:
    """A point at the end of a massless rigid arm that turns with a node of a shell or beam.

    It stands wherever a joint, spring, load or probe asks for a point of a body. A beam's node is a
    frame, and the arm may have any direction. A shell's node knows no rotation about its director,
    so its arm is along that: a lug, a hinge on the lower face.

    Args:
        at: The node: a named point, or its coordinates (x, y, z) [m].
        by: From there to the point in the reference configuration, in the scene's axes [m]; of a
            shell also one number, the distance along the director.
    """

    at: Spot
    by: Arm


Point = Annotated[
    Name | Vec3 | InstanceOf[Offset],
    explained("it must be the name of a point, finite coordinates (x, y, z), or an Offset"),
]


def node_of(point: Any) -> Any:
    """The node of an offset point; anything else as it is."""
    return point.at if isinstance(point, Offset) else point


def arm_components(by: Any, directors: Floats, who: str, body: str) -> Floats:
    """Components of an arm along the directors of its node, shape (m,) [m].

    Args:
        by: The arm: a vector in the scene's axes, or of a shell one number.
        directors: Reference directors as rows, shape (m, 3): one of a shell, three of a frame.
        who: Who asks, for the error.
        body: What messages call the body.

    Raises:
        SceneError: If the node has no such direction.
    """
    given = np.asarray(by, dtype=float)
    if len(directors) == 3:
        if not given.ndim:
            raise SceneError(
                f"{who}: the offset is {show(by)} and {body} is no shell; it must be a vector"
            )
        return np.asarray(directors @ given)
    if not given.ndim:
        return given.reshape(1)
    along = directors @ given
    across = float(np.linalg.norm(given - along @ directors))
    if across > ALONG * float(np.linalg.norm(given)):
        normal = ", ".join(f"{c:.6g}" for c in directors[0])
        raise SceneError(
            f"{who}: the offset {show(by)} is {across:.3g} off the director ({normal}) of {body}, "
            "whose nodes know no rotation about it; it must be along the director, or one number, "
            "the distance along it, or the place must be on a rigid body welded to the shell"
        )
    return np.asarray(along)
