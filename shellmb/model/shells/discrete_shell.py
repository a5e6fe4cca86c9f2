"""A shell bound to mesh, space, section, rules of its integrals, and kinematics."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property, partial
from typing import Any

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem, mesh
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.forms import shell as shell_forms
from shellmb.forms.measure import Measure, measure
from shellmb.forms.shell import ShellStrains, Surface, surface
from shellmb.forms.state import Layout
from shellmb.forms.steps.mixed_nonlinear import NonlinearMixed
from shellmb.forms.tying import Tying, tying
from shellmb.meshes.directors import reference_director
from shellmb.meshes.mesh import SurfaceMesh
from shellmb.meshes.spaces import NO_PARTS, shell_space
from shellmb.meshes.tying import cell_bows, cell_directions, cell_squares, shell_forces
from shellmb.model.body import PartScale
from shellmb.model.frames.frame import FloatingFrame, directors_held
from shellmb.model.sections import section as sections
from shellmb.model.sections.branches import slowing
from shellmb.model.sections.natural import Distributed, LoadedBody
from shellmb.model.sections.strains import Integrate
from shellmb.model.shells.positions import direction_1
from shellmb.model.user_forms import components
from shellmb.scene import Shell
from shellmb.scene.values.user_functions import values_at

# strains that a user's measure gives, and how many of each
STRAINS = {"eps": 3, "kap": 3, "gam": 2}
# distances of cells from parallelograms up to which they are such
PARALLELOGRAMS = 1e-9
_ADVICE_MOTION = "a smaller step, a finer mesh, or a smaller load step"
_ADVICE_FORCE = "a smaller step, or check the stiffness and thickness of the section"


class DiscreteShell(LoadedBody):
    """A shell on its mesh, before any force acts in it.

    Args:
        shell: Description.
        surface_mesh: Its meshed surface.
        loads: Loads on it.
        dynamic: Whether it moves in time, and so has inertia.

    Attributes:
        everywhere: Parts of its state that are the same all over it, with their sizes.
        ties: Floating frames that its strains are small relative to.
    """

    everywhere: Mapping[str, int] = NO_PARTS
    ties: tuple[FloatingFrame, ...] = ()

    def __init__(
        self, shell: Shell, surface_mesh: SurfaceMesh, loads: Sequence[Distributed], dynamic: bool
    ) -> None:
        self.shell = self.described = shell
        self.surface_mesh = self.domain = surface_mesh
        domain = surface_mesh.mesh
        own = sections.has_own_strains(shell, domain)
        super().__init__(shell.name, shell_space(domain, shell.degree, own, self.everywhere))
        nodal = self.mixed.subspaces["u"]
        self.director = self.frames = reference_director(surface_mesh, nodal)
        direction = direction_1(shell, surface_mesh, self.mixed, self.director)
        self.surface: Surface = surface(ufl.Jacobian(domain), direction, self.director)
        self.tying = maps = bind_tying(domain, shell, self.surface)
        self.layout = Layout(self.mixed.parts, maps)
        self.rules = sections.quadrature_rules(domain, shell.degree)
        self._ds = self._edge_measure(domain)
        # integral of densities, by rule
        self.integrate: Integrate = partial(sections.integral, (self.rules.full, *self.rules.taken))
        # the constraint of the director as numbers
        self.held = directors_held(shell_forms.director_constraint, 1)
        self.section = sections.bind_section(shell, domain, maps, at_rest=not dynamic)
        if not isinstance(self.section.formulation, NonlinearMixed):
            self.mixed = replace(self.mixed, stresses=self.mixed.elementwise)
        if shell.holds_strains:
            # forces of constrained strains have hardly a compliance to be eliminated by
            self.mixed = replace(self.mixed, elementwise=self.mixed.elementwise - {"N"})
        weighed = any(getattr(load, "weighs", False) for load in loads)
        # an eccentric weight turns the director whether or not its rotation has inertia
        every = replace(shell, rotary_inertia=True, eccentric_inertia=True)
        self.mass_of_section = sections.bind_mass(every, domain) if weighed else None
        self.mass = sections.bind_mass(shell, domain) if dynamic else None
        # whether the rotation of the director has inertia, or nothing has
        self._turns = self.mass is None or self.mass.I is not None
        self.inertialess = not self._turns
        self._loads, self.slowing = loads, slowing(shell.section, domain)
        self.kinematic = frozenset({"u", "w"})
        # set where joints tie the shell's velocities to those of other bodies
        self.extent = "thickness", self.section.thickness
        self.slenderness = slenderness = self.section.thickness / surface_mesh.length
        label = f"of shell '{shell.name}'"
        scales = {
            "u": (f"displacement {label}", surface_mesh.length, _ADVICE_MOTION),
            "w": (f"director {label}", 1.0, _ADVICE_MOTION),
            "N": (f"forces of the elements {label}", min(slenderness, 1e-3), _ADVICE_FORCE),
            "S": (f"strains of the elements {label}", min(slenderness, 1e-3), _ADVICE_FORCE),
            "lam": (f"director multiplier {label}", slenderness**2, _ADVICE_MOTION),
            "frame": (f"floating frame {label}", 1.0, _ADVICE_MOTION),
            "hold": (f"multiplier of the floating frame {label}", slenderness**2, _ADVICE_MOTION),
        }
        self.parts = tuple(PartScale(name, *scales[name]) for name in self.mixed.parts)

    @property
    def material(self) -> tuple[float, float]:
        """Young's modulus, or stiffness over thickness, and density."""
        sizes = self.section
        E = getattr(self.shell.section, "E", None) or sizes.stiffness / sizes.thickness
        return E, sizes.mass / sizes.thickness

    @property
    def bending(self) -> tuple[float, float]:
        """Bending stiffness `D` and mass, per width."""
        sizes = self.section
        return sizes.stiffness * sizes.thickness**2 / 12, sizes.mass

    @property
    def stretching(self) -> tuple[float, float]:
        """Largest stiffness in the surface and mass, per width."""
        return self.section.stiffness, self.section.mass

    def sizes_at(self, x: Floats) -> dict[str, Any]:
        """Thickness at positions."""
        section: Any = self.shell.section
        varies = section.layered and section.functions
        return {"thickness": section.at(x).thickness if varies else self.section.thickness}

    def natural_faces(self) -> list[Floats]:
        """Natural strains 11, 22 and 2*12 at both faces, for a factor of one."""
        X, half, parts = self.mixed.nodes("u").T, self.section.thickness / 2, []
        for name in ("membrane", "curvature"):
            given = getattr(self.shell.natural, name)
            who = f"natural strain of shell '{self.name}': {name}"
            fixed = None if callable(given) else np.reshape(given, (3, 1))
            parts.append(values_at(given, X, 3, who) if fixed is None else fixed)
        return [parts[0] + side * half * parts[1] for side in (-1.0, 1.0)]

    @cached_property
    def thickness(self) -> fem.Constant:
        """Length that makes curvatures comparable with strains, m."""
        return fem.Constant(self.mixed.space.mesh, self.section.thickness)

    def node_directors(self) -> Floats:
        """Reference directors of the local nodes (owned and ghost), shape (n, 1, 3)."""
        return np.asarray(self.director.x.array.reshape(-1, 1, 3))

    def _edge_measure(self, domain: mesh.Mesh) -> ufl.Measure:
        """Measure over all named edges, numbered in their order; edges may share facets."""
        kind = fem.IntegralType.exterior_facet
        entities = [
            (k, fem.compute_integration_domains(kind, domain.topology, facets))
            for k, facets in enumerate(self.surface_mesh.edges.values())
        ]
        degree = {"quadrature_degree": 2 * self.shell.degree + 1}
        return ufl.Measure("ds", domain, subdomain_data=entities, metadata=degree)

    def ds(self, edge: str | tuple[str, ...], who: str) -> ufl.Measure:
        """Measure along an edge or several.

        Args:
            edge: Name or names.
            who: Who asks, for the error.

        Raises:
            SceneError: If there is no such edge.
        """
        self.surface_mesh.facets(edge, who)
        names = (edge,) if isinstance(edge, str) else edge
        numbers = list(self.surface_mesh.edges)
        return self._ds(tuple(numbers.index(name) for name in names))

    @cached_property
    def strain(self) -> Measure:
        """Strains (eps, kap, gam), shape (8,): those of eq. (9), or of the user's measure."""
        own = self.shell.strains
        if own is None:
            return shell_forms.strain_measure(self.surface, self.layout.moved)

        def strains(q: Expr) -> Expr:
            at = (*self.layout.moved(q), self.surface)
            return ufl.as_vector(components(own, at, f"shell '{self.name}': strains", STRAINS))

        return measure(strains)

    @cached_property
    def length(self) -> Measure:
        """The constraint of the director, shape (1,)."""
        layout, D, held = self.layout, self.director, shell_forms.director_constraint
        return measure(lambda q: ufl.as_vector([held(layout.part(q, "w"), D)]))

    def strains(self, q: Expr) -> ShellStrains:
        """Strains of a state by their names."""
        return shell_forms.named(self.strain.value(q))

    def position(self, q: Expr) -> Expr:
        """Position of the deformed surface, shape (3,), m."""
        return ufl.SpatialCoordinate(self.mixed.space.mesh) + self.layout.part(q, "u")


def bind_tying(domain: mesh.Mesh, shell: Shell, surf: Surface) -> Tying:
    """Maps of the forces of elements.

    Args:
        domain: Mesh of the shell.
        shell: The shell.
        surf: Its local basis.
    """
    forces = shell_forces(domain.basix_cell(), shell.degree)
    direction = bow = None
    if forces.constants:
        direction = sections.per_cell(domain, cell_directions(domain), 3)
    # without them strains that are constrained are those of bodies that bend, on regular meshes
    if forces.twists and shell.stretching:
        bows = cell_bows(domain)
        most = domain.comm.allreduce(np.abs(bows).max(initial=0.0), op=MPI.MAX)
        bow = sections.per_cell(domain, bows, 2) if most > PARALLELOGRAMS else None
    size = sections.per_cell(domain, cell_squares(domain))
    components = forces.weights, forces.polynomials, forces.constants, forces.twists
    rules = tuple(rule.strains for rule in forces.rules)
    return tying(ufl.Jacobian(domain), surf, direction, bow, size, components, rules)
