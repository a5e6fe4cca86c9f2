"""Potentials of the place of bodies, and volumes that shells enclose, filled with gas or fluid."""

from collections.abc import Callable, Mapping
from dataclasses import field
from typing import Any

from shellmb.errors import SceneError
from shellmb.scene.types import NONE, Finite, Listed, Name, Place, Positive, Vec3
from shellmb.scene.values.times import TimeFunction
from shellmb.scene.values.validate import described, refused, show


@described("potential")
class Potential:
    """Potential energy of a body's position: a foundation, a magnet, the field of a planet.

    It is exact in the energy balance of every scheme; dissipative ones never gain energy by it.

    Args:
        name: Its name in the results: ``NAME.energy`` [J], ``NAME.Fx`` to ``NAME.Fz`` [N].
        energy: ``energy(at, parameters)``, written with operators and functions of UFL, gives the
            energy per area of a shell [J/m^2], per length of an edge or a beam [J/m], or at a point
            [J]. ``at.x`` is the position, ``at.u`` the displacement, ``at.X`` the reference
            position, and ``at.directors`` are the deformed directors: one of a shell, three of a
            beam or a rigid body.
        body: Name of the body; None: the only one.
        at: Where on it: edges or areas of a shell, or a point, as a name, several, or coordinates
            [m]; None: all of a shell or beam, or the reference point of a rigid body.
        parameters: Numbers of the energy by name.
        load: Whether it is a load: the load factor of static steps and paths multiplies it, as it
            multiplies loads without a function of time. Otherwise it acts fully from the start.
    """

    name: Name
    energy: Callable[..., Any]
    body: Name | None = None
    at: Place | None = None
    parameters: Mapping[Name, Finite] = field(default_factory=dict)
    load: bool = False


@described("gas")
class Gas:
    """A gas that is shut in: ``p V^exponent`` stays what it is in the reference configuration.

    Args:
        pressure: Absolute pressure in the reference configuration [Pa].
        exponent: 1 where the temperature stays, 1.4 where no heat is exchanged with air.
        ambient: Absolute pressure outside, which stays [Pa]; None: ``pressure``, so that the gas
            exerts no force in the reference configuration.
    """

    pressure: Positive
    exponent: Finite = 1.4
    ambient: Finite | None = None

    def __post_init__(self) -> None:
        """Check the exponent and the pressure outside.

        Raises:
            SceneError: If the exponent is below 1, or the pressure outside below 0.
        """
        if self.exponent < 1:
            raise SceneError(f"gas: exponent is {show(self.exponent)}; it must be 1 or more")
        if self.ambient is not None and self.ambient < 0:
            raise SceneError(f"gas: ambient is {show(self.ambient)}; it must be 0 or more")

    @property
    def outside(self) -> float:
        """Pressure outside, Pa."""
        return self.pressure if self.ambient is None else self.ambient


@described("enclosed volume")
class EnclosedVolume:
    """The volume that shells enclose, and what fills it.

    The shells together are closed: each edge is joined to another of them, or stays in a plane
    through ``origin``, which closes the volume as a lid does (planes of symmetry). Their normals
    may point inwards or outwards. The volume is that of the surface through the nodes.

    Args:
        name: Its name in the results: ``NAME.volume`` [m^3] and ``NAME.pressure`` [Pa], by which
            the pressure inside exceeds that outside.
        shells: Names of the shells; empty: the only one.
        gas: What fills it; None: a fluid whose volume is given.
        change: Relative change of the fluid's volume over time, ``V/V0 - 1``; on a path, over the
            load factor. None: the volume stays.
        origin: A point in all planes that close the volume [m].
    """

    name: Name
    shells: Listed[Name] = NONE
    gas: Gas | None = None
    change: TimeFunction | None = None
    origin: Vec3 = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        """Check that not both are given.

        Raises:
            SceneError: If there is a gas and a given volume, or a shell twice.
        """
        if self.gas is not None and self.change is not None:
            raise SceneError(
                f"enclosed volume '{self.name}': gas and change are given; one of them must be "
                "left out, because the volume of a gas follows from its pressure"
            )
        if len(set(self.shells)) < len(self.shells):
            raise refused(self, "shells", "each must be named once")
