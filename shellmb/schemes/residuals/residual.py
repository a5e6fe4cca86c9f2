"""Residual of one body for one stage: inertia + internal forces - loads - added terms."""

from collections.abc import Callable
from dataclasses import dataclass

import ufl
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.model.body import Body, LoadFactors, Rates, Term, TimeFunction
from shellmb.schemes.base import GAUSS_TIMES, GAUSS_WEIGHTS, Levels, Scheme, Stage
from shellmb.schemes.residuals.rows import PathStates, Span

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
    """

    state: Expr
    rates: Rates | None
    loads: LoadFactors | None
    instants: Instants
    time: fem.Constant
    tau: float
    weight: fem.Constant | None = None

    def update(
        self, t: float, dt: float, factor: Callable[[float, TimeFunction | None], float]
    ) -> None:
        """Set times and factors for a step.

        Args:
            t: Its start, s.
            dt: Its length, s.
            factor: Factor of a load with a time function at an instant.
        """
        self.time.value = t + self.tau * dt  # type: ignore[assignment]
        if self.loads is not None:
            self.loads.update(
                lambda function: float(
                    sum(weight * factor(t + tau * dt, function) for tau, weight in self.instants)
                )
            )

    def of_loads(self, dq: Expr) -> Form | None:
        """Virtual work of the loads."""
        return None if self.loads is None else self.loads.virtual_work(self.state, dq)

    def of_terms(self, body: Body, dq: Expr) -> Form | None:
        """Virtual work of the added terms."""
        form = body.extra(self.state, self.rates, dq, self.time)
        return form if form is None or self.weight is None else self.weight * form


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
    """

    stage: Stage | None
    residual: tuple[Form, ...]
    samples: tuple[Sample, ...] = ()
    terms: tuple[Term, ...] = ()
    states: PathStates | None = None


def stage_forms(
    body: Body, scheme: Scheme, levels: Levels, dt: fem.Constant
) -> dict[str, StageForms]:
    """Residuals of all stages of a scheme for one body.

    Args:
        body: The body.
        scheme: The scheme.
        levels: The body's functions.
        dt: Length of the step.
    """
    result = {}
    unknowns = [levels.unknown[name] for name in scheme.stages]
    for number, (name, stage) in enumerate(scheme.expand(levels, dt).items()):
        unknown = levels.unknown[name]
        space = unknown.function_space
        dq, trial = ufl.TestFunction(space), ufl.TrialFunction(space)
        sub = Span(stage.span, unknowns, number, scheme.linear)
        internal, terms = body.within(sub, dq, trial)
        if internal is not None and scheme.linear:
            # the span is the undeformed state; the unknown is the direction
            internal = ufl.derivative(internal, levels.q, unknown)
        inertia = None if stage.rate is None else body.inertia(stage.rate, dq)
        sample = Sample(
            stage.span.mid,
            stage.rates,
            body.loads(),
            ((1.0, 1.0),) if stage.single else averaged(scheme, name),
            fem.Constant(space.mesh, 0.0),
            1.0 if stage.single else 0.5,
        )
        own = [form for form in (inertia, internal) if form is not None]
        parts = [sum(own[1:], own[0])] if own else []
        parts += acting(body, (sample,), dq)
        result[name] = StageForms(stage, tuple(parts), (sample,), tuple(terms), sub.states)
    jump = scheme.jump(levels, dt) if "b" in levels.unknown else None
    if jump is not None:
        db = ufl.TestFunction(levels.unknown["b"].function_space)
        rows = (
            body.inertia(jump.defect, db),
            body.velocity_constraint(jump.jump, jump.mid, db),
        )
        found = [form for form in rows if form is not None]
        result["b"] = StageForms(None, (sum(found[1:], found[0]),) if found else ())
    return result


def acting(body: Body, samples: tuple[Sample, ...], dq: Expr) -> list[Form]:
    """What loads and added terms have in a residual."""
    forms = [f for s in samples for f in (s.of_loads(dq), s.of_terms(body, dq))]
    return [-form for form in forms if form is not None]


def averaged(scheme: Scheme, stage: str) -> Instants:
    """Instants and weights of the average of a load in a stage."""
    return tuple(
        (float(tau), float(weight * scheme.load_weight(stage, tau)))
        for tau, weight in zip(GAUSS_TIMES, GAUSS_WEIGHTS, strict=True)
    )
