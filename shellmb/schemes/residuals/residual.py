"""Residual of one body for one stage: inertia + internal forces - loads - added terms."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial, reduce
from typing import Any, cast

import numpy as np
import ufl
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.errors import SceneError
from shellmb.forms.constraints.held import VelocityJump
from shellmb.forms.steps.damping import Straining
from shellmb.forms.steps.discrete import stress_average
from shellmb.forms.steps.mixed import Interval
from shellmb.forms.steps.path import Step
from shellmb.model.body import Body, LoadFactors, Rates, SubInterval, Term, TimeFunction, added
from shellmb.model.multipliers import JumpForms
from shellmb.model.sections.branches import Course, MaxwellBranches, branches_of
from shellmb.model.sections.strains import together
from shellmb.schemes.base import END, GAUSS_TIMES, GAUSS_WEIGHTS, Levels, Scheme, Stage, Values
from shellmb.schemes.linearised import change
from shellmb.schemes.residuals.rows import PathStates, Span, over_interval

# instants of a step and their weights
Instants = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Sample:
    """Loads and added terms at one state of a step.

    Args:
        state: The state at which they act.
        rates: Velocities there; None in statics.
        loads: The loads, times the factors of the instants; None without any.
        instants: Instants of the step at which time functions count, and their weights.
        time: Time that added terms see.
        tau: That time as a part of the step.
        weight: Weight of added terms; None: one.
        levels: Functions of the body, where added terms are linearised; then the state is the
            reference.
        terms: Whether added terms count here; not where they do at single instants.
    """

    state: Expr
    rates: Rates | None
    loads: LoadFactors | None
    instants: Instants
    time: fem.Constant
    tau: float
    weight: fem.Constant | None = None
    levels: Levels | None = None
    terms: bool = True

    def update(
        self, t: float, dt: float, factor: Callable[[float, TimeFunction | None], float]
    ) -> None:
        """Set times and factors for a step.

        Args:
            t: Its start, s.
            dt: Its length, s.
            factor: Factor of a load with a time function at an instant.
        """
        self._now[...] = t + self.tau * dt
        if self.loads is not None:
            self.loads.update(
                lambda function: float(
                    sum([weight * factor(t + tau * dt, function) for tau, weight in self.instants])
                )
            )

    @cached_property
    def _now(self) -> Values:
        """The number of `time`, which DOLFINx looks up anew whenever it is asked."""
        return np.asarray(self.time.value)

    def of_loads(self, dq: Expr) -> Form | None:
        """Virtual work of the loads."""
        return None if self.loads is None else self.loads.virtual_work(self.state, dq)

    def of_terms(self, body: Body, dq: Expr) -> Form | None:
        """Virtual work of the added terms."""
        if not self.terms:
            return None
        form = body.applied(self.state, self.rates, dq, self.time)
        if form is None:
            return None
        if self.levels is not None:
            linear = change(form, self.levels)
            form = form if linear is None else form + linear
        return form if self.weight is None else self.weight * form

    def resolved(self, body: Body, dq: Expr, mesh: Any) -> "tuple[Sample, ...]":
        """The sample, with added terms that depend on time at all of its instants, as loads are.

        A single instant misses or doubles what begins or ends within a step.

        Args:
            body: The body.
            dq: Direction.
            mesh: Mesh of the body.
        """
        form = self.of_terms(body, dq)
        if len(self.instants) == 1 or form is None or self.time not in form.constants():
            return (self,)
        parts = [
            replace(
                self,
                loads=None,
                instants=((tau, weight),),
                time=fem.Constant(mesh, 0.0),
                tau=tau,
                weight=fem.Constant(mesh, weight),
            )
            for tau, weight in self.instants
        ]
        return replace(self, terms=False), *parts


@dataclass(frozen=True)
class StageForms:
    """Residual of a body's stage with what feeds it.

    Args:
        stage: Where forms are taken; None for the row of an unknown jump, and for the rows of
            schemes that know no sub-intervals.
        residual: Forms that add up to the residual: the body's own forces, loads, added terms.
        samples: Loads and added terms, at one or several states.
        terms: More of the residual, with derivatives by the stages of the scheme.
        states: Functions that the terms are taken at; None without any.
        damping: Work of the damping of strains over the step; None without, or in another row.
    """

    stage: Stage | None
    residual: tuple[Form, ...]
    samples: tuple[Sample, ...] = ()
    terms: tuple[Term, ...] = ()
    states: PathStates | None = None
    damping: Form | None = None


class IntervalForms:
    """Residuals of a scheme that is made of sub-intervals.

    Args:
        body: The body.
        scheme: The scheme.
        levels: The body's functions.
        dt: Length of the step.

    Attributes:
        stages: Residuals by the names of their stages.
        advance: Rates at the end of the step.
        branches: Maxwell branches of the body; None: none.
    """

    def __init__(self, body: Body, scheme: Scheme, levels: Levels, dt: fem.Constant) -> None:
        self._body, self._levels, self._scheme, self._dt = body, levels, scheme, dt
        self.branches = branches_of(body) if scheme.dynamic else None
        self.stages = stage_forms(body, scheme, levels, dt, self.branches)
        self.advance = scheme.advance
        stage = self.stages[END].stage
        self._share = 1.0 if stage is None else stage.share

    def _last(self, levels: Levels) -> Interval:
        return span_of(self._body, levels, self._scheme.expand(levels, self._dt)[END], END)

    @cached_property
    def _span(self) -> Interval:
        """The last sub-interval, which each step asks for."""
        return self._last(self._levels)

    @property
    def _ends(self) -> tuple[Values, Values]:
        """Arrays of both ends of the last sub-interval; twice that of a state within the step."""
        if self._share == 1.0:
            return self._arrays
        first, last = (q.x.array for q in (self._levels.q, self._levels.unknown[END]))
        there = np.asarray((1 - self._share) * first + self._share * last)
        return there, there

    @cached_property
    def _arrays(self) -> tuple[Values, Values]:
        if self._levels.reference is not None:
            there = np.asarray(self._levels.reference.q.x.array)
            return there, there
        a, b = (cast(fem.Function, end) for end in (self._span.a, self._span.b))
        there = np.asarray(b.x.array)
        return (there if a is b else np.asarray(a.x.array)), there

    def middle(self) -> Values:
        """The middle of the last sub-interval; the state of a single one, or the reference."""
        a, b = self._ends
        return np.asarray(b if a is b else (a + b) / 2)

    def ends(self) -> tuple[Values, Values]:
        """States at the start and end of the step; a single one, or the reference, is both."""
        a, b = self._ends
        return (a if a is b else np.asarray(self._levels.q.x.array)), b

    def mean_state(self) -> Expr:
        """State of which the averaged stress of the last sub-interval is."""
        span = self._span
        return span.b if span.a is span.b else stress_average(span.a, span.b, span.beta)

    def mean_resultants(self, body: Any) -> Expr:
        """Resultants of the averaged stress of the last sub-interval."""
        levels = self._levels
        return body.averaged_resultants(self._last(levels.reference or levels))

    def dissipated(self) -> list[Form]:
        """Elastic part of `c^2`, eq. (34), of the jump to the first stage."""
        stage = self._scheme.dissipation()[1]
        if stage is None:
            return []
        found = jump_energy(self._body, self._levels.q, self._levels.unknown[stage])
        return [] if found is None else [found]


def interval_forces(body: Body, span: Interval, dq: Expr) -> Form | None:
    """Internal and constraint forces of a sub-interval, or of a single state.

    Args:
        body: The body.
        span: The sub-interval.
        dq: Virtual displacement.
    """
    elastic = [part.interval(span, dq) for part in body.elastic]
    return added([*elastic, *(held.interval(span, dq) for held in body.constraints)])


def sub_forces(
    body: Body, sub: SubInterval, dq: Expr, trial: Expr
) -> tuple[Form | None, list[Term]]:
    """Forces of a sub-interval: what has kernels that know no scheme as terms.

    Args:
        body: The body.
        sub: A sub-interval of a step, or a single state.
        dq: Virtual displacement.
        trial: Direction of derivatives.
    """
    terms: list[Term] = []
    for part in body.elastic:
        term = part.interval_term(sub, dq, trial)
        if term is None:
            return interval_forces(body, sub.span, dq), []
        terms.append(term)
    forms = added(held.interval(sub.span, dq) for held in body.constraints)
    return forms, [reduce(together, terms)] if terms else []


def velocity_constraint(body: Body, v: Expr, mid: Expr, dv: Expr) -> Form | None:
    """Constraints on velocities at the state `mid`, with their impulses; None without any."""
    return added(held.velocity(v, mid, dv) for held in body.constraints)


def jump_constraint(body: Body, step: VelocityJump, dq: Expr) -> JumpForms:
    """Constraints on velocities at the end of a step that begins with a jump."""
    found = [pair for held in body.constraints if (pair := held.jump(step, dq)) is not None]
    if not found:
        return None
    impulses, forces = zip(*found, strict=True)
    return sum(impulses[1:], impulses[0]), sum(forces[1:], forces[0])


def jump_energy(body: Body, a: Expr, b: Expr) -> Form | None:
    """Elastic part of eq. (34) for the jump from `a` to `b`; None without any."""
    return added(part.jump(a, b) for part in body.elastic)


def bow_energy(body: Body, step: Step, held: Expr) -> Form | None:
    """Elastic energy of the bow of the strains, eq. (Q5); arguments as of `Elastic.bow`."""
    return added(part.bow(step, held) for part in body.elastic)


def lossy(
    body: Body,
    branches: MaxwellBranches | None,
    over: Callable[..., Straining],
    course: tuple[float, bool],
    tests: Sequence[Expr],
    trial: Expr,
) -> tuple[list[Term], Form | None]:
    """Relaxation and damping of a body's strains over a step, and the work of the damping.

    Args:
        body: The body.
        branches: Its Maxwell branches; None: none.
        over: Changes of strains over the step, of given mixtures of them or of their rate.
        course: Dissipation of the scheme, and whether strains have a bow in its steps.
        tests: Directions of the rows.
        trial: Direction of derivatives.
    """
    terms, work = list[Term](), None
    if branches is not None:
        terms.append(branches.term(Course(over, *course), tests, trial))
    if body.damping is not None:
        along = over()
        terms.append(body.damping.term(along, tests, trial))
        work = body.damping.work(along)
    return terms, work


def stage_forms(
    body: Body,
    scheme: Scheme,
    levels: Levels,
    dt: fem.Constant,
    branches: MaxwellBranches | None = None,
) -> dict[str, StageForms]:
    """Residuals of all stages of a scheme for one body.

    Args:
        body: The body.
        scheme: The scheme.
        levels: The body's functions.
        dt: Length of the step.
        branches: Maxwell branches of the body; None: none.
    """
    result = {}
    unknowns = [levels.unknown[name] for name in scheme.stages]
    linear = levels.reference is not None
    # where forms are taken: small displacements do not change it
    at = scheme.expand(levels.reference or levels, dt)
    jump = scheme.jump(levels, dt) if "b" in levels.unknown else None

    def jump_forms(dq: Expr) -> JumpForms:
        """Constraints on velocities at the end of a step with a jump."""
        return None if jump is None or not levels.slides else jump_constraint(body, jump.step, dq)

    for number, (name, stage) in enumerate(scheme.expand(levels, dt).items()):
        unknown = levels.unknown[name]
        space = unknown.function_space
        dq, trial = ufl.TestFunction(space), ufl.TrialFunction(space)
        resists = body.damping is not None or branches is not None
        before = levels.q if resists else None
        span = span_of(body, levels, stage, name)
        sub = Span(span, unknowns, number, at[name].span if linear else None, before)
        internal, terms = sub_forces(body, sub, dq, trial)
        work = None
        if resists and stage.rates is not None:
            if sub.between is None or len(unknowns) > 2:
                what = "a damping" if branches is None else "a relaxation"
                raise SceneError(
                    f"'{body.name}': it has {what}; scheme '{scheme.name}' does not "
                    "take strains from one state to another, so it must be without, or the scheme "
                    "another, as 'ep', 'ed', 'ep4' or 'ed3'"
                )
            place = len(unknowns), number
            over = partial(over_interval, space.mesh, sub.between, place, dt, linear)
            course = scheme.dissipation()[0], len(unknowns) > 1
            more, dissipated = lossy(body, branches, over, course, [dq], trial)
            terms += more
            work = dissipated if name == END else None
        if internal is not None and linear:
            internal = change(internal, levels)
        inertia = None if stage.rate is None else body.inertia(stage.rate, dq)
        alone = stage.single and name == END
        sample = Sample(
            at[name].span.mid if linear else span.mid,
            at[name].rates,
            body.loads(),
            ((stage.share, 1.0),) if alone else averaged(scheme, name),
            fem.Constant(space.mesh, 0.0),
            stage.share if alone else 0.5,
            levels=levels if linear else None,
        )
        jumped = jump_forms(dq)
        forces = inertia, internal, None if jumped is None else jumped[1]
        parts = [form for form in [added(forces)] if form is not None]
        samples = sample.resolved(body, dq, space.mesh)
        parts += acting(body, samples, dq)
        result[name] = StageForms(stage, tuple(parts), samples, tuple(terms), sub.states, work)
    if jump is not None:
        db = ufl.TestFunction(levels.unknown["b"].function_space)
        jumped = jump_forms(db)
        rows = (
            body.inertia(jump.defect, db),
            velocity_constraint(body, jump.jump, jump.mid, db) if jumped is None else jumped[0],
        )
        result["b"] = StageForms(None, tuple(x for x in [added(rows)] if x is not None))
    return result


def span_of(body: Body, levels: Levels, stage: Stage, name: str) -> Interval:
    """Sub-interval of a stage; of forces within the step the state on the chord where they act.

    Resultants there are between those of both ends, and so follow the strains to second order.
    Multipliers are those of the end.

    Args:
        body: The body.
        levels: Its functions.
        stage: The stage.
        name: Its name.

    Raises:
        SceneError: If forces act elsewhere, or the scheme is one that takes averages.
    """
    share = stage.share
    if share == 1.0:
        return stage.span
    if not (stage.single and 0.5 <= share < 1.0) or levels.reference is not None:
        raise SceneError(
            f"scheme: the share of a stage is {share!r}; it must be between 0.5 and 1, of a stage "
            "with at_state and of a scheme that is not linear"
        )
    start, end = levels.q, levels.unknown[name]
    there = (1 - share) * start + share * end
    titles = {part.name for part in body.parts} - body.kinematic - body.mixed.elementwise
    held = {n for p in titles for n in _numbers(body, p)}
    size = ufl.shape(end)[0]
    unknown = ufl.as_vector([(end if k in held else there)[k] for k in range(size)])
    return Interval(there, there, there, unknown, 0.0, end)


def _numbers(body: Body, part: str) -> range:
    first, count = body.mixed.parts[part]
    return range(first, first + count)


def acting(body: Body, samples: tuple[Sample, ...], dq: Expr) -> list[Form]:
    """Contribution of loads and added terms to a residual."""
    forms = [f for s in samples for f in (s.of_loads(dq), s.of_terms(body, dq))]
    return [-form for form in forms if form is not None]


def averaged(scheme: Scheme, stage: str) -> Instants:
    """Instants and weights of the average of a load in a stage."""
    return tuple(
        (float(tau), float(weight * scheme.load_weight(stage, tau)))
        for tau, weight in zip(GAUSS_TIMES, GAUSS_WEIGHTS, strict=True)
    )
