"""Curves that beams follow: lines, arcs, any map, and lines of a shell's mesh.

Every curve has a parameter ``xi`` in [0, 1] and the named points ``start`` (xi = 0) and ``end``
(xi = 1); a closed one has ``start`` only.
"""

import math
from collections.abc import Callable
from dataclasses import field
from functools import cached_property
from typing import Any

import numpy as np

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.scene.types import Axis, Finite, Name, Spot, Vec3
from shellmb.scene.values.user_functions import points_by
from shellmb.scene.values.validate import Sentences, described, differ, show, unit_vector


class Curve:
    """Base class of curves, also of the user's own.

    Attributes:
        straight: Whether elements with straight edges represent it exactly.
        shell: Name of the shell in whose mesh it lies, or None.
    """

    straight: bool = False
    shell: str | None = None

    def position(self, xi: Floats) -> Floats:
        """Reference positions [m], shape (3, n), at parameters of shape (n,)."""
        raise NotImplementedError(f"{type(self).__name__} is known by a shell's mesh only")

    def tangent(self, xi: Floats) -> Floats:
        """Unit tangents, shape (3, n), at parameters of shape (n,)."""
        d = self._derivative(np.atleast_1d(np.asarray(xi, dtype=float)))
        return np.asarray(d / np.linalg.norm(d, axis=0))

    def _derivative(self, xi: Floats) -> Floats:
        """``X_,xi``, shape (3, n), from a polynomial of degree 6 that stays inside [0, 1]."""
        h, j = 2e-3, np.arange(7.0)
        base = np.clip(xi - 3 * h, 0, 1 - 6 * h)
        x = self.position((base + h * j[:, None]).ravel()).reshape(3, 7, xi.size)
        coefficients = np.einsum("ij,cjn->cin", np.linalg.inv(np.vander(j - 3, 7, True)), x)
        s = (xi - base) / h - 3
        powers = np.array([k * s ** max(k - 1, 0) for k in range(7)])
        return np.asarray(np.einsum("cin,in->cn", coefficients, powers) / h)

    @cached_property
    def length(self) -> float:
        """Length [m], by Gauss quadrature over 64 pieces."""
        points, weights = np.polynomial.legendre.leggauss(8)
        pieces = 64
        xi = ((np.arange(pieces)[:, None] + (1 + points) / 2) / pieces).ravel()
        speed = np.linalg.norm(self._derivative(xi), axis=0)
        return float(np.tile(weights, pieces) @ speed / (2 * pieces))

    @cached_property
    def closed(self) -> bool:
        """Decide whether the curve ends where it starts."""
        if self.shell is not None:
            return False
        start, end = self.position(np.array([0.0, 1.0])).T
        return bool(np.linalg.norm(end - start) < 1e-9 * self.length)

    @property
    def point_names(self) -> tuple[str, ...]:
        """Names of the named points."""
        return ("start",) if self.closed else ("start", "end")

    @property
    def points(self) -> dict[str, Vec3]:
        """Coordinates of the named points [m]; empty where only the shell's mesh knows them."""
        if self.shell is not None:
            return {}
        x, y, z = self.position(np.array([0.0, 1.0])).tolist()
        return {n: (x[i], y[i], z[i]) for i, n in enumerate(self.point_names)}


@described("line")
class Line(Curve):
    """A straight line.

    Args:
        start: Where it begins [m].
        end: Where it ends [m].
    """

    start: Vec3
    end: Vec3

    straight = True

    def _wrong(self) -> Sentences:
        """Check that it has a length."""
        return differ(self, "start", "end")

    def position(self, xi: Floats) -> Floats:
        """Reference positions, shape (3, n)."""
        a, b = np.asarray(self.start)[:, None], np.asarray(self.end)[:, None]
        # this way both ends are met exactly
        return np.asarray((1 - xi) * a + xi * b)

    def _derivative(self, xi: Floats) -> Floats:
        return np.repeat(np.subtract(self.end, self.start)[:, None], xi.size, axis=1)


@described("circular arc")
class CircularArc(Curve):
    """An arc that a point describes when it turns about an axis.

    Args:
        center: A point of the axis [m].
        start: Where the arc begins [m].
        axis: Direction of the axis.
        angle_rad: Angle of the turn, right-handed about the axis [rad]; 2 pi closes the circle.
    """

    center: Vec3
    start: Vec3
    axis: Axis
    angle_rad: Finite

    def _wrong(self) -> Sentences:
        """Check that there is an arc."""
        if not 0 < abs(self.angle_rad) <= 2 * math.pi * (1 + 1e-12):
            yield "angle_rad", "it must not be zero and at most a turn of 2 pi"
        if not self.radius > 1e-12 * float(np.linalg.norm(np.subtract(self.start, self.center))):
            yield f"start {show(self.start)} is on the axis; it must be beside it"

    @cached_property
    def _axes(self) -> tuple[Floats, Floats, Floats]:
        """Foot on the axis, radius vector, and the vector a quarter turn further."""
        n = unit_vector(self.axis, "circular arc: axis")
        r = np.subtract(self.start, self.center)
        radial = r - n * (n @ r)
        return np.subtract(self.start, radial), radial, np.cross(n, radial)

    @property
    def radius(self) -> float:
        """Radius [m]."""
        return float(np.linalg.norm(self._axes[1]))

    def position(self, xi: Floats) -> Floats:
        """Reference positions, shape (3, n)."""
        foot, radial, across = self._axes
        a = self.angle_rad * np.asarray(xi)
        return np.asarray(
            foot[:, None] + np.multiply.outer(radial, np.cos(a)) + np.outer(across, np.sin(a))
        )

    def _derivative(self, xi: Floats) -> Floats:
        _, radial, across = self._axes
        a = self.angle_rad * xi
        return self.angle_rad * np.asarray(
            np.outer(across, np.cos(a)) - np.outer(radial, np.sin(a))
        )


@described("arc")
class Arc(Curve):
    """The arc of a circle through three points.

    Args:
        start: Where it begins [m].
        middle: Any point between [m].
        end: Where it ends [m].
    """

    start: Vec3
    middle: Vec3
    end: Vec3

    def __post_init__(self) -> None:
        """Check that the points are on one circle only.

        Raises:
            SceneError: If they are on a line, or two of them coincide.
        """
        _ = self.circle

    @cached_property
    def circle(self) -> CircularArc:
        """Arc by its center, axis and angle."""
        a, b, c = (np.asarray(p) for p in (self.start, self.middle, self.end))
        u, v = b - a, c - a
        n = np.cross(u, v)
        size = max(float(np.linalg.norm(d)) for d in (u, v, c - b))
        if not np.linalg.norm(n) > 1e-10 * size**2:
            raise SceneError(
                f"arc: {show(self.start)}, {show(self.middle)} and {show(self.end)} are on a "
                "line; they must be three points of a circle"
            )
        # circumcentre of the triangle
        center = a + np.cross(n, (v @ v) * u - (u @ u) * v) / (2 * (n @ n))
        # the angle at the circumference is half of that at the centre, on the other side
        corner = math.atan2(float(np.linalg.norm(np.cross(a - b, c - b))), float((a - b) @ (c - b)))
        return CircularArc(tuple(center), self.start, tuple(n), 2 * (math.pi - corner))

    def position(self, xi: Floats) -> Floats:
        """Reference positions, shape (3, n)."""
        return self.circle.position(xi)

    def _derivative(self, xi: Floats) -> Floats:
        return self.circle._derivative(xi)


@described("parametric curve")
class ParametricCurve(Curve):
    """Any smooth curve.

    Args:
        function: Vectorised ``function(xi) -> array (3, n)`` of positions [m] for ``xi`` of shape
            (n,) in [0, 1].
    """

    function: Callable[[Any], Any]

    def _wrong(self) -> Sentences:
        """Try the function and check that the curve has a length everywhere."""
        speed = np.linalg.norm(self._derivative(np.linspace(0, 1, 33)), axis=0)
        if not speed.min() > 1e-9 * speed.max():
            yield "function stands still; X_,xi must not be zero"

    def position(self, xi: Floats) -> Floats:
        """Reference positions, shape (3, n).

        Raises:
            SceneError: If the function returns another shape or a number that is not finite.
        """
        xi = np.atleast_1d(np.asarray(xi, dtype=float))
        right = f"it must give (3, {xi.size}) numbers for {xi.size} points"
        return points_by("parametric curve: function", right, self.function, xi)


@described("curve along an edge")
class AlongEdge(Curve):
    """An edge of a shell as a beam's curve; the beam takes the nodes of the shell's mesh.

    It runs as xi or eta of the shell grow.

    Args:
        shell: Name of the shell.
        edge: Name of the edge.
    """

    shell: Name = field()  # required: the base class has None
    edge: Name


@described("curve along a line")
class AlongLine(Curve):
    """A straight line of element edges inside a shell's mesh, as a beam's curve.

    Args:
        shell: Name of the shell.
        start: The node where it begins: a named point, or coordinates (x, y, z) [m].
        end: The node where it ends.
    """

    shell: Name = field()
    start: Spot
    end: Spot

    def _wrong(self) -> Sentences:
        """Check that it has a length."""
        return differ(self, "start", "end")
