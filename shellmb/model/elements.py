"""Springs, dampers, motors and stops: forces on coordinates of mechanisms, which are unknowns."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, cast

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem
from ufl import Form
from ufl.algorithms.analysis import extract_coefficients
from ufl.core.expr import Expr

from shellmb.arrays import Bools, Floats
from shellmb.errors import SceneError
from shellmb.forms import contact as forms
from shellmb.forms.measure import Measure, linear
from shellmb.forms.steps import potentials as springs
from shellmb.forms.steps.mixed import Stiffness
from shellmb.meshes.nodes import node_mesh, set_constants
from shellmb.model.body import Elastic, Rates
from shellmb.model.joints.coordinates import Coordinate, scalar_targets, summed
from shellmb.model.massless import LawValues, NodeGroup
from shellmb.model.sections.branches import Fading, MaxwellBranches
from shellmb.model.sections.strains import FAR, ExactEnergy, SeparateRows
from shellmb.model.signals import Signals
from shellmb.model.user_forms import written
from shellmb.scene import Damper, JointDamper, JointSpring, JointStop, Motor, Scene, Spring
from shellmb.scene.control.signals import Input
from shellmb.scene.lookup import of_kind, said


@dataclass(frozen=True)
class BoundElement:
    """A force element with its coordinate.

    Args:
        element: Description.
        coordinate: The coordinate it acts on.
        static: Whether the scene has no motion in time.
    """

    element: Any
    coordinate: Coordinate
    static: bool

    @property
    def law(self) -> Callable[..., Any] | None:
        """Potential of a spring, law of a damper or motor; None: linear."""
        return getattr(self.element, "potential", None) or getattr(self.element, "law", None)

    @property
    def parameter(self) -> float:
        """Stiffness or damping, or what a motor begins with; 0 with a law of its own."""
        if isinstance(self.element.command, Input):
            return self.element.command.mean
        # in motion the long-term stiffness, beside which branches act
        series = self.element.relaxation
        part = 1.0 if series is None else series.at_rest if self.static else series.long_term
        return part * float(self.element.stiffness or getattr(self.element, "damping", None) or 0.0)

    @property
    def rest(self) -> float:
        """Change of the coordinate at which a spring's argument is zero."""
        if not hasattr(self.element, "length"):
            return getattr(self.element, "rest", 0.0)
        start, natural = self.coordinate.start, self.element.length
        return -start if self.law else 0.0 if natural is None else natural - start

    @property
    def key(self) -> tuple[type["ElementGroup"], object]:
        """Key that elements with common kernels share, or the strains of one that relaxes."""
        own = None if self.element.relaxation is None else self.element.name
        return of_kind(_KINDS, self.element), self.law or own


def coordinate_of(scene: Scene, element: Any) -> tuple[str, str]:
    """Coordinate on which a force element acts."""
    if hasattr(element, "second"):
        return element.name, "distance"
    (kind,) = scene.coordinates_of(element)
    return element.joint, kind


# a change of force below this part of the force is round-off
ROUND_OFF = 1e-9
# what is not limited: no coordinate comes there
NEVER = 1e30


class ElementGroup(NodeGroup):
    """Force elements of one kind and law, on one coordinate each.

    Args:
        name: Name in the system.
        comm: Communicator.
        items: The elements.

    Attributes:
        resists: Sign by which what is reported resists a change of the coordinate.
    """

    resists = 1.0

    def command(self, signals: Signals) -> None:
        """Set what is commanded."""

    def by_law(self, count: int) -> LawValues | None:
        """Values of a law of time at many states at once; None without one; collective."""
        return None

    def __init__(self, name: str, comm: MPI.Comm, items: Sequence[BoundElement]) -> None:
        self.items = list(items)
        targets = {"x": scalar_targets([item.coordinate for item in items])}
        super().__init__(name, comm, len(items), targets)
        self.law = items[0].law
        self.parameter = self.per_item([item.parameter for item in items], "parameter")
        self.rest = self.per_item([item.rest for item in items], "rest")
        self.size = self.per_item([item.coordinate.size for item in items], "size")

    def x(self, q: Expr) -> Expr:
        """The coordinate at a state."""
        return self.layout.part(q, "x")

    def measure(self, q: Expr) -> Expr:
        """The coordinate over its size."""
        return ufl.as_vector([self.x(q) / self.size])

    def potential(self, e: Expr) -> Expr:
        """Energy as a function of the measure."""
        raise NotImplementedError

    def exact(self, smooth: float = 0.0) -> ExactEnergy:
        """The energy, with forces that are exact over a step; argument as of `ExactEnergy`."""
        one = ufl.as_ufl(1.0)
        return ExactEnergy(self.measure, self.potential, one, self.dx, smooth=smooth)

    def acted(self, row: Floats) -> Floats:
        """Reported means over a step, shape (items,); collective.

        Args:
            row: Virtual work on the left-hand side of the row that balances the step, by local dof.
        """
        return self.resists * self.gathered("x", row)[:, 0] + 0.0

    def columns(self, forces: Floats) -> dict[str, float]:
        """Forces of the elements, shape (items,), by their columns: sums of equal ones."""
        return summed([f"{i.element.name}.{i.coordinate.effort}" for i in self.items], forces)

    def given(self, *arguments: Expr) -> Expr:
        """Values of the group's law.

        Args:
            arguments: What it is a function of.

        Raises:
            SceneError: If it fails, or gives something else than a scalar of UFL.
        """
        assert self.law is not None
        value = written(self.law, arguments, f"{said(self.items[0].element)}: law")
        if extract_coefficients(value):
            return value
        # a number has no mesh to be integrated on, and no slope
        return value + fem.Constant(self.nodes.mesh, 0.0) * arguments[0] ** 2 / 2

    def force(self, x: Expr, rate: Expr, time: Expr) -> Expr:
        """Reported force: tension of springs, resistance of dampers, drive of motors."""
        raise NotImplementedError

    @cached_property
    def _reading(self) -> LawValues:
        return LawValues(self.nodes, self.force)

    def forces(self, x: Floats, rate: Floats, t: float) -> Floats:
        """Forces [N] or moments [N m] at given coordinates and rates, (items,); collective."""
        return self._reading(x, rate, np.full(len(self.items), t))

    def holds(self, step: float) -> Bools:
        """Elements that answer a motion at the start by a force, shape (items,); collective.

        Args:
            step: Motion, relative to what is large for the coordinate.
        """
        size = np.array([item.coordinate.size for item in self.items])

        def slope(h: float) -> tuple[Floats, Floats]:
            plus, minus = (self.forces(sign * h * size, 0.0 * size, 0.0) for sign in (1, -1))
            return np.abs(plus - minus) / h, np.maximum(np.abs(plus), np.abs(minus)) / h

        (near, force), (far, _) = slope(step / 10), slope(step)
        # a force that grows with a power of the motion has no slope
        return (near > far / 2) & (near > ROUND_OFF * force)


class Springs(ElementGroup):
    """Springs: linear ones, or all that share a potential."""

    def _potential(self, e: Expr) -> Expr:
        return self.given(e) if self.law else springs.linear_potential(self.parameter)(e)

    def holds(self, step: float) -> Bools:
        """Springs that answer a motion by a force; linear ones always do."""
        if self.law is not None:
            return super().holds(step)
        return np.array([item.parameter > 0 for item in self.items])

    def potential(self, e: Expr) -> Expr:
        """Energy as a function of the measure."""
        return self._potential(self.size * e[0] - self.rest)

    @cached_property
    def elastic(self) -> tuple[Elastic, ...]:
        """Their energy."""
        if self.law is not None:
            return (self.exact(springs.SMALL_INCREMENT),)
        return (SeparateRows(self._section, self.layout, self._strain, lambda d: d[0] * self.dx),)

    @property
    def _section(self) -> Stiffness:
        return Stiffness(ufl.as_matrix([[springs.linear_stiffness(self.parameter)]]))

    @property
    def _strain(self) -> Measure:
        """The extension, which changes as the coordinate does."""
        moved = linear(lambda q: ufl.as_vector([self.x(q)]))
        if not any(item.rest for item in self.items):
            return moved
        return moved._replace(
            value=lambda q: ufl.as_vector([self.x(q) - self.rest]),
            rest=lambda q: ufl.as_vector([-self.rest]),
        )

    def branches(self) -> MaxwellBranches | None:
        """New Maxwell branches of a spring that relaxes; None of others."""
        element, domain = self.items[0].element, self.nodes.mesh
        if element.relaxation is None:
            return None
        series, dx = element.relaxation.branches, ufl.dx(domain, degree=0)
        fading = Fading(self._strain, self._section.C, series, dx, domain)
        return MaxwellBranches(element.name, self.layout, [fading])

    def force(self, x: Expr, rate: Expr, time: Expr) -> Expr:
        """Tension: what would have to be applied to hold the coordinate."""
        return springs.slope(self._potential, x - self.rest)


class Dampers(ElementGroup):
    """Dampers: linear ones, or all that share a law.

    They act with the mean rate over the whole step in all of its stages, so that a damper of
    damping `c` takes exactly `c dt rate^2` out of the account.
    """

    def _resistance(self, rate: Expr) -> Expr:
        return self.given(rate) if self.law else self.parameter * rate

    def holds(self, step: float) -> Bools:
        """None: they resist motion in time."""
        return np.zeros(len(self.items), dtype=bool)

    def applied(self, mid: Expr, rates: Rates | None, dq: Expr, time: fem.Constant) -> Form | None:
        """Work of the resistance; none in statics."""
        if rates is None:
            return None
        return -self._resistance(self.x(rates.chord)) * self.x(dq) * ufl.dx

    def force(self, x: Expr, rate: Expr, time: Expr) -> Expr:
        """Resistance."""
        return self._resistance(rate)


class Motors(ElementGroup):
    """Motors that share a law of coordinate, mean rate over the step, and time; or commanded."""

    resists = -1.0

    def command(self, signals: Signals) -> None:
        """Set the torques and forces that are commanded."""
        if self.law is None:
            motors: list[Any] = [item.element for item in self.items]
            given = np.array([[signals.held(motor.command)] for motor in motors])
            set_constants(self.parameter, self.nodes, given)

    def applied(self, mid: Expr, rates: Rates | None, dq: Expr, time: fem.Constant) -> Form | None:
        """Work of the motors in the middle of the sub-interval; in statics at rate zero."""
        x = self.x(mid)
        rate = 0.0 * x if rates is None else self.x(rates.chord)
        return self.force(x, rate, time) * self.x(dq) * ufl.dx

    def by_law(self, count: int) -> LawValues | None:
        """Values of the law at many states at once; None for commanded ones; collective."""
        law = self.law
        if law is None:
            return None
        who = f"{said(self.items[0].element)}: law"
        return LawValues(
            node_mesh(self.nodes.mesh.comm, count), lambda *arguments: written(law, arguments, who)
        )

    def force(self, x: Expr, rate: Expr, time: Expr) -> Expr:
        """Force or torque of the motor."""
        if self.law is None:
            return self.parameter
        return self.given(x, rate, time)


class Stops(ElementGroup):
    """Stops of joints."""

    def __init__(self, name: str, comm: MPI.Comm, items: Sequence[BoundElement]) -> None:
        super().__init__(name, comm, items)
        stops = [cast(JointStop, item.element) for item in items]

        def some(name: str, nothing: float = 0.0) -> fem.Function:
            given = [getattr(stop, name) for stop in stops]
            return self.per_item([nothing if value is None else value for value in given], name)

        self._limits = (some("lower", -NEVER), -1), (some("upper", NEVER), 1)
        self._law = some("stiffness"), some("smoothing")
        self._damping = some("relative_damping")
        self._damped = any(stop.relative_damping > 0 for stop in stops)
        self.always = self.constant(0.0)

    @cached_property
    def elastic(self) -> tuple[Elastic, ...]:
        """Energy of what is beyond the limits."""
        return (self.exact(),)

    def potential(self, e: Expr) -> Expr:
        """Energy of what is beyond either limit."""
        x = self.size * e[0]
        beyond = (self._beyond(x, limit, sign) for limit, sign in self._limits)
        return sum((forms.energy(depth, *self._law) for depth in beyond), start=0 * x)

    def _beyond(self, x: Expr, limit: Expr, sign: int) -> Expr:
        return sign * (x - limit) + FAR * self.always

    def applied(self, mid: Expr, rates: Rates | None, dq: Expr, time: fem.Constant) -> Form | None:
        """Work of the damping, with the rate and the middle of the whole step."""
        if rates is None or not self._damped:
            return None
        x, rate = self.x(mid if rates.middle is None else rates.middle), self.x(rates.chord)
        return -self._damping_force(x, rate) * self.x(dq) * self.dx

    def _damping_force(self, x: Expr, rate: Expr) -> Expr:
        """Contribution of the damping to the force that holds the coordinate."""
        found: Any = 0
        for limit, sign in self._limits:
            pressing = forms.force(self._beyond(x, limit, sign), *self._law)
            into = sign * rate + FAR * self.always
            found += sign * forms.resisted(pressing, into, self._damping)
        return found

    def force(self, x: Expr, rate: Expr, time: Expr) -> Expr:
        """Force that would hold the coordinate."""
        held = springs.slope(lambda e: self.potential(ufl.as_vector([e / self.size])), x)
        return held + self._damping_force(x, rate) if self._damped else held


_KINDS: dict[type, type[ElementGroup]] = {
    **dict.fromkeys((JointSpring, Spring), Springs),
    **dict.fromkeys((JointDamper, Damper), Dampers),
    **{Motor: Motors, JointStop: Stops},
}


def element_groups(comm: MPI.Comm, items: Sequence[BoundElement]) -> list[ElementGroup]:
    """Groups of like force elements.

    Args:
        comm: Communicator.
        items: All force elements.
    """
    groups: list[ElementGroup] = []
    for number, key in enumerate(dict.fromkeys(item.key for item in items)):
        kind, law = key
        members = [item for item in items if item.key == key]
        name = kind.__name__.lower() + ("" if law is None else f" with law {number + 1}")
        if members[0].element.relaxation is not None:
            name = said(members[0].element)
        groups.append(kind(name, comm, members))
    return groups


def check_at_rest(scene: Scene, groups: Sequence[ElementGroup]) -> None:
    """Refuse initial stress where displacements are small; collective.

    Raises:
        SceneError: If a spring is not at rest in the reference configuration.
    """
    springs = [group for group in groups if group.elastic] if scene.linear else []
    for group in springs:
        zeros = np.zeros(len(group.items))
        forces = group.forces(zeros, zeros, 0.0)
        moved = group.forces(np.array([item.coordinate.size for item in group.items]), zeros, 0.0)
        for item, force, scale in zip(group.items, forces, np.abs(moved - forces), strict=True):
            if abs(force) > 1e-12 * scale:
                raise SceneError(
                    f"{item.element.label} '{item.element.name}': it pulls with {force:.4g} in the "
                    f"given positions; with scheme '{scene.scheme_name}' it must be at rest there"
                )
