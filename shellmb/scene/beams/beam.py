"""Beams, and how they are glued to shells."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any, Literal, Self

import numpy as np
from pydantic import InstanceOf

from shellmb.arrays import Floats
from shellmb.errors import SceneError
from shellmb.scene.beams.curves import Curve
from shellmb.scene.beams.sections import BeamSection
from shellmb.scene.types import NONE, Axis, Listed, Name, PositiveInt
from shellmb.scene.values.models import BeamNaturalStrain, BodyModel, Deforming
from shellmb.scene.values.validate import described, error_of, refused, show, unit_vector


@described("beam")
class Beam(Deforming):
    """A geometrically exact beam: a reference line, its section, its mesh.

    At every point of it are three directors: d1 begins as the tangent, d3 as the projection of
    ``up`` across it, and d2 = d3 x d1. The section's axes are d2 and d3.

    Args:
        name: What supports, joints, loads and results call it.
        curve: The reference line.
        section: The section.
        elements: Number of elements; a beam along a shell has those of the shell.
        degree: Degree of displacement and directors, 2 or 3.
        up: Direction whose projection across the tangent is d3; None: the z axis, or where that is
            nearly tangential somewhere, another axis; along a shell, the shell's director.
        rotary_inertia: Whether the rotation of the section has inertia.
        eccentric_inertia: Whether its first moments are included, where it has such.
        transverse_shear: Whether the section shears; False: a slender beam in Bernoulli's limit.
        stretching: Whether it stretches along its line; False: inextensible.
        coupling: Whether forces and moments are coupled, where the section does so.
        model: ``"exact"``: any displacements and rotations; ``"floating-frame"``: small strains and
            rotations relative to a frame that moves by any amount; ``Modal(modes=10)``: the same,
            reduced to modes; ``"rigid"``: one rigid body. Mass and inertia are those of its mesh
            and section in all of them.
        terms: Terms added to the weak form, each a callable in UFL.
        natural: Strains that it has without stress, as by heat.
    """

    name: Name
    curve: InstanceOf[Curve]
    section: InstanceOf[BeamSection]
    elements: PositiveInt = 8
    degree: Literal[2, 3] = 2
    up: Axis | None = None
    rotary_inertia: bool = True
    eccentric_inertia: bool = True
    transverse_shear: bool = True
    stretching: bool = True
    coupling: bool = True
    model: BodyModel = "exact"
    terms: Listed[Callable[..., Any]] = NONE
    natural: InstanceOf[BeamNaturalStrain] | None = None

    home = "beams"
    # no file has its mesh, and its elements have one form
    refined_times = None
    cell = None
    directors = 3
    quantities = ("force", "moment")
    mass_word = "mass per length"

    @property
    def point_names(self) -> tuple[str, ...]:
        """Names of its ends."""
        return self.curve.point_names

    edge_names = point_names

    @property
    def field_kinds(self) -> set[str]:
        """Kinds of fields that it may have."""
        return super().field_kinds if self.rigid else {"beam"}

    @property
    def along(self) -> str | None:
        """Name of the shell in whose mesh it lies; None: it has a mesh of its own."""
        return self.curve.shell

    @property
    def sides(self) -> tuple[int, ...]:
        """Number of elements."""
        return (self.elements,)

    def with_sides(self, sides: Iterable[int]) -> Self:
        """The beam with another number of elements."""
        return replace(self, elements=sum(sides))

    def divided(self, times: int) -> Self:
        """The beam with so many elements in place of one."""
        return replace(self, elements=times * self.elements)

    def some_positions(self, s: Floats) -> Floats | None:
        """Positions along it."""
        return None if self.along is not None else self.curve.position(s)

    def __post_init__(self) -> None:
        """Check the mesh and the direction of the section.

        Raises:
            SceneError: If a closed line has too few elements, ``up`` is tangential somewhere, or it
                is given where the shell tells it.
        """
        if self.natural is not None and not self.exact:
            raise error_of(
                self, f"natural is given, and its model is {show(self.model)}; it must be 'exact'"
            )
        if self.natural is not None and self.natural.extension and not self.stretching:
            raise SceneError(
                f"beam '{self.name}': natural is given with an extension, and stretching is False; "
                "it must be True, or extension must be left out"
            )
        if self.along is not None:
            if self.up is not None:
                raise refused(self, "up", "it must be left out along a shell, whose director is d3")
            return
        if self.curve.closed and self.elements < 3:
            raise refused(self, "elements", "it must be at least 3 around a closed curve")
        if self.up is not None:
            up = unit_vector(self.up, f"beam '{self.name}': up")
            xi = np.linspace(0, 1, 33)
            across = np.linalg.norm(np.cross(up, self.curve.tangent(xi), axis=0), axis=0)
            if across.min() < 1e-6:
                raise SceneError(
                    f"beam '{self.name}': up is {show(self.up)}, which is tangential at xi = "
                    f"{xi[across.argmin()]:.3g}; it must have a part across the beam everywhere"
                )


@described("glue")
class Glue:
    """A connection of a beam to the nodes of the shell's mesh along which it runs.

    Args:
        beam: Name of the beam; its curve is ``AlongEdge`` or ``AlongLine`` of the shell.
        shell: Name of the shell.
        kind: ``"revolute"``: at every node the shell revolute joint of eq. 35, because the shell's
            director carries no moment about itself; ``"director"``: the beam's third director is
            the shell's.
    """

    beam: Name
    shell: Name
    kind: Literal["revolute", "director"] = "revolute"
