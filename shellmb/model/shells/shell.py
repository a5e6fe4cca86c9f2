"""A shell as the schemes see it: forms of `shellmb.forms` bound to a mesh, a section and loads."""

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property

import numpy as np
import numpy.typing as npt
import ufl
from dolfinx import fem, mesh
from ufl import Form
from ufl.core.expr import Expr

from shellmb.forms import hourglass
from shellmb.forms import shell as shell_forms
from shellmb.forms.shell import Mass, ShellStrains
from shellmb.forms.state import Layout
from shellmb.forms.steps.mixed import Density, Interval
from shellmb.forms.steps.path import Step
from shellmb.forms.surface import Surface, surface
from shellmb.forms.terms import Point
from shellmb.meshes.directors import reference_director
from shellmb.meshes.mesh import SurfaceMesh
from shellmb.meshes.spaces import MixedSpace, shell_space
from shellmb.model.body import (
    FixedDofs,
    LoadFactors,
    NodeLink,
    PartScale,
    Rates,
    SubInterval,
    Term,
)
from shellmb.model.rules import quadrature_rules
from shellmb.model.section import bind_mass, bind_section
from shellmb.model.shells import path as shellpath
from shellmb.model.shells.direction import direction_1
from shellmb.model.shells.loads import ShellLoads
from shellmb.model.written import virtual_work
from shellmb.scene import LinearSection, Shell
from shellmb.scene.loads.loads import Gravity, Load

_ADVICE_MOTION = "a smaller step, a finer mesh, or a smaller load step"
_ADVICE_FORCE = "a smaller step, or check the stiffness and thickness of the section"


class ShellModel:
    """A shell body.

    Args:
        shell: Description.
        surface_mesh: Its meshed surface.
        loads: Loads on it.
        dynamic: Whether it moves in time, and so has inertia.
    """

    def __init__(
        self, shell: Shell, surface_mesh: SurfaceMesh, loads: list[Load], dynamic: bool
    ) -> None:
        self.name, self.shell, self.surface_mesh = shell.name, shell, surface_mesh
        domain = surface_mesh.mesh
        linear = isinstance(shell.section, LinearSection)
        self.mixed: MixedSpace = shell_space(domain, shell.degree, not linear)
        if shell.holds_strains:
            # multipliers: no compliance by which they could be eliminated cell by cell
            self.mixed = replace(self.mixed, elementwise=self.mixed.elementwise - {"N"})
        self.layout = Layout(self.mixed.parts)
        self.director = reference_director(
            surface_mesh, self.mixed.subspaces["u"], shell.degree, shell.name
        )
        direction = direction_1(shell, surface_mesh, self.mixed, self.director)
        self.surface: Surface = surface(ufl.Jacobian(domain), direction, self.director)
        self.rules = quadrature_rules(domain, shell.degree)
        self._ds = self._edge_measure(domain)
        self.section = bind_section(shell, domain)
        jacobian = ufl.Jacobian(domain)
        self.line_strains = hourglass.line_strains(self.strains, self.surface, jacobian)
        weighed = any(isinstance(load, Gravity) for load in loads)
        # an eccentric weight turns the director whether or not its rotation has inertia
        every = replace(shell, rotary_inertia=True, eccentric_inertia=True)
        self.mass_of_section = bind_mass(every, domain) if weighed else None
        self.mass = bind_mass(shell, domain) if dynamic else None
        self._loads = loads
        self.fixed: list[FixedDofs] = []
        self.links: tuple[NodeLink, ...] = ()
        self.kinematic = frozenset({"u", "w", "bubble"} & self.mixed.parts.keys())
        # set where joints tie the shell's velocities to those of other bodies
        self.coupled = False
        self.slenderness = slenderness = shell.section.thickness / surface_mesh.length
        label = f"of shell '{shell.name}'"
        scales = {
            "u": (f"displacement {label}", surface_mesh.length, _ADVICE_MOTION),
            "bubble": (f"displacement bubble {label}", surface_mesh.length, _ADVICE_MOTION),
            "w": (f"director {label}", 1.0, _ADVICE_MOTION),
            "N": (f"resultants {label}", min(slenderness, 1e-3), _ADVICE_FORCE),
            "S": (f"assumed strains {label}", min(slenderness, 1e-3), _ADVICE_FORCE),
            "lam": (f"director multiplier {label}", slenderness**2, _ADVICE_MOTION),
        }
        self.parts = tuple(PartScale(name, *scales[name]) for name in self.mixed.parts)

    @property
    def domain(self) -> SurfaceMesh:
        """Its mesh with names."""
        return self.surface_mesh

    @property
    def force_size(self) -> float:
        """Size of its resultants, N."""
        return float(self.section.force.value)

    def node_directors(self) -> npt.NDArray[np.float64]:
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

    def hourglass(self, pair: tuple[Expr, Expr]) -> Form:
        """Difference of the finer rules and the reduced rule of a pair of densities."""
        assert self.rules.lines is not None
        first, second = (self.section.hourglass * density for density in pair)
        dx1, dx2 = self.rules.lines
        return first * dx1 + second * dx2 - (first + second) * self.rules.reduced

    def strains(self, q: Expr) -> ShellStrains:
        """Strains of a state, by the user's measure where there is one."""
        measure = self.shell.strains or shell_forms.shell_strains
        u, w = self.layout.displacement(q), self.layout.director_change(q)
        return measure(u, w, self.surface)

    def integrate(self, density: Density) -> Form:
        """Integral of densities for the full and the reduced rule."""
        return density[0] * self.rules.full + density[1] * self.rules.reduced

    def internal(self, span: Interval, dq: Expr) -> Form:
        """Internal virtual work, compatibility, and the director constraint with its force."""
        return shellpath.general(self, span, dq) + shellpath.directors(self, span, dq)

    def within(self, sub: SubInterval, dq: Expr, trial: Expr) -> tuple[Form | None, list[Term]]:
        """The same, the section's forces as terms where strains are quadratic."""
        return shellpath.within(self, sub, dq, trial)

    def along(self, step: Step, k: int, dq: Expr, trial: Expr) -> tuple[Form | None, list[Term]]:
        """Internal forces over a step, and the constraints of the directors."""
        return shellpath.along(self, step, k, dq, trial)

    def lost(self, step: Step, bow: Expr) -> Form | None:
        """Elastic energy of the bow of the strains, J."""
        return shellpath.lost(self, step, bow)

    def velocities(self, v: Expr) -> tuple[Expr, Expr]:
        """Velocity of the surface and of the director in a rate of the state."""
        return self.layout.displacement(v), self.layout.director_change(v)

    def _integrate_mass(self, density: Callable[[Mass], Expr]) -> Form:
        """Mass by the full rule, moments of inertia of the director at the nodes.

        With a first moment everything is taken at the nodes: with `m` by another rule than `s*` and
        `I*` the kinetic energy would not be positive definite.
        """
        mass = self.mass
        assert mass is not None
        if mass.s is not None:
            return density(mass) * self.rules.nodes
        form = density(shell_forms.without_director(mass)) * self.rules.full
        if mass.I is not None:
            form += density(shell_forms.director_inertia(mass)) * self.rules.nodes
        return form

    @property
    def jump_parts(self) -> frozenset[str]:
        """Parts that have equations for the jump of velocities."""
        turning = {"w", "lam"} if self._turns else set()
        return frozenset(({"u", "bubble"} | turning) & self.mixed.parts.keys())

    @property
    def _turns(self) -> bool:
        """Whether the rotation of the director has inertia, or nothing has."""
        return self.mass is None or self.mass.I is not None

    @property
    def inertialess(self) -> bool:
        """Whether the directors have no inertia though the shell moves."""
        return not self._turns

    def velocity_constraint(self, v: Expr, mid: Expr, dv: Expr) -> Form | None:
        """Directors do not change their length, with the impulses for that."""
        if not self._turns:
            return None
        layout = self.layout
        d = self.director + layout.director_change(mid)
        impulse = layout.part(v, "lam") * ufl.dot(d, layout.director_change(dv))
        violation = layout.part(dv, "lam") * ufl.dot(d, layout.director_change(v))
        return self.section.force * (impulse + violation) * self.rules.nodes

    def tangent(self, b: Expr, mid: Expr) -> Expr:
        """A jump of velocities, its director part without momentum along the mean director."""
        if self.mass is None or self.mass.I is None:
            return b
        first, size = self.mixed.parts["w"]
        d = self.director + self.layout.director_change(mid)
        db = shell_forms.tangent_jump(*self.velocities(b), d, self.mass)
        components = [b[k] for k in range(b.ufl_shape[0])]
        components[first : first + size] = [db[k] for k in range(size)]
        return ufl.as_vector(components)

    def tangent_values(
        self, b: npt.NDArray[np.float64], mid: npt.NDArray[np.float64]
    ) -> npt.NDArray[np.float64]:
        """The same for the values at the nodes."""
        if self.mass is None or self.mass.I is None:
            return b
        place = self.mixed.dofs["w"]
        d = self.director.x.array.reshape(-1, 3) + mid[place].reshape(-1, 3)
        db = b[place].reshape(-1, 3)
        momentum = db
        if self.mass.s is not None:
            _, s, inertia = self.shell.section.mass
            ratio = s / inertia
            momentum = db + ratio * b[self.mixed.dofs["u"]].reshape(-1, 3)
        along = np.sum(momentum * d, axis=1) / np.sum(d * d, axis=1)
        out = b.copy()
        out[place] = (db - along[:, None] * d).ravel()
        return out

    def inertia(self, rate: Expr, dq: Expr) -> Form | None:
        """Virtual work of the inertia forces, left-hand sides of eqs. (26)-(27)."""
        if self.mass is None:
            return None
        du, dw = self.velocities(dq)

        def density(mass: Mass) -> Expr:
            h, g = shell_forms.momenta(*self.velocities(rate), mass)
            return ufl.dot(h, du) + ufl.dot(g, dw)

        return self._integrate_mass(density)

    def loads(self) -> LoadFactors | None:
        """A set of the shell's loads with time factors of their own."""
        return ShellLoads(self, self._loads) if self._loads else None

    def extra(self, mid: Expr, rates: Rates | None, dq: Expr, time: fem.Constant) -> Form | None:
        """The user's terms at the mid-point."""
        if not self.shell.terms:
            return None
        u, w = self.layout.displacement(mid), self.layout.director_change(mid)
        v, dw_dt = (None, None) if rates is None else self.velocities(rates.now)
        du, dw = self.velocities(dq)
        point = Point(u, w, v, dw_dt, du, dw, self.surface, self.mass, time)
        work = virtual_work(self.shell.terms, point, dq, f"shell '{self.name}'")
        return work * self.rules.full

    def resultants(self, q: Expr) -> Expr:
        """Membrane forces N/m, bending moments N, shear forces N/m of a state, shape (8,)."""
        return self.section.formulation.resultants(self.strains, self.layout, q)

    def mean_resultants(self, step: Step) -> Expr:
        """The same as means over a step that is quadratic in time."""
        return shellpath.mean_resultants(self, step)

    def strain_energy(self, q: Expr) -> Form:
        """Strain energy, J."""
        form = self.integrate(self.section.formulation.energy(self.strains, self.layout, q))
        if self.rules.lines is not None:
            form += self.hourglass(hourglass.energy(self.line_strains, q))
        return form

    def kinetic_energy(self, v: Expr) -> Form | None:
        """Kinetic energy, J."""
        if self.mass is None:
            return None
        velocities = self.velocities(v)
        return self._integrate_mass(lambda mass: shell_forms.kinetic_density(*velocities, mass))

    def jump(self, a: Expr, b: Expr) -> Form:
        """Elastic part of `c^2` in eq. (34), J."""
        form = self.integrate(self.section.formulation.jump(self.strains, self.layout, a, b))
        if self.rules.lines is not None:
            form += self.hourglass(hourglass.jump(self.line_strains, a, b))
        return form

    def momentum(self, v: Expr, axis: Expr) -> Form | None:
        """Component of the linear momentum along `axis`, kg m/s."""
        if self.mass is None:
            return None
        velocities = self.velocities(v)
        return self._integrate_mass(
            lambda mass: ufl.dot(shell_forms.momenta(*velocities, mass)[0], axis)
        )

    def angular_momentum(self, q: Expr, v: Expr, axis: Expr) -> Form | None:
        """Component along `axis` of the angular momentum about the origin, kg m^2/s."""
        if self.mass is None:
            return None
        x, d = self.position(q), self.director + self.layout.director_change(q)

        def density(mass: Mass) -> Expr:
            h, g = shell_forms.momenta(*self.velocities(v), mass)
            return ufl.dot(ufl.cross(x, h) + ufl.cross(d, g), axis)

        return self._integrate_mass(density)

    def position(self, q: Expr) -> Expr:
        """Position of the deformed surface, shape (3,), m."""
        return ufl.SpatialCoordinate(self.mixed.space.mesh) + self.layout.displacement(q)

    def reference_directors(self) -> npt.NDArray[np.float64]:
        """Reference directors of the local nodes, shape (n, 3)."""
        return np.asarray(self.director.x.array.reshape(-1, 3))

    def constraint_error(self, q: fem.Function) -> float:
        """Largest deviation of a director's length from one on this rank."""
        reference, places = self._directors_in_state
        d = q.x.array[places]
        d += reference
        lengths = np.sqrt(np.vecdot(d, d))
        lengths -= 1
        # `reduce` and not `max`: Python around it takes longer than the numbers
        return float(np.maximum.reduce(np.abs(lengths), initial=0.0))

    @cached_property
    def _directors_in_state(
        self,
    ) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.intp]]:
        """Reference directors and where their changes are in a state, both of shape (n, 3)."""
        return self.reference_directors(), self.mixed.dofs["w"].reshape(-1, 3).astype(np.intp)
