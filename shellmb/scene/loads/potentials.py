"""Potentials: energies of the position and the directors of bodies."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field
from typing import Any

from shellmb.scene.values.validate import Finite, Name, Place, described


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
