"""Records of a run at single points."""

from collections.abc import Callable
from typing import Annotated, Any, Literal, get_args

from shellmb.scene.multibody.offsets import Point
from shellmb.scene.types import NONE, Held, Listed, Name, PositiveInt, Spot, Untrue
from shellmb.scene.values.validate import Sentences, described, show

# what a probe can record as a frame sees it
Motion = Literal["displacement", "position", "velocity", "director", "rotation", "angular_velocity"]
# what it records of a section: in motion a mean over the step
Resultant = Literal["force", "moment", "membrane", "bending", "shear"]
MOTIONS, RESULTANTS = get_args(Motion), get_args(Resultant)
Component = Literal[0, 1, 2, "norm"]
# criteria of failure, of stresses along a ply and of those across it, too
InPlane = Literal["max-stress", "max-strain", "tsai-hill", "tsai-wu", "hashin", "puck"]
Across = Literal["interlaminar", "von-mises"]
Z: Any = 2


@described("probe")
class Probe:
    """One number at one point over time.

    Args:
        name: Its column in ``history.csv``.
        at: A named point, or coordinates (x, y, z) of any point of the body [m]; or an ``Offset``
            from a node. Between nodes of a shell or a beam values follow the functions of its
            element.
        quantity: What is recorded; of a shell ``"director"``, of a beam or a rigid body
            ``"rotation"`` (a rotation vector from the reference [rad]) and
            ``"angular_velocity"``, of a beam the resultants ``"force"`` and
            ``"moment"``; of a shell the resultants ``"membrane"`` [N/m] and ``"bending"`` [N] (11,
            22, 12) and ``"shear"`` [N/m] (13, 23). In motion resultants are means over the step,
            all others values at its end. Nodal resultants are extrapolated from the
            element interior (also at free edges) and converge as h^2 (degree 2).
            A rotation vector goes on beyond pi and counts whole turns. Near a whole turn, what
            tumbles has no such vector near the last one: there it jumps by up to ``2 pi``. The
            angle of a joint, ``"JOINT.rotation"``, has no jumps.
        component: 0, 1, 2 for x, y, z (of resultants: along d1, d2, d3; 11, 22, 12; in a frame
            along its axes), or ``"norm"`` for the magnitude.
        body: Name of the body.
        frame: Name of a rigid body or a beam that the motion is seen from: relative to it, along
            its axes d1, d2, d3, in the same units. What moves with it rigidly has no displacement
            and no velocity there. None: the scene's.
        frame_at: Where on that body: a named point or coordinates [m]; None: the reference point
            of a rigid body. Positions are from there; of a beam it is the node whose frame it is.
    """

    name: Name
    at: Point
    quantity: Literal[Motion, Resultant] = "displacement"
    component: Annotated[Held[Component, int | Literal["norm"]], Untrue] = Z
    body: Name | None = None
    frame: Name | None = None
    frame_at: Spot | None = None

    def _wrong(self) -> Sentences:
        """Check that a frame can be seen from."""
        if self.frame is None and self.frame_at is not None:
            yield (
                f"frame_at is {show(self.frame_at)} and frame is missing; it must be the body "
                "whose frame it is"
            )
        if self.frame is not None and self.quantity not in MOTIONS:
            yield (
                f"frame is {show(self.frame)} and quantity {show(self.quantity)}, which has the "
                "axes of its own body; frame must be left out"
            )


@described("reserve")
class Reserve:
    """Least reserve factor of a shell against failure in each step, and over all of them.

    The reserve factor is the factor by which all stresses may grow until the criterion is met. The
    column NAME of the history has its inverse, the utilisation: zero without load, 1 at failure.
    ``run.reserves`` has the least factor of all steps with its place, ply, side, time and mode.

    Args:
        name: Its column in ``history.csv``.
        criterion: Criterion; the materials of the plies need its strengths (`Strength`).
            ``"interlaminar"`` is of the shear between plies.
        body: Name of the shell; None: the only one.
        where: Vectorised function of positions (3, n) that is true at the nodes to look at; None:
            all. Where stresses are singular, as at point forces, they are better left out.
        plies: Numbers of the plies to look at, 1 is the lowest; none: all.
    """

    name: Name
    criterion: Literal[InPlane, Across]
    body: Name | None = None
    where: Callable[[Any], Any] | None = None
    plies: Listed[PositiveInt] = NONE
