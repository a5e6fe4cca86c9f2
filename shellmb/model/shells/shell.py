"""A shell as the schemes see it: forms of `shellmb.forms` bound to a mesh, a section and loads."""

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.arrays import Floats, Ints
from shellmb.forms import loads as forms
from shellmb.forms import shell as shell_forms
from shellmb.forms.constraints.held import Held
from shellmb.forms.floating import strains as floating
from shellmb.forms.floating.frame import frame_constraints, of_shell
from shellmb.forms.loads import Point
from shellmb.forms.measure import Measure
from shellmb.forms.shell import Mass, ShellStrains, Surface
from shellmb.forms.steps.mixed import Interval, assumed
from shellmb.forms.steps.mixed_nonlinear import NonlinearMixed
from shellmb.forms.steps.path import Step
from shellmb.meshes.mesh import SurfaceMesh
from shellmb.model.body import Manifold, Rates, largest
from shellmb.model.frames.frame import FRAME, Floating
from shellmb.model.multipliers import Constraints
from shellmb.model.sections.natural import Distributed
from shellmb.model.sections.section import Arm, Rules, mass_arm
from shellmb.model.sections.strains import HyperelasticStrains
from shellmb.model.shells.elastic import ElasticShell
from shellmb.model.shells.positions import field_of
from shellmb.scene import Shell
from shellmb.scene.loads import loads
from shellmb.scene.lookup import of_kind

# the virtual work of loads per area, or length of edges: of a shell, with what gives a parameter of
# the load, displacement and change of the director, and their variations
_DENSITIES: dict[type, Callable[..., Expr]] = {
    loads.SurfaceForce: lambda of, given, u, w, du, dw: forms.dead_force(given("force"), du),
    loads.EdgeForce: lambda of, given, u, w, du, dw: forms.dead_force(given("force"), du),
    loads.FollowerSurfaceForce: lambda of, given, u, w, du, dw: forms.follower_force(
        given("components"), u, w, of.surface, du
    ),
    loads.FollowerEdgeForce: lambda of, given, u, w, du, dw: forms.follower_force(
        given("components"), u, w, of.edge_basis, du
    ),
    loads.Pressure: lambda of, given, u, w, du, dw: forms.pressure(
        given("p", 1), u, of.surface, du
    ),
    loads.Gravity: lambda of, given, u, w, du, dw: forms.gravity(
        given("acceleration"), of.mass_of_section, du, dw
    ),
    loads.EdgeMoment: lambda of, given, u, w, du, dw: forms.director_moment(
        given("moment"), of.surface.D + w, dw
    ),
}


class ShellModel(ElasticShell):
    """A shell body: energies, and virtual work of all that acts in it."""

    @cached_property
    def constraints(self) -> tuple[Constraints, ...]:
        """Directors of unit length, and what floats with the body."""
        of = self.layout.multipliers, self.section.force, self.rules.nodes, self._length_errors
        own = Constraints(Held(self.length.value), *of, self.inertialess, self._turns)
        return own, *(tie.held(self.inertialess) for tie in self.ties)

    @property
    def jump_parts(self) -> frozenset[str]:  # type: ignore[override]
        """Parts that have equations for the jump of velocities."""
        rotary = {"w", "lam"} if self._turns else set()
        found = {"u", *rotary, *self.everywhere}
        return frozenset(found & self.mixed.parts.keys())

    @cached_property
    def _arm(self) -> Arm:
        assert self.mass is not None
        return mass_arm(self.mass, self.mixed.subspaces["u"], self.rules.nodes)

    @property
    def manifold(self) -> Manifold:  # type: ignore[override]
        """Unit directors."""
        reference = self.node_directors()[:, 0] if self.held.unit else None
        if self.mass is None or self.mass.I is None:
            return Manifold(reference, self.inertialess)
        tangent = self._tangent, self._tangent_values, self._tangent_back
        return Manifold(reference, self.inertialess, *tangent)

    def _tangent(self, b: Expr, mid: Expr) -> Expr:
        """A jump of velocities, its director part without momentum along the mean director."""
        first, size = self.mixed.parts["w"]
        d = self.held.normal(self.layout.part(mid, "w"), self.director)
        db = shell_forms.tangent_jump(*self.layout.moved(b), d, self._arm.coefficient)
        components = [b[k] for k in range(b.ufl_shape[0])]
        components[first : first + size] = [db[k] for k in range(size)]
        return ufl.as_vector(components)

    def _tangent_values(self, b: Floats, mid: Floats) -> Floats:
        """Values at the nodes of a jump, its director part without momentum."""
        place, (d, momentum, square) = self.mixed.dofs["w"], self._momenta(b, mid)
        along = np.sum(momentum * d, axis=1, keepdims=True) / square
        out = b.copy()
        out[place] -= (along * d).ravel()
        return out

    def _momenta(self, b: Floats, mid: Floats) -> tuple[Floats, Floats, Floats]:
        """Normals at the nodes, momenta of directors in a jump, and squares of these normals."""
        place = self.mixed.dofs["w"]
        d = self.held.normals(mid[place].reshape(-1, 3), self.node_directors()[:, 0])
        momentum = b[place].reshape(-1, 3)
        if self._arm.coefficient is not None:
            momentum = momentum + self._arm.values * b[self.mixed.dofs["u"]].reshape(-1, 3)
        return d, momentum, np.sum(d * d, axis=1, keepdims=True)

    def _tangent_back(self, b: Floats, mid: Floats, of: Floats) -> tuple[Floats, Floats]:
        """Covectors of a jump and of the state for one of `_tangent_values`: these, transposed."""
        by_jump, by_state = of.copy(), np.zeros_like(of)
        place, (d, momentum, square) = self.mixed.dofs["w"], self._momenta(b, mid)
        w = of[place].reshape(-1, 3)
        along = np.sum(momentum * d, axis=1, keepdims=True) / square
        back = np.sum(w * d, axis=1, keepdims=True) / square
        by_jump[place] -= (back * d).ravel()
        if self._arm.coefficient is not None:
            by_jump[self.mixed.dofs["u"]] -= (self._arm.values * back * d).ravel()
        by_normal = back * (2.0 * along * d - momentum) - along * w
        # normals are linear in the state, by a symmetric matrix
        by_state[place] = self.held.normals(by_normal, np.zeros_like(w)).ravel()
        return by_jump, by_state

    def inertia(self, rate: Expr, dq: Expr) -> Form | None:
        """Virtual work of the inertia forces, left-hand sides of eqs. (26)-(27)."""
        if self.mass is None:
            return None
        motion, virtual = self.layout.moved(rate), self.layout.moved(dq)
        return _over_mass(
            self.mass, self.rules, lambda m: shell_forms.momentum_work(*motion, m, *virtual)
        )

    def natural_stress(self, given: Any) -> tuple[Expr, tuple[Expr, ...], Expr, Measure]:
        """Natural strain, its stress, what of it is reported, and the strains that it acts on."""
        formulation, parts = self.section.formulation, list[Expr]()
        for name in ("membrane", "curvature"):
            who = f"natural strain of shell '{self.name}': {name}"
            parts.append(field_of(getattr(given, name), self.mixed, 3, who))
        membrane = parts[0] if self.shell.stretching else ufl.as_vector([0, 0, 0])
        e = ufl.as_vector([*membrane, *parts[1], 0.0, 0.0])
        if isinstance(formulation, NonlinearMixed):
            resultants = formulation.stress(e)
            return e, (resultants,), resultants, assumed(self.strain, self.layout)
        N = self.forces_of(e)
        return e, formulation.stress(e, N), formulation.joined(e, N), self.strain

    def load_work(self, load: Any, mid: Expr, dq: Expr) -> Form:
        """Virtual work of a load for a factor of one."""
        density = of_kind(_DENSITIES, load)

        def given(name: str, size: int = 3) -> Expr:
            """A constant, or a function of the position interpolated once."""
            return field_of(getattr(load, name), self.mixed, size, f"{load.label}: {name}")

        work = density(self, given, *self.layout.moved(mid), *self.layout.moved(dq))
        return work * (self.ds(load.at, load.label) if hasattr(load, "at") else self.rules.full)

    @property
    def edge_basis(self) -> Surface:
        """Outward, along the edge, and normal: the basis of follower forces on edges."""
        surf = self.surface
        outward = ufl.FacetNormal(self.mixed.space.mesh)
        return Surface(outward, ufl.cross(ufl.cross(surf.e1, surf.e2), outward), surf.D)

    def point(self, mid: Expr, rates: Rates | None, dq: Expr, time: fem.Constant) -> Point:
        """Fields that terms of the user depend on; arguments as of `applied`."""
        u, w = self.layout.moved(mid)
        v, dw_dt = (None, None) if rates is None else self.layout.moved(rates.now)
        du, dw = self.layout.moved(dq)

        def change(d: Expr) -> ShellStrains:
            return shell_forms.named(self.strain.change(mid, d))

        return Point(
            *(u, w, v, dw_dt, du, dw, self.surface, self.mass, time),
            x=self.position(mid),
            d=self.director + w,
            normal=shell_forms.normal(u, self.surface),
            strain_rate=None if rates is None else change(rates.now),
            dstrain=change(dq),
        )

    def forces(self, q: Expr) -> Expr:
        """Membrane and shear forces of the elements, shape (5,), N/m."""
        return self.layout.tying.force(self.section.formulation.N0 * self.layout.forces(q))

    def strained(self, q: Expr) -> tuple[Expr, ...]:
        """Strains and their energy per area where these do not follow from resultants."""
        strains, formulation = self.strains(q), self.section.formulation
        assert isinstance(formulation, NonlinearMixed)
        return *strains.eps, *strains.kap, *strains.gam, formulation.psi(strains)

    def of_squares(self, N: Expr, q: Expr, R: Expr) -> tuple[Expr, Expr, Expr]:
        """Energies of squares of rotations about a frame, as of `forms.floating.frame.of_shell`."""
        return of_shell(N, self.layout.part(q, "u"), R, self.surface)

    def resultants(self, q: Expr) -> Expr:
        """Membrane forces N/m, bending moments N, shear forces N/m of a state, shape (8,)."""
        return self._less(self.section.formulation.resultants(self.strain, self.layout, q), "now")

    def averaged_resultants(self, span: Interval) -> Expr:
        """Resultants of the averaged stress of a sub-interval, the one that acts in its row."""
        return self._less(self.section.formulation.averaged(self.strain, self.layout, span))

    def mean_resultants(self, step: Step) -> Expr:
        """Resultants as means over a step that is quadratic in time."""
        own = self.elastic[0]
        if isinstance(own, HyperelasticStrains):
            return own.mean_stress(step)
        return self._less(own.section.joined(*own.mean(step)))

    def of_stress(self, stress: Expr, q: Expr) -> Expr:
        """Resultants of a stress that is conjugate to the strains, shape (8,)."""
        return stress

    def _less(self, resultants: Expr, at: str = "mean") -> Expr:
        """Resultants less those of the natural strain, at a state or as a mean over a step."""
        if self.natural is None:
            return resultants
        return resultants - getattr(self.natural, at) * self.natural.resultants

    def vectors_at(self, q: Expr) -> Mapping[str, Sequence[Expr]]:
        """Positions and directors at a state."""
        return {"u": [self.position(q)], "w": [self.director + self.layout.part(q, "w")]}

    def _length_errors(self, states: Floats) -> Floats:
        """Largest deviations of a director's length from one on this rank, of some states."""
        reference, places = self._directors_in_state
        d = states[:, places]
        if self.held.unit:
            d += reference
            found = np.sqrt(np.vecdot(d, d))
            found -= 1
        else:
            found = np.array([self.held.values(one, reference)[:, 0] for one in d])
        return largest(found)

    @cached_property
    def _directors_in_state(self) -> tuple[Floats, Ints]:
        """Reference directors and where their changes are in a state, both of shape (n, 3)."""
        return self.node_directors()[:, 0], self.mixed.dofs["w"].reshape(-1, 3).astype(np.intp)


def _over_mass(mass: Mass, rules: Rules, density: Callable[[Mass], Expr]) -> Form:
    """Mass by the full rule, moments of inertia of the director at the nodes (`tangent_jump`).

    With a first moment `m v^2 + 2 s v.d' + I d'^2 = (m - s^2/I) v^2 + I (d' + s/I v)^2`, both
    parts positive: the first by the full rule, the second one at the nodes. So the kinetic energy
    is continuous in the offset of the mass, and positive definite.
    """
    if mass.s is not None:
        assert mass.I is not None and mass.centred is not None
        joined = mass._replace(m=mass.s**2 / mass.I)
        return density(Mass(mass.centred, None, None)) * rules.full + density(joined) * rules.nodes
    form = density(Mass(mass.m, None, None)) * rules.full
    if mass.I is not None:
        form += density(mass._replace(m=0 * mass.m)) * rules.nodes
    return form


class LinearShell(Floating, ShellModel):
    """A shell with a floating frame; made as `DiscreteShell` is."""

    def _apart(self, q: Expr) -> Expr:
        """Constraints that tie the frame, shape (9,)."""
        turned = floating.turned_with_shell(*self.layout.moved(q), self.surface)
        return frame_constraints(self.layout.part(q, FRAME), turned)

    @cached_property
    def strain(self) -> Measure:
        """Strains relative to the frame, shape (8,)."""
        return floating.of_shell(self.surface, self._moved)


def build_shell(
    shell: Shell, surface_mesh: SurfaceMesh, loads: Sequence[Distributed], dynamic: bool
) -> ShellModel:
    """A shell with the strains that its model has; arguments as of `DiscreteShell`."""
    kind = LinearShell if shell.model == "floating-frame" else ShellModel
    return kind(shell, surface_mesh, loads, dynamic)
