"""Shells, the joins between them, and shells with finer meshes."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import field, replace
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, InstanceOf

from shellmb.arrays import Floats
from shellmb.scene.shells.gmsh_surfaces import Meshed
from shellmb.scene.shells.sections import LinearSection, Section, Wrinkling
from shellmb.scene.shells.surfaces import Surface
from shellmb.scene.types import NONE, Edge, Listed, Name, PositiveInt, Untrue, Vec3
from shellmb.scene.values.models import BodyModel, Deforming, NaturalStrain
from shellmb.scene.values.user_functions import OfPosition
from shellmb.scene.values.validate import Sentences, described, differ, error_of, show, unit_vector

Distortion = Annotated[float, Field(ge=0, le=0.3, allow_inf_nan=False)]


@described("shell")
class Shell(Deforming):
    """One shell body: a mid-surface, its section, its mesh.

    Args:
        name: What supports, loads and results call it.
        surface: The mid-surface.
        section: The section.
        mesh: Numbers of elements along xi and eta.
        degree: Degree of displacement and director, 2 or 3; triangles: 2.
        cell: Quadrilaterals, ``"quad"``, or triangles, ``"tri"``; None: those of a mesh that is
            read or made by gmsh, else quadrilaterals.
        geometry_order: Order of the mesh geometry; None: 1 for flat surfaces, 2 for curved ones and
            gmsh models, whatever a mesh file holds.
        distortion: Interior vertices are moved by this fraction of the element size, in a fixed
            pattern, up to 0.3; for studies of locking.
        direction: The material 1-direction is this vector projected on the surface, or a
            vectorised function of positions (3, n) that gives vectors (3, n); None: the x axis, or
            where that is nearly normal to some part of the surface, y or z.
        rotary_inertia: Whether the rotation of the director has inertia.
        eccentric_inertia: Whether the first moment s* of eq. 16 is included, where the
            section has one.
        transverse_shear: Whether it shears across its thickness; False: thin plates and shells in
            Kirchhoff's limit.
        stretching: Whether it stretches in its surface; False: inextensible.
        coupling: Whether bending and stretching are coupled, where the section does so.
        strains: A strain measure in place of the usual one: ``strains(u, w, surface)`` returns
            ``ShellStrains``, as :func:`shellmb.forms.shell.shell_strains` does; of any form, zero
            at rest, and quickest to evaluate if at most quadratic in the unknowns.
        terms: Terms added to the weak form, each a callable in UFL.
        model: ``"exact"``: any displacements and rotations; ``"floating-frame"``: small strains and
            rotations relative to a frame that moves by any amount; ``Modal(modes=10)``: the same,
            reduced to modes; ``"rigid"``: one rigid body. Mass and inertia are those of its mesh
            and section in all of them.
        areas: Names of areas with vectorised functions of positions (3, n) that say whether they
            are inside: ``{"flange": lambda x: x[0] < 0.1}``. An area is the elements of which most
            is inside. Supports hold it as they hold edges, and a ``Weld`` bolts it to a frame.
            Physical groups of a gmsh surface that are part of it are areas, too.
        natural: Strains that it has without stress, as by heat; of linear sections.
    """

    name: Name
    surface: InstanceOf[Surface]
    section: InstanceOf[Section]
    mesh: tuple[PositiveInt, PositiveInt] = (8, 8)
    degree: Literal[2, 3] = 2
    cell: Literal["quad", "tri"] | None = None
    geometry_order: Annotated[Literal[1, 2] | None, Untrue] = None
    distortion: Distortion = 0.0
    direction: Vec3 | OfPosition | None = None
    rotary_inertia: bool = True
    eccentric_inertia: bool = True
    transverse_shear: bool = True
    stretching: bool = True
    coupling: bool = True
    strains: Callable[..., Any] | None = None
    terms: Listed[Callable[..., Any]] = NONE
    model: BodyModel = "exact"
    areas: Mapping[Name, Callable[[Any], Any]] = field(default_factory=dict)
    natural: InstanceOf[NaturalStrain] | None = None

    home = "shells"
    # it has a mesh of its own
    along = None
    directors = 1
    quantities = ("membrane", "bending", "shear")
    mass_word = "mass per area"

    @property
    def point_names(self) -> tuple[str, ...] | None:
        """Names of its points; None where only its mesh knows them."""
        return self.surface.points

    @property
    def edge_names(self) -> tuple[str, ...] | None:
        """Names of its edges; None where only its mesh knows them."""
        return self.surface.edges

    @property
    def area_names(self) -> tuple[str, ...]:
        """Names of the areas that it was given."""
        return tuple(self.areas)

    @property
    def region_names(self) -> tuple[str, ...]:
        """Names of its edges and areas."""
        return (*(self.surface.edges or ()), *self.areas)

    @property
    def field_kinds(self) -> set[str]:
        """Kinds of fields that it may have."""
        if self.rigid:
            return super().field_kinds
        held = self.natural is not None and self.natural.plies
        more = {"relaxing": self.section.relaxes, "held": held}
        return {"shell", *self.section.field_kinds, *(kind for kind, has in more.items() if has)}

    @property
    def sides(self) -> tuple[int, ...]:
        """Numbers of elements along xi and eta."""
        return self.mesh

    def with_sides(self, sides: Iterable[int]) -> Self:
        """The shell with other numbers of elements along xi and eta."""
        xi, eta = sides
        return replace(self, mesh=(xi, eta))

    @property
    def elements(self) -> int:
        """Number of elements, 0 where a file tells it."""
        return 0 if self.surface.of_file else math.prod(self.mesh) * (1 + (self.cell == "tri"))

    @property
    def refined_times(self) -> int | None:
        """Elements along a side of each one of the mesh's file; None of meshes made anew."""
        return self.surface.refined

    def divided(self, times: int) -> Self:
        """The shell with more elements: those of a file are divided, others are made anew."""
        surface: Any = self.surface
        if surface.refined is None:
            return self.with_sides(times * n for n in self.mesh)
        return replace(self, surface=replace(surface, refine=times * surface.refined))

    def some_positions(self, s: Floats) -> Floats | None:
        """Positions in its surface."""
        return None if self.edge_names is None else self.surface.position(s, s[::-1].copy())

    def check_degree(self, cell: str | None) -> None:
        """Refuse a degree that elements do not have.

        Raises:
            SceneError: On triangles, if the degree is not 2.
        """
        if cell == "tri" and self.degree != 2:
            raise error_of(self, f"degree is {self.degree}; it must be 2 on triangles")

    def __post_init__(self) -> None:
        """Fill in the cells of what is not meshed yet."""
        if self.cell is None and not isinstance(self.surface, Meshed):
            object.__setattr__(self, "cell", "quad")

    def _wrong(self) -> Sentences:
        """Check what concerns several parameters."""
        self.check_degree(self.cell)
        if self.linear and self.strains is not None:
            yield (
                "model is 'floating-frame', and it has strains of its own; they must be left out, "
                "or the model must be 'exact'"
            )
        for name in self.areas:
            if name in (*(self.surface.edges or ()), *(self.surface.points or ())):
                yield (
                    f"an area is named {show(name)}, as one of its edges or points is; it must "
                    "have another name"
                )
        if self.distortion and isinstance(self.surface, Meshed):
            yield "distortion", "it must be 0 where the mesh is read, or made by gmsh"
        if self.surface.closed and not self.surface.pole and self.mesh[0] < 3:
            yield "mesh", "it must have at least 3 elements around a closed surface"
        if self.direction is not None and not callable(self.direction):
            unit_vector(self.direction, f"shell '{self.name}': direction")
        if self.natural is not None:
            yield from _natural(self, self.natural)
        if isinstance(self.section, Wrinkling) and not (self.exact or self.rigid):
            yield (
                f"its section wrinkles, and its model is {show(self.model)}; it must be 'exact': "
                "small strains about rest are those of the taut membrane"
            )
        if self.section.relaxes and self.holds_strains:
            yield (
                "its section relaxes, and it holds strains at zero; a shell that relaxes must have "
                "stretching=True and transverse_shear=True"
            )
        if not isinstance(self.section, LinearSection):
            for what in ("transverse_shear", "stretching", "coupling"):
                if not getattr(self, what):
                    yield (
                        f"{what} is False; it must be True with a "
                        f"{getattr(self.section, 'label', 'section')}, whose energy is of all "
                        "strains"
                    )


def _natural(shell: Shell, natural: NaturalStrain) -> Sentences:
    """Refuse natural strains of shells that cannot have them."""
    given: Any = natural.membrane, natural.curvature
    section = shell.section
    if not isinstance(section, LinearSection):
        yield "natural is given; its section must be linear"
        return
    if not shell.exact:
        yield f"natural is given, and its model is {show(shell.model)}; it must be 'exact'"
    if not shell.stretching and natural.membrane != (0.0, 0.0, 0.0):
        yield (
            "natural is given with membrane strains, and stretching is False; it must be True, or "
            "membrane must be left out"
        )
    if not natural.plies:
        return
    who = "natural is given with plies"
    if section.functions or any(map(callable, given)):
        yield f"{who}; its section and its strains must be the same everywhere"
    layup = section.generic.at_rest
    if len(natural.plies) != len(layup.layers):
        yield (
            f"{who} of {len(natural.plies)} strains; there must be {len(layup.layers)}, one for "
            "each ply of the section"
        )
    e, scale = layup.natural_strain(natural.plies), np.repeat([1.0, layup.thickness], 3)
    if np.max(scale * np.abs(np.ravel(given) - e)) > 1e-9 * np.max(np.abs(natural.plies)):
        yield (
            f"{who}, membrane {show(given[0])} and curvature {show(given[1])}; they must be those "
            f"of the plies in this section, {show(tuple(e[:3].tolist()))} and "
            f"{show(tuple(e[3:].tolist()))}, as `thermal_strain` finds them"
        )


@described("join")
class Join:
    """Two shells joined along an edge each; the nodes of the two edges must coincide.

    Args:
        first: Name of one shell.
        second: Name of the other.
        at: Edge or edges of the first shell.
        second_at: Edge or edges of the second.
        kind: ``"smooth"``: one director for both; ``"kink"``: each its own, the angle between them
            locked; ``"auto"``: whichever the surfaces' normals along the edge tell.
    """

    first: Name
    second: Name
    at: Edge
    second_at: Edge
    kind: Literal["auto", "smooth", "kink"] = "auto"

    def _wrong(self) -> Sentences:
        """Check that there are two shells."""
        return differ(self, "first", "second", "they must be two shells")
