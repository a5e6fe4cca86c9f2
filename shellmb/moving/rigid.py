"""The rigid rotation in the motion of a state, and what is left of its motion without it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import ufl
from dolfinx import fem

from shellmb.model.model import Model
from shellmb.moving.axis import Axis
from shellmb.moving.frame import TurningFrame
from shellmb.observers.account.energy import scalar
from shellmb.scene import GROUND, Scene
from shellmb.scene.multibody.elements import PointElement

Floats = npt.NDArray[np.float64]
Functions = Mapping[str, fem.Function]

# directions that hold less than this part of the largest inertia turn nothing
TURNS = 1e-10


class Affine(NamedTuple):
    """A field of velocities `A y + c`; directors have `A d`.

    Args:
        matrix: `A`, shape (3, 3), 1/s.
        shift: `c`, shape (3,), m/s.
    """

    matrix: Floats
    shift: Floats

    def minus(self) -> Affine:
        """The opposite field."""
        return Affine(-self.matrix, -self.shift)


def spinning(omega: Floats, about: Floats) -> Affine:
    """Velocities of a rotation about a point.

    Args:
        omega: Angular velocity, rad/s.
        about: The point, m.
    """
    # columns are the velocities of unit vectors
    matrix = np.cross(omega, np.eye(3)).T
    return Affine(matrix, -matrix @ about)


NOTHING = Affine(np.zeros((3, 3)), np.zeros(3))


class Products:
    """Products `M v.w` of motions of all bodies at a state, each a function and an affine field.

    Args:
        model: The bodies.
        q: Their states.
    """

    def __init__(self, model: Model, q: Functions) -> None:
        self._ends: list[tuple[dict[str, fem.Function], list[tuple[fem.Constant, ...]]]] = []
        sides: list[dict[str, ufl.core.expr.Expr]] = []
        for _ in range(2):
            functions: dict[str, fem.Function] = {}
            constants: list[tuple[fem.Constant, ...]] = []
            side = {}
            for body in model.bodies:
                mesh = body.mixed.space.mesh
                matrix = fem.Constant(mesh, np.zeros((3, 3)))
                shift = fem.Constant(mesh, np.zeros(3))
                constants.append((matrix, shift))
                functions[body.name] = fem.Function(body.mixed.space)
                frame = TurningFrame(body, Axis((0.0, 0.0, 1.0)))
                field = frame.turned(q[body.name], partial(ufl.dot, matrix), shift)
                side[body.name] = functions[body.name] + field
            self._ends.append((functions, constants))
            sides.append(side)
        forms = [body.inertia(sides[0][body.name], sides[1][body.name]) for body in model.bodies]
        self._sum = scalar(forms, model.comm)

    def __call__(
        self, first: tuple[Functions | None, Affine], second: tuple[Functions | None, Affine]
    ) -> float:
        """The product of two motions."""
        for (functions, constants), (given, (matrix, shift)) in zip(
            self._ends, (first, second), strict=True
        ):
            for name, function in functions.items():
                function.x.array[:] = 0.0 if given is None else given[name].x.array
            for A, c in constants:
                A.value[:], c.value[:] = matrix, shift
        return 0.0 if self._sum is None else self._sum()

    def square(self, motion: Functions | None, field: Affine = NOTHING) -> float:
        """The product of a motion with itself; not negative."""
        return max(self((motion, field), (motion, field)), 0.0)


class WholeMotion:
    """Mass, centre, and the mean translation and rotation of a motion, nearest in the mass.

    Args:
        products: Of the state.
        length: Length of the scene, m.

    Attributes:
        mass: Mass, kg.
        centre: Centre of mass, m.
    """

    def __init__(self, products: Products, length: float) -> None:
        self._products, self.length = products, length
        self._along = [Affine(np.zeros((3, 3)), e) for e in np.eye(3)]
        self.mass = products.square(None, self._along[0])
        place = Affine(np.eye(3), np.zeros(3))
        first = [products((None, e), (None, place)) for e in self._along]
        self.centre = np.array(first) / self.mass if self.mass > 0 else np.zeros(3)

    def translation(self, motion: Functions) -> Floats:
        """Mean of the velocities or accelerations of all mass."""
        if self.mass == 0:
            return np.zeros(3)
        return np.array(
            [self._products((motion, NOTHING), (None, e)) / self.mass for e in self._along]
        )

    def rotation(self, velocity: Functions, axis: Floats | None = None) -> Floats:
        """Angular velocity of the rigid motion that is nearest: `J^-1 L` about the centre, rad/s.

        Args:
            velocity: Velocities.
            axis: Unit vector of the axis; None: any.
        """
        units = np.eye(3) if axis is None else axis[None]
        turns = [spinning(e, self.centre) for e in units]
        inertia = np.array([[self._products((None, a), (None, b)) for b in turns] for a in turns])
        momentum = [self._products((velocity, NOTHING), (None, e)) for e in turns]
        found = np.linalg.lstsq(inertia, np.array(momentum), rcond=TURNS)[0]
        return np.asarray(found @ units)


@dataclass(frozen=True)
class Unsteady:
    """How far a state is from a steady rotation.

    Args:
        velocity: Velocities relative to the frame, root mean square over the mass, m/s.
        acceleration: Accelerations beyond those of a steady rotation, m/s^2.
        energy_share: Part of the kinetic energy that is not the rotation of the frame.
        acceleration_share: Part of all accelerations that are not those of that rotation.
        length: Length of the scene, m.
    """

    velocity: float
    acceleration: float
    energy_share: float
    acceleration_share: float
    length: float

    def drift(self, scale: float) -> float:
        """How far the state goes in the time `1/scale`, in lengths of the scene.

        Args:
            scale: Of an eigenvalue, 1/s.
        """
        return (self.velocity / scale + self.acceleration / scale**2) / self.length


def unsteady_part(
    scene: Scene,
    products: Products,
    whole: WholeMotion,
    motion: tuple[Functions, Functions],
    line: Axis,
    rate: float,
) -> Unsteady:
    """What is left of velocities and accelerations without those of a frame.

    Args:
        scene: The scene.
        products: Products of motions at the state.
        whole: Of the state.
        motion: Velocities and accelerations.
        line: Axis of the frame.
        rate: Its rate, rad/s.
    """
    turn = spinning(rate * line.unit, np.asarray(line.about))
    inward = Affine(turn.matrix @ turn.matrix, turn.matrix @ turn.shift)
    squares = []
    for of, frame in zip(motion, (turn, inward), strict=True):
        left = frame.minus()
        if _free(scene):
            # a uniform motion, or fall, of all changes nothing
            mean = whole.translation(of) + left.matrix @ whole.centre + left.shift
            left = Affine(left.matrix, left.shift - mean)
        squares.append((products.square(of, left), products.square(of)))
    (relative, moved), (pushed, pulled) = squares
    mass = max(whole.mass, 1e-300)
    return Unsteady(
        math.sqrt(relative / mass),
        math.sqrt(pushed / mass),
        relative / moved if moved > 0 else 0.0,
        math.sqrt(pushed / pulled) if pulled > 0 else 0.0,
        whole.length,
    )


def _free(scene: Scene) -> bool:
    """Whether nothing holds on to space."""
    ends = [(j.first, j.second) for j in scene.joints]
    ends += [(e.first, e.second) for e in scene.elements if isinstance(e, PointElement)]
    return not scene.supports and not any(GROUND in end for end in ends)
