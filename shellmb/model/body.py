"""Interface of bodies to the schemes: spaces, virtual work, energies; nothing else."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
import ufl
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.arrays import Floats, Int32s, Ints
from shellmb.forms.steps.mixed import Interval
from shellmb.forms.steps.path import Rows, Step
from shellmb.meshes.spaces import MixedSpace
from shellmb.model.multipliers import Constraints

TimeFunction = Callable[[float], float]


@dataclass(frozen=True)
class PartScale:
    """Size of the values of a part, for its convergence test.

    Args:
        name: Name of the part in the body's space.
        title: Its name in messages.
        scale: Size below which a value counts as small.
        advice: What to try if it does not converge.
        idle: Whether these are forces of constraints, which do no work.
    """

    name: str
    title: str
    scale: float
    advice: str
    idle: bool = False


@dataclass(frozen=True)
class PrescribedTurn:
    """A rotation that is prescribed over time.

    Args:
        who: What prescribes it, for messages.
        angle: The angle over time, rad.
        unknown: Whether the angle is itself the unknown that is fixed.
    """

    who: str
    angle: TimeFunction
    unknown: bool


def slope_from(motion: Callable[[float], Floats], t: float, h: float) -> Floats:
    """Derivative at one end of an interval beyond which a motion need not be defined, order 4.

    Args:
        motion: The motion.
        t: The end.
        h: Step of the differences into the interval; less than 0 where it lies before.
    """
    weights = np.array([-25, 48, -36, 16, -3]) / (12 * h)
    return np.asarray(np.dot(weights, [motion(t + k * h) for k in range(5)]))


@dataclass(frozen=True)
class FixedDofs:
    """Dofs that are kept at zero, or whose values are given as functions of time.

    Args:
        dofs: Local dofs in the body's mixed space (owned and ghost).
        motion: Function of time giving their values, shape (n,), or one for all; None: zero.
        turn: The rotation that the values are of; None: they are of none.
    """

    dofs: Int32s
    motion: Callable[[float], Floats | float] | None = None
    turn: PrescribedTurn | None = None

    @property
    def moving(self) -> bool:
        """Decide whether the values change in time."""
        return self.motion is not None

    def value(self, t: float) -> Floats:
        """Values at a time [s], shape (n,)."""
        return np.full(len(self.dofs), 0.0 if self.motion is None else self.motion(t), dtype=float)

    def rate(self, h: float, t: float = 0.0) -> Floats:
        """Rates at a time, shape (n,).

        Args:
            h: Step of the difference, s.
            t: The time, s.
        """
        return slope_from(self.value, t, h) if self.moving else np.zeros(len(self.dofs))


@dataclass(frozen=True)
class NodeLink:
    """Dofs of a body, local ones in its mixed space, that are the nodal dofs of another one.

    Args:
        body: Name of the other body.
        targets: Global dofs in its mixed space.
    """

    dofs: Int32s
    body: str
    targets: Ints


class Rates(NamedTuple):
    """Velocities that forces may depend on, each of the shape of a state.

    Args:
        now: Velocity in the sub-interval.
        chord: Mean velocity over the whole step, in all of its stages the same.
        weighed: Velocity as the stage's test function weighs it; None: `chord`.
        middle: State that belongs to it, in all stages the same; None: that of the sub-interval.
    """

    now: Expr
    chord: Expr
    weighed: Expr | None = None
    middle: Expr | None = None


class Term(NamedTuple):
    """A form of a residual in one row or in several.

    Args:
        residual: The form, tested with a function for each of its rows, one after the other.
        rows: Numbers of the unknown states whose rows they are.
        alone: The residual in each row by itself, tested with a function of its own, of which
            derivatives are taken; perhaps without what they leave out.
    """

    residual: Form
    rows: tuple[int, ...]
    alone: tuple[Form, ...]


class SubInterval(Protocol):
    """A sub-interval of a step, or a single state, as a body sees it.

    Attributes:
        linear: Whether its forms are linearised, at states of the reference.
    """

    linear: bool

    @property
    def span(self) -> Interval:
        """States of the step as expressions."""

    @property
    def rows(self) -> Rows | None:
        """States as functions that follow the unknown ones; None where there are no such."""


@dataclass(frozen=True)
class LoadFactors:
    """The loads of a body with the time factors of one stage of a scheme.

    Args:
        times: Function of time of each load; None: it is constant.
        take: Takes the factors, shape (n,).
        virtual_work: Virtual work at a configuration in a direction; None where there is none.
    """

    times: Sequence[TimeFunction | None]
    take: Callable[[Floats], None]
    virtual_work: Callable[[Expr, Expr], Form | None]

    def update(self, average: Callable[[TimeFunction | None], float]) -> None:
        """Set the time factors; `average` turns a load's time function into a number."""
        self.take(np.array([average(time) for time in self.times]))


class Elastic(Protocol):
    """Elastic parts: measures of the state with a section or a potential."""

    def energy(self, q: Expr) -> Form:
        """Energy of a state, J."""

    def jump(self, a: Expr, b: Expr) -> Form:
        """Elastic part of eq. (34) for the jump from `a` to `b`, J."""

    def interval(self, span: Interval, dq: Expr) -> Form:
        """Virtual work over a sub-interval, or at a single state."""

    def interval_term(self, sub: SubInterval, dq: Expr, trial: Expr) -> Term | None:
        """Virtual work over a sub-interval by kernels that know no scheme; None: `interval`."""
        return None

    def row(self, step: Step, k: int, dq: Expr) -> Form | None:
        """Virtual work in row P0 or P1 of a step quadratic in time; None: as `path_term`."""
        return None

    def path_term(self, step: Step, tests: Sequence[Expr], trial: Expr) -> Term | None:
        """Virtual work in both rows of such a step, with derivatives; None: as `row`."""
        return None

    def bow(self, step: Step, held: Expr) -> Form | None:
        """Energy of the bow of the measures, `bow.C bow/2` of eq. (Q5), J.

        Args:
            step: The step.
            held: State that holds the bow of the resultants, `N_i + N_f - 2 <N>`.
        """


def _same[T](b: T, mid: T) -> T:
    return b


def _same_back(b: Floats, mid: Floats, of: Floats) -> tuple[Floats, Floats]:
    return of, np.zeros_like(of)


@dataclass(frozen=True)
class Manifold:
    """Directors and frames at the nodes of a body.

    Args:
        directors: Unit directors or orthonormal triples at the local nodes of the part "w", shape
            (n, 3) or (n, 9); the part "lam" keeps them so. None for bodies without.
        inertialess: Whether they have no inertia in motion, and so no velocity of their own.
        tangent: The jump of velocities `b` without what constraints at the nodes forbid at a state.
        tangent_values: The same for local arrays.
        tangent_back: Covectors of the jump and of the state for one of that.
    """

    directors: Floats | None = None
    inertialess: bool = False
    tangent: Callable[[Expr, Expr], Expr] = _same
    tangent_values: Callable[[Floats, Floats], Floats] = _same
    tangent_back: Callable[[Floats, Floats, Floats], tuple[Floats, Floats]] = _same_back


class Body:
    """A body of the model: what it consists of at a state. It knows no scheme.

    Shells, groups of joints and loads at points are bodies alike. Here it is one without mass and
    elasticity.

    Args:
        name: Its name in the system.
        mixed: Space of its states.
        parts: Sizes of values.
        links: Dofs that are those of other bodies.

    Attributes:
        fixed: Dofs whose values are given.
        kinematic: Parts that have velocities.
        slenderness: Thickness over length: how much stiffer than bending the body is in its own
            plane or line.
        jump_parts: Parts that have equations for the jump of velocities.
        damping: Damping of its strains, a `StrainDamping`; None without any.
        slowing: Rate of its damping in proportion to the mass, 1/s; None without any.
        manifold: Directors of the body.
        arms: Arms from a frame at whose ends forces act on it, shape (n, 3), m; None: none.
        follow: Finds its places in a local state from what it shares with others; None: they are
            unknown themselves.
        vectors_at: Positions and directors at a state, by the parts that hold their changes, of
            directors "w"; None: it has no places.
        sizes_at: Sizes of its section at positions (3, n) by their names in files, m; None: it has
            no section.
    """

    kinematic: frozenset[str] = frozenset()
    slenderness: float = 1.0
    jump_parts: frozenset[str] = frozenset()
    damping: Any = None
    slowing: fem.Constant | fem.Function | None = None
    manifold: Manifold = Manifold()
    arms: Any = None
    follow: Callable[[Floats], None] | None = None
    vectors_at: Callable[[Expr], Mapping[str, Sequence[Expr]]] | None = None
    sizes_at: Callable[[Floats], dict[str, Any]] | None = None

    def __init__(
        self,
        name: str,
        mixed: MixedSpace,
        parts: tuple[PartScale, ...] = (),
        links: tuple[NodeLink, ...] = (),
    ) -> None:
        self.name, self.mixed, self.parts, self.links = name, mixed, parts, links
        self.fixed: list[FixedDofs] = []

    @property
    def elastic(self) -> Sequence[Elastic]:
        """Measures with their sections."""
        return ()

    @property
    def constraints(self) -> Sequence[Constraints]:
        """Constraints of the body."""
        return ()

    def inertia(self, rate: Expr, dq: Expr) -> Form | None:
        """Virtual work of the inertia forces for the acceleration `rate`; None if massless."""
        return None

    def loads(self) -> LoadFactors | None:
        """A new set of the body's loads, for one stage; None without loads."""
        return None

    def applied(self, mid: Expr, rates: Rates | None, dq: Expr, time: fem.Constant) -> Form | None:
        """Virtual work of what is neither elastic nor inertial; None without any.

        Args:
            mid: State at which it acts.
            rates: Velocities; None in statics.
            dq: Virtual displacement.
            time: Time; what depends on it is averaged over a step.
        """
        return added([self.users(mid, rates, dq, time), self._slowed(rates, dq)])

    def users(self, mid: Expr, rates: Rates | None, dq: Expr, time: fem.Constant) -> Form | None:
        """Terms that the user added; None without any. Arguments as of `applied`."""
        return None

    def _slowed(self, rates: Rates | None, dq: Expr) -> Form | None:
        """Virtual work of forces in proportion to the momentum; None without any."""
        if self.slowing is None or rates is None:
            return None
        rate = rates.chord if rates.weighed is None else rates.weighed
        return self.inertia(-self.slowing * rate, dq)


class MassiveBody(Body):
    """A body with places, whose momenta are its inertia on rigid motions."""

    def node_positions(self) -> Floats:
        """Reference positions of the local nodes (owned and ghost), shape (n, 3), m."""
        return self.mixed.nodes("u")

    def momentum(self, v: Expr, axis: Expr) -> Form | None:
        """Component of the linear momentum along `axis`, kg m/s."""
        return self.inertia(v, rigid_rate(self, v, lambda vector: 0 * vector, axis))

    def angular_momentum(self, q: Expr, v: Expr, axis: Expr) -> Form | None:
        """Component along `axis` of the angular momentum about the origin, kg m^2/s."""
        return self.inertia(v, rigid_rate(self, q, lambda vector: ufl.cross(axis, vector)))


def rigid_rate(
    body: Body,
    q: Expr,
    of: Callable[[Expr], Expr],
    shift: Expr | None = None,
    about: Expr | None = None,
) -> Expr:
    """Rate of a state by which all vectors change alike, as in a rigid motion.

    Args:
        body: The body; zero of those without places.
        q: State.
        of: Linear map of the vectors, as `omega x`.
        shift: Added to the rates of positions, shape (3,).
        about: Point that positions are seen from, shape (3,), m; None: the origin.
    """
    if body.vectors_at is None:
        return 0 * q
    places, parts = body.vectors_at(q), body.mixed.parts
    components: list[Expr] = [ufl.as_ufl(0.0)] * sum(size for _, size in parts.values())
    for part, vectors in places.items():
        first, place = parts[part][0], part != "w"
        for k, vector in enumerate(vectors):
            new = of(vector - about if place and about is not None else vector)
            if place and shift is not None:
                new = new + shift
            components[first + 3 * k : first + 3 * k + 3] = [new[i] for i in range(3)]
    return ufl.as_vector(components)


def same_everywhere(mixed: MixedSpace, part: str, body: str, dofs: Sequence[int]) -> NodeLink:
    """Link of a part, on all cells, to one and the same unknown of another body.

    Args:
        mixed: Space with the part.
        part: Its name.
        body: The other body.
        dofs: Global dofs in its space.
    """
    rows = mixed.dofs[part]
    return NodeLink(rows, body, np.tile(np.asarray(dofs, np.int64), len(rows) // len(dofs)))


def strain_energy(body: Body, q: Expr) -> Form | None:
    """Energy that a body stores at a state, J; None for bodies without."""
    return added(part.energy(q) for part in body.elastic)


def kinetic_energy(body: Body, v: Expr) -> Form | None:
    """Kinetic energy of a body, J; None if massless."""
    form = body.inertia(v, v)
    return None if form is None else 0.5 * form


def constraint_error(body: Body, q: fem.Function) -> float:
    """Largest violation of a body's constraints on this rank, relative."""
    return float(constraint_errors(body, q.x.array[None])[0])


def constraint_errors(body: Body, states: Floats) -> Floats:
    """Largest violations of a body's constraints on this rank, relative, shape (k,).

    Args:
        body: The body.
        states: Local arrays of some states, shape (k, dofs).
    """
    found = [np.zeros(len(states)), *(held.errors(states) for held in body.constraints)]
    return np.asarray(np.maximum.reduce(found))


def largest(values: Floats) -> Floats:
    """Largest absolute value of each of some arrays, shape (k,) from (k, ...)."""
    # `reduce` and not `max`: Python around it takes longer than the numbers
    every = np.abs(values).reshape(len(values), -1)
    return np.asarray(np.maximum.reduce(every, axis=1, initial=0.0))


def added(forms: Iterable[Form | None]) -> Form | None:
    """Sum of those forms that there are; None without any."""
    found = [form for form in forms if form is not None]
    if len(found) < 2:
        return next(iter(found), None)
    # added one by one, UFL looks through those before again and again
    return Form([integral for form in found for integral in form.integrals()])
