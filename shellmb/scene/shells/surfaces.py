"""Mid-surfaces given by a map of the unit square: what they offer, a rectangle, any map.

Every surface has parameters ``xi`` and ``eta`` in [0, 1]. Its edges are ``left`` (xi = 0),
``right`` (xi = 1), ``bottom`` (eta = 0) and ``top`` (eta = 1); its named points are the corners,
``left-bottom`` and so on. A surface that closes or has a pole has fewer of them.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shellmb.errors import SceneError
from shellmb.scene.values.validate import Positive, Vec3, described, in_words, show, unit_vector

type Points = NDArray[np.float64]


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
    """

    edges: tuple[str, ...] | None = ("left", "right", "bottom", "top")
    points: tuple[str, ...] | None = ("left-bottom", "right-bottom", "left-top", "right-top")
    flat: bool = False
    closed: bool = False
    pole: bool = False
    sweep: float = 0.0
    slit: bool = False

    def position(self, xi: Points, eta: Points) -> Points:
        """Reference positions, shape (3, n), at parameters of shape (n,) each."""
        raise NotImplementedError(f"{type(self).__name__} is meshed without a map")

    def normal(self, x: Points) -> Points | None:
        """Exact unit normals, shape (3, n), at positions (3, n) on it; None where unknown."""
        return None


def frame(what: str, first: str, a: Vec3, second: str, b: Vec3) -> tuple[Any, Any, Any]:
    """Orthonormal axes from two vectors that have to be perpendicular."""
    e1, e2 = unit_vector(a, f"{what}: {first}"), unit_vector(b, f"{what}: {second}")
    if abs(e1 @ e2) > 1e-9:
        raise SceneError(
            f"{what}: {first} {show(a)} and {second} {show(b)} are not perpendicular; they must be"
        )
    return e1, e2, np.cross(e1, e2)


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

    def position(self, xi: Points, eta: Points) -> Points:
        """Reference positions, shape (3, n)."""
        e1, e2, _ = self._axes
        along = np.multiply.outer(e1, self.length * xi) + np.multiply.outer(e2, self.width * eta)
        return np.asarray(self.origin)[:, None] + along

    def normal(self, x: Points) -> Points:
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

    def position(self, xi: Points, eta: Points) -> Points:
        """Reference positions, shape (3, n).

        Raises:
            SceneError: If the map fails, returns another shape or a number that is not finite.
        """
        try:
            x = np.asarray(self.map(xi, eta), dtype=float)
        except (Exception, SystemExit) as error:
            raise SceneError(
                f"parametric surface: map fails ({in_words(error)}); it must be written for arrays "
                "xi and eta"
            ) from error
        if x.shape != (3, xi.size):
            raise SceneError(
                f"parametric surface: map returns an array of shape {x.shape} for {xi.size} "
                f"points; it must be (3, {xi.size})"
            )
        if not np.isfinite(x).all():
            raise SceneError("parametric surface: map returns a number that is not finite")
        return x
