"""Loads on shells, beams and rigid bodies.

``body`` names the body and may be left out where the scene has one only that can carry the load.
Where a load may be a function of the position, it is vectorised: of reference positions (3, n), and
gives an array (3, n), or (n,) for a pressure; it is interpolated once. ``time`` multiplies the
load; without it a load grows as t / t_end in statics, and is sudden and constant in dynamics.
Forces are per unit area or length of the reference surface. A dead load keeps its direction; a
follower load turns with the convected basis E1, E2, E3 of the deformed shell, which begins as the
material 1-direction, the one across it, and the normal; or with the directors d1, d2, d3 of a
beam's section, d1 along it, or of a rigid body's axes.
"""

from typing import ClassVar

from shellmb.scene.multibody.offsets import Point
from shellmb.scene.types import Edge, Finite, Name, Vec3
from shellmb.scene.values.times import TimeFunction
from shellmb.scene.values.user_functions import OfPosition
from shellmb.scene.values.validate import described


class Load:
    """Base class of loads.

    Attributes:
        label: What messages call it.
        body: Name of the loaded body, or None.
        time: Function of time that multiplies it, or None.
        at_point: Whether it acts at one point.
        weighs: Whether it acts on mass.
    """

    body: str | None
    time: TimeFunction | None
    label: ClassVar[str] = "load"
    at_point: ClassVar[bool] = False
    weighs: ClassVar[bool] = False


@described("edge load")
class EdgeLoad(Load):
    """Any load along edges of a shell.

    Args:
        at: The edge or edges.
    """

    at: Edge


@described("point load")
class PointLoad(Load):
    """Any load at one point of a body.

    Args:
        at: A named point, coordinates, or an ``Offset`` from a node.
    """

    at: Point

    at_point = True


@described("spread force")
class SpreadForce(Load):
    """Base class of forces per unit area or length, with directions in space.

    Args:
        force: The force, or a function of the position.
        body: Name of the body.
        time: Function of time.
    """

    force: Vec3 | OfPosition
    body: Name | None = None
    time: TimeFunction | None = None


@described("follower load")
class FollowerLoad(Load):
    """Base class of loads that turn with what they act on.

    Args:
        components: Components along directions that turn.
        body: Name of the body.
        time: Function of time.
    """

    components: Vec3
    body: Name | None = None
    time: TimeFunction | None = None


@described("surface force")
class SurfaceForce(SpreadForce):
    """A dead force per unit area.

    Args:
        force: Its components [N/m^2], or a function of the position.
        body: Name of the shell.
        time: Function of time.
    """


@described("follower surface force")
class FollowerSurfaceForce(FollowerLoad):
    """A force per unit area that turns with the shell.

    Args:
        components: Along E1, E2, E3 [N/m^2].
        body: Name of the shell.
        time: Function of time.
    """


@described("pressure")
class Pressure(Load):
    """A pressure on the lower face: it pushes along the normal E3 of the deformed shell.

    Args:
        p: Pressure, positive along E3 [Pa], or a function of the position.
        body: Name of the shell.
        time: Function of time.
    """

    p: Finite | OfPosition
    body: Name | None = None
    time: TimeFunction | None = None


@described("edge force")
class EdgeForce(SpreadForce, EdgeLoad):
    """A dead force per unit length of an edge.

    Args:
        at: The edge or edges.
        force: Its components [N/m], or a function of the position.
        body: Name of the shell.
        time: Function of time.
    """


@described("follower edge force")
class FollowerEdgeForce(FollowerLoad, EdgeLoad):
    """A force per unit length of an edge that turns with the shell.

    Args:
        at: The edge or edges.
        components: Along E1, E2, E3 [N/m].
        body: Name of the shell.
        time: Function of time.
    """


@described("edge moment")
class EdgeMoment(EdgeLoad):
    """A moment per unit length of an edge.

    Args:
        at: The edge or edges.
        moment: Its components, the axis fixed in space [N m/m], or a function of the position.
        body: Name of the shell.
        time: Function of time.
    """

    moment: Vec3 | OfPosition
    body: Name | None = None
    time: TimeFunction | None = None


@described("point force")
class PointForce(PointLoad):
    """A dead force at one point.

    Args:
        at: A named point, or coordinates (x, y, z): of a node of a shell or a beam, of any
            point of a rigid body [m]; or an ``Offset`` from a node.
        force: Its components [N].
        body: Name of the body.
        time: Function of time.
    """

    force: Vec3
    body: Name | None = None
    time: TimeFunction | None = None


@described("gravity")
class Gravity(Load):
    """Weight of one body, or of all.

    Args:
        acceleration: Its components [m/s^2].
        body: Name of the body; None: all of them.
        time: Function of time.
    """

    acceleration: Vec3 = (0.0, 0.0, -9.81)
    body: Name | None = None
    time: TimeFunction | None = None

    weighs = True


@described("line force")
class LineForce(SpreadForce):
    """A dead force per unit length of a beam.

    Args:
        force: Its components [N/m], or a vectorised function of positions (3, n) that gives (3, n).
            Between nodes it is interpolated, which spreads a jump over an element.
        body: Name of the beam.
        time: Function of time.
    """


@described("follower line force")
class FollowerLineForce(FollowerLoad):
    """A force per unit length of a beam that turns with it.

    Args:
        components: Along d1, d2, d3 [N/m].
        body: Name of the beam.
        time: Function of time.
    """


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

    moment: Vec3
    body: Name | None = None
    time: TimeFunction | None = None


@described("follower force")
class FollowerForce(FollowerLoad, PointLoad):
    """A force at a node of a beam or a point of a rigid body that turns with it.

    Args:
        at: A named point, or coordinates (x, y, z) [m].
        components: Along d1, d2, d3 [N].
        body: Name of the body.
        time: Function of time.
    """


@described("follower moment")
class FollowerMoment(FollowerLoad, PointLoad):
    """A moment at a node of a beam, or on a rigid body, that turns with it.

    Args:
        at: A named point, or coordinates (x, y, z) [m].
        components: Along d1, d2, d3 [N m].
        body: Name of the body.
        time: Function of time.
    """
