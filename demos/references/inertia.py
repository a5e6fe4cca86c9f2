"""Mass, centre and inertia tensor of simple solids."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shellmb.arrays import Floats

Vector = Sequence[float] | Floats


@dataclass(frozen=True)
class MassProperties:
    """Mass properties that the motion of a rigid body depends on.

    Args:
        mass: Mass, kg.
        center: Centre of mass, m, shape (3,).
        inertia: Inertia tensor about the centre of mass, kg m^2, shape (3, 3).
    """

    mass: float
    center: Floats
    inertia: Floats

    def about(self, point: Vector) -> Floats:
        """Inertia tensor about a point (Steiner), kg m^2, shape (3, 3)."""
        arm = self.center - np.asarray(point, dtype=np.float64)
        return self.inertia + self.mass * _steiner(arm)

    def __add__(self, other: "MassProperties") -> "MassProperties":
        """The two solids joined to one."""
        mass = self.mass + other.mass
        center = (self.mass * self.center + other.mass * other.center) / mass
        return MassProperties(mass, center, self.about(center) + other.about(center))


def _steiner(arm: Floats) -> Floats:
    return np.asarray(arm @ arm * np.eye(3) - np.outer(arm, arm))


def rod(mass: float, start: Vector, end: Vector, radius: float = 0.0) -> MassProperties:
    """Homogeneous circular cylinder between two points; a thin rod with radius zero.

    Args:
        mass: Mass, kg.
        start: Centre of one end, m.
        end: Centre of the other end, m.
        radius: Radius, m.
    """
    a, b = (np.asarray(p, dtype=np.float64) for p in (start, end))
    axis = b - a
    length2 = float(axis @ axis)
    along = np.outer(axis, axis) / length2
    across = np.eye(3) - along
    tensor = (length2 / 12 + radius**2 / 4) * across + radius**2 / 2 * along
    return MassProperties(mass, (a + b) / 2, mass * tensor)


def box(
    mass: float, sides: Vector, center: Vector = (0.0, 0.0, 0.0), frame: Floats | None = None
) -> MassProperties:
    """Homogeneous box.

    Args:
        mass: Mass, kg.
        sides: Lengths of the sides, m.
        center: Centre, m.
        frame: Directions of the sides as columns, orthonormal; the coordinate axes by default.
    """
    squares = np.asarray(sides, dtype=np.float64) ** 2
    axes = np.eye(3) if frame is None else frame
    tensor = mass / 12 * np.diag(squares.sum() - squares)
    return MassProperties(mass, np.asarray(center, dtype=np.float64), axes @ tensor @ axes.T)
