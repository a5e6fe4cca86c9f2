"""Initial velocities, and states to start from."""

import os
from typing import Annotated, Any

from pydantic import BeforeValidator

from shellmb.scene.types import ORIGIN, Finite, Held, Name, NonNegative, PositiveInt, Vector
from shellmb.scene.values.user_functions import OfPosition
from shellmb.scene.values.validate import Sentences, described


@described("initial velocity")
class InitialVelocity:
    """A rigid motion: velocities ``linear + spin x (X - about)``, of directors ``spin x D``.

    Args:
        linear: Velocity of the point ``about`` [m/s].
        spin: Angular velocity [rad/s].
        about: A point of the axis of rotation [m].
        body: Name of the body; None: all of them.
    """

    linear: Vector = ORIGIN
    spin: Vector = ORIGIN
    about: Vector = ORIGIN
    body: Name | None = None


def _directory(value: object) -> object:
    """The directory of a run, also where the run itself is given."""
    found = getattr(value, "directory", value)
    if not isinstance(found, str | os.PathLike) or not os.fspath(found):
        raise ValueError("it must be a run, or its directory")
    return os.fspath(found)


@described("start from a run")
class FromRun:
    """A start from the last state of another run or from one of its frames; prestress stays.

    The other run may have another scheme, other loads, supports, joints and sections. Its bodies
    must have the same names, meshes and degrees. The time of the new run begins at 0. Controllers
    of the same name and law go on from their memories; events begin anew.

    Args:
        run: The run, or its directory.
        at: Time of a stored frame [s], of a path its arc length; None: the last state. With
            velocities the frames of a motion must have the field ``"director_velocity"``.
        velocities: Whether velocities are taken, too; False: the new run starts at rest.
    """

    run: Annotated[Held[str, object], BeforeValidator(_directory)]
    at: NonNegative | None = None
    velocities: bool = True


@described("start from a mode")
class FromMode:
    """A start in a natural mode about the state reached so far.

    Nodes move along straight lines and directors turn, so bodies that bend or turn are stretched by
    the square of the amplitude: it must be small against the size of the bodies. The largest
    displacement in the mode is ``amplitude``, its largest velocity is ``velocity``.

    Args:
        number: Number of the mode, from 1, in the order of `shellmb modes`, rigid modes included.
        amplitude: Largest displacement [m].
        velocity: Largest velocity [m/s]; positive: along a positive amplitude.
    """

    number: PositiveInt = 1
    amplitude: Finite = 0.0
    velocity: Finite = 0.0

    def _wrong(self) -> Sentences:
        """Refuse a mode without effect."""
        if self.amplitude == 0.0 and self.velocity == 0.0:
            yield "amplitude and velocity are 0; one of them must be different from 0"


@described("start from a shape")
class FromShape:
    """A start from displacements and rotations, given as functions of the reference position.

    Args:
        displacement: ``displacement(x)`` for ``x`` of shape (3, n), shape (3, n) [m]; None: zero.
        rotation: Rotation vectors of directors and sections, ``rotation(x)``, shape (3, n) [rad];
            None: zero.
        body: Name of the body; None: the only one.
    """

    displacement: OfPosition | None = None
    rotation: OfPosition | None = None
    body: Name | None = None

    def _wrong(self) -> Sentences:
        """Refuse a shape without effect."""
        if self.displacement is None and self.rotation is None:
            yield "displacement and rotation are missing; one of them must be given"


WORDS = ("given", "equilibrium")
RIGHT = "it must be 'given' or 'equilibrium'"


def _starts(value: object) -> object:
    """A start, or several of them, one after the other."""
    items = value if isinstance(value, tuple) else (value,)
    for item in items:
        if item not in WORDS if isinstance(item, str) else not isinstance(item, START):
            others = ", or FromRun, FromMode, FromShape"
            raise ValueError(RIGHT + ("" if isinstance(item, str) else others))
    if any(isinstance(item, FromRun) for item in items[1:]):
        raise ValueError("FromRun must stand before all others")
    return value


START = (FromRun, FromMode, FromShape)
Starts = Annotated[Any, BeforeValidator(_starts)]
