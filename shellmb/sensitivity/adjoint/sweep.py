"""The sweep backwards: covectors of a step's end become those of its start.

A step solves `R(u; s, p) = 0` and ends in `s+ = advance(u, s)`. With the covector `w` of `s+`

    J^T mu = (d advance/du)^T w,        w <- (d advance/ds)^T w - (dR/ds)^T mu,        J = dR/du

and the number that is differentiated changes with `p` by `-mu.(dR/dp)`, summed over the steps. All
unknowns are in one matrix here, whose factors give transposed solutions.

Advance of a scheme after a solved step, transposed.

States and rates at the end of a step are combinations of those at its start and of the unknown
states, number by number; what jumps of velocities leave out along directors (ED) depends on the
state, node by node. The combinations are found by asking the scheme for units.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from mpi4py import MPI

import numpy as np
from dolfinx import fem
from ufl import Form

from shellmb.arrays import Floats, Int32s
from shellmb.model.body import Body
from shellmb.preprocessing.bodyfields import kinematic_dofs, resultant_dofs
from shellmb.schemes.base import END, Scheme
from shellmb.sensitivity.adjoint.multipliers import ROUND_OFF, TOLERANCE, Multipliers
from shellmb.sensitivity.adjoint.steps import State, Step, put, relaxing, starts, unknowns
from shellmb.sensitivity.adjoint.transposed import Change, Covector, Refreshed, Transposed
from shellmb.sensitivity.perturbed_run import PerturbedRun
from shellmb.simulate.problem import Problem
from shellmb.simulate.simulation import Simulation
from shellmb.system.condensation.reduction import Reduction
from shellmb.system.direct.linear import Unreduced
from shellmb.system.direct.mumps import new_prefix

# states by kind and name: "q", a "rate", or an "unknown" one
States = dict[tuple[str, str], Floats]
# shares of these in a rate at the end, in the jump and in the middle state of that
Shares = dict[tuple[str, str], tuple[Floats, Floats, Floats]]


class StoredSteps(NamedTuple):
    """A step that was taken back.

    Args:
        number: Its number, from 0.
        start: State and rates at its start.
        unknowns: Its unknowns, entries that this rank owns.
        multipliers: Those of its equations.
        ends: Covectors of the strains of branches at its end.
        t: Its start, s.
        dt: Its length, s.
    """

    number: int
    start: State
    unknowns: Floats
    multipliers: Floats
    ends: Covector
    t: float
    dt: float


def weighed(
    side: PerturbedRun, steps: Sequence[StoredSteps], read: Callable[[StoredSteps], float]
) -> float:
    """Equations of a scene beside the run at its states, times the multipliers; this rank's share.

    What is read of the steps is taken off.

    Args:
        side: The scene.
        steps: All steps.
        read: What is read of a step whose unknowns the scene has.
    """
    total, live, branches = 0.0, starts(side.problem), relaxing(side.problem)
    for step in steps:
        put(step.start, live)
        side.begin(step.t, step.dt)
        total += float(step.multipliers @ side.residual(step.unknowns))
        total -= sum(np.vdot(step.ends[key], group.change()) for key, group in branches.items())
        total -= read(step)
    return total


class Sweep:
    """Takes covectors back from step to step.

    Args:
        simulation: The run at its end; its functions take the states of the steps.
        fields: Changes of coefficients by each field of numbers, with its body.
        weighing: Whether residuals are to be weighed by all multipliers (`weighed`).
        read: Numbers that are read of steps, each with the weights of what is read.

    Attributes:
        covector: Of the state between two steps, by body and name.
        by_fields: Derivatives by each field, one for each element.
        kept: Steps with their multipliers, if `weighing`.
    """

    def __init__(
        self,
        simulation: Simulation,
        fields: Sequence[tuple[str, Sequence[Change]]],
        weighing: bool,
        read: Sequence[tuple[Form, fem.Function]] = (),
    ) -> None:
        self._simulation, self._problem = simulation, simulation.problem
        problem = self._problem
        self._system = system = problem.system
        self._transposed = Transposed(problem, fields, [form for form, _ in read])
        self._weights = [weights.x.array for _, weights in read]
        self._refreshed = Refreshed(problem)
        self._linear = self._solver(weighing)
        self._advances = {b.name: Advance(problem, b) for b in simulation.model.bodies}
        ready = self._linear is problem.iteration.linear
        tolerance = ROUND_OFF if weighing else TOLERANCE
        solver = Multipliers(system, self._transposed, self._linear, ready, tolerance)
        self.multipliers = solver
        self._right = system.x.duplicate()
        self._weighing, self.kept = weighing, list[StoredSteps]()
        self.covector: Covector = {k: np.zeros_like(a) for k, a in starts(problem).items()}
        cells = [problem.levels[body].q.function_space.dofmap.list for body, _ in fields]
        self.by_fields = [np.zeros(len(c)) for c in cells]

    def _solver(self, differenced: bool) -> Reduction | Unreduced:
        """Choose what solves: the run's own reduced system, if it has all multipliers needed.

        Args:
            differenced: Whether residuals at both sides of parameters are weighed by all of them.
        """
        linear, bodies = self._problem.iteration.linear, self._simulation.model.bodies
        moved = any(fixed.moving for body in bodies for fixed in body.fixed)
        plain = not (differenced or moved)
        if plain and isinstance(linear, Reduction) and linear.covers:
            return linear
        return Unreduced(self._system, new_prefix(self))

    def back(self, step: Step, t: float, dt: float) -> None:
        """Go back over a step; collective.

        Args:
            step: The step.
            t: Its start, s.
            dt: Its length, s.
        """
        problem, system, simulation = self._problem, self._system, self._simulation
        here = any(map(np.any, (*self.covector.values(), *self._weights)))
        if not system.comm.allreduce(here, op=MPI.LOR):
            # of a static step in which nothing is read
            return
        put(step.start, starts(problem))
        simulation.model.mechanism.refresh(problem.levels)
        problem.prepare(t, dt)
        put(step.unknown, unknowns(problem))
        system.gather()
        system.follow()
        system.update_fixed_values()
        self._transposed.refresh()
        before = {key: np.zeros_like(a) for key, a in self.covector.items()}
        for body, levels in problem.levels.items():
            for rate in levels.scaled:
                before[body, f"{rate} dt"] = np.zeros_like(levels.q.x.array)
        self._solve(before, dt)
        if self._weighing:
            own, x = system.global_values(self.multipliers.by_field()), np.array(system.x.array_r)
            ends = {key: self.covector[key] for key in relaxing(problem)}
            self.kept.append(StoredSteps(step.number, step.start, x, own, ends, t, dt))
        self._given(before, t, dt)
        self._transposed.add_start(before)
        self._transposed.add_by_fields(self.by_fields)
        self._scaled(before, dt)
        self._refreshed.add(before)
        self.covector = {key: before[key] for key in self.covector}

    def _solve(self, before: Covector, dt: float) -> None:
        """Multipliers of the equations of a step."""
        problem, system = self._problem, self._system
        local = np.zeros(len(system.exchange.wanted))
        for body, levels in problem.levels.items():
            of = {
                stage: local[system.numbering.slice(problem.number(body, stage))]
                for stage in levels.unknown
            }
            self._advances[body](self.covector, before, of, dt)
        self._transposed.carry(self.covector, before, local)
        self._right.array[:] = system.exchange.summed(local)
        self.multipliers.solve(self._right)

    def _given(self, before: Covector, t: float, dt: float) -> None:
        """Prescribed values that depend on rates at the start."""
        problem, system = self._problem, self._system
        local = self.multipliers.local
        for body in self._simulation.model.bodies:
            levels = problem.levels[body.name]
            for fixed in (f for f in body.fixed if f.moving):
                for stage in levels.unknown:
                    mu = local[system.numbering.slice(problem.number(body.name, stage))]
                    for rate in levels.rates:
                        share = _share_of_rate(problem.scheme, stage, t, dt, rate, fixed.dofs)
                        mine = fixed.dofs < _owned(levels.q)
                        dofs = fixed.dofs[mine]
                        before[body.name, rate][dofs] += share[mine] * mu[dofs]

    def _scaled(self, before: Covector, dt: float) -> None:
        """Rates times the step, and those that linked nodes take from their bodies."""
        levels = self._problem.levels
        scaled = {(b, r): before.pop((b, f"{r} dt")) for b in levels for r in levels[b].scaled}
        for key, values in self._of_bodies(scaled).items():
            before[key] += dt * values
        for rate in self._problem.linked_rates:
            ends = self._of_bodies({(body, END): before[body, rate] for body in levels})
            before.update({(body, rate): values for (body, _), values in ends.items()})

    def _of_bodies(self, given: Covector) -> Covector:
        """Covectors by body and stage, those of linked nodes of the bodies that these belong to."""
        problem, system = self._problem, self._system
        if not given:
            return {}
        local = np.zeros(len(system.exchange.wanted))
        places = {key: system.numbering.slice(problem.number(*key)) for key in given}
        for key, values in given.items():
            local[places[key]] = values
        sums, found = system.exchange.seen(system.exchange.summed(local)), Covector()
        bodies = {b.name: b for b in self._simulation.model.bodies}
        for (body, stage), place in places.items():
            found[body, stage] = values = sums[place].copy()
            values[_owned(problem.levels[body].q) :] = 0.0
            for link in bodies[body].links:
                values[link.dofs] = 0.0
        return found


def _owned(function: fem.Function) -> int:
    return int(function.function_space.dofmap.index_map.size_local)


def _share_of_rate(
    scheme: Scheme, stage: str, t: float, dt: float, rate: str, dofs: Int32s
) -> Floats:
    """Share of a rate at the start in prescribed values at a stage."""
    nothing = np.zeros(len(dofs))
    rates = dict.fromkeys(scheme.rates, nothing) | {rate: np.ones(len(dofs))}
    return np.asarray(scheme.prescribed(stage, lambda _: nothing, t, dt, rates))


class Advance:
    """The end of a step of one body, transposed.

    Args:
        problem: The problem.
        body: The body.
    """

    def __init__(self, problem: Problem, body: Body) -> None:
        self._name, self._levels = body.name, problem.levels[body.name]
        self._scheme, self._forms = problem.scheme, problem.steps[body.name]
        self._kinematic, self._resultants = kinematic_dofs(body), resultant_dofs(body)
        self._tangent_back = body.manifold.tangent_back
        levels, self._states = self._levels, States()
        self._states["q", "q"] = levels.q.x.array
        self._states |= {("rate", k): f.x.array for k, f in levels.rates.items()}
        self._states |= {("unknown", k): f.x.array for k, f in levels.unknown.items()}
        # of each rate the length of the step, the shares, and that of the jump
        self._kept: dict[str, tuple[float, Shares, Floats]] = {}

    def __call__(
        self, ends: Covector, starts: Covector, unknown: dict[str, Floats], dt: float
    ) -> None:
        """Add what covectors of the end are at the start and in the unknown states.

        Args:
            ends: Of the end of the step.
            starts: Of its start.
            unknown: Of the unknown states, by stage.
            dt: Length of the step, s.
        """
        name, levels = self._name, self._levels
        of_q = ends[name, "q"].copy()
        rows, of_rows = self._resultants, of_q[self._resultants].copy()
        of_q[rows] = 0.0
        unknown[END] += of_q
        one, zero = np.ones(len(rows)), np.zeros(len(rows))
        zeros = {stage: zero for stage in levels.unknown}
        starts[name, "q"][rows] += self._scheme.resultants(one, zeros) * of_rows
        for stage in levels.unknown:
            unknown[stage][rows] += self._scheme.resultants(zero, zeros | {stage: one}) * of_rows
        for rate in levels.rates:
            w = np.zeros_like(of_q)
            w[self._kinematic] = ends[name, rate][self._kinematic]
            self._of_rate(rate, w, starts, unknown, dt)

    def _of_rate(
        self, rate: str, w: Floats, starts: Covector, unknown: dict[str, Floats], dt: float
    ) -> None:
        shares, weight = self._shares(rate, dt)
        jumps, by_jump, by_middle = weight.any(), w, w
        if jumps:
            _, b, middle = self._advanced(rate, self._states, dt)
            by_jump, by_middle = self._tangent_back(b, middle, weight * w)
        for (kind, name), (plain, jump, middle) in shares.items():
            target = unknown[name] if kind == "unknown" else starts[self._name, name]
            target += plain * w
            if jumps:
                target += jump * by_jump + middle * by_middle

    def _advanced(
        self, rate: str, given: States, dt: float, unit: float = 0.0
    ) -> tuple[Floats, Floats, Floats]:
        """A rate at the end with a given size of what jumps leave; the jump, and its middle state.

        Both are zero where velocities do not jump.
        """
        seen = [np.zeros_like(given["q", "q"])] * 2

        def left(b: Floats, middle: Floats) -> Floats:
            seen[:] = b, middle
            return np.full_like(b, unit)

        rates, unknown = (
            {k: v for (kind, k), v in given.items() if kind == of} for of in ("rate", "unknown")
        )
        made = self._forms.advance(given["q", "q"], rates, unknown, dt, left)
        return np.asarray(made[rate]), seen[0], seen[1]

    def _shares(self, rate: str, dt: float) -> tuple[Shares, Floats]:
        """Shares of all states, and of a jump, in a rate at the end; zero where there is no jump.

        They are linear combinations, of which units tell the shares; kept as long as the step is.
        """
        kept = self._kept.get(rate)
        if kept is None or kept[0] != dt:
            zeros = {key: np.zeros_like(values) for key, values in self._states.items()}
            units = {key: zeros | {key: np.ones_like(values)} for key, values in zeros.items()}
            shares = {key: self._advanced(rate, unit, dt) for key, unit in units.items()}
            kept = self._kept[rate] = dt, shares, self._advanced(rate, zeros, dt, 1.0)[0]
        return kept[1:]
