"""Shapes of obstacles: measures of a place, the distance that follows from these, and normals."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import ufl
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.forms import contact as forms
from shellmb.model.locations.ends import frame_about
from shellmb.model.sections.strains import FAR
from shellmb.scene.loads.contacts import Ball, Box, Obstacle, Plane, Rod
from shellmb.scene.lookup import of_kind

# distance from a centre or axis, in radii, within which there is no direction any more
CORE = 1e-3
# parts of the scene's size by which points are beyond all faces of a box where the pattern of
# matrices is looked for: none of the measures is missing there, and what is far is still in contact
BESIDE = 10.0
# thirds of a path after which the deepest point in a box is found, to 1e-7 of the path
THIRDS = 40


class Shape:
    """Shape of an obstacle in the reference configuration.

    Args:
        obstacle: Description.
        point: Its centre, or a point of its plane or axis, shape (3,), m.
        axes: Its axes as rows, shape (3, 3).

    Attributes:
        depth: How deep a point may be before it is beyond the middle, m; infinite: as deep as may
            be.
        extent: What that is of the obstacle.
    """

    # whether the distance follows from several measures
    several = False
    depth, extent = np.inf, "radius"

    def __init__(self, obstacle: Obstacle, point: Any, axes: Floats) -> None:
        self.point, self.axes, self.label = np.array(point, dtype=float), axes, obstacle.label

    def bind(self, constant: Callable[[Any], Any], length: float, always: Expr) -> None:
        """Make Constants of what forms need.

        Args:
            constant: Makes a Constant.
            length: Size of the scene, m.
            always: Not zero where the pattern of matrices is looked for, where all must act.
        """
        self.size, self._always = constant(length), always

    def measure(self, r: Expr, e: Sequence[Expr]) -> Expr:
        """Measures of order one, at most quadratic in the state, shape (n,).

        Args:
            r: Vector from the obstacle's point, m.
            e: Axes of the obstacle.
        """
        raise NotImplementedError

    def distance(self, m: Expr) -> Expr:
        """Distance from the surface by the measures, over the size of the scene."""
        raise NotImplementedError

    def normal(self, r: Expr, e: Sequence[Expr]) -> Expr:
        """Unit vector from the obstacle to a point, shape (3,); arguments as of `measure`."""
        raise NotImplementedError

    def normals(self, x: Floats) -> tuple[Floats, Floats]:
        """Normals at positions (n, 3), and distances from the surface there, (n,), m."""
        raise NotImplementedError

    def nearest(self, start: Floats, end: Floats) -> Floats:
        """Find where points that move straight are deepest, shape (n, 3)."""
        return end

    def overrated(self, start: Floats, end: Floats) -> Floats:
        """Excess of distances in the middle of a step, shape (n,), m."""
        return np.zeros(len(start))


class PlaneShape(Shape):
    """The half-space below a plane."""

    def measure(self, r: Expr, e: Sequence[Expr]) -> Expr:
        """Distance from the plane."""
        return ufl.as_vector([ufl.dot(e[2], r) / self.size])

    def distance(self, m: Expr) -> Expr:
        """The measure."""
        return m[0]

    def normal(self, r: Expr, e: Sequence[Expr]) -> Expr:
        """Normal of the plane."""
        return e[2] / ufl.sqrt(ufl.dot(e[2], e[2]))

    def normals(self, x: Floats) -> tuple[Floats, Floats]:
        """Normal of the plane, and distances from it."""
        return np.tile(self.axes[2], (len(x), 1)), (x - self.point) @ self.axes[2]


class RoundShape(Shape):
    """A ball or rod, or what is outside of one; about an axis or a centre.

    Args:
        obstacle: Description.
        point: As of `Shape`.
        axes: As of `Shape`.
        squared: Whether the square of a vector is at most quadratic in the state.
    """

    def __init__(self, obstacle: Any, point: Any, axes: Floats, squared: bool) -> None:
        super().__init__(obstacle, point, axes)
        self.radius, self.sign = float(obstacle.radius), -1.0 if obstacle.inside else 1.0
        self._squared, self._straight = squared, hasattr(obstacle, "axis")
        self.depth = self.radius if self.sign > 0 else np.inf

    def bind(self, constant: Callable[[Any], Any], length: float, always: Expr) -> None:
        """Make Constants of the size, the radius and the side."""
        super().bind(constant, length, always)
        self._big, self._side = constant(self.radius), constant(self.sign)

    def _away(self, r: Expr, e: Sequence[Expr]) -> Expr:
        """From the centre or the axis, shape (3,), m."""
        return r - ufl.dot(r, e[2]) * e[2] / ufl.dot(e[2], e[2]) if self._straight else r

    def measure(self, r: Expr, e: Sequence[Expr]) -> Expr:
        """Square of the distance from the centre or axis, or the vector from there."""
        away = self._away(r, e) / self.size
        return ufl.as_vector([ufl.dot(away, away)]) if self._squared else away

    def _square(self, m: Expr) -> Expr:
        return m[0] if self._squared else ufl.dot(m, m)

    def distance(self, m: Expr) -> Expr:
        """Distance from the surface."""
        core, square = (CORE * self._big / self.size) ** 2, self._square(m)
        # a path may pass through the centre
        away = ufl.sqrt(ufl.conditional(ufl.gt(square, core), square, core))
        return self._side * (away - self._big / self.size)

    def normal(self, r: Expr, e: Sequence[Expr]) -> Expr:
        """From the centre or axis, or towards it."""
        away = self._away(r, e)
        return self._side * away / ufl.sqrt(ufl.dot(away, away) + (CORE * self._big) ** 2 * CORE)

    def normals(self, x: Floats) -> tuple[Floats, Floats]:
        """From the centre or axis, or towards it."""
        r = self._across(x - self.point)
        distance = np.linalg.norm(r, axis=1)
        normals = self.sign * r / np.maximum(distance, CORE * self.radius)[:, None]
        return normals, self.sign * (distance - self.radius)

    def _across(self, r: Floats) -> Floats:
        return r - np.outer(r @ self.axes[2], self.axes[2]) if self._straight else r

    def nearest(self, start: Floats, end: Floats) -> Floats:
        """Find where points that move straight are nearest to the centre or axis, shape (n, 3)."""
        move, r = self._across(end - start), self._across(start - self.point)
        square = np.maximum(np.vecdot(move, move), 1e-300)
        share = np.clip(-np.vecdot(r, move) / square, 0.0, 1.0)
        return np.asarray(start + share[:, None] * (end - start))


class MovingRod(RoundShape):
    """A rod that moves, or what is outside of one: how it turns about itself does not matter."""

    several = True

    def measure(self, r: Expr, e: Sequence[Expr]) -> Expr:
        """Square of the vector from a point of the axis, and its component along the axis."""
        r = r / self.size
        return ufl.as_vector([ufl.dot(r, r), ufl.dot(e[2], r)])

    def overrated(self, start: Floats, end: Floats) -> Floats:
        """The measures are linear over a step, and one of them is squared for the distance."""
        along, away = (end - start) @ self.axes[2], self._across(end - self.point)
        return np.asarray(along**2 / (8 * np.maximum(np.linalg.norm(away, axis=1), self.radius)))

    def _square(self, m: Expr) -> Expr:
        return m[0] - m[1] ** 2 + FAR * self._always


class BoxShape(Shape):
    """A box that may have rounded edges."""

    several, extent = True, "half thickness"

    def __init__(self, obstacle: Box) -> None:
        super().__init__(obstacle, obstacle.center, obstacle.axes)
        self.rounding = obstacle.rounding
        self.core = np.array(obstacle.size) / 2 - self.rounding
        self.depth = min(obstacle.size) / 2

    def bind(self, constant: Callable[[Any], Any], length: float, always: Expr) -> None:
        """Make Constants of the extents and the rounding."""
        super().bind(constant, length, always)
        self._core, self._rounding = constant(self.core / length), constant(self.rounding / length)

    def measure(self, r: Expr, e: Sequence[Expr]) -> Expr:
        """Components from the centre along the edges."""
        return ufl.as_vector([ufl.dot(axis, r) / self.size for axis in e])

    def distance(self, m: Expr) -> Expr:
        """Distance from the surface, less than zero within."""
        core = [self._core[k] - BESIDE * self._always for k in range(3)]
        return forms.box_distance(list(m), core) - self._rounding

    def normal(self, r: Expr, e: Sequence[Expr]) -> Expr:
        """Slope of the distance."""
        y = ufl.variable(self.measure(r, e))
        slope = ufl.diff(self.distance(y), y)
        n = sum((slope[k] * e[k] for k in range(3)), start=0 * e[0])
        return n / ufl.sqrt(ufl.dot(n, n))

    def normals(self, x: Floats) -> tuple[Floats, Floats]:
        """Slopes of the distance, and distances."""
        y = (x - self.point) @ self.axes.T
        beyond = np.abs(y) - self.core
        out = np.maximum(beyond, 0.0)
        far = np.linalg.norm(out, axis=1)
        faces = np.eye(3)[np.argmax(beyond, axis=1)]
        outside = (far > 0)[:, None]
        slopes = np.where(outside, out / np.where(far > 0, far, 1.0)[:, None], faces) * np.sign(y)
        return slopes @ self.axes, np.where(far > 0, far, beyond.max(axis=1)) - self.rounding

    def nearest(self, start: Floats, end: Floats) -> Floats:
        """Find where points that move straight are deepest: the distance is convex along a path."""
        low, high = np.zeros(len(start)), np.ones(len(start))
        for _ in range(THIRDS):
            a, b = low + (high - low) / 3, high - (high - low) / 3
            first, second = (
                self.normals(start + share[:, None] * (end - start))[1] for share in (a, b)
            )
            low, high = np.where(first > second, a, low), np.where(first > second, high, b)
        return np.asarray(start + ((low + high) / 2)[:, None] * (end - start))


def shape_of(obstacle: Obstacle, moving: bool, linear: bool) -> Shape:
    """Shape of an obstacle.

    Args:
        obstacle: Description.
        moving: Whether it moves with a body.
        linear: Whether positions of points are linear in the state.
    """
    return of_kind(_SHAPES, obstacle)(obstacle, moving, linear)


def _rod(rod: Rod, moving: bool, linear: bool) -> Shape:
    made = MovingRod if moving else RoundShape
    return made(rod, rod.point, frame_about(rod.axis), linear)


_SHAPES: dict[type, Callable[[Any, bool, bool], Shape]] = {
    Plane: lambda plane, *_: PlaneShape(plane, plane.point, frame_about(plane.normal)),
    Ball: lambda ball, _, linear: RoundShape(ball, ball.center, np.eye(3), linear),
    Rod: _rod,
    Box: lambda box, *_: BoxShape(box),
}
