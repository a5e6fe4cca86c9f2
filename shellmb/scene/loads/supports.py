"""Supports and prescribed motions.

Every ``at`` is the name of an edge or a tuple of names, unless the support says more; ``body``
names the shell and may be left out where the scene has one only. An area of a shell
(``Shell(areas=...)``) is fixed likewise, all of its nodes: by its name in the place of an
edge's, except where a support goes along an edge (``HardSupport``). ``Clamped``, ``Hinged`` and
``Fixed`` hold beams too: their edges are ``start`` and ``end``. Rigid bodies are fixed by
joints to the ground.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, ClassVar

from shellmb.scene.multibody.offsets import Arm
from shellmb.scene.types import Axis, Edge, Finite, Name, Place, Vec3
from shellmb.scene.values.times import TimeFunction
from shellmb.scene.values.validate import Sentences, described, show

Component = Finite | Callable[[float], float] | None
Components = tuple[Component, Component, Component]


class Support:
    """Base class of supports.

    Attributes:
        label: What messages call it.
        at: Where it holds the body.
        body: Name of the supported shell or beam, or None.
        rotation: Angle over time that it turns by, or None.
        translation: Displacement over time that it moves by, or None.
        hinges: Whether it lets directors turn freely about the places that it holds.
    """

    at: Any
    body: str | None
    label: ClassVar[str] = "support"
    hinges: ClassVar[bool] = False
    rotation: Any = None
    translation: Any = None

    @property
    def given(self) -> dict[str, Any]:
        """Values that it prescribes, numbers or functions of time, by their names; None: free."""
        return {}

    @property
    def still(self) -> Support:
        """A support that holds where it is what this one holds elsewhere or moves."""
        return self


@described("edge support")
class EdgeSupport(Support):
    """Any support of edges.

    Args:
        at: The edge or edges.
    """

    at: Edge


@described("clamped edge")
class Clamped(EdgeSupport):
    """Clamped edges: no displacement and no rotation.

    Args:
        at: The edge or edges.
        body: Name of the shell or beam.
    """

    body: Name | None = None


@described("hinged edge")
class Hinged(EdgeSupport):
    """Hinged edges: no displacement, and the directors are free.

    Args:
        at: The edge or edges.
        body: Name of the shell or beam.
        offset: From the nodes to the fixed points, as in ``Offset``: of a shell the distance along
            the director [m], so that a hinge may be on one of its faces.
    """

    body: Name | None = None
    offset: Arm = 0.0

    hinges = True


@described("soft support")
class SoftSupport(EdgeSupport):
    """Simple support: no displacement along one axis, everything else free.

    Args:
        at: The edge or edges.
        axis: Direction of the fixed displacement, for a plate its normal.
        body: Name of the shell.
        offset: From the nodes to the fixed points: the distance along the director [m].
    """

    axis: Axis = (0.0, 0.0, 1.0)
    body: Name | None = None
    offset: Arm = 0.0


@described("hard support")
class HardSupport(EdgeSupport):
    """Hard simple support: also fixes the rotation about the edge normal.

    Displacements across ``axis`` stay free: a plate that nothing else holds has three rigid motions
    in its plane, with frequencies of 0. ``Fixed`` at two corners holds it there.

    Args:
        at: The edge or edges.
        axis: Direction of the fixed displacement, for a plate its normal.
        body: Name of the shell.
    """

    axis: Axis = (0.0, 0.0, 1.0)
    body: Name | None = None


@described("diaphragm")
class Diaphragm(EdgeSupport):
    """Thin wall at an edge: fixes in-plane displacements of the wall; the rest is free.

    Args:
        at: The edge or edges.
        axis: Normal of the wall, for a cylinder its axis.
        body: Name of the shell.
    """

    axis: Axis
    body: Name | None = None


@described("symmetry plane")
class SymmetryPlane(EdgeSupport):
    """A plane of symmetry: the edge and its director stay in it.

    Args:
        at: The edge or edges.
        normal: Normal of the plane.
        body: Name of the shell.
    """

    normal: Axis
    body: Name | None = None


@described("fixed components")
class Fixed(Support):
    """Single components of a displacement, fixed or prescribed over time.

    Args:
        at: An edge or several (of a beam ``start`` or ``end``), a named point, or the
            coordinates (x, y, z) of a node [m].
        displacement: For each component the value [m], a function of time, or None where free.
        director: The same for the change of the director of a shell [-].
        body: Name of the shell or beam.
    """

    at: Place
    displacement: Components = (None, None, None)
    director: Components = (None, None, None)
    body: Name | None = None

    @property
    def given(self) -> dict[str, Any]:
        """Each of the components."""
        both = {"displacement": self.displacement, "director": self.director}
        return {f"{name}[{k}]": c for name, some in both.items() for k, c in enumerate(some)}

    @property
    def still(self) -> Support:
        """The components, fixed where they are."""
        both = {"displacement": self.displacement, "director": self.director}
        zeros: Any = {n: [None if c is None else 0.0 for c in some] for n, some in both.items()}
        return replace(self, **zeros)

    def _wrong(self) -> Sentences:
        """Check that something is fixed."""
        if all(c is None for c in self.given.values()):
            yield (
                f"nothing is fixed at {show(self.at)}; give at least one component of displacement "
                "or director"
            )


@described("driven edge")
class Driven(EdgeSupport):
    """A clamped edge carried along by a rigid motion.

    Positions on the edge are ``about + R(rotation(t)) (X - about) + translation(t)``, directors
    ``R(rotation(t)) D``.

    Args:
        at: The edge or edges.
        about: A point of the axis of rotation [m].
        axis: Its direction.
        rotation: Angle about the axis as a function of time [rad]; None: no rotation.
        translation: Displacement (3,) over time [m]; None: none.
        body: Name of the shell.
    """

    about: Vec3 = (0.0, 0.0, 0.0)
    axis: Axis = (0.0, 0.0, 1.0)
    rotation: TimeFunction | None = None
    translation: Callable[[float], Any] | None = None
    body: Name | None = None

    @property
    def given(self) -> dict[str, Any]:
        """Rotation and translation."""
        return {"rotation": self.rotation, "translation": self.translation}

    @property
    def still(self) -> Support:
        """The clamped edge."""
        return Clamped(self.at, self.body)

    def _wrong(self) -> Sentences:
        """Check that a motion is given."""
        if all(value is None for value in self.given.values()):
            yield (
                f"neither rotation nor translation is given for {show(self.at)}; give one at "
                "least, or use Clamped"
            )


def moves(support: Support) -> bool:
    """Decide whether a support prescribes values that change with time.

    Args:
        support: Any support.
    """
    return any(map(callable, support.given.values()))


def at_rest(support: Support) -> bool:
    """Decide whether a support holds what it holds where it is.

    Args:
        support: Any support.
    """
    return not any(callable(value) or value for value in support.given.values())
