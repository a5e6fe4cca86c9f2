"""Hinges along edges: two shells that share an edge line and turn about it."""

from __future__ import annotations

from dataclasses import field

from shellmb.errors import SceneError
from shellmb.scene.multibody.joints import Joint, Revolute
from shellmb.scene.values.validate import Axis, described, show


@described("edge hinge")
class EdgeHinge(Joint):
    """Two shells that share a straight edge line and turn about it; or a shell and a rigid body.

    The edges stay together at every node, and the directors turn freely about the line. The nodes
    of the two edges may coincide or not. Springs, dampers, stops, locks and events act on the
    rotation of the hinge as on that of a revolute joint. Constraints that supports imply, or at
    single nodes other hinges, as at a corner, are left out without an error.

    Args:
        name: What drivers, force elements and results call it.
        first: Name of a shell, a rigid body, or ``"ground"``.
        second: Name of the other; one of the two must be a shell.
        at: Edge of the first body if that is a shell; None otherwise.
        second_at: Edge of the second body if that is a shell; None otherwise.
        axis: Direction along the edge about which the second shell's rotation is right-handed;
            None: that in which x grows along the edge, or else y, or else z.
        rigid_angle: Whether the angle is the same all along the edge. If False, each node has its
            own: stiffness and damping of springs, dampers and stops are distributed evenly along
            the edge, locks hold each angle, ``NAME.rotation`` is the mean, and ``NAME.1.rotation``
            and so on are the angles along ``axis``.
        active: None: it acts always.
        mass: 0: the shells or a rigid body have the mass of the hardware.
    """

    axis: Axis | None = field(default=None, kw_only=True)
    rigid_angle: bool = field(default=False, kw_only=True)

    freedoms = ("rotation",)
    shells = (True, True)

    def __post_init__(self) -> None:
        """Check what concerns the hinge alone.

        Raises:
            SceneError: If it has a mass or windows, or an end is no edge.
        """
        super().__post_init__()
        if self.mass:
            raise SceneError(
                f"{self.said}: mass is {show(self.mass)}; it must be 0, where the mass of a hinge "
                "is part of a rigid body or of a shell"
            )
        if self.active is not None:
            raise SceneError(
                f"{self.said}: active is {show(self.active)}; it must be left out, because an edge "
                "hinge acts always"
            )
        for name in ("at", "second_at"):
            where = getattr(self, name)
            if where is not None and not isinstance(where, str):
                raise SceneError(
                    f"{self.said}: {name} is {show(where)}; it must be the name of an edge, or be "
                    "left out where the body is no shell"
                )


@described("revolute joint")
class FramedHinge(Revolute):
    """Revolute joint in place of an edge hinge whose edges both move as frames."""

    along_scene = True
