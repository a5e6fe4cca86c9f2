"""A body of the user's own: measures with an energy, mass and constraints on any DOLFINx space.

Strains have a stiffness or an energy of any form, without independent resultants. Forces are those
of the pages of the schemes (`schemes.interval`, `schemes.quadratic`) at functions that follow the
unknown states.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields
from functools import cached_property, partial
from typing import Any, ClassVar

from mpi4py import MPI

import basix.ufl
import numpy as np
import ufl
from dolfinx import fem
from ufl import Form
from ufl.algorithms.analysis import extract_coefficients
from ufl.core.expr import Expr

from shellmb.arrays import Bools, Floats, Int32s
from shellmb.errors import SceneError
from shellmb.forms.constraints.held import Held
from shellmb.forms.measure import measure
from shellmb.forms.state import Layout
from shellmb.forms.steps.mixed import Stiffness
from shellmb.forms.steps.path import is_quadratic
from shellmb.meshes.spaces import mixed_space
from shellmb.model.body import Body, Elastic, FixedDofs, PartScale, Rates, TimeFunction
from shellmb.model.massless import NONE
from shellmb.model.multipliers import Constraints
from shellmb.model.sections.strains import PotentialStrains, Strains
from shellmb.model.user_forms import vector_of, virtual, written
from shellmb.native.expressions import values_in_cells
from shellmb.scene.types import Listed, Name, Positive, Vec3, numbers
from shellmb.scene.values.bodies import UserBody
from shellmb.scene.values.validate import Sentences, described, show

ADVICE = "a smaller step"
# round-off of what is symmetric
SAME = 1e-9
# of the energy of a constraint, below which a multiplier counts as zero
SMALL_FORCE = 1e-3


@dataclass(frozen=True)
class Hold:
    """Constraints `g(u) = 0` at the nodes of an element, enforced by multipliers.

    Args:
        constraint: Function of the unknown field in UFL, a scalar or a vector, at most quadratic in
            the field. It is evaluated at the nodes of the element.
        element: Scalar element of `basix.ufl`, which has a multiplier at each node.
        dx: Measure whose quadrature points are these nodes, such as
            `ufl.dx(metadata={"quadrature_rule": "vertex"})`.
        force: Characteristic magnitude of the multipliers, used to scale convergence tests, N.
    """

    constraint: Callable[[Expr], Any]
    element: Any
    dx: ufl.Measure
    force: float = 1.0


@described("own body")
class _Parts:
    """Parts of an own body, checked; as of `OwnBody`."""

    name: Name
    space: Any
    strain: Callable[..., Any] | None
    energy: Any
    mass: Callable[..., Any] | None
    force: Callable[..., Any] | None
    constraints: Listed[Hold]
    dx: ufl.Measure
    size: Positive
    points: Mapping[Name, Vec3]
    regions: Mapping[Name, Callable[..., Any]]

    AS_GIVEN: ClassVar[tuple[str, ...]] = ("energy", "space")

    def _wrong(self) -> Sentences:
        if (self.strain is None) != (self.energy is None):
            has, lacks = ("energy", "strain") if self.strain is None else ("strain", "energy")
            yield f"it has {has} and no {lacks}, so nothing resists; it must have both, or none"


class OwnBody(Body, UserBody):
    """A body that is described in UFL, in scenes (`Scene(own_bodies=...)`) or by itself (`Motion`).

    The unknown is a field `u` of the space. `strain(u)` is a vector of strains, at most quadratic
    in `u`, and `energy(e)` an energy density, any function of the strains; the work of the stresses
    over a step is its change, plus the dissipation of the scheme. All are integrated with `dx`.

    Args:
        name: Its name.
        space: Function space of DOLFINx; or a function that makes one on a communicator, which
            scenes need that are run on other communicators than the space's.
        strain: Strains of a field, a UFL vector without units; their value at the zero field is
            a prestrain. None: no energy.
        energy: Energy density as a function of the strains, J per unit of `dx`; or a stiffness, a
            symmetric matrix of numbers or of UFL.
        mass: `m v . w` as a function of two fields, symmetric and bilinear, per unit of `dx`; half
            of it at `v, v` is the kinetic energy. None: massless.
        force: Virtual power of applied forces per unit of `dx`: a function of the field, its rate
            (None in statics), a virtual field and the time (a UFL constant, s). None: no force.
        constraints: Constraints on the field.
        dx: Measure of the integrals.
        size: Characteristic magnitude of the field, used to scale convergence tests, m.
        points: Named points of scenes, by their coordinates [m]; each is a vertex of the mesh.
        regions: Named parts of scenes, by functions of coordinates, shape (3, n), that mark what is
            in them, as `lambda x: np.isclose(x[0], 0)`.

    Raises:
        SceneError: If strains or constraints are not quadratic.
    """

    def __init__(
        self,
        name: str,
        space: fem.FunctionSpace | Callable[[MPI.Comm], fem.FunctionSpace],
        *,
        strain: Callable[[Expr], Expr] | None = None,
        energy: Callable[[Expr], Expr] | Any = None,
        mass: Callable[[Expr, Expr], Expr] | None = None,
        force: Callable[[Expr, Expr | None, Expr, Expr], Expr] | None = None,
        constraints: Sequence[Hold] = (),
        dx: ufl.Measure = ufl.dx,
        size: float = 1.0,
        points: Mapping[str, Sequence[float]] = NONE,
        regions: Mapping[str, Callable[[Floats], Any]] = NONE,
    ) -> None:
        checked: Any = _Parts
        parts = checked(
            name, space, strain, energy, mass, force, constraints, dx, size, points, regions
        )
        self._given = {f.name: getattr(parts, f.name) for f in fields(parts) if f.name != "name"}
        self._nodes_held: list[tuple[Any, ...]] = []
        space = space(MPI.COMM_WORLD) if callable(space) else space
        if not isinstance(space, fem.FunctionSpace):
            raise SceneError(
                f"own body '{name}': space is {show(space)}; it must be a function space of "
                "DOLFINx, or a function that makes one on a communicator"
            )
        elements = {"u": space.ufl_element()}
        for k, hold in enumerate(constraints):
            at = (ufl.Coefficient(space),)
            count = len(vector_of(hold.constraint, at, f"body '{name}': constraint {k}"))
            shaped = basix.ufl.blocked_element(hold.element, (count,)) if count > 1 else None
            elements[f"mu{k}"] = shaped or hold.element
        mixed = mixed_space(space.mesh, elements, frozenset())
        multiplier = f"multiplier of '{name}'", SMALL_FORCE
        scales = {"u": (f"'{name}'", size)} | dict.fromkeys(list(elements)[1:], multiplier)
        super().__init__(name, mixed, tuple(PartScale(p, *scales[p], ADVICE) for p in scales))
        self.kinematic, self.jump_parts = frozenset({"u"}), frozenset(elements)
        self.layout, self.dx = Layout(mixed.parts), dx(space.mesh)
        self.space = mixed.subspaces["u"]
        self._strain, self._energy, self._mass, self._force = strain, energy, mass, force
        self._holds = tuple(constraints)
        self.points, self.regions = parts.points, parts.regions
        self.massive, self.has_strains = mass is not None, strain is not None
        self.placed = is_placed(space)
        self._one = fem.Constant(space.mesh, 1.0)
        self._nonlinear = callable(energy) and not isinstance(energy, Expr)
        if energy is not None and not self._nonlinear:
            self._check_stiffness()
        self._check_densities()
        functions: dict[str, Any] = {"strain": self._measure} if strain is not None else {}
        functions |= {f"constraint {k}": law.function for k, law in enumerate(self._laws)}
        for what, function in functions.items():
            state = ufl.Coefficient(mixed.space)
            if state not in extract_coefficients(function(state)):
                raise SceneError(f"body '{name}': {what} does not depend on the field; it must")
            if not is_quadratic(function, state):
                raise SceneError(
                    f"body '{name}': {what} is not quadratic in the field; it must be: put "
                    "functions of quadratic measures into the energy"
                )

    def _check_stiffness(self) -> None:
        """Refuse a stiffness that is no symmetric matrix of the strains."""
        size, given = len(self._measure(ufl.Coefficient(self.mixed.space))), self._energy
        fits = getattr(given, "ufl_shape", ()) == (size, size)
        # what is no matrix of numbers fails in one of these ways
        with suppress(TypeError, ValueError, IndexError):
            matrix = np.zeros(0) if isinstance(given, Expr) else numbers(given)
            off = np.abs(matrix - matrix.T).max(axis=(0, 1))
            fits = matrix.shape == (size, size) and bool(off <= SAME * np.abs(matrix).max())
        if not fits:
            raise SceneError(
                f"own body '{self.name}': energy is {show(given)}; it must be a function, or a "
                f"symmetric matrix of {size} by {size} finite numbers, of {size} strains"
            )

    def _check_densities(self) -> None:
        """Refuse a mass that is not symmetric, bilinear and positive, and no virtual work."""
        v, w, mesh = fem.Function(self.space), fem.Function(self.space), self.space.mesh
        test, time = ufl.TestFunction(self.space), fem.Constant(mesh, 0.0)
        who = f"body '{self.name}'"
        if self._force is not None:
            virtual(self._force, (v, v, test, time), f"{who}: force")
        if self._mass is None:
            return
        virtual(self._mass, (v, test), f"{who}: mass")
        pairs = [self._scalar("mass", self._mass, *each) for each in ((v, w), (w, v), (v, v))]
        middle = basix.geometry(mesh.basix_cell()).mean(axis=0, keepdims=True)
        values = values_in_cells(ufl.as_vector(pairs), middle, mesh)
        for function, seed in ((v, 1), (w, 2)):
            function.x.array[:] = np.random.default_rng(seed).normal(size=len(function.x.array))
        there, back, energy = values().reshape(-1, 3).T
        wrong = max(np.abs(there - back).max(initial=0.0), -energy.min(initial=0.0))
        if mesh.comm.allreduce(not wrong <= SAME * np.abs(energy).max(initial=0.0)):
            raise SceneError(
                f"own body '{self.name}': mass {show(self._mass)} is not symmetric in its two "
                "fields, or negative; it must be as rho * ufl.dot(v, w)"
            )

    def field(self, q: Expr) -> Expr:
        """The field of a state."""
        return self.layout.part(q, "u")

    def _measure(self, q: Expr) -> Expr:
        assert self._strain is not None
        return vector_of(self._strain, (self.field(q),), f"body '{self.name}': strain")

    @cached_property
    def elastic(self) -> tuple[Elastic, ...]:
        """The energy."""
        if self._strain is None or self._energy is None:
            return ()
        strain = measure(self._measure)
        if self._nonlinear:
            energy = partial(self._scalar, "energy", self._energy)
            return (PotentialStrains(self._measure, energy, self._one, self.dx, strain),)
        C, dx = self._energy, self.dx
        if not isinstance(C, Expr):
            C = fem.Constant(self.space.mesh, np.ascontiguousarray(C, dtype=float))
        return (Strains(Stiffness(C), self.layout, strain, lambda d: d[0] * dx),)

    def _scalar(self, what: str, function: Callable[..., Any], *arguments: Any) -> Expr:
        """Value of one of the user's densities."""
        return written(function, arguments, f"body '{self.name}': {what}")

    @cached_property
    def _laws(self) -> tuple[Held, ...]:
        name = self.name

        def law(hold: Hold) -> Held:
            who = f"body '{name}': constraint"
            return Held(lambda q: vector_of(hold.constraint, (self.field(q),), who))

        return tuple(map(law, self._holds))

    @cached_property
    def constraints(self) -> tuple[Constraints, ...]:
        """Constraints that act."""
        mesh = self.mixed.space.mesh
        return tuple(
            Constraints(
                law,
                lambda q, part=f"mu{k}": self.layout.part(q, part),  # type: ignore[misc]
                fem.Constant(mesh, float(hold.force)),
                hold.dx(mesh),
                _errors(fem.Function(self.mixed.space), law, hold),
            )
            for k, (law, hold) in enumerate(zip(self._laws, self._holds, strict=True))
        )

    def inertia(self, rate: Expr, dq: Expr) -> Form | None:
        """Virtual work of the inertia forces."""
        return self.momentum_along(rate, self.field(dq))

    def momentum_along(self, v: Expr, motion: Expr) -> Form | None:
        """Momentum of velocities in the direction of a field."""
        if self._mass is None:
            return None
        return self._scalar("mass", self._mass, self.field(v), motion) * self.dx

    def applied(self, mid: Expr, rates: Rates | None, dq: Expr, time: fem.Constant) -> Form | None:
        """Virtual work of the applied forces."""
        if self._force is None:
            return None
        rate = None if rates is None else self.field(rates.chord)
        # on the mesh, and of the time, whatever the force is of
        at = self.field(mid), rate, self.field(dq), time
        return self._one * self._scalar("force", self._force, *at) * self.dx

    def dofs(self, where: Callable[[Floats], Bools], components: Sequence[int] = ()) -> Int32s:
        """Local dofs of the state at nodes.

        Args:
            where: Function of coordinates, shape (3, n), that marks nodes, shape (n,).
            components: Components of the field; all if there are none.
        """
        nodes = fem.locate_dofs_geometrical(self.space, where)
        rows = self.mixed.dofs["u"].reshape(-1, self.space.dofmap.index_map_bs)[nodes]
        return (rows[:, list(components)] if components else rows).ravel()

    def hold(
        self,
        where: Callable[[Floats], Bools],
        components: Sequence[int] = (),
        motion: TimeFunction | None = None,
    ) -> None:
        """Fix nodes, or prescribe their motion.

        Args:
            where: Function of coordinates, shape (3, n), that marks nodes, shape (n,).
            components: Components of the field; all if there are none.
            motion: Their value as a function of time; None: zero.
        """
        self._nodes_held.append((where, components, motion))
        self.fixed.append(FixedDofs(self.dofs(where, components), motion))

    def in_values(self) -> dict[str, Any]:
        """Description in values: the space by its element and the size of its mesh."""
        topology = self.space.mesh.topology
        counts = [topology.index_map(d).size_global for d in (0, topology.dim)]
        plain = {"space": [str(self.space.ufl_element()), *counts], "dx": str(self._given["dx"])}
        return {"name": self.name, **self._given, **plain, "hold": self._nodes_held}

    def again[B: OwnBody](self, comm: MPI.Comm, kind: type[B]) -> B:
        """The body of a scene's model, made anew; collective.

        Args:
            comm: Communicator of the model.
            kind: Its class.

        Raises:
            SceneError: If its space is on another communicator.
        """
        given: dict[str, Any] = dict(self._given)
        if callable(given["space"]):
            given["space"] = given["space"](comm)
        elif MPI.Comm.Compare(comm, self.space.mesh.comm) not in (MPI.IDENT, MPI.CONGRUENT):
            raise SceneError(
                f"own body '{self.name}': its space is on another communicator than the scene is "
                "run on; space must be a function that makes it on a communicator"
            )
        made = kind(self.name, **given)
        for held in self._nodes_held:
            made.hold(*held)
        return made


def is_placed(space: fem.FunctionSpace) -> bool:
    """Decide whether a field is a displacement at nodes: of three components, Lagrange.

    Args:
        space: Its space.
    """
    if tuple(space.value_shape) != (3,) or space.num_sub_spaces != 3:
        return False
    element: Any = space.element.basix_element
    return bool(element.family == basix.ElementFamily.P and not element.discontinuous)


def _errors(state: fem.Function, law: Held, hold: Hold) -> Callable[[Floats], Floats]:
    """Find largest violations of what is held, at the nodes of its element, at some states."""
    points = hold.element.basix_element.points
    read = values_in_cells(law.function(state), points, state.function_space.mesh)

    def error(values: Floats) -> float:
        state.x.array[:] = values
        return float(np.max(np.abs(read()), initial=0.0))

    return lambda states: np.array([error(values) for values in states])
