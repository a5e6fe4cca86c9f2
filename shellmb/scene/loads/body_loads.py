"""Loads on beams and rigid bodies, and moments at points.

The directors d1, d2, d3 are those of a beam's section, d1 along it, or the axes of a rigid body. A
dead load keeps its direction, a follower load turns with the directors.
"""

from shellmb.scene.loads.loads import Load, PointLoad
from shellmb.scene.multibody.offsets import Point
from shellmb.scene.types import Name, Vec3
from shellmb.scene.values.times import TimeFunction
from shellmb.scene.values.user_functions import OfPosition
from shellmb.scene.values.validate import described


@described("line force")
class LineForce(Load):
    """A dead force per unit length of a beam.

    Args:
        force: Its components [N/m], or a vectorised function of positions (3, n) that gives (3, n).
            Between nodes it is interpolated, which spreads a jump over an element.
        body: Name of the beam.
        time: Function of time.
    """

    force: Vec3 | OfPosition
    body: Name | None = None
    time: TimeFunction | None = None


@described("follower line force")
class FollowerLineForce(Load):
    """A force per unit length of a beam that turns with it.

    Args:
        components: Along d1, d2, d3 [N/m].
        body: Name of the beam.
        time: Function of time.
    """

    components: Vec3
    body: Name | None = None
    time: TimeFunction | None = None


@described("line moment")
class LineMoment(Load):
    """A moment per unit length of a beam.

    Args:
        moment: Its components, the axis fixed in space [N m/m].
        body: Name of the beam.
        time: Function of time.
    """

    moment: Vec3
    body: Name | None = None
    time: TimeFunction | None = None


@described("point moment")
class PointMoment(PointLoad):
    """A moment at a node of a shell or beam, or on a rigid body.

    A shell carries none about its director: at the start the moment must be across it; what is
    about it later, when the shell has turned, does no work.

    Args:
        at: A named point, or coordinates (x, y, z) [m].
        moment: Its components, the axis fixed in space [N m].
        body: Name of the body.
        time: Function of time.
    """

    at: Point
    moment: Vec3
    body: Name | None = None
    time: TimeFunction | None = None


@described("follower force")
class FollowerForce(PointLoad):
    """A force at a node of a beam or a point of a rigid body that turns with it.

    Args:
        at: A named point, or coordinates (x, y, z) [m].
        components: Along d1, d2, d3 [N].
        body: Name of the body.
        time: Function of time.
    """

    at: Point
    components: Vec3
    body: Name | None = None
    time: TimeFunction | None = None


@described("follower moment")
class FollowerMoment(PointLoad):
    """A moment at a node of a beam, or on a rigid body, that turns with it.

    Args:
        at: A named point, or coordinates (x, y, z) [m].
        components: Along d1, d2, d3 [N m].
        body: Name of the body.
        time: Function of time.
    """

    at: Point
    components: Vec3
    body: Name | None = None
    time: TimeFunction | None = None
