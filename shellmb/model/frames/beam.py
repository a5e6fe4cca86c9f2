"""A beam as the schemes see it: forms of `shellmb.forms` bound to a line, a section and loads."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem, mesh
from ufl import Form
from ufl.core.expr import Expr

from shellmb.arrays import Floats
from shellmb.forms import beam as beam_forms
from shellmb.forms import loads as load_forms
from shellmb.forms.beam import BeamMixed, Line, LinePoint
from shellmb.forms.floating import strains as floating
from shellmb.forms.floating.frame import frame_constraints, of_beam
from shellmb.forms.frame import FrameMass, momenta, vectors
from shellmb.forms.measure import Measure
from shellmb.forms.steps.damping import ViscousBeam
from shellmb.forms.steps.mixed import Interval
from shellmb.forms.steps.path import Step
from shellmb.meshes.curve_mesh import LineMesh, build_line
from shellmb.meshes.spaces import NO_PARTS, beam_space
from shellmb.model.body import PartScale, Rates
from shellmb.model.frames.frame import FRAME, Floating, FrameBody
from shellmb.model.sections.branches import Fading, MaxwellBranches, StrainDamping, slowing
from shellmb.model.sections.natural import Distributed, LoadedBody
from shellmb.model.sections.section import SLACK, integral, line_rules
from shellmb.model.sections.strains import Integrate, Strains
from shellmb.model.shells.positions import field_of
from shellmb.scene import Beam, BeamSection
from shellmb.scene.loads.loads import FollowerLineForce, Gravity, LineForce, LineMoment
from shellmb.scene.lookup import of_kind

_ADVICE_MOTION = "a smaller step, a finer mesh, or a smaller load step"
_ADVICE_FORCE = "a smaller step, or check the stiffness of the section"

# couplings and moments of inertia smaller than this, relative to their scale, are round-off
NOTHING = 1e-14

# the virtual work per length of loads: of a beam, what is given, directors, and variations of
# displacement and directors; the parameter that gives it, and the quadrature rule
_WORK: dict[type, tuple[Callable[..., Expr], str, str]] = {
    LineForce: (lambda of, f, d, du, dw: load_forms.dead_force(f, du), "force", "full"),
    FollowerLineForce: (
        lambda of, f, d, du, dw: load_forms.follower_frame_force(f, d, du),
        "components",
        "full",
    ),
    LineMoment: (
        lambda of, m, d, du, dw: load_forms.frame_moment(m, d, vectors(dw)),
        "moment",
        "nodes",
    ),
    Gravity: (
        lambda of, g, d, du, dw: load_forms.dead_force(g, momenta(du, dw, of.weight)[0]),
        "acceleration",
        "nodes",
    ),
}


@dataclass(frozen=True)
class BoundBeamSection:
    """A beam section on a mesh.

    Args:
        formulation: Mixed form of its strain energy.
        force: Size of the forces, and of the directors' multipliers, N.
        centre: Where an axial force does not bend it, along d2 and d3, m; None: on the line.
    """

    formulation: BeamMixed
    force: fem.Constant
    centre: fem.Constant | None


def bind_beam_section(beam: Beam, domain: mesh.Mesh, at_rest: bool) -> BoundBeamSection:
    """Constants of a section; without coupling of forces and moments none of its terms exists.

    Args:
        beam: The beam.
        domain: Its mesh.
        at_rest: Whether the stiffness is that of statics; it is the long-term one otherwise.
    """
    A, D0, H, held = _parts(beam)
    A, D0 = (_share(beam, at_rest) * part for part in (A, D0))
    free = [k for k in range(3) if k not in held]

    def constant(value: float | Floats) -> fem.Constant:
        return fem.Constant(domain, np.array(value, dtype=float, order="C"))

    force = constant(float(np.max(np.diag(A))))
    formulation = BeamMixed(
        A_inv=constant(np.linalg.inv(A[np.ix_(free, free)])),
        D0=constant(D0),
        N0=force,
        H=None if H is None else constant(H),
        held=held,
        slack=constant(SLACK / float(np.max(np.diag(A)))) if held else None,
    )
    centre = np.zeros(2) if H is None else np.array([-H[0, 2], H[0, 1]])
    apart = bool(np.max(np.abs(centre)) > NOTHING * beam.section.size)
    return BoundBeamSection(formulation, force, constant(centre) if apart else None)


def _share(beam: Beam, at_rest: bool) -> float:
    """Stiffness, that of statics or the long-term one, over the long-term one."""
    series = beam.section.relaxation
    return 1.0 if series is None or not at_rest else series.at_rest / series.long_term


def _parts(beam: Beam) -> tuple[Floats, Floats, Floats | None, tuple[int, ...]]:
    """`A`, `D_0`, `H` and the strains that are held, as of `BeamMixed`; `H` None if uncoupled."""
    C = beam.section.long_term
    A, B, D = C[:3, :3], C[:3, 3:], C[3:, 3:]
    H = np.linalg.solve(A, B)
    coupled = beam.coupling and np.max(np.abs(H)) > NOTHING * beam.section.size
    held: tuple[int, ...] = () if beam.stretching else (0,)
    held += () if beam.transverse_shear else (1, 2)
    return A, D - B.T @ H if beam.coupling else D, H if coupled else None, held


def _effective(beam: Beam, at_rest: bool = False) -> Floats:
    """Stiffness, long-term or that of statics, (6, 6), without the coupling that is left out."""
    C = _share(beam, at_rest) * beam.section.long_term
    if not beam.coupling:
        C[:3, 3:] = C[3:, :3] = 0.0
    return C


def bind_beam_damping(beam: Beam, elastic: BeamMixed, domain: mesh.Mesh) -> ViscousBeam | None:
    """Constants of the damping of its strains, none of constrained ones; None without any.

    Args:
        beam: The beam.
        elastic: Its elastic form.
        domain: Its mesh.
    """
    A, D0, _, held = _parts(beam)
    times = np.array(beam.section.damping_times)
    times[list(held)] = 0.0
    if not times.any():
        return None
    root, here = np.sqrt(np.outer(times, times)), [k for k in range(3) if k not in held]
    own, by_force = np.zeros((3, 3)), np.zeros((3, 3))
    free = np.ix_(here, here)
    own[free] = A[free]
    by_force[free] = (root[:3, :3] * A)[free] @ np.linalg.inv(A[free])
    numbers = own, by_force, root[3:, 3:] * D0
    return ViscousBeam(elastic, *(fem.Constant(domain, np.ascontiguousarray(n)) for n in numbers))


def bind_beam_mass(section: BeamSection, domain: mesh.Mesh) -> FrameMass:
    """Mass coefficients per length; those that are zero are absent from the forms.

    Args:
        section: The section.
        domain: Line mesh.
    """
    m, first, second = section.mass

    def constant(value: float, scale: float) -> fem.Constant | None:
        return fem.Constant(domain, float(value)) if abs(value) > NOTHING * scale else None

    s2, s3 = (constant(s, m * section.size) for s in first)
    J22, J23, J33 = (constant(j, m * section.size**2) for j in second)
    # in the order of forms.frame.PAIRS; the section has no extent along d1
    J = (None, J22, J33, None, None, J23)
    return FrameMass(fem.Constant(domain, float(m)), (None, s2, s3), J)


class BeamModel(FrameBody, LoadedBody):
    """A beam.

    Args:
        beam: Description.
        domain: Its meshed reference line.
        loads: Distributed loads on it.
        dynamic: Whether it moves in time, and so has inertia.

    Attributes:
        everywhere: Parts of its state that are the same all over it, with their sizes.
    """

    everywhere: Mapping[str, int] = NO_PARTS

    def __init__(
        self, beam: Beam, domain: LineMesh, loads: Sequence[Distributed], dynamic: bool
    ) -> None:
        self.beam = self.described = beam
        self.domain, self.extent = domain, ("size of its section", beam.section.size)
        # its directors at the start
        self.rigid_axes = domain.triads[0].reshape(3, 3).T
        line = domain.mesh
        mixed = beam_space(line, beam.degree, self.everywhere)
        space = mixed.subspaces["w"]
        frames = domain.frames(space)
        # nodes of the parts are listed as those of u
        place = np.argsort(domain.numbers(space))
        order = place[np.argsort(np.argsort(domain.numbers(mixed.subspaces["u"])))]
        self.order = order.astype(np.int32)
        self.rules = line_rules(line, beam.degree)
        # integral of densities at as many Gauss points as the degree
        self.integrate: Integrate = partial(integral, self.rules.taken)
        self._static = not dynamic
        self.section = bind_beam_section(beam, line, self._static)
        if beam.holds_strains:
            # multipliers have no compliance by which they could be eliminated cell by cell
            mixed = replace(mixed, elementwise=frozenset())
        super().__init__(beam.name, mixed)
        self.frames, self.reference = frames, ufl.SpatialCoordinate(line)
        self.nodes, self.force = self.rules.nodes, self.section.force
        self.line: Line = beam_forms.line(ufl.Jacobian(line), frames, self.section.centre)
        mass = bind_beam_mass(beam.section, line)
        # an eccentric weight turns the beam whether or not its rotation has inertia
        self.weight = FrameMass(mass.m, mass.s)
        if dynamic:
            # all of it at the nodes: frames are orthonormal there, and with another rule for the
            # mass than for its moments eccentric sections would have negative kinetic energies
            moved = mass if beam.eccentric_inertia else FrameMass(mass.m, J=mass.J)
            inert = moved if beam.rotary_inertia else FrameMass(mass.m)
            self.masses = ((inert, self.rules.nodes),)
            self.inertialess = "lam" not in self.jump_parts
        self.slowing = slowing(beam.section, line)
        viscous = bind_beam_damping(beam, self.section.formulation, line)
        if viscous is not None:
            resists = Strains(viscous, self.layout, self.strain, self.integrate)
            self.damping = StrainDamping((resists,))
        self._loads = loads
        self.slenderness = slenderness = beam.section.size / domain.length
        label = f"of beam '{beam.name}'"
        scales = {
            "u": (f"displacement {label}", domain.length, _ADVICE_MOTION),
            "w": (f"directors {label}", 1.0, _ADVICE_MOTION),
            "N": (f"forces {label}", min(slenderness, 1e-3), _ADVICE_FORCE),
            "lam": (f"director multipliers {label}", slenderness**2, _ADVICE_MOTION),
            "frame": (f"floating frame {label}", 1.0, _ADVICE_MOTION),
            "hold": (f"floating frame {label}", slenderness**2, _ADVICE_MOTION),
        }
        self.parts = tuple(PartScale(name, *scales[name]) for name in self.mixed.parts)

    def branches(self) -> MaxwellBranches | None:
        """New Maxwell branches of its section; None without any."""
        relaxation, (rule,) = self.beam.section.relaxation, self.rules.taken
        if relaxation is None:
            return None
        C, held = _effective(self.beam), list(self.section.formulation.held)
        C[held], C[:, held] = 0.0, 0.0
        stiffness = fem.Constant(self.domain.mesh, C)
        common = relaxation.branches, rule, self.domain.mesh
        found = Fading(self.strain, stiffness, *common)
        return MaxwellBranches(self.name, self.layout, [found])

    @property
    def material(self) -> tuple[float, float] | None:
        """Young's modulus and density; None where only stiffness and mass are given."""
        section: Any = self.beam.section
        return (section.E, section.density) if hasattr(section, "E") else None

    @property
    def bending(self) -> tuple[float, float]:
        """Least bending stiffness `D`, and mass per length."""
        return float(np.min(np.diag(self.beam.section.stiffness)[4:])), self.beam.section.mass[0]

    @property
    def stretching(self) -> tuple[float, float]:
        """Stiffness along it, and mass per length."""
        return float(self.beam.section.stiffness[0, 0]), self.beam.section.mass[0]

    def sizes_at(self, x: Floats) -> dict[str, Any]:
        """Size of its cross-section."""
        return {"size": self.beam.section.size}

    def natural_faces(self) -> list[tuple[float, float, float]]:
        """Natural strains 11, 22 and 2*12 at both faces, for a factor of one."""
        given: Any = self.beam.natural
        half = self.beam.section.size / 2
        twist, *bent = given.curvature
        bend = half * math.hypot(*bent)
        return [(given.extension + side * bend, 0.0, half * twist) for side in (-1.0, 1.0)]

    def node_directors(self) -> Floats:
        """Reference directors of the local nodes (owned and ghost), shape (n, 3, 3)."""
        return np.asarray(self.frames.x.array.reshape(-1, 3, 3)[self.order])

    def strains(self, q: Expr) -> Expr:
        """Strains (Gamma, K) of a state, shape (6,)."""
        return self.strain.value(q)

    def forces(self, q: Expr) -> Expr:
        """Forces along the directors, shape (3,), N."""
        return self.section.formulation.forces(self.layout, q)

    def strained(self, q: Expr) -> tuple[Expr, ...]:
        """Strains and their energy per length where these do not follow from resultants."""
        e = self.strains(q)
        return *e, *self.section.formulation.stored(e, self.forces(q))

    def of_squares(self, N: Expr, q: Expr, R: Expr) -> tuple[Expr, Expr, Expr]:
        """Energies of squares of rotations about a frame, as of `forms.floating.frame.of_beam`."""
        return of_beam(N, self.layout.part(q, "u"), R, self.line)

    def resultants(self, q: Expr) -> Expr:
        """Forces and moments that balance loads, and those conjugate to the strains, shape (12,).

        Along the directors, N and N m.
        """
        e, formulation = self.strains(q), self.section.formulation
        return self._twice(e, formulation.forces(self.layout, q), "now")

    def averaged_resultants(self, span: Interval) -> Expr:
        """Resultants of the averaged stress of a sub-interval, the one that acts in its row."""
        found = self.section.formulation.averages(self.strain, self.layout, span)
        return self._twice(*found)

    def _twice(self, e: Expr, N: Expr, at: str = "mean") -> Expr:
        N, M = beam_forms.halves(self.section.formulation.joined(e, N))
        if self.natural is not None:
            less = beam_forms.halves(getattr(self.natural, at) * self.natural.resultants)
            N, M = N - less[0], M - less[1]
        return self._both(e, N, M)

    def of_stress(self, stress: Expr, q: Expr) -> Expr:
        """Resultants of a stress that is conjugate to the strains at a state, as `resultants`."""
        return self._both(self.strains(q), *beam_forms.halves(stress))

    def _both(self, e: Expr, N: Expr, M: Expr) -> Expr:
        force, moment = self.acting(e, N, M)
        return ufl.as_vector([v[k] for v in (force, moment, N, M) for k in range(3)])

    def acting(self, e: Expr, N: Expr, M: Expr) -> tuple[Expr, Expr]:
        """Forces and moments that balance loads, of strains and what is conjugate to them."""
        return beam_forms.acting(self.line, e, N, M)

    @cached_property
    def elastic(self) -> tuple[Strains]:
        """Strains of the beam with their section."""
        return (Strains(self.section.formulation, self.layout, self.strain, self.integrate),)

    @cached_property
    def strain(self) -> Measure:
        """Strains (Gamma, K), shape (6,)."""
        return beam_forms.strain_measure(self.line, self.layout.moved)

    def natural_stress(self, given: Any) -> tuple[Expr, tuple[Expr, ...], Expr, Measure]:
        """Natural strain, its stress, what of it is reported, and the strains that it acts on."""
        values = np.array([given.extension, 0.0, 0.0, *given.curvature])
        e = fem.Constant(self.domain.mesh, values)
        stress = fem.Constant(self.domain.mesh, _effective(self.beam, self._static) @ values)
        return e, (stress,), stress, self.strain

    def mean_resultants(self, step: Step) -> Expr:
        """Resultants as means over a step that is quadratic in time."""
        return self._twice(*self.elastic[0].mean(step))

    def load_work(self, load: Any, mid: Expr, dq: Expr) -> Form:
        """Virtual work of a load for a factor of one."""
        density, name, rule = of_kind(_WORK, load)
        given = field_of(getattr(load, name), self.mixed, 3, f"{load.label}: {name}")
        work = density(self, given, self.directors(mid), *self.layout.moved(dq))
        return work * getattr(self.rules, rule)

    def point(self, mid: Expr, rates: Rates | None, dq: Expr, time: fem.Constant) -> LinePoint:
        """Fields that terms of the user depend on; arguments as of `applied`."""
        u, w = self.layout.moved(mid)
        v, dw_dt = (None, None) if rates is None else self.layout.moved(rates.now)
        du, dw = self.layout.moved(dq)
        rate = None if rates is None else self.strain.change(mid, rates.now)
        x, d, de = self.position(mid), self.frames + w, self.strain.change(mid, dq)
        return LinePoint(u, w, v, dw_dt, du, dw, self.line, time, x, d, rate, de)


class LinearBeam(Floating, BeamModel):
    """A beam with a floating frame; made as `BeamModel` is."""

    def _apart(self, q: Expr) -> Expr:
        """Constraints that tie the frame, shape (9,)."""
        turned = floating.turned_with_beam(self.layout.part(q, "w"), self.line)
        return frame_constraints(self.layout.part(q, FRAME), turned)

    @cached_property
    def strain(self) -> Measure:
        """Strains relative to the frame, shape (6,)."""
        return floating.of_beam(self.line, self._moved)

    def acting(self, e: Expr, N: Expr, M: Expr) -> tuple[Expr, Expr]:
        """Forces and moments that balance loads: those conjugate to small strains."""
        return N, M


def build_beam(
    beam: Beam,
    comm: MPI.Comm,
    loads: Sequence[Distributed],
    dynamic: bool,
    domain: LineMesh | None = None,
) -> BeamModel:
    """Mesh a beam and bind its section and loads.

    Args:
        beam: Description.
        comm: Communicator; the call is collective.
        loads: Distributed loads on it.
        dynamic: Whether it moves in time.
        domain: Its meshed line, if it runs along a shell.

    Raises:
        SceneError: If its curve cannot be meshed as described.
    """
    if domain is None:
        domain = build_line(beam, comm)
    kind = LinearBeam if beam.model == "floating-frame" else BeamModel
    return kind(beam, domain, loads, dynamic)
