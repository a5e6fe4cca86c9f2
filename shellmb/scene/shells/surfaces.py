"""Mid-surfaces given by a map of the unit square: rectangle, cylinder, sphere, disc, any map.

Every surface has parameters ``xi`` and ``eta`` in [0, 1]. Its edges are ``left`` (xi = 0),
``right`` (xi = 1), ``bottom`` (eta = 0) and ``top`` (eta = 1); its named points are the corners,
``left-bottom`` and so on. A surface that closes or has a pole has fewer of them.
"""

import math
from collections.abc import Callable
from functools import cached_property
from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.scene.types import Finite, Positive, Vec3
from shellmb.scene.values.user_functions import points_by
from shellmb.scene.values.validate import described, frame, show


class Surface:
    """Base class of mid-surfaces, also of the user's own.

    Attributes:
        edges: Names of the edges, or None where only the mesh tells them.
        points: Names of the named points, or None where only the mesh tells them.
        flat: Whether elements with straight edges represent it exactly.
        closed: Whether xi = 0 and xi = 1 are the same line.
        pole: Whether eta = 0 is a single point.
        sweep: Angle that xi goes through at a pole [degrees].
        slit: Whether opposite edges on the same line are meant to be apart, without a warning.
        of_file: Whether its mesh, or its geometry, is read from a file.
    """

    edges: tuple[str, ...] | None = ("left", "right", "bottom", "top")
    points: tuple[str, ...] | None = ("left-bottom", "right-bottom", "left-top", "right-top")
    flat: bool = False
    closed: bool = False
    pole: bool = False
    sweep: float = 0.0
    slit: bool = False
    of_file: bool = False

    @property
    def refined(self) -> int | None:
        """Elements along a side of each one of the mesh's file; None of meshes made anew."""
        return None

    def position(self, xi: Floats, eta: Floats) -> Floats:
        """Reference positions, shape (3, n), at parameters of shape (n,) each."""
        raise NotImplementedError(f"{type(self).__name__} is meshed without a map")

    def normal(self, x: Floats) -> Floats | None:
        """Exact unit normals, shape (3, n), at positions (3, n) on it; None where unknown."""
        return None


@described("rectangle")
class Rectangle(Surface):
    """A flat rectangle: xi along ``axis1``, eta along ``axis2``, normal ``axis1 x axis2``.

    Args:
        length: Extent along ``axis1`` [m].
        width: Extent along ``axis2`` [m].
        origin: The corner xi = eta = 0 [m].
        axis1: Direction of xi; any length.
        axis2: Direction of eta, perpendicular to ``axis1``; any length.
    """

    length: Positive
    width: Positive
    origin: Vec3 = (0.0, 0.0, 0.0)
    axis1: Vec3 = (1.0, 0.0, 0.0)
    axis2: Vec3 = (0.0, 1.0, 0.0)

    flat = True

    def __post_init__(self) -> None:
        """Check the axes."""
        _ = self._axes

    @cached_property
    def _axes(self) -> tuple[Any, Any, Any]:
        return frame("rectangle", "axis1", self.axis1, "axis2", self.axis2)

    def position(self, xi: Floats, eta: Floats) -> Floats:
        """Reference positions, shape (3, n)."""
        e1, e2, _ = self._axes
        along = np.multiply.outer(e1, self.length * xi) + np.multiply.outer(e2, self.width * eta)
        return np.asarray(self.origin)[:, None] + along

    def normal(self, x: Floats) -> Floats:
        """The one unit normal, repeated to shape (3, n)."""
        return np.repeat(self._axes[2][:, None], x.shape[1], axis=1)


@described("parametric surface")
class Parametric(Surface):
    """Any smooth surface over the unit square; its normal is ``X_,xi x X_,eta``.

    It is never closed: where the map puts ``left`` and ``right`` (or ``bottom`` and ``top``) on the
    same line it is slit, as an annular plate cut open. Each lip has its own nodes, edge and corner
    points, which can move apart; a node inside a lip has no name. What is to close must be a
    :class:`Cylinder`, :class:`Sphere` or :class:`Disc` of 360 degrees, or a user's own
    :class:`Surface` with ``closed = True``. A run warns of a slit unless it is declared.

    Args:
        map: Vectorised ``map(xi, eta) -> array (3, n)`` of positions [m] for ``xi``, ``eta`` of
            shape (n,) in [0, 1].
        slit: Whether it is meant to be slit where two of its edges lie on the same line.
    """

    map: Callable[[Any, Any], Any]
    slit: bool = False

    def position(self, xi: Floats, eta: Floats) -> Floats:
        """Reference positions, shape (3, n).

        Raises:
            SceneError: If the map fails, returns another shape or a number that is not finite.
        """
        right = "it must be written for arrays xi and eta"
        return points_by("parametric surface: map", right, self.map, xi, eta)


def _angles(value: tuple[float, float]) -> tuple[float, float]:
    if not 0 < value[1] - value[0] <= 360:
        raise ValueError("the second angle must exceed the first, by 360 degrees at most")
    return value


Angles = Annotated[tuple[Finite, Finite], AfterValidator(_angles)]


def _outward(r: Floats, flip: bool) -> Floats:
    """Unit vectors along radii, or against them."""
    return np.asarray((-r if flip else r) / np.linalg.norm(r, axis=0))


def _around(angle: Floats, e1: Floats, e2: Floats) -> Floats:
    return np.multiply.outer(e1, np.cos(angle)) + np.multiply.outer(e2, np.sin(angle))


@described("cylinder")
class Cylinder(Surface):
    """A circular cylinder: xi along the arc, eta along the axis, normal outwards.

    With 360 degrees between the angles it is closed: then it has the edges ``bottom`` and ``top``
    only, and its named points lie on the line where xi starts.

    Args:
        radius: Radius [m].
        length: Extent along the axis [m].
        angles: First and last angle, right-handed about ``axis`` from ``start`` [degrees].
        origin: The point of the axis at eta = 0 [m].
        axis: Direction of the axis; any length.
        start: Direction of angle 0, perpendicular to the axis; any length.
        flip: Whether it is turned over: normal inwards.
    """

    radius: Positive
    length: Positive
    angles: Angles = (0.0, 360.0)
    origin: Vec3 = (0.0, 0.0, 0.0)
    axis: Vec3 = (0.0, 0.0, 1.0)
    start: Vec3 = (1.0, 0.0, 0.0)
    flip: bool = False

    def __post_init__(self) -> None:
        """Check the axes; a closed cylinder has two edges."""
        _ = self._axes
        if self.closed:
            object.__setattr__(self, "edges", ("bottom", "top"))
            object.__setattr__(self, "points", ("left-bottom", "left-top"))

    @property
    def closed(self) -> bool:  # type: ignore[override]
        """Decide whether the angles make a full turn."""
        return math.isclose(self.angles[1] - self.angles[0], 360.0)

    @cached_property
    def _axes(self) -> tuple[Any, Any, Any]:
        return frame("cylinder", "axis", self.axis, "start", self.start)

    def position(self, xi: Floats, eta: Floats) -> Floats:
        """Reference positions, shape (3, n)."""
        axis, e1, e2 = self._axes
        angle = np.radians(self.angles[0] + (self.angles[1] - self.angles[0]) * xi)
        arc = self.radius * _around(angle, e1, e2)
        return np.asarray(self.origin)[:, None] + arc + np.multiply.outer(axis, self.length * eta)

    def normal(self, x: Floats) -> Floats:
        """Unit normals, away from the axis or towards it, shape (3, n)."""
        axis = self._axes[0]
        r = x - np.asarray(self.origin)[:, None]
        r = r - np.multiply.outer(axis, axis @ r)
        return _outward(r, self.flip)


class _Polar(Surface):
    """Base of a sphere and a disc: a closed rim, and a pole that takes the place of an edge."""

    def _name_parts(self, span: float, pole: bool) -> None:
        closed = math.isclose(span, 360.0)
        sides = () if closed else ("left", "right")
        ends = ("top",) if pole else ("bottom", "top")
        columns = ("left",) if closed else ("left", "right")
        points = ("pole",) if pole else tuple(f"{c}-bottom" for c in columns)
        for name, value in (
            ("closed", closed),
            ("pole", pole),
            ("sweep", span),
            ("edges", sides + ends),
            ("points", points + tuple(f"{c}-top" for c in columns)),
        ):
            object.__setattr__(self, name, value)


@described("sphere")
class Sphere(_Polar):
    """A part of a sphere about the z axis: xi the azimuth, eta the polar angle, normal outwards.

    Where the polar angle starts at 0 the mesh is made of blocks that avoid collapsed cells: there
    is no edge ``bottom`` but a point ``pole``, ``mesh[0]`` counts the cells along a quarter turn of
    the rim and ``mesh[1]`` those from the pole to the rim. With the full azimuth there are no edges
    ``left`` and ``right``. The whole sphere, ``polar=(0, 180)``, has no edges and the points
    ``pole`` and ``antipole``; its rim is the equator.

    Args:
        radius: Radius [m].
        polar: First and last polar angle, from the pole at +z, within [0, 180) [degrees]; or 0
            and 180.
        azimuth: First and last azimuth, from the x axis towards y [degrees].
        origin: The centre [m].
        flip: Whether it is turned over: normal inwards.
    """

    radius: Positive
    polar: Angles = (0.0, 90.0)
    azimuth: Angles = (0.0, 360.0)
    origin: Vec3 = (0.0, 0.0, 0.0)
    flip: bool = False

    def __post_init__(self) -> None:
        """Check the polar angles and name the edges."""
        sweep = self.azimuth[1] - self.azimuth[0]
        whole = self.polar == (0.0, 180.0) and math.isclose(sweep, 360.0)
        if self.polar[0] < 0 or (self.polar[1] >= 180 and not whole):
            raise SceneError(
                f"sphere: polar is {show(self.polar)} and azimuth {show(self.azimuth)}; polar must "
                "begin at 0 or more and end below 180 degrees, or be (0, 180) with the full azimuth"
            )
        self._name_parts(sweep, self.polar[0] == 0)
        if whole:
            object.__setattr__(self, "edges", ())
            object.__setattr__(self, "points", ("pole", "antipole"))

    def position(self, xi: Floats, eta: Floats) -> Floats:
        """Reference positions, shape (3, n)."""
        phi = np.radians(self.azimuth[0] + (self.azimuth[1] - self.azimuth[0]) * xi)
        theta = np.radians(self.polar[0] + (self.polar[1] - self.polar[0]) * eta)
        s = np.sin(theta)
        unit = np.stack([s * np.cos(phi), s * np.sin(phi), np.cos(theta)])
        return np.asarray(self.origin)[:, None] + self.radius * unit

    def normal(self, x: Floats) -> Floats:
        """Unit normals, away from the centre or towards it, shape (3, n)."""
        return _outward(x - np.asarray(self.origin)[:, None], self.flip)


@described("disc")
class Disc(_Polar):
    """A flat disc or sector: xi the angle, eta the radius, normal ``axis1 x axis2``.

    Its edges are ``top`` (the rim) and, for a sector, ``left`` and ``right``; its centre is the
    point ``pole``. ``mesh[0]`` counts the cells along a quarter of the rim, ``mesh[1]`` those along
    a radius.

    Args:
        radius: Radius [m].
        angles: First and last angle, from ``axis1`` towards ``axis2`` [degrees].
        origin: The centre [m].
        axis1: Direction of angle 0; any length.
        axis2: Direction of angle 90 degrees, perpendicular to ``axis1``; any length.
    """

    radius: Positive
    angles: Angles = (0.0, 360.0)
    origin: Vec3 = (0.0, 0.0, 0.0)
    axis1: Vec3 = (1.0, 0.0, 0.0)
    axis2: Vec3 = (0.0, 1.0, 0.0)

    def __post_init__(self) -> None:
        """Check the axes and name the edges."""
        _ = self._axes
        self._name_parts(self.angles[1] - self.angles[0], True)

    @cached_property
    def _axes(self) -> tuple[Any, Any, Any]:
        return frame("disc", "axis1", self.axis1, "axis2", self.axis2)

    def position(self, xi: Floats, eta: Floats) -> Floats:
        """Reference positions, shape (3, n)."""
        e1, e2, _ = self._axes
        angle = np.radians(self.angles[0] + (self.angles[1] - self.angles[0]) * xi)
        return np.asarray(self.origin)[:, None] + self.radius * eta * _around(angle, e1, e2)

    def normal(self, x: Floats) -> Floats:
        """The one unit normal, repeated to shape (3, n)."""
        return np.repeat(self._axes[2][:, None], x.shape[1], axis=1)
