"""One step of a scene as a block system: model and scheme turned into fields of unknowns."""

import math
from collections.abc import Hashable
from dataclasses import replace
from functools import cached_property
from itertools import chain
from typing import Any

import numpy as np
from dolfinx import fem

from shellmb.arrays import Bools, Floats, Int32s
from shellmb.errors import ConvergenceError
from shellmb.model.body import Body, TimeFunction
from shellmb.model.model import Model
from shellmb.model.sections.branches import MaxwellBranches
from shellmb.model.sections.natural import NaturalStress
from shellmb.native.assembler import is_native
from shellmb.preprocessing.bodyfields import (
    NONE,
    body_directors,
    body_field,
    kinematic_dofs,
    residual_terms,
    resultant_dofs,
    without_impulse,
)
from shellmb.schemes.base import END, GAUSS_TIMES, GAUSS_WEIGHTS, Levels, Scheme
from shellmb.schemes.linearised import at_reference
from shellmb.schemes.residuals.pathforms import StepForms, step_forms
from shellmb.schemes.residuals.residual import StageForms
from shellmb.simulate.couplings.faces import FacesCoupling
from shellmb.simulate.predictor import Pairs, Predictor
from shellmb.simulate.start.consistent import Arrays, ScaledRates, VelocityProjection, flight
from shellmb.simulate.stepsize import rounded
from shellmb.system.assembly.blocks import BlockSystem
from shellmb.system.assembly.fields import (
    DependentFunctions,
    DirectorPath,
    DirectorRates,
    Directors,
    Field,
    Part,
)
from shellmb.system.condensation.reduction import Reduction
from shellmb.system.direct.mumps import new_prefix
from shellmb.system.newton.iteration import Iteration, NewtonSettings
from shellmb.system.newton.solver import NEWTON

# name of the unknown jump of velocities
JUMP = "b"
# an update of a position or director this many times its scale is no motion of the body any more
DIVERGED = 1e3
# solutions of a step with other pairs of contacts after which it is given up
SEARCHES = 8
# step of the load factor in derivatives of what is prescribed by it: of fourth order
FACTOR_STEP = 1e-3


class Problem:
    """The functions of all bodies at all time levels, and the system that advances them.

    Args:
        model: The bodies.
        scheme: The scheme.

    Attributes:
        levels: Functions by body name.
        forms: Residuals by body name and stage.
        system: The block system.
        couplings: Contacts with faces of shells.
        branches: Maxwell branches by the name of their body.
        iteration: What Newton's method iterates.
        steps: Steps of the bodies by their name.
        load_factor: Factor of all loads, where it is an unknown; None: loads depend on time.
        counted: Coordinates of joints in the state that the run starts from, by column of the
            history, as another run has counted them: whole turns do not show in the bodies.
        controlled: States of controllers in it, by name, as of `Sampler.state`.
    """

    def __init__(self, model: Model, scheme: Scheme) -> None:
        self.model, self.scheme = model, scheme
        self.load_factor: float | None = None
        self.counted: dict[str, float] = {}
        self.controlled: dict[str, dict[str, Any]] = {}
        self.levels: dict[str, Levels] = {}
        self.forms: dict[str, dict[str, StageForms]] = {}
        self._dt_values, self._time_values = list[Floats](), list[Floats]()
        self.steps: dict[str, StepForms] = {}
        for body in model.bodies:
            self._add(body)
        stages = (*scheme.stages, JUMP)
        names = [(n, s) for s in stages for n, own in self.levels.items() if s in own.unknown]
        self._index = {key: k for k, key in enumerate(names)}
        self._bodies = {b.name: b for b in model.bodies}
        # bodies and stages whose given values do not change in time, and are in place
        self._still = set[tuple[str, str]]()
        # the kinematic ones among the local dofs
        dofs = {name: np.arange(len(levels.q.x.array)) for name, levels in self.levels.items()}
        self._moving = {b.name: np.isin(dofs[b.name], kinematic_dofs(b)) for b in model.bodies}
        self._resultant_dofs = {b.name: resultant_dofs(b) for b in model.bodies}
        self._tangents = {b.name: b.manifold.tangent_values for b in model.bodies}
        self._arrays = {name: Arrays(levels) for name, levels in self.levels.items()}
        self.fields = [self._field(self._bodies[b], s) for b, s in names]
        made = [forms.states for stages in self.forms.values() for forms in stages.values()]
        followers = [DependentFunctions(**vars(states)) for states in made if states is not None]
        self.system = BlockSystem(model.comm, self.fields, followers)
        self.couplings = self._couplings()
        every = {name: getattr(steps, "branches", None) for name, steps in self.steps.items()}
        self.branches: dict[str, MaxwellBranches] = {k: b for k, b in every.items() if b}
        self._relaxing = [own for branches in self.branches.values() for own in branches]
        self.system.couplings.extend(self.couplings)
        solver = model.scene.solver
        kind = "linear " if scheme.linear else "" if scheme.dynamic else "static "
        settings = NewtonSettings(solver.tolerance, solver.max_iterations, kind + solver.newton)
        reduction = Reduction if solver.solve == "reduced" and is_native() else None
        self.iteration = Iteration(self.system, settings, new_prefix(self), reduction)
        self.newton = NEWTON[solver.backend](self.iteration)

    def _couplings(self) -> list[FacesCoupling]:
        """Contacts with faces of shells, by the pieces of the scheme's steps."""
        if not self.model.faces:
            return []
        pieces, offsets = self.scheme.pieces, self.system.numbering.offsets
        assert pieces is not None, "scenes with such contacts are checked"
        places = {key: int(offsets[k]) for key, k in self._index.items()}
        comm, levels = self.model.comm, self.levels
        return [FacesCoupling(comm, made, levels, pieces, places) for made in self.model.faces]

    def key(self, dt: float) -> tuple[Hashable, ...]:
        """Steps with the same one have nearly the same Jacobian; in linear statics all have it."""
        linear = self.scheme.linear and not self.scheme.dynamic
        return self.switches if linear else (rounded(dt), *self.switches)

    @property
    def switches(self) -> tuple[Hashable, ...]:
        """Steps with the same one continue one another."""
        return self.model.mechanism.switches.key

    @cached_property
    def predictor(self) -> Predictor:
        """Extrapolates the steps before."""
        return Predictor(self.iteration, self._pairs())

    def _pairs(self) -> Pairs:
        """Owned unknowns whose slopes in time others tell, as the scheme says."""
        numbering, found = self.system.numbering, [np.zeros((3, 0))]
        stresses, reactions = self.scheme.slopes
        for (name, stage), rate in self._index.items():
            if stage in self.scheme.scaled:
                times = np.where(self._moving[name], 1.0, reactions)
                times[self._resultant_dofs[name]] = stresses
                fields = (self.number(name, self.last), rate)
                places = [numbering.by_field[k] - numbering.start for k in fields]
                found.append(np.array([*places, times]))
        every = np.unique(np.hstack(found), axis=1)
        # of nodes that joints see, too, the first one is as of their own body: it has the least
        values, first = np.unique(every[0], return_index=True)
        mine = first[(values >= 0) & (values < numbering.owned)]
        states, rates = (rows[mine].astype(np.int64) for rows in every[:2])
        return Pairs(states, rates, every[2, mine])

    def _add(self, body: Body) -> None:
        space = body.mixed.space

        def function(name: str) -> fem.Function:
            return fem.Function(space, name=f"{name}_{body.name}")

        jumps = self.scheme.jumps and self.model.coupled(body)
        stages = (*self.scheme.stages, JUMP) if jumps else self.scheme.stages
        levels = Levels(
            function("q"),
            {rate: function(rate) for rate in self.scheme.rates},
            {stage: function(f"q_{stage}") for stage in stages},
            body.manifold.tangent,
            {rate: function(f"scaled_{rate}") for rate in self.scheme.scaled},
            slides=self.model.slides,
        )
        if self.scheme.linear:
            levels = replace(levels, reference=at_reference(levels))
        dt, time = fem.Constant(space.mesh, 1.0), fem.Constant(space.mesh, 0.0)
        self._dt_values.append(np.asarray(dt.value))
        self._time_values.append(np.asarray(time.value))
        self.levels[body.name] = levels
        self.steps[body.name] = made = step_forms(body, self.scheme, levels, dt)
        self.forms[body.name] = made.stages

    def _field(self, body: Body, stage: str) -> Field:
        jump = stage == JUMP
        suffix = f" (stage {stage})" if len(self.scheme.stages) > 1 else ""
        parts = tuple(
            Part(
                p.title + suffix,
                body.mixed.dofs[p.name],
                # the jump follows from the states: it is no criterion of its own
                math.inf if jump else p.scale,
                p.advice,
                DIVERGED * p.scale if p.name in body.kinematic and not jump else math.inf,
                p.idle,
                self.model.farthest if p.name == "u" else 0.0,
            )
            for p in body.parts
        )
        field = body_field(
            body,
            self.levels[body.name].unknown[stage],
            self.forms[body.name][stage].residual,
            {name: k for (name, other), k in self._index.items() if other == stage},
            parts,
            f"{body.name}{suffix}",
            without_impulse(body) if jump else (),
        )
        columns = [self._index[body.name, s] for s in self.scheme.stages]
        terms = residual_terms(self.forms[body.name][stage].terms, columns)
        kept = self._kept(body) if jump and self.model.slides else NONE
        return replace(field, directors=self._directors(body, stage), terms=terms, kept=kept)

    def _kept(self, body: Body) -> Int32s:
        """Multipliers of directors that joints act on: unknown in the joints' cells; collective."""
        declared = body_directors(body)
        if declared is None:
            return NONE
        links = (link for other in self.model.bodies for link in other.links)
        here = [NONE, *(k.targets for k in links if k.body == body.name)]
        linked = np.concatenate([*chain(*self.model.comm.allgather(here))])
        joined = np.isin(body.mixed.numbers(declared.dofs), linked).any(axis=1)
        return declared.multipliers[joined].ravel()

    def _directors(self, body: Body, stage: str) -> Directors | None:
        """The directors of a stage, with the start of its sub-interval."""
        declared, levels = body_directors(body), self.levels[body.name]
        if declared is None or (stage == JUMP and self.model.slides):
            return None
        # where velocities are unknown, too, directors and these are on one path
        for rate, velocity in levels.scaled.items():
            state, other = (-1 if s == stage else self._index[body.name, s] for s in (END, rate))
            return DirectorPath(
                **vars(declared) | {"before": levels.q},
                start_velocity=velocity,
                alpha=self.scheme.dissipation()[0],
                state=state,
                rate=other,
                massless=body.manifold.inertialess,
            )
        found = self.forms[body.name][stage].stage
        if found is None:
            # jumps of velocities are tangent at the middle of the first sub-interval
            state = self._index[body.name, self.scheme.stages[0]]
            return DirectorRates(**vars(declared) | {"before": levels.q, "state": state})
        start = found.span.a
        if levels.reference is not None:
            return replace(declared, before=levels.reference.q, linear=True)
        if start is levels.unknown[stage]:
            return declared
        assert isinstance(start, fem.Function)
        return replace(declared, before=start)

    def state(self, body: str) -> fem.Function:
        """Function with the state of a body."""
        return self.levels[body].q

    def unknown(self, body: str) -> list[fem.Function]:
        """Functions of a body's stages."""
        return list(self.levels[body].unknown.values())

    def number(self, body: str, stage: str) -> int:
        """Number of that field in the system."""
        return self._index[body, stage]

    last = END  # name of the stage at the end of a step

    def start_factor(self, t: float, function: TimeFunction | None) -> float:
        """Factor of a load at a time: its time function, or the default of the scheme."""
        if self.load_factor is not None:
            return self.load_factor
        if function is not None:
            return self.model.signals(function, t)
        return 1.0 if self.scheme.dynamic else t / self.model.scene.t_end

    @cached_property
    def _natural(self) -> list[NaturalStress]:
        """Stresses of natural strains; none for most scenes."""
        found = (getattr(body, "natural", None) for body in self.model.meshed.values())
        return [natural for natural in found if natural is not None]

    def begin(self) -> None:
        """Take the accepted state as the start of what remembers earlier ones."""
        for name, branches in self.branches.items():
            for own in branches:
                own.begin(self.levels[name].q)

    def arrive(self, t: float) -> None:
        """Take down that the accepted state is that of a time, for what is reported of it."""
        for potential in self.model.potentials:
            if potential.factor is not None:
                potential.factor.value = self.start_factor(t, None)  # type: ignore[assignment]
        for natural in self._natural:
            natural.now.value = self.start_factor(t, natural.time)  # type: ignore[assignment]

    def prepare(self, t: float, dt: float) -> None:
        """Set times, load factors and prescribed values for a step."""
        for natural in self._natural:
            instants = zip(GAUSS_TIMES, GAUSS_WEIGHTS, strict=True)
            mean = sum(w * self.start_factor(t + tau * dt, natural.time) for tau, w in instants)
            natural.mean.value = mean
        for constant, middle in zip(self._dt_values, self._time_values, strict=True):
            constant[...] = dt
            middle[...] = t + (dt / 2 if self.scheme.dynamic else dt)
        for rates in self._scaled_rates:
            rates.take(dt)
        for name, stages in self.forms.items():
            for stage, forms in stages.items():
                for sample in forms.samples:
                    sample.update(t, dt, self.start_factor)
                given = (t, dt) if self.load_factor is None else (self.load_factor, 0.0)
                if (name, stage) not in self._still:
                    self._prescribe(name, stage, *given)
        for own in self._relaxing:
            own.prepare(dt)
        for coupling in self.couplings:
            coupling.look(dt)
        self._renew()

    @cached_property
    def linked_rates(self) -> tuple[str, ...]:
        """Rates at the start that linked nodes take from their bodies: of a single state."""
        last = (stages[END].stage for stages in self.forms.values() if self.scheme.dynamic)
        return (*self.scheme.rates,) if any(stage and stage.single for stage in last) else ()

    @cached_property
    def _scaled_rates(self) -> list[ScaledRates]:
        """Rates at the start times the step, or those that a single state is taken with."""
        of = [(self._bodies[name], self.levels[name], stage) for name, stage in self._index]
        named = (None,) if self.scheme.scaled else self.linked_rates
        return [ScaledRates(self.system, of, rate) for rate in named]

    def start_from_state(self) -> None:
        """Take the first guess of the scheme, from the state at the start of the step."""
        for now in self._arrays.values():
            for stage, unknown in now.unknown.items():
                unknown[:] = self.scheme.first_guess(stage, now.q, now.scaled)

    def follow_given(self, factor: float) -> Floats:
        """Give prescribed dofs their values at a load factor, which is their time.

        Returns:
            Their derivatives by it, aligned with the system's fixed unknowns.
        """
        for name, stage in self._index:
            given = [fixed.rate(FACTOR_STEP, factor) for fixed in self._bodies[name].fixed]
            if given:
                rates = np.concatenate(given)
                self.fields[self.number(name, stage)].values[: len(rates)] = rates
        self.system.update_fixed_values()
        rates = self.system.fixed_values()
        for name, stage in self._index:
            self._prescribe(name, stage, factor, 0.0)
        self.system.update_fixed_values()
        return rates

    def _prescribe(self, name: str, stage: str, t: float, dt: float) -> None:
        now, values = self._arrays[name], [np.zeros(0)]
        every = self._bodies[name].fixed
        for fixed in every:
            if fixed.moving:
                rates = {k: v[fixed.dofs] for k, v in now.rates.items()}
                values.append(self.scheme.prescribed(stage, fixed.value, t, dt, rates))
            else:
                values.append(fixed.value(t) * (stage not in self.scheme.scaled))
        given = np.concatenate(values)
        if not any(fixed.moving for fixed in every):
            self._still.add((name, stage))
        # behind these come the parts of a jump that have no equations: zero
        self.fields[self.number(name, stage)].values[: len(given)] = given

    def warm_up(self, dt: float) -> None:
        """Assemble once and order the factorisation, at the state at the start of a step.

        A resumed run does the same at the same state: it orders its unknowns as the first did.

        Args:
            dt: Length of the first step, s.
        """
        self.start_from_state()
        self.iteration.warm_up(self.key(dt))
        if self.scheme.dynamic:
            # it is made here and not in the first step
            self.predictor.clear()

    def solve(self, dt: float) -> int:
        """Solve for the unknown states; returns the number of Newton iterations.

        Where contacts may miss something that comes near in the step, it is solved once more.

        Args:
            dt: Length of the step, s.

        Raises:
            ConvergenceError: Names the field that did not converge, or the contact that something
                passes through.
        """
        iterations, times = self._solve(dt), 0
        while lacking := [c.name for c in self.couplings if not c.covered()]:
            if (times := times + 1) > SEARCHES:
                raise ConvergenceError(
                    f"contact '{lacking[0]}': each solution of the step touches elsewhere; use a "
                    "smaller step",
                    lacking[0],
                )
            self._renew()
            iterations += self._solve(dt)
        for coupling in self.couplings:
            coupling.check()
        return iterations

    def _renew(self) -> None:
        """Make room in the matrix for what may touch now."""
        if any(coupling.changed for coupling in self.couplings):
            self.iteration.linear.renew()
            self.iteration.refresh.forget()

    def _solve(self, dt: float) -> int:
        """Solve with the pairs that are known to come near.

        Where an extrapolated first guess or an old factorisation leads nowhere, the iteration
        starts again from the start of the step, with a factorisation each time.

        Args:
            dt: Length of the step, s.

        Raises:
            ConvergenceError: Names the field that did not converge.
        """
        key = self.key(dt)
        guess = self.predictor.guess(self.switches, dt) if self.scheme.dynamic else None
        if guess is None:
            self._begin_at_state(dt)
        self.iteration.guessed = guess is not None
        try:
            return self.newton.solve(key, guess=guess)
        except ConvergenceError:
            if guess is None and not self.iteration.lags:
                raise
        self.predictor.clear()
        self.iteration.guessed = False
        self._begin_at_state(dt)
        return self.newton.solve(full=True)

    def _begin_at_state(self, dt: float) -> None:
        """Take the first guess of the scheme, from which bodies fly as far as they do in a step."""
        self.start_from_state()
        if "v" in self.scheme.rates:
            self.iteration.convergence.widen(flight(self.model.bodies, self.levels, dt))

    def accept(self, dt: float) -> None:
        """Make the state at the end of the step the start of the next one."""
        if self.scheme.dynamic:
            self.predictor.accept(self.system.x, self.switches, dt)
        self.advance(dt)

    def advance(self, dt: float) -> None:
        """Put the state at the end of the step in place of that at its start."""
        for own in self._relaxing:
            own.accept()
        for name, now in self._arrays.items():
            if self._bodies[name].kinematic:
                step, tangents = self.steps[name], self._tangents[name]
                new = step.advance(now.q, now.rates, now.unknown, dt, tangents)
                for key, values in new.items():
                    np.copyto(now.rates[key], values, where=self._moving[name])
            dofs = self._resultant_dofs[name]
            start = now.q[dofs]
            now.q[:] = now.unknown[self.last]
            # the unknown ones stay: they may be means over the step
            if len(dofs):
                rows = {stage: values[dofs] for stage, values in now.unknown.items()}
                now.q[dofs] = self.scheme.resultants(start, rows)

    @cached_property
    def projection(self) -> VelocityProjection:
        """Makes velocities consistent with the constraints."""
        return VelocityProjection(self.model, self.levels)

    def half_chord(self, body: str) -> Floats:
        """Half of what the step just solved changes of a body's state, as a local array."""
        now = self._arrays[body]
        return np.asarray((now.unknown[self.last] - now.q) / 2)

    def support_work(self, part: Bools | slice = slice(None)) -> float:
        """Work of forces that hold or move fixed dofs, or a part of them, over the last step, J."""
        found = {n: self.scheme.moved(a.q, a.scaled, a.unknown) for n, a in self._arrays.items()}
        moved = [found[name][stage] for name, stage in self._index]
        path = self.system.global_values(moved)[self.system.fixed][part]
        return float(self.model.comm.allreduce(float(np.dot(self.system.reactions[part], path))))
