"""Residuals of a body for a step that is quadratic in time, eqs. (Q2)-(Q4)."""

from dataclasses import replace
from functools import cached_property, partial, reduce
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from ufl import Form
from ufl.core.expr import Expr

from shellmb.arrays import Int32s
from shellmb.forms.steps.path import Path, Rows, Step
from shellmb.model.body import Body, Rates, added, kinetic_energy
from shellmb.model.sections.branches import branches_of
from shellmb.model.sections.strains import together
from shellmb.schemes.base import END, Levels, Named, Scheme, Tangent, Values
from shellmb.schemes.residuals.residual import (
    Instants,
    IntervalForms,
    Sample,
    StageForms,
    acting,
    averaged,
    bow_energy,
    lossy,
)
from shellmb.schemes.residuals.rows import (
    NAMES,
    PathStates,
    constants,
    moment,
    over_path,
    path_stresses,
)


class PathForms:
    """Makes the residuals of one body.

    Args:
        body: The body.
        scheme: The scheme, `QuadraticInTime`.
        levels: The body's functions.
        dt: Length of the step.

    Attributes:
        path: The step.
        step: The same with what rows of mixed sections need.
        states: Functions that must follow the unknown ones.
        dt: Length of the step.
        branches: Maxwell branches of the body; None: none.
    """

    def __init__(self, body: Body, scheme: Any, levels: Levels, dt: fem.Constant) -> None:
        self._body, self._scheme, self._levels, self.dt = body, scheme, levels, dt
        self.branches = branches_of(body)
        self._mesh, page, alpha = levels.q.function_space.mesh, scheme.page, scheme.alpha
        unknown, (velocity,) = tuple(levels.unknown.values()), levels.scaled.values()
        constant = fem.Constant(self._mesh, float(alpha))
        self.path: Path = page.path_of(levels.q, unknown[0], velocity, unknown[1], constant)
        self.states = PathStates((levels.q, velocity, *unknown), page.states(alpha))
        stresses = path_stresses(self._mesh, page, alpha, unknown)
        rows = Rows(self.states.functions, stresses, (0, 1))
        changes = 2.0 * page.strains(0.0)[1], page.bow
        chord, bow = (moment(self._mesh, weights, unknown[0]) for weights in changes)
        self.step = Step(self.path, rows, chord, bow, alpha > 0)

    @cached_property
    def stages(self) -> dict[str, StageForms]:
        """Residuals of both rows, by the name of their stage."""
        body, result = self._body, {}
        found = [part.path_term(self.step, *body.mixed.arguments) for part in body.elastic]
        both = [term for term in found if term is not None]
        terms = [reduce(together, both)] if both else []
        alpha, path = self._scheme.alpha, self.path
        sources = path.start, path.end, path.end_velocity
        states = self.states.functions
        over = partial(over_path, self._scheme.page, self._mesh, alpha, states, sources, self.dt)
        more, work = lossy(body, self.branches, over, (alpha, True), *body.mixed.arguments)
        terms += more
        # derivatives by functions that follow the unknown states have one kernel for both of these
        functions: Any = dict(zip(NAMES, self.states.functions, strict=True))
        step = self.step._replace(path=path._replace(**functions))
        for k, (stage, unknown) in enumerate(self._levels.unknown.items()):
            dq = ufl.TestFunction(unknown.function_space)
            elastic = [part.row(step, k, dq) for part in body.elastic]
            held = [constraint.path(step.path, k, dq) for constraint in body.constraints]
            inertia = body.inertia(path.acceleration[k] / self.dt**2, dq)
            samples, followed = self._samples(stage, step.path)
            parts = [f for f in (inertia, added([*elastic, *held])) if f is not None]
            parts += acting(body, followed, dq)
            result[stage] = StageForms(None, tuple(parts), samples)
        forms = [term.residual for term in terms]
        forms += [form for made in result.values() for form in made.residual]
        seen = {coefficient for form in forms for coefficient in form.coefficients()}
        follow = None if seen.isdisjoint(self.states.functions) else self.states
        # they are of both rows
        result[END] = replace(result[END], terms=tuple(terms), states=follow, damping=work)
        return result

    def advance(
        self, q: Values, rates: Named, unknown: Named, dt: float, tangent: Tangent
    ) -> dict[str, Values]:
        """Advance as the scheme does; without inertia rates are those of the path at its end."""
        new, free = self._scheme.advance(q, rates, unknown, dt, tangent), self._inertialess
        if len(free):
            # all that is carried on of it: strains of the next step begin with its rate there
            rows = {s: values[free] for s, values in unknown.items()}
            moved = self._scheme.moved(q[free], {"v": dt * rates["v"][free]}, rows)
            new["v"][free] = sum(moved.values()) / dt
        return new

    def middle(self) -> Values:
        """Mean of the path of the step just solved, where the mean of the forces acts."""
        if self.stages[END].states is None:
            return np.asarray(self.states.weights[0] @ np.array(self._arrays))
        # what follows the unknown states has it
        return self._mean

    def ends(self) -> tuple[Values, Values]:
        """States at the start and at the end of the step."""
        start, _, end, _ = self._arrays
        return start, end

    @cached_property
    def _mean(self) -> Values:
        return np.asarray(self.states.functions[0].x.array)

    @cached_property
    def _arrays(self) -> list[Values]:
        """Arrays of the start of the step, of scaled rates, and of the unknown states."""
        return [np.asarray(function.x.array) for function in self.states.sources]

    def mean_state(self) -> Expr:
        """Mean of the path."""
        return self.path.mean

    def mean_resultants(self, body: Any) -> Expr:
        """Mean of a shell's or beam's resultants, those of `S_0`."""
        return body.mean_resultants(self.step)

    def dissipated(self) -> list[Form]:
        """Energy that the step dissipates over alpha, eq. (Q5)."""
        path = self.path
        # of the resultants, by (Q3)
        bow = 2 * (path.end_velocity + path.start - path.end) / (1 + path.alpha)
        kinetic = kinetic_energy(self._body, path.shake / self.dt)
        four = None if kinetic is None else 4 * kinetic
        return [f for f in (bow_energy(self._body, self.step, bow), four) if f is not None]

    @cached_property
    def _inertialess(self) -> Int32s:
        """Dofs of directors without inertia that no support moves."""
        body, none = self._body, np.zeros(0, np.int32)
        if not body.manifold.inertialess:
            return none
        fixed = np.concatenate([none, *(f.dofs for f in body.fixed)])
        # and of the frame that they float about
        found = [none, *(body.mixed.dofs[p] for p in ("w", "frame") if p in body.mixed.dofs)]
        return np.setdiff1d(np.concatenate(found), fixed)

    def _samples(self, stage: str, followed: Path) -> tuple[tuple[Sample, ...], tuple[Sample, ...]]:
        """Loads and added terms: at Gauss' points in time, or as a mean if the state is nothing.

        Args:
            stage: Name of the row.
            followed: The path by functions that follow the unknown states: samples there, too.
        """
        instants = averaged(self._scheme, stage)
        dq = ufl.TestFunction(self._levels.q.function_space)
        whole = self._sample(0.5, instants)
        loads, terms = whole.of_loads(dq), whole.of_terms(self._body, dq)
        forms = [form for form in (loads, terms) if form is not None]
        unknown = set(self._levels.unknown.values())
        if terms is None and not any(unknown & set(form.coefficients()) for form in forms):
            return ((whole,), (whole,)) if forms else ((), ())
        if loads is None and terms is not None and whole.time not in terms.constants():
            # forces that depend on velocities alone must see none where there is none
            weigh, rolling = self._scheme.load_weight, self._scheme.rolling
            instants = tuple((tau, weight * weigh(stage, tau)) for tau, weight in rolling)
        found, there = [], []
        for tau, weight in instants:
            found.append(self._sample(tau, ((tau, weight),), weight))
            state, rates = self._at(followed, tau)
            there.append(replace(found[-1], state=state, rates=rates))
        return tuple(found), tuple(there)

    def _sample(self, tau: float, instants: Instants, weight: float | None = None) -> Sample:
        """Loads and added terms at an instant, with a weight of their own."""
        mesh, loads = self._mesh, self._body.loads()
        own, time = None if weight is None else fem.Constant(mesh, weight), fem.Constant(mesh, 0.0)
        return Sample(*self._at(self.path, tau), loads, instants, time, tau, own)

    def _at(self, path: Path, tau: float) -> tuple[Expr, Rates]:
        """State and rates at an instant of the path."""
        (place,) = constants(self._mesh, tau)
        velocity = path.velocity(place) / self.dt
        return path.at(place), Rates(velocity, velocity)


# residuals of a body in a step, and what is read of a step that was solved
StepForms = IntervalForms | PathForms


def step_forms(body: Body, scheme: Scheme, levels: Levels, dt: fem.Constant) -> StepForms:
    """Residuals of one body in a step.

    Args:
        body: The body.
        scheme: The scheme.
        levels: The body's functions.
        dt: Length of the step.
    """
    kind = IntervalForms if scheme.page is None else PathForms
    return kind(body, scheme, levels, dt)
